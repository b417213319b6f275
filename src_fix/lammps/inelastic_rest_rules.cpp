#include "inelastic_rest_rules.h"

#include "inelastic_step.h"

#include <algorithm>

using namespace LAMMPS_NS;
using namespace Inelastic_NS;

namespace {

// A cluster is quiet if the root mean square of its held particles' speeds is at most this part of
// the mean speed that they would have without contacts, and its motion as a whole this part of what
// resists it.
constexpr double QUIET = 0.1;
// A trial comes where this speed is at most so large a part, or some accuracies where these are
// more: what is faster still moves when it has begun at rest.
constexpr double SLOW = 0.005;
// A particle at rest is no faster than so many accuracies; a coarser accuracy counts as the one
// below.
constexpr double AT_REST = 5.0;
constexpr double COARSEST_ACCURACY = 1.0e-3;
// When it comes to rest it is no faster than so many along the normal of a contact with something
// that is not held: as much of the force there is lacking.
constexpr double SLIP = 1.0;
// An error of the solver becomes smaller than this part in the more accurate solution of a trial.
constexpr double ERRORS_LEFT = 0.5;
// Below this part of what particles would have without contacts slip is round-off.
constexpr double LEAST_SLIP = 1.0e-9;

}    // namespace

bool RestRules::is_quiet(const ClusterMotion &cluster) const
{
  const double round_off = ROUND_OFF * cluster.without_contacts;
  return cluster.supported && !cluster.driven &&
      cluster.held_speed <= QUIET * cluster.without_contacts &&
      cluster.speed <= std::max(QUIET * cluster.resisted, round_off);
}

bool RestRules::moves(const ClusterMotion &cluster) const
{
  const double round_off = ROUND_OFF * cluster.without_contacts;
  return cluster.fastest > limit() ||
      cluster.speed > std::max(limit() * cluster.resisted, round_off);
}

bool RestRules::is_slow(const ClusterMotion &cluster) const
{
  const double part = std::clamp(AT_REST * step_.settings.accuracy, SLOW, QUIET);
  return cluster.held_speed <= part * cluster.without_contacts;
}

bool RestRules::slips(const ClusterMotion &cluster, const ClusterMotion &less_accurate) const
{
  if (cluster.slip <= LEAST_SLIP * cluster.without_contacts) return false;
  return cluster.most_slip > SLIP / AT_REST * limit() ||
      cluster.slip > ERRORS_LEFT * less_accurate.slip;
}

double RestRules::limit() const
{ return AT_REST * std::min(step_.settings.accuracy, COARSEST_ACCURACY); }
