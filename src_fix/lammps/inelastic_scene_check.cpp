#include "inelastic_scene_check.h"

#include "inelastic_periods.h"

#include "atom.h"
#include "comm.h"
#include "compute.h"
#include "error.h"
#include "fix.h"
#include "force.h"
#include "group.h"
#include "modify.h"
#include "neighbor.h"

#include "fmt/format.h"

using namespace LAMMPS_NS;
using namespace Inelastic_NS;

bool SceneCheck::changes_periods(const Fix *fix) const
{ return (fix->box_change & Periods(lmp).changes()) != 0; }

void SceneCheck::check(bool shorten) const
{
  // LAMMPS accepts neigh_modify include and comm_modify group for the group of atom_modify first
  // alone.
  if (neighbor->includegroup)
    error->all(
        FLERR,
        "Fix inelastic does not work with neigh_modify include {}, which keeps pairs of other "
        "spheres out of the neighbour list: leave it out",
        group->names[neighbor->includegroup]);
  if (atom->firstgroupname)
    error->all(
        FLERR,
        "Fix inelastic does not work with atom_modify first {}, nor with comm_modify group and "
        "neigh_modify include, which need it and hide spheres: leave it out",
        atom->firstgroupname);
  for (const Fix *fix : modify->get_fix_list()) {
    if (changes_periods(fix))
      error->all(FLERR,
                 "Fix inelastic: fix {} ({}) changes the box during a run, and the contacts do not "
                 "follow it: use many short runs with change_box between them, or walls that move",
                 fix->id, fix->style);
    if (fix->diam_flag && fix->nevery > 0)
      error->all(
          FLERR,
          "Fix inelastic: fix {} ({}) changes diameters during a run, and the contacts do not "
          "follow them: use many short runs and change the diameters between them (adapt 0)",
          fix->id, fix->style);
    const std::string style = fix->style;
    if (shorten && (style == "move" || style == "pour" || style == "plumed"))
      error->all(
          FLERR,
          "Fix inelastic: fix {} ({}) refuses every change of the time step, and shorten yes "
          "changes it: leave out shorten, or this fix (frozen spheres also move by fix nve, "
          "and fix deposit pours, too)",
          fix->id, fix->style);
  }
}

// Collective.
bool SceneCheck::any(bool here) const
{
  int mine = here, all = 0;
  MPI_Allreduce(&mine, &all, 1, MPI_INT, MPI_MAX, world);
  return all != 0;
}

// Tells whether pairs between spheres of two sides are hidden from the fix, other than pairs of two
// frozen spheres. Collective.
template <typename One, typename Other>
bool SceneCheck::hides(const Group &group, One &&on_one_side, Other &&on_the_other) const
{
  bool one = false, other = false, one_moves = false, other_moves = false;
  for (int i = 0; i < atom->nlocal; ++i) {
    if (!(atom->mask[i] & group.bit)) continue;
    const bool moves = !(atom->mask[i] & group.frozen_bit);
    if (on_one_side(i)) {
      one = true;
      one_moves = one_moves || moves;
    }
    if (on_the_other(i)) {
      other = true;
      other_moves = other_moves || moves;
    }
  }
  const bool sides = any(one) && any(other);
  return (any(one_moves) || any(other_moves)) && sides;
}

void SceneCheck::warn_of_hidden(const std::string &what) const
{
  if (comm->me == 0)
    error->warning(FLERR,
                   "Fix inelastic does not see pairs of its group that {} keeps out of the "
                   "neighbour list: they can overlap",
                   what);
}

void SceneCheck::warn_of_hidden_pairs(const Group &group) const
{
  // LAMMPS has the bits of excluded groups only after this.
  auto member_of = [this](int number) {
    return [this, number](int i) {
      return (atom->mask[i] & this->group->bitmask[number]) != 0;
    };
  };
  auto of_type = [this](int type) {
    return [this, type](int i) {
      return atom->type[i] == type;
    };
  };
  const char *const *const names = this->group->names;
  for (int k = 0; k < neighbor->nex_group; ++k) {
    const int one = neighbor->ex1_group[k], other = neighbor->ex2_group[k];
    if (hides(group, member_of(one), member_of(other)))
      warn_of_hidden(fmt::format("neigh_modify exclude group {} {}", names[one], names[other]));
  }
  for (int k = 0; k < neighbor->nex_type; ++k) {
    const int one = neighbor->ex1_type[k], other = neighbor->ex2_type[k];
    if (hides(group, of_type(one), of_type(other)))
      warn_of_hidden(fmt::format("neigh_modify exclude type {} {}", one, other));
  }
  for (int k = 0; k < neighbor->nex_mol; ++k) {
    // The spheres of one body are kept apart anyway; free spheres are looked at with the bodies.
    if (neighbor->ex_mol_intra[k] && group.bodies) continue;
    const auto chosen = member_of(neighbor->ex_mol_group[k]);
    if (hides(group, chosen, chosen))
      warn_of_hidden(fmt::format("neigh_modify exclude molecule/{} {}",
                                 neighbor->ex_mol_intra[k] ? "intra" : "inter",
                                 names[neighbor->ex_mol_group[k]]));
  }
  const bool bonds = atom->nbonds > 0 || atom->nangles > 0 || atom->ndihedrals > 0;
  for (int k = 1; k <= 3 && bonds; ++k)
    if (force->special_lj[k] == 0.0 && force->special_coul[k] == 0.0)
      return warn_of_hidden("special_bonds with a factor of 0");
}

bool SceneCheck::sets_forces(const Fix *fix)
{
  // An accelerated style has the name of its package behind it.
  const std::string style = fix->style;
  const std::string name = style.substr(0, style.find('/'));
  for (const char *one : {"freeze", "setforce", "lineforce", "planeforce", "aveforce"})
    if (name == one) return true;
  return false;
}

// These fixes replace the forces of spheres by others. They do it before the contacts are known,
// which then move the spheres all the same; behind this fix they would take contact forces away.
void SceneCheck::check_held(const Group &group) const
{
  for (const Fix *fix : modify->get_fix_list()) {
    if (!sets_forces(fix)) continue;
    bool free = false;
    for (int i = 0; i < atom->nlocal && !free; ++i)
      free = (atom->mask[i] & fix->groupbit) && (atom->mask[i] & group.bit) &&
          !(atom->mask[i] & group.frozen_bit);
    if (any(free))
      error->all(FLERR,
                 "Fix inelastic: fix {} ({}) sets forces on spheres of group {}, and contacts move "
                 "them all the "
                 "same: leave it out; spheres that are to be held, or moved, are named with the "
                 "keyword frozen",
                 fix->id, fix->style, this->group->names[fix->igroup]);
  }
}

bool SceneCheck::is_integrated(int i) const
{
  for (const Fix *fix : modify->get_fix_list())
    if (fix->time_integrate && (atom->mask[i] & fix->groupbit)) return true;
  return false;
}

void SceneCheck::warn_of_counts()
{
  std::string found;
  for (const Compute *compute : modify->get_compute_list()) {
    const std::string style = compute->style;
    if (style == "contact/atom" || style == "rattlers/atom" || style == "fabric")
      found += fmt::format("{}{} ({})", found.empty() ? "" : ", ", compute->id, style);
  }
  if (found.empty() || warned_of_counts_) return;
  warned_of_counts_ = true;
  if (comm->me == 0)
    error->warning(FLERR,
                   "Fix inelastic: compute {} takes spheres that overlap for contacts, and of the "
                   "contacts of hard spheres few do: take those that carry a force, columns 1 and "
                   "2 of this fix for each atom, its local array, and inelastic look or "
                   "lammps_inelastic.analysis for rattlers and fabric",
                   found);
}

void SceneCheck::remember_box()
{ box_at_start_ = Periods(lmp).lengths_and_tilts(); }

std::string SceneCheck::change_of_box() const
{
  if (Periods(lmp).lengths_and_tilts() == box_at_start_) return "";
  return "the periodic box has changed during the run, and the contacts do not follow it: change "
         "it between runs (change_box)";
}

std::string SceneCheck::fixes_that_change_radii() const
{
  std::string names;
  for (const Fix *fix : modify->get_fix_list())
    if (fix->diam_flag) names += fmt::format(" {} ({})", fix->id, fix->style);
  return names;
}
