#include "inelastic_packed_iterations.h"

#include <algorithm>
#include <limits>

namespace inelastic {

namespace {

  // At every so many looks working constraints are looked at, too, for those that could be idle:
  // this takes a pass over them, and they become idle more rarely than idle ones become working.
  constexpr int SET_IDLE_EVERY = 4;

  // A gap is known to a few units of round-off of the largest change.
  constexpr double ROUND_OFFS = 2.0;

}    // namespace

template <typename Real> void PackedIterations<Real>::prepare(const Start &start, double idle_gap)
{
  const ContactSet &contacts = start.problem.contacts;
  const Scales &scales = start.scales;
  idle_gap_ = static_cast<Real>(idle_gap / scales.length);
  looks_ = 0;
  start_ = contacts.impulse;
  of_impulses_ = contacts.set;
  std::vector<std::size_t> near, far;
  for (std::size_t c = 0; c < start.gap.size(); ++c)
    (contacts.is_loaded(c) || !(start.gap[c] > idle_gap) ? near : far).push_back(c);
  working_.pack(start, near);
  idle_.pack(start, far);
  inverse_diagonals_ = 0.0;
  for (const PackedConstraints<Real> *const some : {&working_, &idle_})
    some->add_inverse_diagonals(inverse_diagonals_);
  for (std::vector<Real> *const state : states()) state->assign(near.size(), 0);
  velocities_.prepare(start.problem, start.problem.timestep * (scales.impulse / scales.length));
  targets_.begin(start);
  set_targets();
}

template <typename Real> void PackedIterations<Real>::set_targets()
{
  targets_.set(velocities_.velocity());
  for (PackedConstraints<Real> *const some : {&working_, &idle_}) some->set_targets(targets_);
}

template <typename Real> void PackedIterations<Real>::keep_velocities()
{ targets_.keep(velocities_.velocity()); }

template <typename Real> double PackedIterations<Real>::moved_since_kept(double accuracy)
{
  targets_.compare(velocities_.velocity());
  Real most = 0;
  for (std::size_t k = 0; k < working_.size(); ++k) {
    if (!working_.set[k].is_loaded(unbound_[k])) continue;
    const std::size_t i = working_.first(k), j = working_.second(k);
    most = std::max(most,
                    targets_.moved(i, j) /
                        targets_.free_target(i, j, working_.least_target[k], working_.part[k]));
  }
  return accuracy * static_cast<double>(most);
}

template <typename Real>
packed::Passed PackedIterations<Real>::advance(const Weights &weights, double step, double blur)
{
  packed::Passed passed = packed::advance_impulses(packed::Pass<Real, AdmissibleSet>{
      working_.size(), working_.ends.data(), working_.normal.data(), working_.diagonal.data(),
      working_.compliance.data(), working_.set.data(), working_.inverse_target.data(),
      velocities_.velocity().data(), unbound_.data(), change_before_.data(), gap_before_.data(),
      velocities_.sum(), static_cast<Real>(step), static_cast<Real>(step_before_),
      static_cast<Real>(weights.along), static_cast<Real>(weights.beyond),
      static_cast<Real>(weights.back), static_cast<Real>(blur)});
  step_before_ = step;
  // Where gaps change by no more than round-off, squares of the changes tell nothing.
  const double round_off = ROUND_OFFS * std::numeric_limits<Real>::epsilon() * passed.since_start;
  if (passed.steep <= inverse_diagonals_ * round_off * round_off) passed.steep = 0.0;
  return passed;
}

template <typename Real> void PackedIterations<Real>::look(double idle_gap)
{
  idle_gap_ = static_cast<Real>(idle_gap);
  if (++looks_ % SET_IDLE_EVERY == 0) set_idle();
  looked_.resize((idle_.size() + 3) / 4);
  packed::find_gaps(packed::Look<Real>{idle_.size(), idle_.ends.data(), idle_.normal.data(),
                                       velocities_.velocity().data(), looked_.data()});
  const Real *const gap = reinterpret_cast<const Real *>(looked_.data());
  std::vector<std::size_t> near;
  for (std::size_t k = 0; k < idle_.size(); ++k)
    if (!(gap[k] > idle_gap_)) near.push_back(k);
  wake(near, gap);
}

template <typename Real>
void PackedIterations<Real>::join(const std::vector<double> &gap, const Scales &scales)
{
  std::vector<Real> packed(idle_.size());
  std::vector<std::size_t> near;
  for (std::size_t k = 0; k < idle_.size(); ++k) {
    packed[k] = static_cast<Real>(gap[idle_.source[k]] / scales.length);
    if (!(packed[k] > idle_gap_)) near.push_back(k);
  }
  wake(near, packed.data());
}

// Makes idle constraints working, given by their places in ascending order. `gap` has one number
// per idle constraint. The gap of the impulses before is not known: the present one takes its
// place, since the next advance uses it in the momentum alone.
template <typename Real>
void PackedIterations<Real>::wake(const std::vector<std::size_t> &near, const Real *gap)
{
  if (near.empty()) return;
  std::size_t to = working_.size();
  const std::size_t count = to + near.size();
  working_.resize(count);
  for (std::vector<Real> *const state : states()) state->resize(count, 0);
  for (const std::size_t k : near) {
    working_.copy(idle_, k, to);
    gap_before_[to++] = gap[k];
  }
  std::size_t kept = near.front();
  auto next = near.begin();
  for (std::size_t k = kept; k < idle_.size(); ++k) {
    if (next != near.end() && *next == k)
      ++next;
    else
      idle_.copy(idle_, k, kept++);
  }
  idle_.resize(kept);
}

// Makes working constraints idle that have no impulse and are far from closed.
template <typename Real> void PackedIterations<Real>::set_idle()
{
  const auto is_idle = [this](std::size_t k) {
    return !working_.set[k].may_pull() && !working_.set[k].is_loaded(unbound_[k]) &&
        change_before_[k] == 0 && gap_before_[k] > idle_gap_;
  };
  std::size_t more = 0;
  for (std::size_t k = 0; k < working_.size(); ++k)
    if (is_idle(k)) ++more;
  if (more <= working_.size() / FEW_IDLE) return;
  std::size_t idle = idle_.size(), kept = 0;
  idle_.resize(idle + more);
  for (std::size_t k = 0; k < working_.size(); ++k) {
    if (is_idle(k)) {
      idle_.copy(working_, k, idle++);
      continue;
    }
    working_.copy(working_, k, kept);
    for (std::vector<Real> *const state : states()) (*state)[kept] = (*state)[k];
    ++kept;
  }
  working_.resize(kept);
  for (std::vector<Real> *const state : states()) state->resize(kept);
}

// `change` need not be admissible.
template <typename Real>
void PackedIterations<Real>::unpack(const std::vector<Real> &change, const Scales &scales,
                                    std::vector<double> &impulse) const
{
  for (const std::size_t c : idle_.source) impulse[c] = of_impulses_[c].idle();
  for (std::size_t k = 0; k < change.size(); ++k) {
    const std::size_t c = working_.source[k];
    const double free = start_[c] + scales.impulse * static_cast<double>(change[k]);
    impulse[c] = working_.set[k].is_loaded(change[k]) ? of_impulses_[c].project(free)
                                                      : of_impulses_[c].idle();
  }
}

template class PackedIterations<float>;
template class PackedIterations<double>;

}    // namespace inelastic
