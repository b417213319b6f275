// Whether the velocities of a search have come to what they end with.
//
// In a chain residuals add up, and the error of a velocity is many times that of a gap. So a search
// goes on while velocities differ by more than a fortieth of what contacts change from those of a
// half to two thirds as many iterations; where the accuracy is above the default of the fix, by a
// part that grows with it.

#pragma once

#include "inelastic_host.h"

#include <algorithm>

namespace inelastic {

// The fortieth is this part of the sixteenth by which targets are set
// (inelastic_contact_targets.cpp; for bodies a third as much).
constexpr double MOST_MOVED = 0.4;
// Up to this accuracy it is the fortieth, from there on 25 times the accuracy.
constexpr double FINE = 1.0e-3;

// `Iterations` is PackedIterations or PackedSweeps: iterations that keep velocities and set the
// targets, at those of their own count at which it is time to.
template <typename Iterations> class Settling {
 public:
  // Velocities that are not `asked` for have always settled, and targets stay.
  Settling(Iterations &iterations, bool asked, long iterations_before) :
      iterations_(iterations), asked_(asked), next_kept_(iterations_before + 2)
  {
  }

  // Collective.
  bool has_settled(double accuracy, Host &host)
  {
    if (!asked_) return true;
    iterations_.set_targets();
    double moved = iterations_.moved_since_kept(accuracy);
    host.reduce(nullptr, 0, &moved, 1);
    return moved <= MOST_MOVED * std::max(1.0, accuracy / FINE);
  }

  // Call it after each iteration.
  void see(long iteration)
  {
    if (!asked_) return;
    if (iteration >= next_kept_) {
      iterations_.keep_velocities();
      next_kept_ = iteration + iteration / 2 + 4;
    }
    if (Iterations::sets_targets(++in_search_)) iterations_.set_targets();
  }

 private:
  Iterations &iterations_;
  bool asked_;
  long next_kept_, in_search_ = 0;
};

}    // namespace inelastic
