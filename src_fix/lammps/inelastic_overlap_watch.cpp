#include "inelastic_overlap_watch.h"

#include "inelastic_ghost_exchange.h"

#include "comm.h"
#include "error.h"
#include "update.h"

#include "fmt/format.h"

#include <algorithm>

using namespace LAMMPS_NS;
using namespace Inelastic_NS;

OverlapWatch::OverlapWatch(LAMMPS *lmp, Step &step, GhostExchange &ranks) :
    Pointers(lmp), step_(step), ranks_(ranks)
{
}

void OverlapWatch::begin_run()
{
  if (pushed_before_) left_ = EXTREME;
  pushed_before_ = false;
}

void OverlapWatch::begin_step()
{
  step_.bad_start = false;
  step_.largest_overlap = 0.0;
  unexpected_ = 0.0;
}

void OverlapWatch::note(double gap, int i, tagint partner)
{
  step_.largest_overlap = std::max(step_.largest_overlap, -gap);
  if (!is_bad(gap)) return;
  step_.bad_start = true;
  if (-gap <= std::max(left_, unexpected_)) return;
  unexpected_ = -gap;
  who_ = partner < 0 ? fmt::format("atom {} overlaps wall {}", atom->tag[i], -partner)
                     : fmt::format("atoms {} and {} overlap", atom->tag[i], partner);
}

void OverlapWatch::share()
{
  double maxima[3] = {step_.bad_start ? 1.0 : 0.0, step_.largest_overlap, unexpected_};
  ranks_.reduce(nullptr, 0, maxima, 3);
  step_.bad_start = maxima[0] > 0.0;
  step_.largest_overlap = maxima[1];
  appeared_ = maxima[2] > 0.0;
}

void OverlapWatch::warn_of_unexpected()
{
  if (!appeared_ || ++unexpected_steps_ > 1) return;
  double depth;
  const int rank = ranks_.rank_of_largest(unexpected_, &depth);
  const std::string who = ranks_.said_by(rank, who_);
  if (comm->me == 0)
    error->warning(
        FLERR,
        "Fix inelastic: step {}: {} by {:.4g} ({:.3g} tolerances), which no earlier step has "
        "left: something else has moved or changed the spheres, the box, a region or the "
        "group. Such overlaps are pushed apart without momentum; the summary counts the "
        "steps",
        update->ntimestep, who, depth, depth / step_.settings.tolerance);
}

void OverlapWatch::end_step(bool certain, double pushed)
{
  pushes_in_velocity_ = step_.bad_start || pushed_before_;
  pushed_before_ = step_.bad_start;
  left_ = certain ? step_.eps(in_eps::REGULAR + in_eps::KNOWN_OTHERWISE) +
          (step_.bad_start ? std::max(step_.largest_overlap, pushed) : 0.0) + step_.excess
                  : EXTREME;
}
