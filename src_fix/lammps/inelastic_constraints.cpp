#include "inelastic_constraints.h"

#include "inelastic_ghost_exchange.h"
#include "inelastic_mover.h"

#include <algorithm>
#include <utility>

using namespace LAMMPS_NS;
using namespace Inelastic_NS;

namespace {

constexpr double FIRST_MARGIN = 0.02;    // of the smallest radius

}    // namespace

Constraints::Constraints(LAMMPS *lmp, Step &step, GhostExchange &ranks, PhaseClock &clock,
                         const FirstGuesses &guesses, LawContacts &laws, Walls &walls,
                         Movers &movers) :
    Pointers(lmp), step_(step), ranks_(ranks), clock_(clock), movers_(movers), walls_(walls),
    overlaps_(lmp, step, ranks), rules_(step, overlaps_), rows_(step, rules_, laws, guesses),
    entangled_(lmp, step, rows_, overlaps_), pairs_(lmp, step, rules_, rows_, entangled_, movers),
    wall_constraints_(lmp, step, rules_, rows_, walls, ranks, movers)
{
}

void Constraints::begin_run(double smallest_radius)
{
  if (margin_ < 0.0 && step_.largest_radius > 0.0) margin_ = FIRST_MARGIN * smallest_radius;
}

void Constraints::collect()
{
  const PhaseClock::Within within(clock_, PhaseClock::COLLECT);
  step_.phase = Phase::CONTACT;
  rows_.begin_step();
  step_.problem_found.clear();
  step_.excess = 0.0;
  step_.relinearisations = 0;
  overlaps_.begin_step();
  came_back_ = relinearised_ = solved_relinearised_ = false;
  pairs_.collect(margin_);
  wall_constraints_.collect(margin_);
  ranks_.fail_together(step_.problem_found);
  entangled_.begin_step();
}

// The velocities are those of the step, `problem` is its problem.
inelastic::Refined Constraints::refine(const std::vector<double> &velocity,
                                       inelastic::ContactProblem &problem)
{
  const PhaseClock::Within within(clock_, PhaseClock::COLLECT);
  step_.problem_found.clear();
  solved_relinearised_ = relinearised_;
  movers_.turn(problem, velocity, step_.motion_of_bodies);
  const inelastic::ContactSet &contacts = problem.contacts;
  const std::size_t known = contacts.size();
  const long added = pairs_.add_violated() + wall_constraints_.add_violated();
  inelastic::Refined refined;
  if (step_.phase == Phase::CONTACT) rules_.keep_within_tolerance(velocity, refined);
  if (need_relinearising()) ++step_.relinearisations;
  const long relinearised = relinearise();
  double sums[3] = {static_cast<double>(added), static_cast<double>(relinearised),
                    static_cast<double>(refined.number)};
  ranks_.reduce(sums, 3, &step_.excess, 1);
  came_back_ = came_back_ || sums[0] > 0.0;
  relinearised_ = relinearised_ || sums[1] > 0.0;
  ranks_.fail_together(step_.problem_found);
  refined.number += added + relinearised;
  refined.anew = refined.anew || relinearised > 0;
  // Where a law may pull the first guess of a new constraint is no idle impulse.
  for (std::size_t c = known; c < contacts.size(); ++c)
    refined.anew = refined.anew || contacts.set[c].may_pull();
  // New constraints come as they are now.
  const auto is_new = [known](const inelastic::ChangedGap &gap) {
    return gap.constraint >= known;
  };
  refined.gaps.erase(std::remove_if(refined.gaps.begin(), refined.gaps.end(), is_new),
                     refined.gaps.end());
  return refined;
}

bool Constraints::need_relinearising() const
{ return movers_.any_turns() || rows_.may_pull() || wall_constraints_.need_relinearising(); }

// Notes the excess of the step on this rank. Returns how many constraints changed. Collective.
long Constraints::relinearise()
{
  step_.excess = 0.0;
  long changed = 0;
  if (movers_.any_turns() || rows_.may_pull()) changed += pairs_.relinearise();
  if (wall_constraints_.need_relinearising()) changed += wall_constraints_.relinearise(margin_);
  return changed;
}

double Constraints::excess()
{
  if (!need_relinearising()) return 0.0;
  const PhaseClock::Within within(clock_, PhaseClock::COLLECT);
  // After the last round no constraint changes any more.
  const int rounds = std::exchange(step_.relinearisations, GapRules::MAX_RELINEARISATIONS + 1);
  relinearise();
  step_.relinearisations = rounds;
  ranks_.reduce(nullptr, 0, &step_.excess, 1);
  return step_.excess;
}

long Constraints::add_violated()
{
  const PhaseClock::Within within(clock_, PhaseClock::COLLECT);
  step_.problem_found.clear();
  double added = static_cast<double>(pairs_.add_violated() + wall_constraints_.add_violated());
  ranks_.reduce(&added, 1, nullptr, 0);
  ranks_.fail_together(step_.problem_found);
  return static_cast<long>(added);
}

void Constraints::adapt_margin(double reach)
{
  constexpr double MORE = 1.1, FEWER = 0.95;
  const double least = step_.eps(in_eps::MARGIN);
  entangled_.end_step();
  margin_ *= came_back_ ? MORE : FEWER;
  margin_ = std::clamp(margin_, least, std::max(least, reach));
}
