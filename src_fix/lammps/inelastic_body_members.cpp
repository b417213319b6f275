#include "inelastic_body_members.h"

#include "inelastic_periods.h"

#include "atom.h"
#include "comm.h"
#include "error.h"
#include "fix.h"
#include "modify.h"
#include "neighbor.h"
#include "utils.h"

#include "fmt/format.h"

#include <algorithm>
#include <cmath>

using namespace LAMMPS_NS;
using namespace Inelastic_NS;
using inelastic::dot;

namespace {

// Returns the body of each owned atom, -1 = in none.
const int *bodies_of_atoms(Fix *fix)
{
  int dimension;
  return static_cast<const int *>(fix->extract("body", dimension));
}

}    // namespace

BodyMembers::BodyMembers(LAMMPS *lmp, Step &step, inelastic::Host &host) :
    Pointers(lmp), step_(step), host_(host)
{
}

void BodyMembers::find_fix()
{
  const std::string &fix_id = step_.settings.rigid_fix;
  fix_ = modify->get_fix_by_id(fix_id);
  if (!fix_) error->all(FLERR, "Fix inelastic rigid: there is no fix {}", fix_id);
  if (!utils::strmatch(fix_->style, "^rigid/small$") &&
      !utils::strmatch(fix_->style, "^rigid/small/omp$"))
    error->all(FLERR, "Fix inelastic rigid: fix {} is of style {}, and must be rigid/small", fix_id,
               fix_->style);
}

void BodyMembers::count_spheres()
{
  const int *const body = bodies_of_atoms(fix_);
  std::vector<MoleculeSizes::Molecule> mine;
  for (int i = 0; i < atom->nlocal; ++i)
    if (body[i] >= 0)
      mine.push_back({atom->molecule[i], 1, !step_.in_group(atom, i),
                      (atom->mask[i] & step_.settings.frozen_bit) != 0});
  molecules_.count(std::move(mine), world);
  for (const MoleculeSizes::Molecule &molecule : molecules_.all()) {
    if (molecule.id < 0)
      error->all(FLERR,
                 "Fix inelastic rigid: molecule ID {} of a body must not be negative: use "
                 "reset_atoms mol",
                 molecule.id);
    if (molecule.outside > 0 && molecule.outside < molecule.spheres)
      error->all(FLERR,
                 "Fix inelastic rigid: the body of molecule {} is partly outside the fix's group: "
                 "put all its spheres in, or none",
                 molecule.id);
    if (molecule.frozen > 0)
      error->all(FLERR,
                 "Fix inelastic rigid: a sphere of molecule {} is frozen: frozen spheres cannot "
                 "belong to a body",
                 molecule.id);
  }
  const auto &all = molecules_.all();
  const bool none_inside = std::all_of(all.begin(), all.end(), [](const auto &molecule) {
    return molecule.outside > 0;
  });
  if (!all.empty() && none_inside)
    error->all(FLERR,
               "Fix inelastic rigid: no body of fix {} is in the fix's group: leave out rigid, or "
               "give fix inelastic a group that holds the bodies",
               step_.settings.rigid_fix);
  last_sphere_.assign(molecules_.all().size(), NONE);
  check_hidden_pairs();
}

// Free spheres have no molecule of their own: LAMMPS takes all of them for one.
void BodyMembers::check_hidden_pairs() const
{
  const int *const body = bodies_of_atoms(fix_);
  int unseen = 0, any_unseen = 0;
  for (int k = 0; k < neighbor->nex_mol; ++k)
    for (int i = 0; i < atom->nlocal; ++i)
      if (body[i] < 0 && neighbor->ex_mol_intra[k] && step_.in_group(atom, i) &&
          (atom->mask[i] & neighbor->ex_mol_bit[k]))
        unseen = 1;
  MPI_Allreduce(&unseen, &any_unseen, 1, MPI_INT, MPI_MAX, world);
  if (any_unseen)
    error->all(
        FLERR,
        "Fix inelastic rigid: neigh_modify exclude molecule/intra hides free spheres from one "
        "another, because they share a molecule ID: give it a group of bodies only");
}

std::string BodyMembers::find()
{
  if (!bodies_of_atoms(fix_))
    error->all(FLERR, "Fix inelastic rigid: fix {} has not set up its bodies",
               step_.settings.rigid_fix);
  if (first_of_run_) count_spheres();

  const int nlocal = atom->nlocal;
  const int nall = nlocal + atom->nghost;
  const int *const body = bodies_of_atoms(fix_);
  in_body_.assign(nall, 0.0);
  for (int i = 0; i < nlocal; ++i)
    in_body_[i] = body[i] >= 0 && step_.in_group(atom, i) ? 1.0 : 0.0;
  host_.share_with_ghosts(in_body_.data(), 1);

  std::string message;
  std::vector<int> next(nall, NONE);
  incomplete_.assign(nall, 0);
  const std::vector<int> first = first_spheres(next, message);
  step_.problem.bodies.clear(nall);
  original_of_.clear();
  for (const int first_sphere : first) {
    const std::string missing = add_body(first_sphere, next);
    if (!missing.empty()) message = missing;
  }
  return explained(message);
}

// The spheres of a body become a chain, whose links are `next`, and bodies stand in the order of
// their first ones: spheres that are near in space are near in memory.
std::vector<int> BodyMembers::first_spheres(std::vector<int> &next, std::string &message)
{
  std::vector<int> first;
  for (int i = 0; i < static_cast<int>(next.size()); ++i) {
    if (!(in_body_[i] > 0.0)) continue;
    const int place = molecules_.place(atom->molecule[i]);
    if (place == MoleculeSizes::NONE) {
      incomplete_[i] = 1;
      message = fmt::format("molecule {} had no body when the run began: create no bodies during a "
                            "run, and change no molecule ID",
                            atom->molecule[i]);
      continue;
    }
    int &before = last_sphere_[place];
    if (before == NONE)
      first.push_back(i);
    else
      next[before] = i;
    before = i;
  }
  return first;
}

std::string BodyMembers::add_body(int first_sphere, const std::vector<int> &next)
{
  const tagint *const tag = atom->tag;
  const tagint id = atom->molecule[first_sphere];
  const int place = molecules_.place(id);
  last_sphere_[place] = NONE;
  std::vector<int> spheres, originals, copies, original_of;
  for (int i = first_sphere; i != NONE; i = next[i]) spheres.push_back(i);
  // An owned sphere comes before its ghosts.
  std::sort(spheres.begin(), spheres.end(), [&](int a, int b) {
    return tag[a] != tag[b] ? tag[a] < tag[b] : a < b;
  });
  for (const int i : spheres) {
    if (originals.empty() || tag[originals.back()] != tag[i]) {
      originals.push_back(i);
    } else {
      copies.push_back(i);
      original_of.push_back(static_cast<int>(originals.size()) - 1);
    }
  }
  const int number = static_cast<int>(originals.size());
  const auto all = static_cast<int>(molecules_.all()[place].spheres);
  std::string message;
  if (number != all) {
    for (const int i : spheres) incomplete_[i] = 1;
    for (const int i : originals)
      if (i < atom->nlocal)
        message = fmt::format("the body of molecule {} has {} spheres, of which a rank sees {}: "
                              "raise comm_modify cutoff, and create no bodies during a run",
                              id, all, number);
    return message;
  }
  for (int k = 0; k < number; ++k) original_of_.push_back(k);
  original_of_.insert(original_of_.end(), original_of.begin(), original_of.end());
  originals.insert(originals.end(), copies.begin(), copies.end());
  const std::vector<double> nothing(3 * originals.size() + 6, 0.0);
  step_.problem.bodies.add(originals.data(), nothing.data(), static_cast<int>(originals.size()),
                           number, 0.0, nothing.data());
  return message;
}

// A body may be seen in part because a sphere of it is not there any more. Collective.
std::string BodyMembers::explained(const std::string &message) const
{
  const int *const body = bodies_of_atoms(fix_);
  double sums[2] = {message.empty() ? 0.0 : 1.0, 0.0};
  for (int i = 0; i < atom->nlocal; ++i)
    if (body[i] >= 0) sums[1] += 1.0;
  host_.reduce(sums, 2, nullptr, 0);
  double expected = 0.0;
  for (const MoleculeSizes::Molecule &molecule : molecules_.all())
    expected += static_cast<double>(molecule.spheres);
  if (message.empty() || sums[1] >= expected) return message;
  return fmt::format(
      "{:.0f} of the {:.0f} spheres of bodies are lost, because they left the box or were "
      "deleted: walls must keep bodies inside of the box, and whole bodies alone may be "
      "deleted, between runs",
      expected - sums[1], expected);
}

// A sphere of another rank that touches one of this rank's brings its whole body with it.
void BodyMembers::check_reach() const
{
  constexpr double ROUNDED_UP = 1.00001;    // six digits of it are enough
  double extent = 0.0;
  const inelastic::RigidBodies &bodies = step_.problem.bodies;
  for (std::size_t k = 0; k < bodies.member.size(); ++k)
    extent = std::max(extent, 2.0 * std::sqrt(dot(&bodies.arm[3 * k], &bodies.arm[3 * k])));
  host_.reduce(nullptr, 0, &extent, 1);
  const Periods periods(lmp);
  if (comm->nprocs == 1 && !periods.any()) return;
  // Locked bodies may hang in one another without that any of their spheres is listed.
  const double near = step_.settings.unlock ? 0.5 * extent : 0.0;
  const double needed = std::max(neighbor->cutneighmax, near) + extent;
  const double cutoff = std::max(comm->cutghostuser, neighbor->cutneighmax);
  if (cutoff < needed)
    error->all(FLERR,
               "Fix inelastic rigid: ranks and periodic images see {:.6g} far, which is too short "
               "for bodies of this size: set comm_modify cutoff to at least {:.6g}",
               cutoff, ROUNDED_UP * needed);
  if (periods.narrowest() >= 2.0 * needed) return;
  const double most = (periods.narrowest() / 2.0 - needed) / ROUNDED_UP + neighbor->skin;
  error->all(FLERR,
             "Fix inelastic rigid: the periodic box is {:.6g} wide and must be at least {:.6g}, so "
             "that no body can meet its own image{}",
             periods.narrowest(), 2.0 * ROUNDED_UP * needed,
             most > 0.0 ? fmt::format(", or the skin of command neighbor, {:.6g}, at most {:.4g}",
                                      neighbor->skin, most)
                        : "");
}
