#include "inelastic_conjugate_gradients.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace inelastic {

namespace {

  // Impulses are judged in double precision every so many iterations.
  constexpr long JUDGE_EVERY = 10;
  // The search ends where the largest part of a target comes down to this: velocities, in which
  // residuals add up, have then settled, too.
  constexpr double SETTLED = 0.1;
  // It also ends where that part has not come down by this factor in so many iterations, or in as
  // many as were made before.
  constexpr double PROGRESS = 0.5;
  constexpr long PATIENCE = 60;
  // A projected gradient step may have at most twice the inverse of the largest eigenvalue, of
  // which the curvature is a bound from below.
  constexpr double STEP = 1.0;

}    // namespace

void ConjugateGradients::begin(const ContactProblem &problem, const std::vector<double> &diagonal)
{
  const ContactSet &contacts = problem.contacts;
  const std::size_t count = contacts.size();
  for (std::vector<double> *const numbers : {&root_, &x_, &least_, &g_, &p_, &product_, &unscaled_})
    numbers->resize(count);
  for (std::size_t c = 0; c < count; ++c) {
    root_[c] = std::sqrt(diagonal[c]);
    x_[c] = contacts.impulse[c] * root_[c];
    least_[c] = contacts.set[c].idle() * root_[c];
  }
  curvature_ = 1.0;
}

void ConjugateGradients::take_gaps(const std::vector<double> &gap)
{
  for (std::size_t c = 0; c < g_.size(); ++c) g_[c] = gap[c] / root_[c];
}

void ConjugateGradients::give_impulses(ContactProblem &problem) const
{
  ContactSet &contacts = problem.contacts;
  // A held impulse is its least one to the last bit.
  for (std::size_t c = 0; c < x_.size(); ++c)
    contacts.impulse[c] = is_free(c) ? x_[c] / root_[c] : contacts.set[c].idle();
}

void ConjugateGradients::multiply(const ContactProblem &problem, const std::vector<double> &by,
                                  Host &host)
{
  for (std::size_t c = 0; c < by.size(); ++c) unscaled_[c] = by[c] / root_[c];
  gap_operator_->product(problem, unscaled_.data(), product_.data(), host);
  for (std::size_t c = 0; c < by.size(); ++c) product_[c] /= root_[c];
}

ConjugateGradients::Sums ConjugateGradients::look(Host &host) const
{
  double sums[2] = {0.0, 0.0};
  for (std::size_t c = 0; c < g_.size(); ++c) {
    if (!is_free(c)) {
      const double pushes = std::min(g_[c], 0.0);
      sums[0] += pushes * pushes;
    } else
      sums[1] += std::min(curvature_ / STEP * (x_[c] - least_[c]), g_[c]) * g_[c];
  }
  host.reduce(sums, 2, nullptr, 0);
  return {sums[0], sums[1]};
}

void ConjugateGradients::begin_direction()
{
  for (std::size_t c = 0; c < p_.size(); ++c) p_[c] = free_gradient(c);
}

// Goes along the direction until an impulse comes to its least one, and from there by a projected
// gradient step.
void ConjugateGradients::expand(double longest)
{
  for (std::size_t c = 0; c < x_.size(); ++c) {
    x_[c] = std::max(least_[c], x_[c] - longest * p_[c]);
    g_[c] -= longest * product_[c];
  }
  for (std::size_t c = 0; c < x_.size(); ++c)
    x_[c] = std::max(least_[c], x_[c] - STEP / curvature_ * free_gradient(c));
  expanded_ = true;
}

// Makes a step along the direction. Returns false where there is none.
bool ConjugateGradients::step(const ContactProblem &problem, Host &host)
{
  multiply(problem, p_, host);
  double sums[4] = {0.0, 0.0, 0.0, 0.0}, nearest = -std::numeric_limits<double>::max();
  for (std::size_t c = 0; c < p_.size(); ++c) {
    sums[0] += p_[c] * product_[c];
    sums[1] += p_[c] * g_[c];
    sums[2] += p_[c] * p_[c];
    sums[3] += product_[c] * product_[c];
    if (p_[c] > 0.0) nearest = std::max(nearest, -(x_[c] - least_[c]) / p_[c]);
  }
  host.reduce(sums, 4, &nearest, 1);
  if (!(sums[0] > 0.0) || !std::isfinite(sums[3])) return false;
  curvature_ = std::max(curvature_, std::sqrt(sums[3] / sums[2]));
  const double length = sums[1] / sums[0];
  if (length > -nearest) {
    expand(-nearest);
    return true;
  }
  double along = 0.0;
  for (std::size_t c = 0; c < x_.size(); ++c) {
    x_[c] = std::max(least_[c], x_[c] - length * p_[c]);
    g_[c] -= length * product_[c];
    along += free_gradient(c) * product_[c];
  }
  host.reduce(&along, 1, nullptr, 0);
  for (std::size_t c = 0; c < p_.size(); ++c) p_[c] = free_gradient(c) - along / sums[0] * p_[c];
  return true;
}

// Makes a step along the gradients of the held impulses that push to be let go. Returns false where
// there are none.
bool ConjugateGradients::let_go(const ContactProblem &problem, Host &host)
{
  for (std::size_t c = 0; c < p_.size(); ++c) p_[c] = is_free(c) ? 0.0 : std::min(g_[c], 0.0);
  multiply(problem, p_, host);
  double sums[2] = {0.0, 0.0};
  for (std::size_t c = 0; c < p_.size(); ++c) {
    sums[0] += p_[c] * product_[c];
    sums[1] += p_[c] * g_[c];
  }
  host.reduce(sums, 2, nullptr, 0);
  if (!(sums[0] > 0.0)) return false;
  const double length = sums[1] / sums[0];
  for (std::size_t c = 0; c < x_.size(); ++c) {
    x_[c] -= length * p_[c];
    g_[c] -= length * product_[c];
  }
  begin_direction();
  return true;
}

long ConjugateGradients::search(ContactProblem &problem, GapOperator &gap_operator,
                                const std::vector<double> &diagonal, const std::vector<double> &gap,
                                long most, const Judge &judge, Host &host)
{
  gap_operator_ = &gap_operator;
  begin(problem, diagonal);
  take_gaps(gap);
  begin_direction();
  std::vector<double> &impulse = problem.contacts.impulse;
  std::vector<double> best = impulse;
  double least = std::numeric_limits<double>::max(), mark = least;
  long made = 0, marked = 0;
  for (long next_judged = JUDGE_EVERY; made < most;) {
    const Sums sums = look(host);
    const bool goes_on = sums.held <= sums.free ? step(problem, host) : let_go(problem, host);
    ++made;
    if (goes_on && !expanded_ && made < next_judged && made < most) continue;
    give_impulses(problem);
    if (expanded_ && made < next_judged && made < most) {
      gap_operator.apply(problem, impulse.data(), product_.data(), host);
      take_gaps(product_);
      ++made;
    } else {
      const double unsolved = judge();
      take_gaps(gap);
      if (unsolved < least) {
        least = unsolved;
        best = impulse;
      }
      if (least < PROGRESS * mark) {
        mark = least;
        marked = made;
      }
      const bool stuck = made - marked > std::max(PATIENCE, marked);
      if (!goes_on || !std::isfinite(unsolved) || least <= SETTLED || stuck) break;
      next_judged = made + JUDGE_EVERY;
    }
    if (expanded_) begin_direction();
    expanded_ = false;
  }
  expanded_ = false;
  if (impulse != best) impulse = best;
  judge();
  return made;
}

}    // namespace inelastic
