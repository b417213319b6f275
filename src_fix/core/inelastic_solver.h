// The interface of all solvers of the projection problem (inelastic_contact_problem.h).
//
// Solvers work on the dual problem: they look for the impulses lambda. All are judged by the same
// two residuals, in units of length, with w the gaps at the end of the step and l the least
// impulses:
//
//   feasibility       the largest -w_c of all constraints: what is lacking of the gap that they ask
//                     for; where l_c < 0 and lambda_c > l_c also the largest w_c: the contact holds
//   complementarity   the largest w_c of the constraints with lambda_c > l_c: the gap that is left
//                     where a force acts
//
// A solver that warm-starts takes its first guess from ContactSet::impulse, of which it takes the
// nearest admissible one. Every solver leaves its result there.

#pragma once

#include "inelastic_contact_problem.h"
#include "inelastic_contact_targets.h"
#include "inelastic_gap_operator.h"
#include "inelastic_host.h"
#include "inelastic_refined.h"
#include "inelastic_solver_limits.h"

#include <algorithm>
#include <limits>
#include <vector>

namespace inelastic {

// Returns the residual of this rank's constraints with their impulses; UNSOLVED if a number is not
// finite.
Residual residual(const double *gap_at_end, const ContactSet &contacts);

// Returns the same over the constraints of all ranks. Collective.
Residual residual_over_ranks(const double *gap_at_end, const ContactSet &contacts, Host &host);

// How the search for the impulses of a step has ended.
enum class Status {
  // The residual is within the target, or within the tolerance where no smaller one was to be had.
  CONVERGED,
  // Each solve converged, but the last one allowed left constraints to add or change
  // (inelastic_projection.h).
  OUT_OF_ROUNDS,
  // The largest number of iterations was made, and the residual is above the tolerance.
  OUT_OF_ITERATIONS,
  // Where impulses act gaps are known to no better than their round-off, and the tolerance is below
  // that.
  ROUND_OFF,
  // A number in the problem or in the iterations is infinite or no number.
  NOT_FINITE,
  // It is certain that no sensible velocities are admissible (inelastic_infeasibility.h).
  INFEASIBLE
};

// The history of the larger residual during the iterations of a solver. When the residual no longer
// comes down, more iterations are of no use.
class ResidualTrend {
 public:
  // Takes the residual of an iteration. Iterations count from 1.
  void see(long iteration, double residual)
  {
    least_ = std::min(least_, residual);
    if (iteration < 2 * mark_) return;
    before_mark_ = at_mark_;
    at_mark_ = least_;
    mark_ = iteration;
  }

  // Returns the least residual so far.
  double least() const { return least_; }
  // Returns the least residual after the first quarter to half of the iterations; infinity if there
  // were too few iterations to tell.
  double earlier() const { return before_mark_; }

 private:
  static constexpr double NONE = std::numeric_limits<double>::infinity();
  long mark_ = 1;    // the last iteration that was a power of two
  double least_ = NONE, at_mark_ = NONE, before_mark_ = NONE;
};

// Tells where the largest residual, as a part of its target, no longer comes down. A search passes
// levels on which it stays for a while, the longer the more contacts there are.
class Plateau {
 public:
  // Takes that part at an iteration.
  void see(long iteration, double unsolved)
  {
    if (!(unsolved < PROGRESS * mark_)) return;
    mark_ = unsolved;
    marked_ = iteration;
  }

  // Tells whether it has stayed for so many iterations.
  bool lasts(long iteration, long so_many) const { return iteration - marked_ > so_many; }

  // Tells whether it has stayed for half of all iterations, or for so many. With `always` it need
  // not have stayed. Notes that something else is tried then: the next time comes after as many
  // iterations again.
  bool is_time_to_try(long iteration, bool always)
  {
    constexpr long FIRST = 100;
    if (iteration < std::max(FIRST, 2 * tried_)) return false;
    if (!always && !lasts(iteration, std::max(FIRST, iteration / 2))) return false;
    tried_ = iteration;
    return true;
  }

 private:
  static constexpr double PROGRESS = 0.5;
  double mark_ = std::numeric_limits<double>::infinity();
  long marked_ = 0, tried_ = 0;
};

// A contact is hardly resolved if more than this part is left of what contacts change: forces then
// say little.
constexpr double HARDLY_RESOLVED = 0.1;
// On a plateau a search ends only where no more is left: a grain that more of it pushes aside ends
// far from where it should, and a few thousand iterations can be enough for it.
constexpr double RESOLVED_ON_PLATEAU = 0.03;
// Where no more is left contacts are resolved as well as the default accuracy asks for: a search
// that comes so far is no lost one, and goes on to whatever its targets are.
constexpr double WELL_RESOLVED = 1.0e-4;

// The constraints with impulses above their least ones, and the particles that they act on and can
// move; over all ranks.
struct Network {
  double contacts = 0.0, particles = 0.0;

  // Returns in about how many iterations conjugate gradients end, one way or the other; sweeps and
  // accelerated gradients do not surpass them.
  long enough_iterations() const
  {
    constexpr double EACH = 0.75;
    return static_cast<long>(EACH * contacts);
  }

  // Returns after how many iterations without progress a search ends. Chains, and a few contacts
  // such as those of grains between walls that close at an angle, are no network, and are solved to
  // the end, however long that takes.
  long most_on_plateau() const
  {
    constexpr double FEW = 60.0, CHAIN = 1.5;
    if (contacts < std::max(FEW, CHAIN * particles)) return std::numeric_limits<long>::max();
    return std::max(LEAST_ON_PLATEAU, enough_iterations());
  }
  static constexpr long LEAST_ON_PLATEAU = 150;
};

// Collective.
Network find_network(const ContactProblem &problem, Host &host);

// What is known before the iterations, from the first guess of the impulses; over all ranks.
struct Guess {
  Residual residual;
  double largest_length =
      0.0;    // [length] The largest gap without impulses, or change by an impulse.
  double largest_diagonal = 0.0;    // [time / mass] of A
  // [1 / mass] Of what can move and has a constraint: that of the heaviest and of the lightest.
  double least_inverse_mass = 0.0, largest_inverse_mass = 0.0;
};

struct SolverResult {
  Status status = Status::OUT_OF_ITERATIONS;
  long iterations = 0;
  Residual residual;         // over all ranks
  double round_off = 0.0;    // [length] of the gaps where impulses act; no residual gets below it
  // Whether all residuals are within their targets, and the largest one as a part of what contacts
  // change (ContactTargets::unresolved).
  bool accurate = false;
  double unresolved = 0.0;
  ResidualTrend trend;
};

// Makes a search that has ended above its targets, but within the tolerance, a solution.
void settle_for_tolerance(const SolverLimits &limits, double reached, SolverResult &result);

class Solver {
 public:
  virtual ~Solver() = default;

  // Solves the problem for problem.contacts.impulse. Collective.
  virtual SolverResult solve(ContactProblem &problem, const SolverLimits &limits, Host &host) = 0;

  // Does the same for a problem that it has just solved to these limits, after which the problem
  // was refined. Collective.
  virtual SolverResult go_on(ContactProblem &problem, const Refined &, const SolverLimits &limits,
                             Host &host)
  { return solve(problem, limits, host); }

  // Returns the operator, prepared for the problem of the last solve. If that solve has converged,
  // the operator was last applied to its result.
  GapOperator &gap_operator() { return gap_operator_; }
  // Those of the last solve.
  const ContactTargets &targets() const { return targets_; }

 protected:
  // Makes the impulses of the problem admissible and judges them as the first guess. Sets the
  // diagonal, and tells the targets. The operator must be prepared for the problem. Collective.
  Guess judge_first_guess(ContactProblem &problem, Host &host);

  GapOperator gap_operator_;
  ContactTargets targets_;
  // Judges what is new in a problem that was solved, and then refined; the impulses of its new
  // constraints become 0. Of the guess the residual changes. Without ghosts.
  void judge_refined(ContactProblem &problem, const Refined &refined, const SolverLimits &limits,
                     Guess &guess);

  std::vector<double> gap_;         // [length] at the end of the step, one per constraint
  std::vector<double> diagonal_;    // of A [time / mass]
};

}    // namespace inelastic
