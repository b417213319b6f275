#include "inelastic_restitution.h"

#include "inelastic_read_number.h"

#include <algorithm>
#include <cmath>

namespace inelastic {

Demand Restitution::ask(const ContactState &contact, const double *) const
{
  const double before = contact.speed_before, predicted = contact.predicted_speed;
  const double approach = std::min(-before, -predicted);
  const bool collides = contact.gap + contact.timestep * predicted < 0.0;
  if (coefficient_ == 0.0 || !collides || !(approach > std::abs(predicted - before))) return {};
  return Demand::parts_with(coefficient_ * approach);
}

std::unique_ptr<ContactLaw> make_restitution(const std::vector<std::string> &words,
                                             std::string &error)
{
  double coefficient;
  if (words.size() == 1 && read_number(words[0], coefficient) && coefficient >= 0.0 &&
      coefficient <= 1.0)
    return std::make_unique<Restitution>(coefficient);
  error = "restitution E, with E from 0 to 1";
  return nullptr;
}

}    // namespace inelastic
