// The way out of a bad start, overlaps beyond the regular ones: the smallest motion, added to the
// step's but not kept as momentum, that takes the spheres apart at a bounded speed.
//
// Where there is no motion that opens all overlaps at once by what is asked for, as in a bed whose
// spheres have grown, they give way to one another: overlap c opens by a_c - C lambda_c, a_c what
// is asked for, C its compliance, lambda_c the impulse of the push. Step by step the overlaps then
// relax as those of soft spheres do that move without inertia, to none where there is room. Where
// they no longer open there is none.

#ifndef INELASTIC_PUSH_APART_H
#define INELASTIC_PUSH_APART_H

#include "inelastic_projection.h"

#include "pointers.h"

#include <functional>
#include <string>

namespace LAMMPS_NS::Inelastic_NS {

class Constraints;
class GhostExchange;
class Movers;
struct Step;

class PushApart : protected Pointers {
 public:
  // Projects the step's predicted velocities with at most so many iterations.
  using Project = std::function<inelastic::ProjectionResult(long max_iterations)>;

  PushApart(class LAMMPS *lmp, Step &step, Constraints &constraints, GhostExchange &ranks,
            Movers &movers);

  // Changes the velocities of the step, which were projected with bad overlaps counted as touching.
  // The predicted velocities become those without the push. Adds the second projection to the
  // result. Collective.
  void run(inelastic::ProjectionResult &result, const Project &project);
  // Notes a step without bad overlaps.
  void skip();

  // Tells whether the overlaps no longer open, so that there is no room.
  bool in_vain() const;
  // The bad overlaps at the present positions: their number, and the largest [length] with the
  // names of the two. None in a step without bad ones.
  struct Left {
    double number = 0.0, largest = 0.0;
    std::string named;
  };
  const Left &left() const { return left_; }
  // The largest overlap that the push leaves at the end of the step [length].
  double deepest_at_end() const { return deepest_at_end_; }

 private:
  void begin_trial(const inelastic::ContactSet &contacts);
  void ask_for_all(bool gives_way);
  bool look_at_opening(bool solved);
  void stir();

  Step &step_;
  Constraints &constraints_;
  GhostExchange &ranks_;
  Movers &movers_;

  bool gives_way_ = false;    // since this start could not be opened at once
  int in_vain_ = 0;           // steps in a row, whatever runs they belong to
  bigint looked_at_ = -1;     // the step that was counted last
  Left left_;
  double deepest_at_end_ = 0.0;    // [length]
};

}    // namespace LAMMPS_NS::Inelastic_NS

#endif
