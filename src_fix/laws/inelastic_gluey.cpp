#include "inelastic_gluey.h"

#include "inelastic_read_number.h"

#include <algorithm>
#include <limits>

namespace inelastic {

Demand Gluey::ask(const ContactState &, const double *remembered) const
{ return Demand::pulls(-remembered[0]); }

bool Gluey::remember(const Impulse &impulse, double *remembered) const
{
  remembered[0] = std::max(-limit_, std::min(0.0, remembered[0] - impulse.normal));
  return remembered[0] < 0.0;
}

std::unique_ptr<ContactLaw> make_gluey(const std::vector<std::string> &words, std::string &error)
{
  double limit = std::numeric_limits<double>::infinity();
  const bool has_limit = words.size() == 2 && words[0] == "limit";
  if (words.empty() || (has_limit && read_number(words[1], limit) && limit > 0.0))
    return std::make_unique<Gluey>(limit);
  error = "gluey [limit G], with an impulse G greater than 0";
  return nullptr;
}

}    // namespace inelastic
