// When sweeps are interrupted: the residual, which takes half a sweep, is looked at only when it
// may be within its targets, and what is idle, or drifts by round-off, now and then.

#pragma once

#include "inelastic_search.h"

#include <algorithm>

namespace inelastic {

// When the residual is worth a look.
class Checkpoints {
 public:
  explicit Checkpoints(long sweeps) : next_(sweeps + 1) {}

  // `of_target` is that of swept::Swept.
  bool is_due(long sweep, double of_target) const { return sweep >= next_ && of_target <= hint_; }

  // Takes what a look has found.
  void note(long sweep, double of_target, double unsolved)
  {
    constexpr double MOST = 3.0, LEAST = 0.5;
    constexpr long PART = 40;
    if (unsolved > 0.0) hint_ = std::clamp(of_target / unsolved, LEAST, MOST);
    next_ = sweep + 2 + sweep / PART;
  }

  void wait_until(long until) { next_ = until; }

 private:
  long next_;
  double hint_ = 2.0;    // the largest change of a sweep at which residuals may be in the targets
};

// What is done between sweeps.
class Upkeep {
 public:
  explicit Upkeep(long sweeps) :
      begun_(sweeps), next_refresh_(sweeps + REFRESH_EVERY), next_look_(sweeps + LOOK_EVERY)
  {
  }

  // Collective. `idle_gap` is that of PackedSweeps::look_at_idle.
  template <typename Sweeps> void run(long sweep, Sweeps &sweeps, double idle_gap, Host &host)
  {
    if (sweep >= next_refresh_) {
      sweeps.refresh(host);
      next_refresh_ = sweep + REFRESH_EVERY;
    }
    if (sweep >= next_look_) {
      sweeps.look_at_idle(idle_gap);
      next_look_ = sweep + std::max(LOOK_EVERY, (sweep - begun_) / LOOK_PART);
    }
  }

 private:
  // The states are computed anew after at most so many sweeps: the round-off of each stays in them.
  static constexpr long REFRESH_EVERY = 50;
  // Idle constraints are looked at later than LOOK_EVERY sweeps on, when this part of all was made
  // since.
  static constexpr long LOOK_PART = 3;

  long begun_, next_refresh_, next_look_;
};

}    // namespace inelastic
