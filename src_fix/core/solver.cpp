#include "solver.h"

#include <algorithm>
#include <cmath>

namespace inelastic {

Residual residual(const double *gap_at_end, const double *impulse, std::size_t count)
{
  Residual worst;
  for (std::size_t c = 0; c < count; ++c) {
    worst.feasibility = std::max(worst.feasibility, -gap_at_end[c]);
    if (impulse[c] > 0.0) worst.complementarity = std::max(worst.complementarity, gap_at_end[c]);
  }
  return worst;
}

double largest_eigenvalue(const ContactProblem &problem, Host &host)
{
  constexpr double RELATIVE_CHANGE = 1.0e-4;    // of the estimate, per iteration, to stop at
  constexpr int MAX_ITERATIONS = 1000;

  // With the constraint values at zero the gap operator is the linear map A itself.
  ContactProblem linear = problem;
  std::fill(linear.contacts.gap.begin(), linear.contacts.gap.end(), 0.0);
  std::fill(linear.predicted_velocity.begin(), linear.predicted_velocity.end(), 0.0);
  GapOperator gap_operator;
  gap_operator.prepare(linear);

  const std::size_t count = linear.contacts.size();
  std::vector<double> direction(count), image(count);
  // An uneven start, so that no eigenvector of a symmetric arrangement is orthogonal to it.
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
    const bool settled = std::abs(rayleigh - estimate) <= RELATIVE_CHANGE * rayleigh;
    estimate = rayleigh;
    if (settled) break;
    direction.swap(image);
  }
  return estimate;
}

SolverResult AcceleratedProjectedGradient::solve(ContactProblem &problem, const SolverLimits &limits,
                                                 Host &host)
{
  // L is let down a little between calls, so that it can follow a packing that becomes less
  // connected, and raised with a margin when a step shows it too small.
  constexpr double RELAXATION = 0.95;
  constexpr double MARGIN = 1.05;
  constexpr double FIRST_CURVATURE = 2.0;    // two spheres in contact; denser packings raise it

  ContactSet &contacts = problem.contacts;
  const std::size_t count = contacts.size();
  gap_operator_.prepare(problem);

  inverse_diagonal_.resize(count);
  for (std::size_t c = 0; c < count; ++c)
    inverse_diagonal_[c] = 1.0 /
        (problem.timestep *
         (problem.inverse_mass[contacts.first[c]] + problem.inverse_mass[contacts.second[c]]));

  impulse_ = contacts.impulse;
  impulse_before_.resize(count);
  impulse_next_.resize(count);
  gap_.resize(count);
  gap_before_.resize(count);
  gap_next_.resize(count);

  gap_operator_.apply(problem, impulse_.data(), gap_.data(), host);
  SolverResult result;
  result.residual = residual(gap_.data(), impulse_.data(), count);
  double first_maxima[2] = {result.residual.feasibility, result.residual.complementarity};
  host.reduce(nullptr, 0, first_maxima, 2);
  result.residual = {first_maxima[0], first_maxima[1]};
  auto done = [&limits](const Residual &r) {
    return r.feasibility <= limits.tolerance && r.complementarity <= limits.tolerance;
  };
  result.converged = done(result.residual);

  curvature_ = curvature_ == 0.0 ? FIRST_CURVATURE : std::max(1.0, RELAXATION * curvature_);
  double momentum_time = 1.0;
  double momentum = 0.0;
  impulse_before_ = impulse_;
  gap_before_ = gap_;

  while (!result.converged && result.iterations < limits.max_iterations) {
    const double step = 1.0 / curvature_;
    double toward_gradient = 0.0;    // > 0: the momentum points uphill
    double change_squared = 0.0;
    for (std::size_t c = 0; c < count; ++c) {
      const double impulse_ahead = impulse_[c] + momentum * (impulse_[c] - impulse_before_[c]);
      const double gap_ahead = gap_[c] + momentum * (gap_[c] - gap_before_[c]);
      const double next = std::max(0.0, impulse_ahead - step * inverse_diagonal_[c] * gap_ahead);
      const double change = next - impulse_[c];
      toward_gradient += (impulse_ahead - next) * change / inverse_diagonal_[c];
      change_squared += change * change / inverse_diagonal_[c];
      impulse_next_[c] = next;
    }
    gap_operator_.apply(problem, impulse_next_.data(), gap_next_.data(), host);
    ++result.iterations;

    double curved = 0.0;
    double maxima[2] = {0.0, 0.0};
    for (std::size_t c = 0; c < count; ++c) {
      curved += (impulse_next_[c] - impulse_[c]) * (gap_next_[c] - gap_[c]);
      maxima[0] = std::max(maxima[0], -gap_next_[c]);
      if (impulse_next_[c] > 0.0) maxima[1] = std::max(maxima[1], gap_next_[c]);
    }
    double sums[3] = {toward_gradient, change_squared, curved};
    host.reduce(sums, 3, maxima, 2);

    if (sums[2] > curvature_ * sums[1] && sums[1] > 0.0) {
      // The step was longer than the curvature along it allows: shorten it and go on from here
      // without momentum. Nothing of this trial is kept.
      curvature_ = MARGIN * sums[2] / sums[1];
      momentum = 0.0;
      momentum_time = 1.0;
      continue;
    }

    impulse_before_.swap(impulse_);
    impulse_.swap(impulse_next_);
    gap_before_.swap(gap_);
    gap_.swap(gap_next_);
    result.residual = {maxima[0], maxima[1]};
    result.converged = done(result.residual);

    if (sums[0] > 0.0) {
      momentum = 0.0;
      momentum_time = 1.0;
    } else {
      const double next_time = 0.5 * (1.0 + std::sqrt(1.0 + 4.0 * momentum_time * momentum_time));
      momentum = (momentum_time - 1.0) / next_time;
      momentum_time = next_time;
    }
  }
  contacts.impulse = impulse_;
  return result;
}

SolverResult Uzawa::solve(ContactProblem &problem, const SolverLimits &limits, Host &host)
{
  ContactSet &contacts = problem.contacts;
  const std::size_t count = contacts.size();
  std::fill(contacts.impulse.begin(), contacts.impulse.end(), 0.0);
  gap_operator_.prepare(problem);
  gap_.resize(count);

  SolverResult result;
  double step = 0.0;
  while (true) {
    gap_operator_.apply(problem, contacts.impulse.data(), gap_.data(), host);
    const Residual here = residual(gap_.data(), contacts.impulse.data(), count);
    double maxima[2] = {here.feasibility, here.complementarity};
    host.reduce(nullptr, 0, maxima, 2);
    result.residual = {maxima[0], maxima[1]};
    result.converged = result.residual.feasibility <= limits.tolerance;
    if (result.converged || result.iterations >= limits.max_iterations) return result;
    if (step == 0.0) step = 1.0 / largest_eigenvalue(problem, host);
    for (std::size_t c = 0; c < count; ++c)
      contacts.impulse[c] = std::max(0.0, contacts.impulse[c] - step * gap_[c]);
    ++result.iterations;
  }
}

std::unique_ptr<Solver> make_solver(const std::string &name)
{
  if (name == "apgd") return std::make_unique<AcceleratedProjectedGradient>();
  if (name == "uzawa") return std::make_unique<Uzawa>();
  return nullptr;
}

}    // namespace inelastic
