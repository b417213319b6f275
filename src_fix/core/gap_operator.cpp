#include "gap_operator.h"

#include "vector3.h"
#include "vectorise.h"

#include <algorithm>
#include <cmath>

namespace inelastic {

namespace {

  // Returns n . (v_first - v_second) for 3 numbers per slot.
  inline double opening_speed(const double *n, const double *v_first, const double *v_second)
  {
    const double relative[3] = {v_first[0] - v_second[0], v_first[1] - v_second[1],
                                v_first[2] - v_second[2]};
    return dot(n, relative);
  }

}    // namespace

void GapOperator::prepare(const ContactProblem &problem)
{
  const ContactSet &contacts = problem.contacts;
  const double *velocity = problem.predicted_velocity.data();
  free_gap_.resize(contacts.size());
  change_.resize(3 * static_cast<std::size_t>(problem.slots()));
  for (std::size_t c = 0; c < contacts.size(); ++c)
    free_gap_[c] = contacts.gap[c] +
        problem.timestep *
            opening_speed(&contacts.normal[3 * c],
                          velocity + 3 * static_cast<std::size_t>(contacts.first[c]),
                          velocity + 3 * static_cast<std::size_t>(contacts.second[c]));
}

// Adds G^T impulse to `sum`, 3 per slot. Constraints come in runs with the same first particle,
// in the order of the neighbour list. The sum of that particle is kept in registers over a run:
// through memory each addition would wait for the one before.
INELASTIC_CLONES void scatter_impulses(const ContactSet &contacts, const double *impulse,
                                       double *sum)
{
  const std::size_t count = contacts.size();
  const int *const first = contacts.first.data();
  const int *const second = contacts.second.data();
  const double *n = contacts.normal.data();
  std::size_t c = 0;
  while (c < count) {
    const int i = first[c];
    double ix = 0.0, iy = 0.0, iz = 0.0;
    for (; c < count && first[c] == i; ++c, n += 3) {
      const double lambda = impulse[c];
      double *const j = sum + 3 * static_cast<std::size_t>(second[c]);
      const double x = lambda * n[0], y = lambda * n[1], z = lambda * n[2];
      ix += x;
      iy += y;
      iz += z;
      j[0] -= x;
      j[1] -= y;
      j[2] -= z;
    }
    double *const own = sum + 3 * static_cast<std::size_t>(i);
    own[0] += ix;
    own[1] += iy;
    own[2] += iz;
  }
}

// Writes free_gap + h G change + C impulse, one per constraint.
INELASTIC_CLONES void gather_gaps(const ContactSet &contacts, const double *free_gap,
                                  double timestep, const double *change, const double *impulse,
                                  double *gap_at_end)
{
  const std::size_t count = contacts.size();
  const int *const first = contacts.first.data();
  const int *const second = contacts.second.data();
  const double *const compliance = contacts.compliance.data();
  const double *n = contacts.normal.data();
  for (std::size_t c = 0; c < count; ++c, n += 3)
    gap_at_end[c] = free_gap[c] + compliance[c] * impulse[c] +
        timestep *
            opening_speed(n, change + 3 * static_cast<std::size_t>(first[c]),
                          change + 3 * static_cast<std::size_t>(second[c]));
}

void GapOperator::find_change(const ContactProblem &problem, const double *impulse, Host &host)
{
  std::fill(change_.begin(), change_.end(), 0.0);
  scatter_impulses(problem.contacts, impulse, change_.data());
  problem.velocity_change(change_.data(), host);
}

GapOperator::ImpulseNorm GapOperator::impulse_norm(const ContactProblem &problem,
                                                   const double *impulse, Host &host)
{
  // The norm is summed over particles and not over constraints: where impulses balance, the
  // round-off that is left of a particle's sum is squared.
  std::vector<double> sum(change_.size(), 0.0);
  scatter_impulses(problem.contacts, impulse, sum.data());
  host.sum_over_ghosts(sum.data());
  find_change(problem, impulse, host);
  ImpulseNorm result = {0.0, 0.0};
  std::vector<char> pushed(problem.slots(), 0);
  for (std::size_t c = 0; c < problem.contacts.size(); ++c)
    if (impulse[c] > 0.0)
      pushed[problem.contacts.first[c]] = pushed[problem.contacts.second[c]] = 1;
  auto work = [&](int i) {
    return dot(&sum[3 * i], &change_[3 * i]);
  };
  const RigidBodies &bodies = problem.bodies;
  for (int i = 0; i < problem.slots(); ++i) {
    if (!pushed[i] || problem.is_member(i) || !problem.is_mobile(i)) continue;
    result.squared += work(i);
    result.mass += 1.0 / problem.inverse_mass[i];
  }
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    bool any = false;
    double of_body = 0.0;
    for (int k = bodies.start[b]; k < bodies.start[b] + bodies.originals[b]; ++k)
      of_body += work(bodies.member[k]);
    for (int k = bodies.start[b]; k < bodies.start[b + 1]; ++k)
      any = any || pushed[bodies.member[k]];
    if (!any || bodies.inverse_mass[b] == 0.0) continue;
    result.squared += std::max(0.0, of_body);
    result.mass += 1.0 / bodies.inverse_mass[b];
  }
  return result;
}

void GapOperator::apply(const ContactProblem &problem, const double *impulse, double *gap_at_end,
                        Host &host)
{
  find_change(problem, impulse, host);
  gather_gaps(problem.contacts, free_gap_.data(), problem.timestep, change_.data(), impulse,
              gap_at_end);
}

void GapOperator::velocity(const ContactProblem &problem, const double *impulse, double *velocity,
                           Host &host)
{
  find_change(problem, impulse, host);
  velocity_applied(problem, velocity);
}

void GapOperator::velocity_applied(const ContactProblem &problem, double *velocity) const
{
  for (std::size_t k = 0; k < change_.size(); ++k)
    velocity[k] = problem.predicted_velocity[k] + change_[k];
}

double largest_eigenvalue(const ContactProblem &problem, Host &host)
{
  // The iteration stops when the estimate changes by less than this part of itself ...
  constexpr double RELATIVE_CHANGE = 1.0e-6;
  // ... but not before a stiff mode of few constraints has had time to grow.
  constexpr int MIN_ITERATIONS = 50;
  constexpr int MAX_ITERATIONS = 2000;

  // Without gaps and predicted velocities w(lambda) is the linear map A lambda.
  ContactProblem linear = problem;
  std::fill(linear.contacts.gap.begin(), linear.contacts.gap.end(), 0.0);
  std::fill(linear.predicted_velocity.begin(), linear.predicted_velocity.end(), 0.0);
  GapOperator gap_operator;
  gap_operator.prepare(linear);

  const std::size_t count = linear.contacts.size();
  std::vector<double> direction(count), image(count);
  // The start is uneven, so that no eigenvector of a symmetric arrangement is orthogonal to it.
  for (std::size_t c = 0; c < count; ++c) direction[c] = 1.0 + 0.5 * std::sin(1.0 + 7.0 * c);

  double estimate = 0.0;
  for (int k = 0; k < MAX_ITERATIONS; ++k) {
    double squared_norm = 0.0;
    for (double value : direction) squared_norm += value * value;
    host.reduce(&squared_norm, 1, nullptr, 0);
    if (squared_norm == 0.0) return 0.0;
    const double scale = 1.0 / std::sqrt(squared_norm);
    for (double &value : direction) value *= scale;
    gap_operator.apply(linear, direction.data(), image.data(), host);
    double rayleigh = 0.0;
    for (std::size_t c = 0; c < count; ++c) rayleigh += direction[c] * image[c];
    host.reduce(&rayleigh, 1, nullptr, 0);
    const bool settled =
        k >= MIN_ITERATIONS && std::abs(rayleigh - estimate) <= RELATIVE_CHANGE * rayleigh;
    estimate = rayleigh;
    if (settled) break;
    direction.swap(image);
  }
  return estimate;
}

}    // namespace inelastic
