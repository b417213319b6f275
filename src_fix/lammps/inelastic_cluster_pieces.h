// What is left of the clusters of a step (inelastic_clusters.h) when some of their contacts have
// lost their force since: each piece keeps its own momentum along directions in which nothing
// outside holds it.

#ifndef INELASTIC_CLUSTER_PIECES_H
#define INELASTIC_CLUSTER_PIECES_H

#include "inelastic_clusters.h"
#include "inelastic_directions.h"
#include "inelastic_step.h"

#include <vector>

namespace LAMMPS_NS::Inelastic_NS {

class GhostExchange;

class ClusterPieces {
 public:
  ClusterPieces(class LAMMPS *lmp, const Step &step, GhostExchange &ranks);

  // Finds the pieces by the impulses that the step has now. Collective.
  void find();

  const Clusters &clusters() const { return clusters_; }
  // By piece: along which walls and frozen particles carry a force of it.
  const std::vector<Directions> &held() const { return held_; }

 private:
  const Step &step_;
  Clusters clusters_;
  std::vector<Directions> held_;
};

// Returns for each marked particle the mean of these velocities (3 per particle) over those of its
// cluster, by mass, across the directions in which something outside holds the cluster. Collective.
std::vector<double> common_velocities(const Atom *atom, const Clusters &clusters,
                                      const std::vector<Directions> &held,
                                      const std::vector<double> &velocity,
                                      const std::vector<char> &marked);

}    // namespace LAMMPS_NS::Inelastic_NS

#endif
