#include "contact_problem.h"

#include "vectorise.h"

#include <algorithm>

namespace inelastic {

void ContactProblem::resize(int number_of_particles)
{
  particles = number_of_particles;
  const std::size_t slots = static_cast<std::size_t>(number_of_particles) + 1;
  predicted_velocity.resize(3 * slots);
  inverse_mass.resize(slots);
  std::fill_n(predicted_velocity.end() - 3, 3, 0.0);
  inverse_mass.back() = 0.0;
}

void GapOperator::prepare(const ContactProblem &problem)
{
  const ContactSet &contacts = problem.contacts;
  const double *velocity = problem.predicted_velocity.data();
  free_gap_.resize(contacts.size());
  change_.resize(3 * (static_cast<std::size_t>(problem.particles) + 1));
  for (std::size_t c = 0; c < contacts.size(); ++c) {
    const double *n = &contacts.normal[3 * c];
    const double *vi = velocity + 3 * static_cast<std::size_t>(contacts.first[c]);
    const double *vj = velocity + 3 * static_cast<std::size_t>(contacts.second[c]);
    free_gap_[c] = contacts.gap[c] +
        problem.timestep *
            (n[0] * (vi[0] - vj[0]) + n[1] * (vi[1] - vj[1]) + n[2] * (vi[2] - vj[2]));
  }
  if (problem.bodies.empty()) return;
  free_particles_.clear();
  for (int i = 0; i <= problem.particles; ++i)
    if (i == problem.particles || problem.bodies.body[i] < 0) free_particles_.push_back(i);
}

// Contacts come in runs with the same first particle, in the order of the neighbour list. Its sum
// is kept in registers over a run: through memory each addition would wait for the one before.
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

INELASTIC_CLONES void gather_gaps(const ContactSet &contacts, const double *free_gap,
                                  double timestep, const double *change, double *gap_at_end)
{
  const std::size_t count = contacts.size();
  const int *const first = contacts.first.data();
  const int *const second = contacts.second.data();
  const double *n = contacts.normal.data();
  for (std::size_t c = 0; c < count; ++c, n += 3) {
    const double *const i = change + 3 * static_cast<std::size_t>(first[c]);
    const double *const j = change + 3 * static_cast<std::size_t>(second[c]);
    gap_at_end[c] = free_gap[c] +
        timestep * (n[0] * (i[0] - j[0]) + n[1] * (i[1] - j[1]) + n[2] * (i[2] - j[2]));
  }
}

void GapOperator::velocity_change(const ContactProblem &problem, const double *impulse, Host &host)
{
  double *const change = change_.data();
  std::fill(change_.begin(), change_.end(), 0.0);
  scatter_impulses(problem.contacts, impulse, change);
  host.sum_over_copies(change);
  auto divide_by_mass = [&](std::size_t i) {
    const double w = problem.inverse_mass[i];
    change[3 * i] *= w;
    change[3 * i + 1] *= w;
    change[3 * i + 2] *= w;
  };
  if (problem.bodies.empty()) {
    for (std::size_t i = 0; i <= static_cast<std::size_t>(problem.particles); ++i)
      divide_by_mass(i);
  } else {
    for (const int i : free_particles_) divide_by_mass(i);
    problem.bodies.velocity_change(change);
  }
}

GapOperator::Kick GapOperator::kick(const ContactProblem &problem, const double *impulse,
                                    Host &host)
{
  // Of each particle, and not of each constraint: where impulses balance, what round-off leaves
  // is squared.
  std::vector<double> sum(change_.size(), 0.0);
  scatter_impulses(problem.contacts, impulse, sum.data());
  host.sum_over_copies(sum.data());
  velocity_change(problem, impulse, host);
  Kick kick = {0.0, 0.0};
  std::vector<char> pushed(static_cast<std::size_t>(problem.particles) + 1, 0);
  for (std::size_t c = 0; c < problem.contacts.size(); ++c)
    if (impulse[c] > 0.0)
      pushed[problem.contacts.first[c]] = pushed[problem.contacts.second[c]] = 1;
  auto work = [&](int i) {
    return sum[3 * i] * change_[3 * i] + sum[3 * i + 1] * change_[3 * i + 1] +
        sum[3 * i + 2] * change_[3 * i + 2];
  };
  const RigidBodies &bodies = problem.bodies;
  for (int i = 0; i < problem.particles; ++i) {
    if (!pushed[i] || problem.inverse_mass[i] == 0.0) continue;
    if (!bodies.empty() && bodies.body[i] >= 0) continue;
    kick.squared += work(i);
    kick.mass += 1.0 / problem.inverse_mass[i];
  }
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    bool any = false;
    double of_body = 0.0;
    for (int k = bodies.start[b]; k < bodies.start[b] + bodies.originals[b]; ++k)
      of_body += work(bodies.member[k]);
    for (int k = bodies.start[b]; k < bodies.start[b + 1]; ++k)
      any = any || pushed[bodies.member[k]];
    if (!any || bodies.inverse_mass[b] == 0.0) continue;
    kick.squared += std::max(0.0, of_body);
    kick.mass += 1.0 / bodies.inverse_mass[b];
  }
  return kick;
}

void GapOperator::apply(const ContactProblem &problem, const double *impulse, double *gap_at_end,
                        Host &host)
{
  velocity_change(problem, impulse, host);
  gather_gaps(problem.contacts, free_gap_.data(), problem.timestep, change_.data(), gap_at_end);
}

void GapOperator::velocity(const ContactProblem &problem, const double *impulse, double *velocity,
                           Host &host)
{
  velocity_change(problem, impulse, host);
  velocity_applied(problem, velocity);
}

void GapOperator::velocity_applied(const ContactProblem &problem, double *velocity) const
{
  for (std::size_t k = 0; k < 3 * static_cast<std::size_t>(problem.particles); ++k)
    velocity[k] = problem.predicted_velocity[k] + change_[k];
}

}    // namespace inelastic
