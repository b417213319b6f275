// This clock tells where the time of the projections goes, phase by phase, for the summary of a
// run.

#ifndef INELASTIC_PHASE_CLOCK_H
#define INELASTIC_PHASE_CLOCK_H

#include <array>
#include <chrono>

namespace LAMMPS_NS::Inelastic_NS {

class PhaseClock {
 public:
  enum Phase {
    COLLECT,        // constraints: what may touch, what a solution violates
    SOLVE,          // iterations, and what prepares and judges them
    COMMUNICATE,    // with other ranks, and waiting for them
    CHECK,          // of the motion and of the neighbour list's reach
    APPLY,          // forces, output, and what the next step starts from
    OUTSIDE,        // not the fix
    NUMBER_OF_PHASES
  };

  // Counts for a phase while it is alive, then again for the one before.
  class Within {
   public:
    Within(PhaseClock &clock, Phase phase) : clock_(clock), before_(clock.phase_)
    { clock_.enter(phase); }
    ~Within() { clock_.enter(before_); }
    Within(const Within &) = delete;
    Within &operator=(const Within &) = delete;

   private:
    PhaseClock &clock_;
    Phase before_;
  };

  void reset() { seconds_.fill(0.0); }
  double seconds(Phase phase) const { return seconds_[phase]; }

 private:
  using Clock = std::chrono::steady_clock;

  void enter(Phase phase)
  {
    const Clock::time_point now = Clock::now();
    seconds_[phase_] += std::chrono::duration<double>(now - entered_).count();
    entered_ = now;
    phase_ = phase;
  }

  std::array<double, NUMBER_OF_PHASES> seconds_{};
  Phase phase_ = OUTSIDE;
  Clock::time_point entered_ = Clock::now();
};

}    // namespace LAMMPS_NS::Inelastic_NS

#endif
