#include "inelastic_periods.h"

#include "inelastic_lammps_versions.h"

#include "domain.h"
#include "fix.h"

#include <algorithm>
#include <cmath>
#include <limits>

using namespace LAMMPS_NS;
using namespace Inelastic_NS;

bool Periods::any() const
{ return along(0) || along(1) || along(2); }

bool Periods::along(int direction) const
{ return domain->periodicity[direction] != 0; }

double Periods::widest() const
{ return std::max({domain->xprd, domain->yprd, domain->zprd}); }

double Periods::narrowest() const
{
  double width = std::numeric_limits<double>::infinity();
  for (int d = 0; d < 3; ++d)
    if (along(d)) width = std::min(width, domain->prd[d]);
  return width;
}

bool Periods::wrap(double *where, double *image) const
{
  if (!any()) return false;
  if (domain->triclinic) return wrap_tilted(where, image);
  bool wrapped = false;
  for (int d = 0; d < 3; ++d) {
    const double beyond = std::max(domain->boxlo[d] - where[d], where[d] - domain->boxhi[d]);
    if (!along(d) || beyond <= 0.0) continue;
    const double widths = std::floor((where[d] - domain->boxlo[d]) / domain->prd[d]);
    image[d] = widths * domain->prd[d];
    where[d] -= image[d];
    wrapped = true;
  }
  return wrapped;
}

// Wraps a point in a box whose periods are not at right angles.
bool Periods::wrap_tilted(double *where, double *image) const
{
  double of_box[3], widths[3] = {0.0, 0.0, 0.0};
  domain->x2lamda(where, of_box);
  for (int d = 0; d < 3; ++d)
    if (along(d) && (of_box[d] < 0.0 || of_box[d] > 1.0)) widths[d] = std::floor(of_box[d]);
  if (widths[0] == 0.0 && widths[1] == 0.0 && widths[2] == 0.0) return false;
  const double *const h = domain->h;
  image[0] = h[0] * widths[0] + h[5] * widths[1] + h[4] * widths[2];
  image[1] = h[1] * widths[1] + h[3] * widths[2];
  image[2] = h[2] * widths[2];
  for (int d = 0; d < 3; ++d) where[d] -= image[d];
  return true;
}

void Periods::to_nearest_image(double *vector) const
{ NearestImage<Domain>::of(domain, vector); }

double Periods::own_part(int d) const
{
  return domain->triclinic ? domain->subhi_lamda[d] - domain->sublo_lamda[d]
                           : (domain->subhi[d] - domain->sublo[d]) / domain->prd[d];
}

std::vector<double> Periods::lengths_and_tilts() const
{
  std::vector<double> sizes;
  for (int d = 0; d < 3; ++d)
    if (along(d)) sizes.push_back(domain->prd[d]);
  sizes.insert(sizes.end(), {domain->xy, domain->xz, domain->yz});
  return sizes;
}

// Along a direction that is not periodic the box is no part of any gap.
int Periods::changes() const
{
  int bits = Fix::BOX_CHANGE_ANY | Fix::BOX_CHANGE_SHAPE;
  if (along(0)) bits |= Fix::BOX_CHANGE_X;
  if (along(1)) bits |= Fix::BOX_CHANGE_Y;
  if (along(2)) bits |= Fix::BOX_CHANGE_Z;
  return bits;
}
