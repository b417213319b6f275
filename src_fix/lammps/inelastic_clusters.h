// Clusters: the particles that contacts with a force connect, through particles and bodies that can
// move. Walls and frozen particles connect nothing. A cluster can be shared by ranks, and reach
// through periodic boundaries.

#ifndef INELASTIC_CLUSTERS_H
#define INELASTIC_CLUSTERS_H

#include "inelastic_step.h"

#include "pointers.h"

#include <vector>

namespace LAMMPS_NS::Inelastic_NS {

class GhostExchange;

class Clusters : protected Pointers {
 public:
  Clusters(class LAMMPS *lmp, const Step &step, GhostExchange &ranks);

  // Finds the clusters of the step, whose impulses are known. Collective.
  void find();

  // The number of clusters of which this rank sees a particle.
  std::size_t size() const { return label_.size(); }

  static constexpr int NONE = -1;
  // The cluster of a slot (inelastic_unknowns.h), ghosts included; NONE for one that no force
  // moves.
  int of(int slot) const { return cluster_[slot]; }

  // Tells whether forces move a particle.
  bool is_mobile(int i) const
  {
    const inelastic::ContactProblem &problem = step_.problem;
    if (problem.is_wall(i)) return false;
    return step_.is_member(i) ? problem.bodies.inverse_mass[problem.bodies.body[i]] > 0.0
                              : problem.inverse_mass[i] > 0.0;
  }

  // Replaces numbers of every cluster, so many sums and so many maxima each, one cluster after the
  // other, by those over all ranks. Collective.
  void over_ranks(int number_of_sums, std::vector<double> &sums, int number_of_maxima,
                  std::vector<double> &maxima) const;

 private:
  int root(int i);
  void join(int i, int j);
  void join_local();
  void agree_on_labels(std::vector<double> &labels);

  const Step &step_;
  GhostExchange &ranks_;
  std::vector<int> parent_;     // per particle, towards the root of what is connected on this rank
  std::vector<int> cluster_;    // per slot (inelastic_unknowns.h)
  // Per cluster: the least atom ID in it, and whether other ranks have a part.
  std::vector<double> label_;
  std::vector<char> shared_;
};

}    // namespace LAMMPS_NS::Inelastic_NS

#endif
