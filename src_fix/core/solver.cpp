#include "solver.h"

#include "accelerated_gradient.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace inelastic {

namespace {

  constexpr Residual UNSOLVED = {std::numeric_limits<double>::infinity(),
                                 std::numeric_limits<double>::infinity()};

}    // namespace

Residual residual(const double *gap_at_end, const double *impulse, std::size_t count)
{
  Residual worst;
  for (std::size_t c = 0; c < count; ++c) {
    // A value that is no number satisfies nothing.
    if (!std::isfinite(gap_at_end[c]) || !std::isfinite(impulse[c])) return UNSOLVED;
    worst.feasibility = std::max(worst.feasibility, -gap_at_end[c]);
    if (impulse[c] > 0.0) worst.complementarity = std::max(worst.complementarity, gap_at_end[c]);
  }
  return worst;
}

bool is_infeasible(const ContactProblem &problem, GapOperator &gap_operator,
                   const SolverLimits &limits, Host &host)
{
  constexpr double FAR = 10.0;
  const std::vector<double> &impulse = problem.contacts.impulse;
  const std::vector<double> &free_gap = gap_operator.free_gap();
  double lacking = 0.0, farthest = 0.0;
  for (std::size_t c = 0; c < impulse.size(); ++c) {
    lacking -= impulse[c] * (free_gap[c] + limits.tolerance);
    farthest = std::max(farthest, -free_gap[c]);
  }
  for (int i = 0; i < problem.particles; ++i) {
    const double *const v = &problem.predicted_velocity[3 * static_cast<std::size_t>(i)];
    farthest = std::max(farthest, problem.timestep * std::hypot(v[0], v[1], v[2]));
  }
  const GapOperator::Kick kick = gap_operator.kick(problem, impulse.data(), host);
  double sums[3] = {lacking, kick.squared, kick.mass};
  host.reduce(sums, 3, &farthest, 1);
  return sums[0] > std::max(limits.reach, FAR * farthest) * std::sqrt(sums[1] * sums[2]);
}

double largest_eigenvalue(const ContactProblem &problem, Host &host)
{
  constexpr double RELATIVE_CHANGE = 1.0e-6;    // of the estimate, per iteration, to stop at
  constexpr int MIN_ITERATIONS = 50;    // a stiff mode of few constraints grows before it is seen
  constexpr int MAX_ITERATIONS = 2000;

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
    const bool settled =
        k >= MIN_ITERATIONS && std::abs(rayleigh - estimate) <= RELATIVE_CHANGE * rayleigh;
    estimate = rayleigh;
    if (settled) break;
    direction.swap(image);
  }
  return estimate;
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
    if (result.converged || result.iterations >= limits.max_iterations ||
        !std::isfinite(result.residual.feasibility))
      return result;
    if (result.iterations > 0) result.trend.see(result.iterations, result.residual.feasibility);
    if (result.iterations > 0 && result.iterations % CHECK_EVERY == 0) {
      result.infeasible = is_infeasible(problem, gap_operator_, limits, host);
      if (result.infeasible) return result;
    }
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
