// What counts as quiet, slow and at rest (inelastic_rest.h): the thresholds of a cluster's motion.

#ifndef INELASTIC_REST_RULES_H
#define INELASTIC_REST_RULES_H

#include "inelastic_cluster_motions.h"

namespace LAMMPS_NS::Inelastic_NS {

struct Step;

class RestRules {
 public:
  explicit RestRules(const Step &step) : step_(step) {}

  // So many quiet steps come before a trial: a force that nothing balances would show.
  static constexpr double PATIENCE = 8.0;
  // The count of a cluster at rest, and of one that was and did not balance in the last step.
  static constexpr double RESTS = PATIENCE + 1.0, RESTED = RESTS + 1.0;
  // After a trial in which something held moved so many quiet steps more come before the next one;
  // none more if the cluster was at rest just before.
  static constexpr double PAUSE = 8.0;
  // A cluster moves if it is faster than this part of what it would be without contacts, whatever
  // resists it.
  static constexpr double ROUND_OFF = 1.0e-12;

  // A particle at rest is no faster than this, as a part of its unit.
  double limit() const;

  bool is_quiet(const ClusterMotion &cluster) const;
  // Tells whether something in a quiet cluster moves that contacts are to hold.
  bool moves(const ClusterMotion &cluster) const;
  // Tells whether a quiet cluster is so slow that a trial may pass.
  bool is_slow(const ClusterMotion &cluster) const;
  // Tells whether something held gives way to, or follows, what is not held, in a trial after a
  // less accurate one in which the cluster moved so.
  bool slips(const ClusterMotion &cluster, const ClusterMotion &less_accurate) const;
  bool is_at_rest(const ClusterMotion &cluster) const { return cluster.quiet_steps == RESTS; }
  bool was_at_rest(const ClusterMotion &cluster) const { return cluster.quiet_steps == RESTED; }
  bool needs_refinement(const ClusterMotion &cluster) const
  { return is_at_rest(cluster) && is_quiet(cluster) && moves(cluster); }

 private:
  const Step &step_;
};

}    // namespace LAMMPS_NS::Inelastic_NS

#endif
