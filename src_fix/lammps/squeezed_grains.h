// Grains that walls squeeze out from between them. Two walls that close at a small angle to one
// another leave a sphere that fills the room between them one way out, along which it moves as many
// times faster than they as the angle is small. That is where it goes, and it is told, for no grain
// would.

#ifndef INELASTIC_SQUEEZED_GRAINS_H
#define INELASTIC_SQUEEZED_GRAINS_H

#include "step.h"

#include "pointers.h"

#include <string>

namespace LAMMPS_NS {

class GhostExchange;

class SqueezedGrains : protected Pointers {
 public:
  SqueezedGrains(class LAMMPS *lmp, const Step &step, GhostExchange &ranks);

  void begin_run() { told_ = false; }

  // Looks for the sphere at a closing wall that a projection makes most times as fast as anything
  // moved before. Collective.
  void look();
  // Nothing was looked for.
  void skip() { said_.clear(); }

  // What happens to it; empty where no sphere is so fast.
  const std::string &said() const { return said_; }

  // Warns of it, once a run.
  void warn();

 private:
  double fastest_before() const;

  const Step &step_;
  GhostExchange &ranks_;
  std::string said_;
  bool told_ = false;
};

}    // namespace LAMMPS_NS

#endif
