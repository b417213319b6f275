/* -*- c++ -*- ----------------------------------------------------------
   A random force: an acceleration uniform in [-A, A]^3 for every atom and
   step, drawn from (seed, atom ID, step) alone, so that it is the same on
   any number of ranks and after a restart.
------------------------------------------------------------------------- */

#ifdef FIX_CLASS
// clang-format off
FixStyle(random/force,FixRandomForce);
// clang-format on
#else

#ifndef LMP_FIX_RANDOM_FORCE_H
#define LMP_FIX_RANDOM_FORCE_H

#include "fix.h"

#include <cstdint>

namespace LAMMPS_NS {

class FixRandomForce : public Fix {
 public:
  FixRandomForce(class LAMMPS *, int, char **);
  int setmask() override;
  void init() override;
  void setup(int) override;
  void post_force(int) override;

 private:
  double acceleration_;    // A [length / time^2]
  std::uint32_t seed_;
};

}    // namespace LAMMPS_NS

#endif
#endif
