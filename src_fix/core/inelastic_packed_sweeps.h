// Coloured sweeps (inelastic_coloured_sweeps.h) on packed batches (inelastic_sweep_kernels.h): this
// class packs a problem, sweeps, and unpacks impulses.
//
// Constraints are coloured in the order of the problem (inelastic_constraint_colours.h), those at
// cuts between ranks (inelastic_shared_grains.h) and all others apart. Each rank sweeps over its
// own constraints.
//
// As in inelastic_packed_iterations.h the unknown is the change of the impulses since the start of
// the search, and constraints are working or idle: sweeps visit the working ones alone.

#pragma once

#include "inelastic_packed_batches.h"
#include "inelastic_packed_targets.h"
#include "inelastic_refined.h"
#include "inelastic_shared_grains.h"
#include "inelastic_start.h"
#include "inelastic_swept_grains.h"

#include <algorithm>
#include <cstddef>
#include <optional>
#include <vector>

namespace inelastic {

template <typename Batch> class PackedSweeps {
 public:
  // Packs a problem, whose impulses are the start. Constraints without an impulse whose gap is
  // above `idle_gap` [length] are idle. Returns false where so many constraints have one grain in
  // common that batches would be mostly empty. Collective; what is returned is this rank's answer.
  bool prepare(const Start &start, double idle_gap, Host &host);

  // Takes a problem that was refined, and not anew, since the present impulses have solved it: what
  // it had is packed, and `start` is to refer to what `prepare` was given. Without ghosts and
  // bodies (inelastic_search_chain.h).
  void go_on(const Start &start, const Refined &refined);

  // Makes the present impulses the centre of what follows. They are those of the problem now, and
  // double precision has judged them: what `prepare` was given refers to what is new. Colours,
  // batches and the last change of the impulses stay. Collective.
  void recentre(double idle_gap, Host &host);

  // Extrapolates all impulses by `along` times their last change, and visits each working
  // constraint once.
  // Changes and residuals below `blur`, in scaled units, may be round-off. Collective; what is
  // returned is of this rank's constraints.
  swept::Swept sweep(double along, double blur, Host &host);

  // Returns the largest residual of this rank's working constraints as a part of its target.
  double unsolved(double blur) const
  {
    const auto by = static_cast<float>(blur);
    return std::max(find_unsolved(at_cuts_, by), find_unsolved(inside_, by));
  }

  // Computes the states from the impulses: sums of many changes drift in single precision.
  // Collective.
  void refresh(Host &host);

  // As in PackedIterations. Targets are set twice until there are twice as many sweeps.
  static bool sets_targets(long sweep);
  void set_targets();
  void keep_velocities() { targets_.keep(velocities()); }
  double moved_since_kept(double accuracy);

  // Finds anew which constraints are idle. Idle ones become working whose gaps are no larger than
  // some residuals, or than `least_idle_gap` where that is more (in packed units). Working ones
  // without an impulse whose gaps are larger become idle, unless these are few.
  void look_at_idle(double least_idle_gap);

  // Writes the present impulses, in the order of the problem's constraints.
  void impulses(const Scales &scales, std::vector<double> &impulse) const;

 private:
  using State = typename Batch::State;
  using Vector = packed::Vector<float>;
  using Packed = PackedBatches<Batch>;
  static constexpr int WIDTH = swept::WIDTH;

  using Looked = std::vector<swept::Looked>;    // by batch

  double find_unsolved(const Packed &packed, float blur) const
  { return swept::find_unsolved(packed.batches, packed.springs(), states_.data(), blur); }
  ConstraintColours colour(const std::vector<int> &first, const std::vector<int> &second) const;
  std::size_t pack(bool at_cuts, const std::vector<std::size_t> &constraints);
  void write(std::size_t c, Packed &packed, std::size_t place) const;
  void write_start(Packed &packed, std::size_t place) const;
  void write_idle(const std::vector<std::size_t> &constraints);
  void open(Packed &packed, const std::vector<float> &by) const;
  void wake_near();
  void wake(const std::vector<std::size_t> &near);
  float look_at(const Packed &packed, Looked &looked) const;
  void set_idle(double least_idle_gap);
  void make_idle(const Looked &looked, Packed &packed);
  void set_targets(Packed &packed, std::size_t from) const;
  const std::vector<Vector> &velocities();

  // What `prepare` was given. Until all of it is packed nothing of it changes but the impulses.
  std::optional<Start> given_;
  SweptGrains<Batch> grains_;
  SharedGrains<Batch> shared_{grains_};
  // Working constraints: those at cuts, and all others.
  Packed at_cuts_, inside_;
  Packed idle_;
  std::vector<std::size_t> far_;    // in the problem: idle constraints that are not packed yet
  std::vector<State> states_, before_;
  std::vector<Vector> velocity_;    // per slot
  std::vector<double> start_;       // impulses of the centre, in the order of the problem
  std::vector<AdmissibleSet<double>>
      of_impulses_;    // which impulses are admissible, in that order
  PackedTargets<float> targets_;
  struct {
    Looked at_cuts, inside, idle;
  } looked_;
  float idle_gap_ = 0.0f;    // above it a constraint without an impulse is idle
};

}    // namespace inelastic
