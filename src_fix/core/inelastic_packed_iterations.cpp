#include "inelastic_packed_iterations.h"

#include "inelastic_vector3.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace inelastic {

namespace {

  // Working constraints that could be idle become so only when they are more than one in so many:
  // to make a few of them idle moves all others in memory, and saves little.
  constexpr std::size_t FEW = 10;

  // At every so many looks working constraints are looked at, too, for those that could be idle:
  // this takes a pass over them, and they become idle more rarely than idle ones become working.
  constexpr int SET_IDLE_EVERY = 4;

  // A gap is known to a few units of round-off of the largest change.
  constexpr double ROUND_OFFS = 2.0;

  struct RodShape {
    double axis[3];    // unit vector
    double arm[2];     // of the two members along the axis [length]
    double across;     // inverse inertia across the axis [1 / (mass length^2)]
  };

  // Returns whether body b is a rod (packed::Rod) as far as `Real` can tell, and its shape if so.
  template <typename Real> bool is_rod(const RigidBodies &bodies, std::size_t b, RodShape &shape)
  {
    constexpr double SAME = 8.0 * std::numeric_limits<Real>::epsilon();
    if (bodies.start[b + 1] - bodies.start[b] != 2 || bodies.originals[b] != 2) return false;
    const double *const first = &bodies.arm[3 * static_cast<std::size_t>(bodies.start[b])];
    const double *const second = first + 3;
    const double from[3] = {first[0] - second[0], first[1] - second[1], first[2] - second[2]};
    const double length = norm(from);
    if (!(length > 0.0)) return false;
    double *const axis = shape.axis;
    for (int d = 0; d < 3; ++d) axis[d] = from[d] / length;
    for (int k = 0; k < 2; ++k) {
      const double *const r = first + 3 * k;
      shape.arm[k] = dot(r, axis);
      for (int d = 0; d < 3; ++d)
        if (!(std::abs(r[d] - shape.arm[k] * axis[d]) <= SAME * length)) return false;
    }
    const double *const a = &bodies.inverse_inertia[6 * b];
    double turned[3];
    multiply(a, axis, turned);
    const double along = dot(turned, axis);
    const double across = 0.5 * (a[0] + a[1] + a[2] - along);
    const int row[6] = {0, 1, 2, 0, 0, 1}, column[6] = {0, 1, 2, 1, 2, 2};
    for (int k = 0; k < 6; ++k) {
      const double symmetric =
          (along - across) * axis[row[k]] * axis[column[k]] + (row[k] == column[k] ? across : 0.0);
      if (!(std::abs(a[k] - symmetric) <= SAME * std::max(along, across))) return false;
    }
    shape.across = across;
    return across >= 0.0;
  }

  template <typename Real>
  void set_lanes(packed::Vector<Real> &vector, double x, double y, double z, double fourth)
  {
    vector.lanes =
        typename packed::Vector<Real>::Lanes{static_cast<Real>(x), static_cast<Real>(y),
                                             static_cast<Real>(z), static_cast<Real>(fourth)};
  }

  // Returns the slot whose vector is at a place, in bytes.
  template <typename Real> std::size_t index(std::uint32_t place)
  { return place / sizeof(packed::Vector<Real>); }

  // Returns the place of a slot's vector, in bytes.
  template <typename Real> std::uint32_t place(int slot)
  { return static_cast<std::uint32_t>(slot * sizeof(packed::Vector<Real>)); }

}    // namespace

template <typename Real>
void PackedIterations<Real>::prepare(const ContactProblem &problem,
                                     const std::vector<double> &diagonal,
                                     const std::vector<double> &gap, double idle_gap,
                                     const Scales &scales, const ContactTargets &targets,
                                     const std::vector<double> &change, double tolerance)
{
  idle_gap_ = static_cast<Real>(idle_gap / scales.length);
  looks_ = 0;
  start_ = problem.contacts.impulse;
  of_impulses_ = problem.contacts.set;
  std::vector<std::size_t> near, far;
  for (std::size_t c = 0; c < gap.size(); ++c)
    (of_impulses_[c].is_loaded(start_[c]) || !(gap[c] > idle_gap) ? near : far).push_back(c);
  inverse_diagonals_ = 0.0;
  pack(problem.contacts, near, diagonal, gap, scales, targets, working_);
  pack(problem.contacts, far, diagonal, gap, scales, targets, idle_);
  for (std::vector<Real> *const state : states()) state->assign(near.size(), 0);

  const auto slots = static_cast<std::size_t>(problem.slots());
  first_wall_ = problem.particles;
  walls_move_ = problem.any_wall_moves();
  const double mobility_unit = problem.timestep * (scales.impulse / scales.length);
  inverse_mass_.resize(slots);
  for (std::size_t i = 0; i < slots; ++i)
    inverse_mass_[i] = static_cast<Real>(problem.inverse_mass[i] * mobility_unit);
  pack_bodies(problem.bodies, mobility_unit);
  sum_.assign(slots, Vector{});
  velocity_.assign(slots, Vector{});
  targets_.begin(problem, scales, targets, change, tolerance);
  set_targets();
}

template <typename Real> void PackedIterations<Real>::set_targets()
{
  targets_.set(velocity_);
  for (Constraints *const some : {&working_, &idle_})
    for (std::size_t k = 0; k < some->size(); ++k)
      some->inverse_target[k] = 1 /
          targets_.target(index<Real>(some->ends[k].first), index<Real>(some->ends[k].second),
                          some->least_target[k], some->part[k]);
}

template <typename Real> void PackedIterations<Real>::keep_velocities()
{ targets_.keep(velocity_); }

template <typename Real> double PackedIterations<Real>::moved_since_kept(double accuracy)
{
  targets_.compare(velocity_);
  Real most = 0;
  for (std::size_t k = 0; k < working_.size(); ++k) {
    if (!working_.set[k].is_loaded(unbound_[k])) continue;
    const std::size_t i = index<Real>(working_.ends[k].first);
    const std::size_t j = index<Real>(working_.ends[k].second);
    most = std::max(most,
                    targets_.moved(i, j) /
                        targets_.free_target(i, j, working_.least_target[k], working_.part[k]));
  }
  return accuracy * static_cast<double>(most);
}

template <typename Real>
packed::Passed PackedIterations<Real>::advance(const Weights &weights, double step, double blur)
{
  packed::Passed passed = packed::advance_impulses(packed::Pass<Real, HalfLine>{
      working_.size(), working_.ends.data(), working_.normal.data(), working_.diagonal.data(),
      working_.compliance.data(), working_.set.data(), working_.inverse_target.data(),
      velocity_.data(), unbound_.data(), change_before_.data(), gap_before_.data(), sum_.data(),
      static_cast<Real>(step), static_cast<Real>(step_before_), static_cast<Real>(weights.along),
      static_cast<Real>(weights.beyond), static_cast<Real>(weights.back), static_cast<Real>(blur)});
  step_before_ = step;
  // Where gaps change by no more than round-off, squares of the changes tell nothing.
  const double round_off = ROUND_OFFS * std::numeric_limits<Real>::epsilon() * passed.farthest;
  if (passed.steep <= inverse_diagonals_ * round_off * round_off) passed.steep = 0.0;
  return passed;
}

template <typename Real> void PackedIterations<Real>::finish(Host &host)
{
  host.sum_over_chosen_ghosts(reinterpret_cast<Real *>(sum_.data()));
  if (walls_move_) add_up_walls(host);
  if (!rods_.empty() || !bodies_.empty())
    packed::turn_bodies(rods_, bodies_, members_.data(), sum_.data());
  packed::move_particles(
      packed::Move<Real>{velocity_.size(), inverse_mass_.data(), sum_.data(), velocity_.data()});
}

template <typename Real> void PackedIterations<Real>::add_up_walls(Host &host)
{
  std::vector<double> of_walls;
  for (std::size_t i = first_wall_; i < sum_.size(); ++i)
    for (int d = 0; d < 3; ++d) of_walls.push_back(sum_[i].lanes[d]);
  host.sum_over_ranks(of_walls.data(), static_cast<int>(of_walls.size()));
  const double *next = of_walls.data();
  for (std::size_t i = first_wall_; i < sum_.size(); ++i)
    for (int d = 0; d < 3; ++d) sum_[i].lanes[d] = static_cast<Real>(*next++);
}

template <typename Real> void PackedIterations<Real>::look(double idle_gap)
{
  idle_gap_ = static_cast<Real>(idle_gap);
  if (++looks_ % SET_IDLE_EVERY == 0) set_idle();
  looked_.resize((idle_.size() + 3) / 4);
  packed::find_gaps(packed::Look<Real>{idle_.size(), idle_.ends.data(), idle_.normal.data(),
                                       velocity_.data(), looked_.data()});
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
  if (more <= working_.size() / FEW) return;
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

template <typename Real> void PackedIterations<Real>::Constraints::resize(std::size_t count)
{
  source.resize(count);
  ends.resize(count);
  normal.resize(count);
  diagonal.resize(count);
  compliance.resize(count);
  set.resize(count);
  least_target.resize(count);
  part.resize(count);
  inverse_target.resize(count);
}

template <typename Real>
void PackedIterations<Real>::Constraints::copy(const Constraints &other, std::size_t k,
                                               std::size_t to)
{
  source[to] = other.source[k];
  ends[to] = other.ends[k];
  normal[to] = other.normal[k];
  diagonal[to] = other.diagonal[k];
  compliance[to] = other.compliance[k];
  set[to] = other.set[k];
  least_target[to] = other.least_target[k];
  part[to] = other.part[k];
  inverse_target[to] = other.inverse_target[k];
}

template <typename Real>
void PackedIterations<Real>::pack(const ContactSet &contacts,
                                  const std::vector<std::size_t> &places,
                                  const std::vector<double> &diagonal,
                                  const std::vector<double> &gap, const Scales &scales,
                                  const ContactTargets &targets, Constraints &packed)
{
  packed.resize(places.size());
  packed.source = places;
  const double per_length = 1.0 / scales.length;
  const double diagonal_unit = scales.impulse / scales.length;
  for (std::size_t k = 0; k < places.size(); ++k) {
    const std::size_t c = places[k];
    const double *const n = &contacts.normal[3 * c];
    packed.ends[k] = {place<Real>(contacts.first[c]), place<Real>(contacts.second[c])};
    set_lanes(packed.normal[k], n[0], n[1], n[2], gap[c] * per_length);
    packed.diagonal[k] = static_cast<Real>(diagonal[c] * diagonal_unit);
    inverse_diagonals_ += 1.0 / packed.diagonal[k];
    packed.compliance[k] = static_cast<Real>(contacts.compliance[c] * diagonal_unit);
    packed.set[k] =
        contacts.set[c].changes_of(contacts.impulse[c]).template in_units<Real>(scales.impulse);
    packed.least_target[k] = static_cast<Real>(targets.least()[c] * per_length);
    packed.part[k] = static_cast<Real>(targets.part()[c]);
  }
}

template <typename Real>
void PackedIterations<Real>::pack_bodies(const RigidBodies &bodies, double mobility_unit)
{
  rods_.clear();
  bodies_.clear();
  members_.resize(bodies.member.size());
  for (std::size_t b = 0; b < bodies.size(); ++b)
    if (!pack_rod(bodies, b, mobility_unit)) pack_body(bodies, b, mobility_unit);
  for (const int particle : bodies.member) inverse_mass_[particle] = 1;
}

// Returns false if the body is no rod.
template <typename Real>
bool PackedIterations<Real>::pack_rod(const RigidBodies &bodies, std::size_t b,
                                      double mobility_unit)
{
  RodShape shape;
  if (!is_rod<Real>(bodies, b, shape)) return false;
  packed::Rod<Real> rod;
  const double root = std::sqrt(shape.across * mobility_unit);
  set_lanes(rod.axis, shape.axis[0], shape.axis[1], shape.axis[2],
            bodies.inverse_mass[b] * mobility_unit);
  for (int k = 0; k < 2; ++k) {
    rod.arm[k] = static_cast<Real>(shape.arm[k] * root);
    rod.particle[k] = place<Real>(bodies.member[bodies.start[b] + k]);
  }
  rods_.push_back(rod);
  return true;
}

// The arms of a body are in units of their own, a power of two near the largest of them.
template <typename Real>
void PackedIterations<Real>::pack_body(const RigidBodies &bodies, std::size_t b,
                                       double mobility_unit)
{
  packed::Body<Real> body;
  body.first = bodies.start[b];
  body.last_original = bodies.start[b] + bodies.originals[b];
  body.end = bodies.start[b + 1];
  body.inverse_mass = static_cast<Real>(bodies.inverse_mass[b] * mobility_unit);
  double reach = 0.0;
  for (int k = 3 * body.first; k < 3 * body.end; ++k)
    reach = std::max(reach, std::abs(bodies.arm[k]));
  const double unit = reach > 0.0 ? std::exp2(std::ilogb(reach)) : 1.0;
  const double *const a = &bodies.inverse_inertia[6 * b];
  const double inertia_unit = mobility_unit * unit * unit;
  const int columns[3][3] = {{0, 3, 4}, {3, 1, 5}, {4, 5, 2}};
  for (int d = 0; d < 3; ++d)
    set_lanes(body.inverse_inertia[d], a[columns[d][0]] * inertia_unit,
              a[columns[d][1]] * inertia_unit, a[columns[d][2]] * inertia_unit, 0.0);
  for (int k = body.first; k < body.end; ++k) {
    packed::Member<Real> &member = members_[k];
    const double *const arm = &bodies.arm[3 * k];
    set_lanes(member.arm, arm[0] / unit, arm[1] / unit, arm[2] / unit, 0.0);
    member.particle = bodies.member[k];
  }
  bodies_.push_back(body);
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
