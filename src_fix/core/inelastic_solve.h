// One solve of a problem, as its searches share it (inelastic_search.h): the impulses that it has
// come to, the verdict on them, which is always in double precision, and when a search that gets
// nowhere is to end or to be helped.

#pragma once

#include "inelastic_conjugate_gradients.h"
#include "inelastic_solver.h"
#include "inelastic_start.h"

#include <vector>

namespace inelastic {

class Solve {
 public:
  // What a solver keeps from one solve to the next.
  struct Kept {
    GapOperator &gap_operator;
    ContactTargets &targets;
    std::vector<double> &gap, &diagonal;
    ConjugateGradients &conjugate_gradients;
  };

  // The first guess has been judged by its solver.
  Solve(ContactProblem &of_problem, const SolverLimits &of_limits, const Kept &kept,
        const Guess &guess, Host &of_host);

  ContactProblem &problem;
  const SolverLimits &limits;
  Host &host;
  SolverResult result;
  ResidualTrend trend_of_targets;    // of the largest residual as a part of its target
  Plateau plateau;

  std::vector<double> &impulse() { return problem.contacts.impulse; }
  GapOperator &gap_operator() { return kept_.gap_operator; }
  const std::vector<double> &gap() const { return kept_.gap; }
  const Scales &scales() const { return scales_; }
  Start start() const;
  // The gap above which a constraint without an impulse is idle now [length].
  double idle_gap() const;
  bool is_out_of_iterations() const { return result.iterations >= limits.max_iterations; }

  // Sets the gaps, the residual and the targets of the impulses. Returns whether every residual is
  // at most its target. Collective.
  bool judge();

  // Sets the targets of impulses whose gaps are known. Returns the largest residual as a part of
  // its target. Collective.
  double set_targets();
  // Returns what set_targets() has returned last.
  double unsolved() const { return unsolved_; }

  // Sets the gaps of the impulses. Collective.
  void find_gaps() { kept_.gap_operator.apply(problem, impulse().data(), kept_.gap.data(), host); }

  // Chooses the ghosts that are in constraints of this rank, and all members of a body of which one
  // is, if no search has done so. Most ghosts are in none. Collective.
  void choose_ghosts();

  // Forgets how residuals have come down: the next ones are those of more constraints.
  void forget_trends() { result.trend = trend_of_targets = ResidualTrend(); }

  // Tells whether the residual has stayed where it is for so long that it is time to look whether a
  // few slow modes keep it up.
  bool is_time_for_slow_modes();

  // Tells whether a few slow modes may keep the residual up: where masses are very different, or it
  // has stayed for longer than conjugate gradients would take with the present impulses, as among
  // a few grains that are wedged between nearly parallel walls. Collective.
  bool may_have_slow_modes();

  // Tries conjugate gradients (inelastic_conjugate_gradients.h). If they solve the problem this
  // returns true. Otherwise all stays as it was but the number of iterations. Collective.
  bool solve_slow_modes();

  // Tells whether the residual has not come down for so long that it is worth to look why.
  bool is_on_plateau() const { return plateau.lasts(result.iterations, Network::LEAST_ON_PLATEAU); }

  // Tells whether that is so long that a search may end, by the network of contacts as it was when
  // most_on_plateau() was called last: it changes little in a search.
  bool may_end_on_plateau() const
  { return is_on_plateau() && plateau.lasts(result.iterations, most_on_plateau_); }

  // Returns after how many iterations without progress a search ends. Collective.
  long most_on_plateau()
  { return most_on_plateau_ = find_network(problem, host).most_on_plateau(); }

  // Tells whether a search ends on a plateau: with `tries` slow modes are tried first. Otherwise
  // the impulses, which are judged here, will do if their residual has not come down for long and
  // is within the tolerance, and little is left of what contacts change, but more than the default
  // accuracy leaves: if conjugate gradients do not solve them either, the targets are not to be
  // had. Collective.
  bool ends_on_plateau(bool tries);

 private:
  const Kept kept_;
  Scales scales_;
  double mass_ratio_;    // of the heaviest to the lightest that can move
  bool chose_ghosts_ = false;
  double unsolved_ = 0.0;
  long most_on_plateau_ = 0;
};

}    // namespace inelastic
