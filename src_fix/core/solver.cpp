#include "solver.h"

#include "vectorise.h"

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

// One step of projected gradient from the point that the momentum leads to.
INELASTIC_CLONES AcceleratedProjectedGradient::Advance
AcceleratedProjectedGradient::advance_impulses(std::size_t count, double momentum, double step)
{
  const double *const impulse = impulse_.data();
  const double *const impulse_before = impulse_before_.data();
  const double *const gap = gap_.data();
  const double *const gap_before = gap_before_.data();
  const double *const diagonal = diagonal_.data();
  double *const impulse_next = impulse_next_.data();
  double uphill = 0.0, change_squared = 0.0;
#pragma omp simd reduction(+ : uphill, change_squared)
  for (std::size_t c = 0; c < count; ++c) {
    const double impulse_ahead = impulse[c] + momentum * (impulse[c] - impulse_before[c]);
    const double gap_ahead = gap[c] + momentum * (gap[c] - gap_before[c]);
    const double unconstrained = impulse_ahead - step * gap_ahead / diagonal[c];
    const double next = unconstrained > 0.0 ? unconstrained : 0.0;
    const double change = next - impulse[c];
    uphill += (impulse_ahead - next) * change * diagonal[c];
    change_squared += change * change * diagonal[c];
    impulse_next[c] = next;
  }
  return {uphill, change_squared};
}

INELASTIC_CLONES AcceleratedProjectedGradient::Outcome
AcceleratedProjectedGradient::compare(std::size_t count) const
{
  const double *const impulse = impulse_.data();
  const double *const impulse_next = impulse_next_.data();
  const double *const gap = gap_.data();
  const double *const gap_next = gap_next_.data();
  double curved = 0.0, least = 0.0, most = 0.0;
#pragma omp simd reduction(+ : curved) reduction(min : least) reduction(max : most)
  for (std::size_t c = 0; c < count; ++c) {
    curved += (impulse_next[c] - impulse[c]) * (gap_next[c] - gap[c]);
    const double under_force = impulse_next[c] > 0.0 ? gap_next[c] : 0.0;
    least = gap_next[c] < least ? gap_next[c] : least;
    most = under_force > most ? under_force : most;
  }
  return {curved, {std::max(0.0, -least), most}};
}

SolverResult AcceleratedProjectedGradient::solve(ContactProblem &problem,
                                                 const SolverLimits &limits, Host &host)
{
  // L is let down a little between calls, so that it can follow a packing that becomes less
  // connected, and raised with a margin when a step shows it too small.
  constexpr double RELAXATION = 0.998;
  constexpr double MARGIN = 1.05;
  constexpr double LEAST_SCALE = 0.9, MOST_SCALE = 1.1;
  constexpr double FIRST_CURVATURE =
      2.0;    // of a few contacts; a first step far too long costs more

  ContactSet &contacts = problem.contacts;
  const std::size_t count = contacts.size();
  gap_operator_.prepare(problem);

  diagonal_.resize(count);
  for (std::size_t c = 0; c < count; ++c) {
    const double *const n = &contacts.normal[3 * c];
    diagonal_[c] = problem.timestep *
        (problem.mobility(contacts.first[c], n) + problem.mobility(contacts.second[c], n));
  }

  impulse_.resize(count);
  for (std::size_t c = 0; c < count; ++c) impulse_[c] = std::max(0.0, contacts.impulse[c]);
  impulse_before_.resize(count);
  impulse_next_.resize(count);
  gap_.resize(count);
  gap_before_.resize(count);
  gap_next_.resize(count);

  gap_operator_.apply(problem, impulse_.data(), gap_.data(), host);
  SolverResult result;
  result.residual = residual(gap_.data(), impulse_.data(), count);
  double along = 0.0, along_free = 0.0;
  const std::vector<double> &free_gap = gap_operator_.free_gap();
  for (std::size_t c = 0; c < count; ++c) {
    along += impulse_[c] * gap_[c];
    along_free += impulse_[c] * free_gap[c];
  }
  double first_sums[2] = {along, along_free};
  double first_maxima[2] = {result.residual.feasibility, result.residual.complementarity};
  host.reduce(first_sums, 2, first_maxima, 2);
  result.residual = {first_maxima[0], first_maxima[1]};
  auto done = [&limits](const Residual &r) {
    return r.feasibility <= limits.tolerance && r.complementarity <= limits.tolerance;
  };
  result.converged = done(result.residual);
  if (result.converged || !std::isfinite(result.residual.feasibility)) {
    contacts.impulse = impulse_;
    return result;
  }

  // The guess is first made as large as the dual function likes it along its own direction, which
  // costs no product since w is affine: with b = w(0), the minimum over s of the dual at s lambda
  // is at s = -lambda.b / lambda.(w - b). Measured to save a tenth of the iterations, within these
  // bounds.
  const double curved_along = first_sums[0] - first_sums[1];
  if (curved_along > 0.0) {
    const double scale = std::clamp(-first_sums[1] / curved_along, LEAST_SCALE, MOST_SCALE);
    for (std::size_t c = 0; c < count; ++c) {
      impulse_[c] *= scale;
      gap_[c] = free_gap[c] + scale * (gap_[c] - free_gap[c]);
    }
  }

  curvature_ = curvature_ == 0.0 ? FIRST_CURVATURE : std::max(1.0, RELAXATION * curvature_);
  double momentum_time = 1.0;
  double momentum = 0.0;
  impulse_before_ = impulse_;
  gap_before_ = gap_;

  while (!result.converged && result.iterations < limits.max_iterations) {
    const Advance advance = advance_impulses(count, momentum, 1.0 / curvature_);
    gap_operator_.apply(problem, impulse_next_.data(), gap_next_.data(), host);
    ++result.iterations;

    const Outcome outcome = compare(count);
    double maxima[2] = {outcome.residual.feasibility, outcome.residual.complementarity};
    double sums[3] = {advance.uphill, advance.change_squared, outcome.curved};
    host.reduce(sums, 3, maxima, 2);
    if (!std::isfinite(sums[2])) {
      result.residual = UNSOLVED;
      break;
    }

    // A step that was longer than the curvature along it allows is kept: the next ones undo its
    // harm, and dropping it with its momentum was measured to cost a quarter more iterations.
    if (sums[2] > curvature_ * sums[1] && sums[1] > 0.0) curvature_ = MARGIN * sums[2] / sums[1];

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
    if (result.converged || result.iterations >= limits.max_iterations ||
        !std::isfinite(result.residual.feasibility))
      return result;
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
