// The radii of a scene, the kind of neighbour list that suits them, and how far the list reaches.

#ifndef INELASTIC_LIST_REACH_H
#define INELASTIC_LIST_REACH_H

#include "inelastic_step.h"

#include "pointers.h"

#include <vector>

namespace LAMMPS_NS::Inelastic_NS {

class GhostExchange;

class ListReach : protected Pointers {
 public:
  ListReach(class LAMMPS *lmp, Step &step, GhostExchange &ranks);

  // Finds the largest and smallest radius of the group. Errors: no radius, or one within the
  // tolerance. Collective.
  void measure_radii();
  double smallest_radius() const { return smallest_radius_; }    // [length]

  // Chooses the kind of neighbour list for a run: by one cutoff for all pairs, if radii are so
  // similar that this wastes little, or by the radii of each pair.
  void choose_list();
  bool has_one_cutoff() const { return one_cutoff_; }

  // At the start of a run.
  void warn_of_tolerance() const;

  // The list is new. Errors: those of measure_radii(), a tolerance below the round-off of
  // positions, and a list that is too short for the spheres. Collective.
  void built();

  // [length] The gap beyond which a pair may lack in a new list.
  double reach() const { return reach_; }

 private:
  const char *name_of_group() const;
  void check_tolerance() const;
  std::vector<double> radii_of_types() const;
  double least_listed(const std::vector<double> &radius) const;
  void check(const std::vector<double> &radius) const;
  void check_types(const std::vector<double> &radius) const;

  Step &step_;
  GhostExchange &ranks_;
  double smallest_radius_ = 0.0;    // [length] in the group, on all ranks
  bool one_cutoff_ = true;
  double reach_ = 0.0;
};

}    // namespace LAMMPS_NS::Inelastic_NS

#endif
