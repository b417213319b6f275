#include "inelastic_gap_operator.h"

#include "inelastic_vector3.h"

#include <algorithm>
#include <cmath>

namespace inelastic {

void GapOperator::prepare(const ContactProblem &problem)
{
  free_gap_.resize(problem.contacts.size());
  change_.resize(problem.predicted_velocity.size());
  problem.contacts.free_gaps(problem.timestep, problem.predicted_velocity.data(), free_gap_.data());
}

void GapOperator::find_change(const ContactProblem &problem, const double *impulse, Host &host)
{
  std::fill(change_.begin(), change_.end(), 0.0);
  problem.contacts.add_impulses(impulse, change_.data());
  problem.velocity_change(change_.data(), host);
}

GapOperator::ImpulseNorm GapOperator::impulse_norm(const ContactProblem &problem,
                                                   const double *impulse, Host &host)
{
  // The norm is summed over particles and not over constraints: where impulses balance, the
  // round-off that is left of a particle's sum is squared.
  std::vector<double> sum(change_.size(), 0.0);
  problem.contacts.add_impulses(impulse, sum.data());
  host.sum_over_ghosts(sum.data(), 3);
  find_change(problem, impulse, host);
  ImpulseNorm result = {0.0, 0.0};
  std::vector<char> pushed(problem.slots(), 0);
  for (std::size_t c = 0; c < problem.contacts.size(); ++c)
    if (problem.contacts.pushes(c, impulse))
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
  problem.contacts.gaps_at_end(free_gap_.data(), problem.timestep, change_.data(), impulse,
                               gap_at_end);
}

void GapOperator::refine(const ContactProblem &problem, const Refined &refined,
                         std::vector<double> &gap_at_end)
{
  const ContactSet &contacts = problem.contacts;
  const auto free_gap = [&](std::size_t c) {
    return contacts.free_gap(c, problem.timestep, problem.predicted_velocity.data());
  };
  for (const ChangedGap &gap : refined.gaps) {
    free_gap_[gap.constraint] += gap.by;
    gap_at_end[gap.constraint] += gap.by;
  }
  for (std::size_t c = free_gap_.size(); c < contacts.size(); ++c) {
    free_gap_.push_back(free_gap(c));
    const double opened = contacts.free_gap(c, problem.timestep, change_.data()) - contacts.gap[c];
    gap_at_end.push_back(free_gap_[c] + opened);
  }
}

void GapOperator::product(const ContactProblem &problem, const double *impulse, double *opened,
                          Host &host)
{
  find_change(problem, impulse, host);
  const std::vector<double> none(free_gap_.size(), 0.0);
  problem.contacts.gaps_at_end(none.data(), problem.timestep, change_.data(), impulse, opened);
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
  // The start is uneven, so that no eigenvector of a symmetric arrangement is orthogonal to it: by
  // the normal, too, since each rank counts its own constraints from 0.
  for (std::size_t c = 0; c < count; ++c) {
    const double *const n = &linear.contacts.normal[3 * c];
    const double of_normal = 2.0 * n[0] + 3.0 * n[1] + 5.0 * n[2];
    direction[c] = 1.0 + 0.5 * std::sin(1.0 + 7.0 * static_cast<double>(c) + of_normal);
  }

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
