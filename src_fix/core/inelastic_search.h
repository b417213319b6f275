// A search for the impulses of a problem: one way to look for them, from wherever the one before
// has come to. A chain of searches is a solver (inelastic_search_chain.h).

#pragma once

#include "inelastic_refined.h"

namespace inelastic {

class Solve;

// How a search has ended.
enum class End {
  SOLVED,    // every residual is at most its target, or as small as it is to be had
  GO_ON,     // another search may get further, from the impulses reached
  // The precision of the search gets no further: the next one is to have a better one.
  ROUND_OFF,
  INFEASIBLE,    // it is certain that there is no solution (inelastic_infeasibility.h)
  NOT_FINITE     // a number is infinite or no number
};

class Search {
 public:
  virtual ~Search() = default;

  // Called once for each problem, before the first search.
  virtual void begin() {}
  // Searches from the impulses of the problem, and leaves there what it has come to, judged, unless
  // a number is not finite. Collective.
  virtual End run(Solve &solve) = 0;
  // Whether the last run has solved its problem, and what it has packed of it is the solution.
  virtual bool can_go_on() const { return false; }
  // Goes on from there: the problem, which has no bodies, was refined, and not anew. Else as run().
  virtual End go_on(Solve &solve, const Refined &) { return run(solve); }
  // Whether it works in single precision.
  virtual bool is_single() const = 0;
  // How often it runs, each time from the impulses of the time before, as long as it is to go on.
  virtual int most_runs() const { return 1; }
};

// What searches have in common.

// So many searches in single precision at most, each from the impulses of the one before: what is
// round-off of one is a change of the next.
constexpr int MOST_SEARCHES = 3;
// What may be round-off of single precision is this part of the largest change of an impulse since
// the start of a search, some ten times its unit round-off.
constexpr double SINGLE_ROUND_OFF = 1.0 / 3.0e5;

// Constraints without an impulse whose gaps are far from closed are idle: iterations leave them
// out. A gap is far that is above so many residuals, or tolerances where these are larger: gaps
// change by some residuals until the end. (With tolerances alone a bed at rest moved up to four
// times as fast, measured: contacts that closed in the step came in late.)
constexpr double IDLE_GAP = 5.0;
// Idle constraints are looked at in every so many iterations.
constexpr long LOOK_EVERY = 20;
// Working constraints that could be idle become so only when they are more than one in so many: to
// make a few of them idle moves all others in memory, and saves little.
constexpr int FEW_IDLE = 10;

}    // namespace inelastic
