#include "solver.h"

#include <cmath>

namespace inelastic {

Residual residual(const double *gap_at_end, const double *impulse, std::size_t count)
{
  Residual worst;
  for (std::size_t c = 0; c < count; ++c) {
    // A value that is no number satisfies no constraint.
    if (!std::isfinite(gap_at_end[c]) || !std::isfinite(impulse[c])) return UNSOLVED;
    worst.feasibility = std::max(worst.feasibility, -gap_at_end[c]);
    if (impulse[c] > 0.0) worst.complementarity = std::max(worst.complementarity, gap_at_end[c]);
  }
  return worst;
}

Residual residual_over_ranks(const double *gap_at_end, const double *impulse, std::size_t count,
                             Host &host)
{
  const Residual mine = residual(gap_at_end, impulse, count);
  double maxima[2] = {mine.feasibility, mine.complementarity};
  host.reduce(nullptr, 0, maxima, 2);
  return {maxima[0], maxima[1]};
}

}    // namespace inelastic
