#include "inelastic_swept_grains.h"

#include "inelastic_vector3.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace inelastic {

namespace {

  // Writes L by columns, the lower triangle with L L^T = A, of an inverse inertia A (xx yy zz xy xz
  // yz). Where impulses do not turn the body about some axis, the column that is left over is 0.
  void find_root(const double *a, double scale, double *l)
  {
    // Below it a diagonal entry is round-off of the others.
    constexpr double NOTHING = 1.0e-12;
    const double least = NOTHING * (a[0] + a[1] + a[2]);
    std::fill(l, l + 9, 0.0);
    if (a[0] > least) {
      l[0] = std::sqrt(a[0]);
      l[1] = a[3] / l[0];
      l[2] = a[4] / l[0];
    }
    const double second = a[1] - l[1] * l[1];
    if (second > least) {
      l[4] = std::sqrt(second);
      l[5] = (a[5] - l[1] * l[2]) / l[4];
    }
    const double third = a[2] - l[2] * l[2] - l[5] * l[5];
    if (third > least) l[8] = std::sqrt(third);
    for (int k = 0; k < 9; ++k) l[k] *= scale;
  }

}    // namespace

template <typename Batch>
void SweptGrains<Batch>::find(const ContactProblem &problem, double mobility_unit)
{
  const int slots = problem.slots();
  grain_.resize(slots);
  int grains = HAS_BODIES<Batch> ? static_cast<int>(problem.bodies.size()) : 0;
  for (int i = 0; i < slots; ++i)
    grain_[i] = HAS_BODIES<Batch> && problem.is_member(i) ? problem.bodies.body[i] : grains++;
  mobility_.assign(grains, 0.0f);
  moves_.assign(grains, 0);
  for (int i = 0; i < slots; ++i) {
    mobility_[grain_[i]] = static_cast<float>(problem.inverse_mass_of(i) * mobility_unit);
    moves_[grain_[i]] = problem.is_mobile(i);
  }
  is_copy_.assign(slots, 0);
  if constexpr (HAS_BODIES<Batch>) find_bodies(problem.bodies, mobility_unit);
}

template <typename Batch>
void SweptGrains<Batch>::find_bodies(const RigidBodies &bodies, double mobility_unit)
{
  spin_root_.resize(9 * bodies.size());
  arm_.assign(3 * grain_.size(), 0.0);
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    find_root(&bodies.inverse_inertia[6 * b], std::sqrt(mobility_unit), &spin_root_[9 * b]);
    for (int k = bodies.start[b]; k < bodies.start[b + 1]; ++k) {
      const std::size_t slot = bodies.member[k];
      is_copy_[slot] = k >= bodies.start[b] + bodies.originals[b];
      std::copy_n(&bodies.arm[3 * static_cast<std::size_t>(k)], 3, &arm_[3 * slot]);
    }
  }
}

template <typename Batch>
void SweptGrains<Batch>::write_rows(const ContactProblem &problem, std::size_t c, double root,
                                    Batch &batch, int lane) const
{
  const ContactSet &contacts = problem.contacts;
  const double *const n = &contacts.normal[3 * c];
  batch.first[lane] = static_cast<std::uint32_t>(of(contacts.first[c]) * sizeof(State));
  batch.second[lane] = static_cast<std::uint32_t>(of(contacts.second[c]) * sizeof(State));
  if constexpr (!HAS_BODIES<Batch>) {
    swept::Eight &row = batch.row[lane % 4];
    const int from = 4 * (lane / 4);
    for (int d = 0; d < 3; ++d) row[from + d] = static_cast<float>(n[d] / root);
    row[from + 3] = 0.0f;
  } else {
    for (const bool is_first : {true, false}) {
      const int slot = is_first ? contacts.first[c] : contacts.second[c];
      swept::Eight &row = is_first ? batch.first_row[lane] : batch.second_row[lane];
      row = swept::Eight{};
      if (!problem.is_mobile(slot)) continue;
      const double by = (is_first ? 1.0 : -1.0) / root;
      const double sliding = by * slide(slot);
      for (int d = 0; d < 3; ++d) row[d] = static_cast<float>(sliding * n[d]);
      if (!problem.is_member(slot)) continue;
      double moment[3];
      cross(&arm_[3 * static_cast<std::size_t>(slot)], n, moment);
      const double *const l = &spin_root_[9 * static_cast<std::size_t>(of(slot))];
      for (int d = 0; d < 3; ++d) row[4 + d] = static_cast<float>(by * dot(l + 3 * d, moment));
    }
  }
}

template <typename Batch> void SweptGrains<Batch>::stop(std::vector<State> &states) const
{
  states.assign(moves_.size() + 1, State{});
  if constexpr (!HAS_BODIES<Batch>)
    for (std::size_t m = 0; m < moves_.size(); ++m) states[m].lanes[3] = mobility_[m];
}

template <typename Batch>
void SweptGrains<Batch>::push(int slot, const Vector &impulse, std::vector<State> &states) const
{
  if constexpr (HAS_BODIES<Batch>) {
    const auto m = static_cast<std::size_t>(of(slot));
    const typename Vector::Lanes by = impulse.lanes;
    const float sliding = slide_in_single(slot);
    swept::Eight &state = states[m].lanes;
    for (int d = 0; d < 3; ++d) state[d] += sliding * by[d];
    if (!is_body(m)) return;
    const double s[3] = {by[0], by[1], by[2]};
    double moment[3];
    cross(&arm_[3 * static_cast<std::size_t>(slot)], s, moment);
    for (int d = 0; d < 3; ++d)
      state[4 + d] += static_cast<float>(dot(&spin_root_[9 * m + 3 * d], moment));
  }
}

template <typename Batch>
void SweptGrains<Batch>::velocities(const std::vector<State> &states,
                                    std::vector<Vector> &velocity) const
{
  velocity.resize(grain_.size());
  for (std::size_t i = 0; i < grain_.size(); ++i) {
    const std::size_t m = grain_[i];
    if constexpr (HAS_BODIES<Batch>) {
      const swept::Eight &state = states[m].lanes;
      const double sliding = slide(static_cast<int>(i));
      double v[3] = {sliding * state[0], sliding * state[1], sliding * state[2]};
      if (is_body(m)) {
        const double *const l = &spin_root_[9 * m];
        double spin[3], turning[3];
        for (int d = 0; d < 3; ++d)
          spin[d] = l[d] * state[4] + l[3 + d] * state[5] + l[6 + d] * state[6];
        cross(spin, &arm_[3 * i], turning);
        for (int d = 0; d < 3; ++d) v[d] += turning[d];
      }
      packed::set_lanes(velocity[i], v[0], v[1], v[2], 0.0);
    } else {
      velocity[i].lanes = states[m].lanes;
    }
  }
}

template class SweptGrains<swept::ParticleBatch>;
template class SweptGrains<swept::BodyBatch>;

}    // namespace inelastic
