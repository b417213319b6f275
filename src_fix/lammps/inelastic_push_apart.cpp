#include "inelastic_push_apart.h"

#include "inelastic_constraints.h"
#include "inelastic_ghost_exchange.h"
#include "inelastic_mover.h"
#include "inelastic_random.h"
#include "inelastic_step.h"

#include "atom.h"
#include "domain.h"
#include "update.h"

#include "fmt/format.h"

#include <algorithm>
#include <cstdint>
#include <vector>

using namespace LAMMPS_NS;
using namespace Inelastic_NS;
using inelastic::dot;

namespace {

// The compliance of an overlap that gives way, in units of the diagonal of A: a lone one opens by a
// hundredth less than asked for. (With a tenth a bed whose spheres grow by a tenth needs five times
// as many steps.)
constexpr double GIVES_WAY = 0.01;
// Overlaps open where they do so by at least this part of what is asked for. In dense starts it is
// never below 0.2, in beds that swell mostly above 0.05, in jammed packings at most 0.003; in
// between are layers that are pressed together in their plane.
constexpr double OPENS = 0.02;
// They are not expected to open any more after so many steps in which they did not.
constexpr int MOST_IN_VAIN = 6;

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
// whether they open all in all, or at least none becomes deeper than the deepest by more than a
// push may open it: walls that close would drive spheres into one another where these give way.
// Collective.
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
  return opens || maxima[0] == 0.0;
}

// Adds to the predicted velocities a random motion of what overlaps badly. Spheres that are pressed
// together in a plane, as a layer on a floor, do not open by any small push, though beside the
// plane there is room: this brings them out of it. Where there is no room it changes nothing.
// Collective.
void PushApart::stir()
{
  constexpr std::uint32_t SEED = 1;
  inelastic::ContactProblem &problem = step_.problem;
  const inelastic::ContactSet &contacts = problem.contacts;
  const auto particles = static_cast<std::size_t>(problem.particles);
  std::vector<double> stirred(particles, 0.0);    // -1 for those
  for (std::size_t c = 0; c < contacts.size(); ++c) {
    const Contact &contact = step_.contact_of(c);
    if (!constraints_.overlaps().is_bad(contact.gap_now)) continue;
    stirred[contacts.first[c]] = -1.0;
    if (!contact.is_with_wall()) stirred[contacts.second[c]] = -1.0;
  }
  ranks_.least_over_ghosts(stirred.data(), 1);
  // Velocities of free spheres, impulses on those in bodies.
  std::vector<double> by(3 * particles, 0.0);
  for (std::size_t i = 0; i < particles; ++i) {
    const bool free = !step_.is_member(static_cast<int>(i));
    const double inverse_mass = free ? problem.inverse_mass[i]
                                     : problem.bodies.inverse_mass[problem.bodies.body[i]];
    if (stirred[i] == 0.0 || inverse_mass == 0.0) continue;
    const double speed = 2.0 * PUSH_LIMIT * atom->radius[i] / step_.regular_timestep;
    const auto uniform = inelastic::uniform_vector(SEED, static_cast<std::uint64_t>(atom->tag[i]),
                                                   static_cast<std::uint64_t>(update->ntimestep));
    for (int d = 0; d < domain->dimension; ++d)
      by[3 * i + d] = uniform[d] * (free ? speed : speed / inverse_mass);
  }
  if (!problem.bodies.empty()) problem.bodies.velocity_change(by.data());
  for (std::size_t k = 0; k < by.size(); ++k) problem.predicted_velocity[k] += by[k];
}

void PushApart::run(inelastic::ProjectionResult &result, const Project &project)
{
  inelastic::ContactProblem &problem = step_.problem;
  const inelastic::ContactSet contacts = problem.contacts;
  const std::size_t number_of_contacts = step_.contacts.size();
  const std::vector<double> unpushed = step_.velocity;
  problem.predicted_velocity = unpushed;
  step_.phase = Phase::PUSH;
  step_.relinearisations = 0;
  if (movers_.any_turns()) constraints_.entangled().find();
  const inelastic::ContactSet with_locked = problem.contacts;
  // What no longer opens while it gives way may be the rest, which opens at once: so it is tried.
  if (in_vain_ > 0) {
    gives_way_ = false;
    stir();
  }
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
  problem.predicted_velocity = unpushed;
  movers_.note_push(problem, step_.velocity);
}
