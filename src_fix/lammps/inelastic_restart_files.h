// What restart files hold of the fix: the regular time step, if the step was shortened, and the law
// whose memory goes along with the atoms. In files of other runs there is nothing of it.

#ifndef INELASTIC_RESTART_FILES_H
#define INELASTIC_RESTART_FILES_H

#include "pointers.h"

#include <cstdio>
#include <string>

namespace LAMMPS_NS::Inelastic_NS {

struct Step;
class StepLength;

class RestartFiles : protected Pointers {
 public:
  RestartFiles(class LAMMPS *lmp, const Step &step, StepLength &length);

  void write(FILE *file) const;
  // A time step that was set since the file was read stays. Warns of another law.
  void read(const char *buffer);

  // Whether the file that was read holds what contacts remember, and by the law of this fix.
  bool has_memory() const { return !law_.empty(); }
  bool is_of_same_law() const;

  // Error: a file holds what contacts remember for a fix with another ID than this one. LAMMPS
  // gives it to the fix with the same ID alone, and tells nobody before the end of the first run.
  // Without a law there is little to lose.
  void find_lost_memory(const char *id, const char *style) const;

  // Warns where the fix is gone and with it what the law remembers of so many contacts.
  void warn_of_lost_memory(const char *id, double contacts) const;

 private:
  const Step &step_;
  StepLength &length_;
  std::string law_;    // whose memory a file holds; empty for none
};

}    // namespace LAMMPS_NS::Inelastic_NS

#endif
