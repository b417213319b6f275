// Grains that walls squeeze out from between them. Two walls that close at a small angle to one
// another leave a sphere that fills the room between them one way out, along which it moves at
// their speed over the angle. The projection sends it there; the log tells so, since a real grain
// would not go.

#ifndef INELASTIC_SQUEEZED_GRAINS_H
#define INELASTIC_SQUEEZED_GRAINS_H

#include "inelastic_step.h"

#include "pointers.h"

#include <string>

namespace LAMMPS_NS::Inelastic_NS {

class GhostExchange;

class SqueezedGrains : protected Pointers {
 public:
  SqueezedGrains(class LAMMPS *lmp, const Step &step, GhostExchange &ranks);

  void begin_run() { told_ = false; }

  // Looks for the fastest sphere at a closing wall after the projection, if it is many times as
  // fast as anything moved before. Collective.
  void look();
  // Forgets the last look, in a step in which nothing is looked for.
  void skip() { said_.clear(); }

  // What happens to that sphere; empty where none is so fast.
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

}    // namespace LAMMPS_NS::Inelastic_NS

#endif
