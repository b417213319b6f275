#include "inelastic_packed_targets.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace inelastic {

namespace {

  // Where one of two particles in contact has changed its velocity more than the other, this part
  // of the larger change counts, if it is more than the smaller one.
  constexpr double ALONE = 0.5;

  // A velocity, which is a sum of some impulses, is known to so many units of its own round-off.
  constexpr int BLURRED = 16;

  template <typename Real> Real square(const typename packed::Vector<Real>::Lanes &a)
  { return a[0] * a[0] + a[1] * a[1] + a[2] * a[2]; }

  template <typename Real> Real length(const typename packed::Vector<Real>::Lanes &a)
  { return std::sqrt(square<Real>(a)); }

}    // namespace

template <typename Real> void PackedTargets<Real>::begin(const Start &start)
{
  const ContactProblem &problem = start.problem;
  const auto slots = static_cast<std::size_t>(problem.slots());
  const double per_length = problem.timestep / start.scales.length;
  const std::vector<double> &change = start.change, &guess = start.targets.change_by_guess();
  at_start_.resize(slots);
  since_guess_.resize(slots);
  for (std::size_t i = 0; i < slots; ++i) {
    const double *const v = &change[3 * i], *const g = &guess[3 * i];
    packed::set_lanes(at_start_[i], per_length * v[0], per_length * v[1], per_length * v[2], 0.0);
    packed::set_lanes(since_guess_[i], per_length * (v[0] - g[0]), per_length * (v[1] - g[1]),
                      per_length * (v[2] - g[2]), 0.0);
  }
  mobile_.resize(slots);
  for (std::size_t i = 0; i < slots; ++i) mobile_[i] = problem.is_mobile(static_cast<int>(i));
  most_ = static_cast<Real>(start.tolerance / start.scales.length);
  kept_.assign(slots, Vector{});
  kept_before_ = kept_;
  set(kept_);
}

template <typename Real>
void PackedTargets<Real>::recentre(const Start &start, const std::vector<Vector> &moved)
{
  std::vector<Vector> kept = std::move(kept_), kept_before = std::move(kept_before_);
  begin(start);
  for (std::size_t i = 0; i < moved.size(); ++i) {
    kept_[i].lanes = kept[i].lanes - moved[i].lanes;
    kept_before_[i].lanes = kept_before[i].lanes - moved[i].lanes;
  }
}

template <typename Real> void PackedTargets<Real>::set(const std::vector<Vector> &velocity)
{
  changed_.resize(velocity.size());
  for (std::size_t i = 0; i < changed_.size(); ++i)
    changed_[i] = !mobile_[i]
        ? std::numeric_limits<Real>::max()
        : std::sqrt(std::max(square<Real>(at_start_[i].lanes + velocity[i].lanes),
                             square<Real>(since_guess_[i].lanes + velocity[i].lanes)));
}

template <typename Real> void PackedTargets<Real>::keep(const std::vector<Vector> &velocity)
{
  kept_before_.swap(kept_);
  kept_ = velocity;
}

template <typename Real> void PackedTargets<Real>::compare(const std::vector<Vector> &velocity)
{
  moved_.resize(velocity.size());
  for (std::size_t i = 0; i < moved_.size(); ++i) {
    const Real blur =
        BLURRED * std::numeric_limits<Real>::epsilon() * length<Real>(velocity[i].lanes);
    moved_[i] = std::max(Real(0), length<Real>(velocity[i].lanes - kept_before_[i].lanes) - blur);
  }
}

template <typename Real>
Real PackedTargets<Real>::moved(std::size_t first, std::size_t second) const
{
  const Real one = moved_[first], other = moved_[second];
  const Real both = !mobile_[first] ? other : !mobile_[second] ? one : std::min(one, other);
  return std::max(both, static_cast<Real>(ALONE) * std::max(one, other));
}

template class PackedTargets<float>;
template class PackedTargets<double>;

}    // namespace inelastic
