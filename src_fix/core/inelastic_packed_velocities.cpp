#include "inelastic_packed_velocities.h"

#include "inelastic_vector3.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace inelastic {

namespace {

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

}    // namespace

template <typename Real>
void PackedVelocities<Real>::prepare(const ContactProblem &problem, double mobility_unit)
{
  const auto slots = static_cast<std::size_t>(problem.slots());
  first_wall_ = problem.particles;
  walls_move_ = problem.any_wall_moves();
  inverse_mass_.resize(slots);
  for (std::size_t i = 0; i < slots; ++i)
    inverse_mass_[i] = static_cast<Real>(problem.inverse_mass[i] * mobility_unit);
  pack_bodies(problem.bodies, mobility_unit);
  sum_.assign(slots, Vector{});
  velocity_.assign(slots, Vector{});
}

template <typename Real> void PackedVelocities<Real>::move(Host &host)
{
  host.sum_over_chosen_ghosts(reinterpret_cast<Real *>(sum_.data()));
  if (walls_move_) add_up_walls(host);
  if (!rods_.empty() || !bodies_.empty())
    packed::turn_bodies(rods_, bodies_, members_.data(), sum_.data());
  packed::move_particles(
      packed::Move<Real>{velocity_.size(), inverse_mass_.data(), sum_.data(), velocity_.data()});
}

template <typename Real> void PackedVelocities<Real>::add_up_walls(Host &host)
{
  std::vector<double> of_walls;
  for (std::size_t i = first_wall_; i < sum_.size(); ++i)
    for (int d = 0; d < 3; ++d) of_walls.push_back(sum_[i].lanes[d]);
  host.sum_over_ranks(of_walls.data(), static_cast<int>(of_walls.size()));
  const double *next = of_walls.data();
  for (std::size_t i = first_wall_; i < sum_.size(); ++i)
    for (int d = 0; d < 3; ++d) sum_[i].lanes[d] = static_cast<Real>(*next++);
}

template <typename Real>
void PackedVelocities<Real>::pack_bodies(const RigidBodies &bodies, double mobility_unit)
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
bool PackedVelocities<Real>::pack_rod(const RigidBodies &bodies, std::size_t b,
                                      double mobility_unit)
{
  RodShape shape;
  if (!is_rod<Real>(bodies, b, shape)) return false;
  packed::Rod<Real> rod;
  const double root = std::sqrt(shape.across * mobility_unit);
  packed::set_lanes(rod.axis, shape.axis[0], shape.axis[1], shape.axis[2],
                    bodies.inverse_mass[b] * mobility_unit);
  for (int k = 0; k < 2; ++k) {
    rod.arm[k] = static_cast<Real>(shape.arm[k] * root);
    rod.particle[k] = packed::place<Real>(bodies.member[bodies.start[b] + k]);
  }
  rods_.push_back(rod);
  return true;
}

// The arms of a body are in units of their own, a power of two near the largest of them.
template <typename Real>
void PackedVelocities<Real>::pack_body(const RigidBodies &bodies, std::size_t b,
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
    packed::set_lanes(body.inverse_inertia[d], a[columns[d][0]] * inertia_unit,
                      a[columns[d][1]] * inertia_unit, a[columns[d][2]] * inertia_unit, 0.0);
  for (int k = body.first; k < body.end; ++k) {
    packed::Member<Real> &member = members_[k];
    const double *const arm = &bodies.arm[3 * k];
    packed::set_lanes(member.arm, arm[0] / unit, arm[1] / unit, arm[2] / unit, 0.0);
    member.particle = bodies.member[k];
  }
  bodies_.push_back(body);
}

template class PackedVelocities<float>;
template class PackedVelocities<double>;

}    // namespace inelastic
