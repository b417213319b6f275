#include "inelastic_push_apart.h"

#include "inelastic_constraints.h"
#include "inelastic_ghost_exchange.h"
#include "inelastic_mover.h"
#include "inelastic_step.h"

#include "atom.h"
#include "update.h"

#include "fmt/format.h"

#include <algorithm>

using namespace LAMMPS_NS;
using namespace Inelastic_NS;
using inelastic::dot;

namespace {

// The compliance of an overlap that gives way, in units of the diagonal of A: a lone one opens by a
// hundredth less than asked for. (With a tenth a bed whose spheres grow by a tenth needs five times
// as many steps.)
constexpr double GIVES_WAY = 0.01;
// Overlaps open where they do so by at least this part of what is asked for. In dense starts and in
// beds that swell it is never below 0.2, in jammed packings at most 0.003.
constexpr double OPENS = 0.02;
// They are not expected to open any more after so many steps in which they did not.
constexpr int MOST_IN_VAIN = 3;

// Both projections of a step as one result.
void add(inelastic::ProjectionResult &result, const inelastic::ProjectionResult &pushed)
{
  result.iterations += pushed.iterations;
  result.status = inelastic::worse(result.status, pushed.status);
  result.round_off = std::max(result.round_off, pushed.round_off);
  result.residual.feasibility = std::max(result.residual.feasibility, pushed.residual.feasibility);
  result.residual.complementarity =
      std::max(result.residual.complementarity, pushed.residual.complementarity);
}

}    // namespace

PushApart::PushApart(LAMMPS *lmp, Step &step, Constraints &constraints, GhostExchange &ranks,
                     Movers &movers) :
    Pointers(lmp), step_(step), constraints_(constraints), ranks_(ranks), movers_(movers)
{
}

void PushApart::skip()
{
  gives_way_ = false;
  in_vain_ = 0;
  left_ = Left{};
  deepest_at_end_ = 0.0;
}

bool PushApart::in_vain() const
{ return in_vain_ >= MOST_IN_VAIN; }

// Sets the contacts back to those of the first projection. What earlier trials have found stays: it
// is known to be in the problem, and nobody would find it again.
void PushApart::begin_trial(const inelastic::ContactSet &contacts)
{
  inelastic::ContactSet &present = step_.problem.contacts;
  const inelastic::ContactSet last = present;
  present = contacts;
  for (std::size_t c = contacts.size(); c < last.size(); ++c) present.add_of(last, c);
  step_.approaches.clear();
}

// Asks for what bad overlaps are to be opened by, and for what others are to stay.
void PushApart::ask_for_all(bool gives_way)
{
  inelastic::ContactSet &contacts = step_.problem.contacts;
  for (std::size_t c = 0; c < contacts.size(); ++c) {
    const Contact &contact = step_.contact_of(c);
    // A gap that counted as closed in the first projection is taken as it is here.
    if (contact.gap_now <= step_.settings.tolerance)
      contacts.gap[c] = constraints_.rules().effective_gap(contact) - step_.rows[c].wall_motion;
    if (gives_way && constraints_.overlaps().is_bad(contact.gap_now))
      contacts.compliance[c] =
          GIVES_WAY * contacts.diagonal(c, step_.problem, step_.problem.timestep);
    else if (gives_way && contact.gap_now < 0.0)
      contacts.gap[c] = -step_.rows[c].wall_motion;
    contacts.impulse[c] = 0.0;
  }
  if (movers_.any_turns()) constraints_.entangled().disentangle();
}

// Counts bad overlaps, and looks how far they open and what the push leaves of them. Returns
// whether none becomes deeper than the deepest by more than a push may open it: walls that close
// would drive spheres into one another where these give way. Collective.
bool PushApart::look_at_opening(bool solved)
{
  const inelastic::ContactSet &contacts = step_.problem.contacts;
  const double h = step_.problem.timestep;
  enum { NUMBER, OPENED, ASKED, SUMS };
  double sums[SUMS] = {0.0, 0.0, 0.0};
  double maxima[2] = {0.0, 0.0};    // whether one is driven deeper, and what is left of them
  double deepest = 0.0;
  std::string named;
  for (std::size_t c = 0; c < contacts.size(); ++c) {
    const Contact &contact = step_.contact_of(c);
    if (contact.gap_now >= 0.0) continue;
    const int i = contacts.first[c], j = contacts.second[c];
    const double *const n = &contacts.normal[3 * c];
    const double *const one = &step_.velocity[3 * static_cast<std::size_t>(i)];
    const double *const other = &step_.velocity[3 * static_cast<std::size_t>(j)];
    const double opens = h * (dot(n, one) - dot(n, other)) - step_.rows[c].wall_motion;
    if (-contact.gap_now - opens >
        step_.largest_overlap + constraints_.rules().most_pushed(contact))
      maxima[0] = 1.0;
    if (!constraints_.overlaps().is_bad(contact.gap_now)) continue;
    const double asked = -contacts.gap[c] - step_.rows[c].wall_motion;
    sums[OPENED] += asked * std::min(opens, asked);
    sums[ASKED] += asked * asked;
    maxima[1] = std::max(maxima[1], -contact.gap_now - opens);
    sums[NUMBER] += 1.0;
    if (-contact.gap_now <= deepest) continue;
    deepest = -contact.gap_now;
    named = contact.is_with_wall()
        ? fmt::format("atom {} and wall {}", atom->tag[i], contact.wall())
        : fmt::format("atoms {} and {}", atom->tag[i], contact.partner);
  }
  ranks_.reduce(sums, SUMS, maxima, 2);
  deepest_at_end_ = maxima[1];
  left_.number = sums[NUMBER];
  const int rank = ranks_.rank_of_largest(deepest, &left_.largest);
  left_.named = ranks_.said_by(rank, named);
  const bool opens = sums[OPENED] > OPENS * sums[ASKED];
  // What is not solved tells nothing of room.
  if (!solved) return true;
  if (opens || !gives_way_)
    in_vain_ = 0;
  else if (looked_at_ != update->ntimestep)
    ++in_vain_;
  looked_at_ = update->ntimestep;
  return maxima[0] == 0.0;
}

void PushApart::run(inelastic::ProjectionResult &result, const Project &project)
{
  inelastic::ContactProblem &problem = step_.problem;
  const inelastic::ContactSet contacts = problem.contacts;
  const std::size_t number_of_contacts = step_.contacts.size();
  problem.predicted_velocity = step_.velocity;
  step_.phase = Phase::PUSH;
  step_.relinearisations = 0;
  if (movers_.any_turns()) constraints_.entangled().find();
  const inelastic::ContactSet with_locked = problem.contacts;
  // What no longer opens while it gives way may be the rest, which opens at once: so it is tried.
  if (in_vain_ > 0) gives_way_ = false;
  // Iterations of the first trial. Thousands of spheres that have room for what is asked take far
  // fewer.
  constexpr long MOST = 10000;
  for (bool ends = false; !ends;) {
    begin_trial(with_locked);
    step_.gives_way = gives_way_;
    ask_for_all(gives_way_);
    const long left = std::max(0L, step_.settings.max_iterations - result.iterations);
    const inelastic::ProjectionResult pushed =
        project(gives_way_ ? left : std::min(MOST, left / 4));
    ends = gives_way_ || pushed.status == inelastic::Status::CONVERGED;
    if (ends)
      add(result, pushed);
    else
      result.iterations += pushed.iterations;
    gives_way_ = gives_way_ || !ends;
  }
  const bool solved = result.status == inelastic::Status::CONVERGED;
  if (!look_at_opening(solved) && gives_way_)
    result.status = inelastic::worse(result.status, inelastic::Status::INFEASIBLE);

  step_.gives_way = false;
  problem.contacts = contacts;
  step_.rows.resize(contacts.size());
  step_.contacts.resize(number_of_contacts);
  if (!step_.law_states.empty()) step_.law_states.resize(number_of_contacts);
  movers_.note_push(problem, step_.velocity);
}
