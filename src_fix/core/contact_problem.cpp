#include "contact_problem.h"

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
        problem.timestep * (n[0] * (vi[0] - vj[0]) + n[1] * (vi[1] - vj[1]) + n[2] * (vi[2] - vj[2]));
  }
}

void GapOperator::velocity_change(const ContactProblem &problem, const double *impulse, Host &host)
{
  const ContactSet &contacts = problem.contacts;
  double *const change = change_.data();
  std::fill(change_.begin(), change_.end(), 0.0);
  const std::size_t count = contacts.size();
  for (std::size_t c = 0; c < count; ++c) {
    const double *n = &contacts.normal[3 * c];
    double *pi = change + 3 * static_cast<std::size_t>(contacts.first[c]);
    double *pj = change + 3 * static_cast<std::size_t>(contacts.second[c]);
    const double px = impulse[c] * n[0];
    const double py = impulse[c] * n[1];
    const double pz = impulse[c] * n[2];
    pi[0] += px;
    pi[1] += py;
    pi[2] += pz;
    pj[0] -= px;
    pj[1] -= py;
    pj[2] -= pz;
  }
  host.sum_over_copies(change);
  for (std::size_t i = 0; i <= static_cast<std::size_t>(problem.particles); ++i) {
    const double w = problem.inverse_mass[i];
    change[3 * i] *= w;
    change[3 * i + 1] *= w;
    change[3 * i + 2] *= w;
  }
}

void GapOperator::apply(const ContactProblem &problem, const double *impulse, double *gap_at_end,
                        Host &host)
{
  velocity_change(problem, impulse, host);
  const ContactSet &contacts = problem.contacts;
  const double *const change = change_.data();
  const double h = problem.timestep;
  const std::size_t count = contacts.size();
  for (std::size_t c = 0; c < count; ++c) {
    const double *n = &contacts.normal[3 * c];
    const double *ui = change + 3 * static_cast<std::size_t>(contacts.first[c]);
    const double *uj = change + 3 * static_cast<std::size_t>(contacts.second[c]);
    gap_at_end[c] = free_gap_[c] +
        h * (n[0] * (ui[0] - uj[0]) + n[1] * (ui[1] - uj[1]) + n[2] * (ui[2] - uj[2]));
  }
}

void GapOperator::velocity(const ContactProblem &problem, const double *impulse, double *velocity,
                           Host &host)
{
  velocity_change(problem, impulse, host);
  for (std::size_t k = 0; k < 3 * static_cast<std::size_t>(problem.particles); ++k)
    velocity[k] = problem.predicted_velocity[k] + change_[k];
}

}    // namespace inelastic
