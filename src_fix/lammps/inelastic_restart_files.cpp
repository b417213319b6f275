#include "inelastic_restart_files.h"

#include "inelastic_lammps_versions.h"
#include "inelastic_step.h"
#include "inelastic_step_length.h"

#include "comm.h"
#include "error.h"
#include "modify.h"
#include "update.h"

#include <cstring>

using namespace LAMMPS_NS;
using namespace Inelastic_NS;

namespace {

std::string first_word(const std::string &words)
{ return words.substr(0, words.find(' ')); }

// The first number of what restart files hold. In files of version 0.1 it is a time, in those of
// development versions after it EARLIER_LAYOUT.
constexpr double LAYOUT = -3.0, EARLIER_LAYOUT = -2.0;

}    // namespace

RestartFiles::RestartFiles(LAMMPS *lmp, const Step &step, StepLength &length) :
    Pointers(lmp), step_(step), length_(length)
{
}

bool RestartFiles::is_of_same_law() const
{ return first_word(law_) == first_word(step_.settings.law_words); }

void RestartFiles::find_lost_memory(const char *id, const char *style) const
{
  if (!step_.settings.law) return;
  for (int k = 0; k < modify->nfix_restart_peratom; ++k)
    if (strcmp(style_in_restart_file(modify, k), style) == 0 &&
        strcmp(id_in_restart_file(modify, k), id) != 0)
      error->all(FLERR,
                 "Fix inelastic: the restart file holds what contacts remember for fix {}: give "
                 "this fix the same ID, in place of {}",
                 id_in_restart_file(modify, k), id);
}

void RestartFiles::warn_of_lost_memory(const char *id, double contacts) const
{
  if (contacts > 0.0 && comm->me == 0)
    error->warning(
        FLERR,
        "Fix inelastic: with fix {} ends what law {} remembers of {:.0f} contacts: a fix "
        "that is defined anew begins without it",
        id, step_.settings.law_words, contacts);
}

void RestartFiles::write(FILE *file) const
{
  const std::string law = step_.settings.law ? step_.settings.law_words : "";
  const double numbers[4] = {LAYOUT, update->dt, step_.regular_timestep,
                             static_cast<double>(law.size())};
  const int size = sizeof(numbers) + static_cast<int>(law.size());
  fwrite(&size, sizeof(size), 1, file);
  fwrite(numbers, sizeof(numbers), 1, file);
  fwrite(law.data(), 1, law.size(), file);
}

void RestartFiles::read(const char *buffer)
{
  double numbers[4];
  std::memcpy(numbers, buffer, sizeof(double));
  const bool earlier = numbers[0] != LAYOUT && numbers[0] != EARLIER_LAYOUT;
  std::memcpy(numbers + (earlier ? 1 : 0), buffer, (earlier ? 2 : 4) * sizeof(double));
  if (update->dt == numbers[1] && numbers[1] != numbers[2])
    length_.set_regular_timestep(numbers[2]);
  if (earlier) return;
  law_.assign(buffer + sizeof(numbers), static_cast<std::size_t>(numbers[3]));
  if (numbers[0] == EARLIER_LAYOUT && !law_.empty())
    error->all(FLERR,
               "Fix inelastic: the restart file is of an earlier development version, and what its "
               "contacts remember cannot be read: make it again with this version");
  if (law_.empty() || is_of_same_law() || comm->me != 0) return;
  error->warning(FLERR,
                 "Fix inelastic: the restart file holds what contacts remember by law {}, which "
                 "is dropped: this fix has law {}",
                 law_, step_.settings.law_words.empty() ? "inelastic" : step_.settings.law_words);
}
