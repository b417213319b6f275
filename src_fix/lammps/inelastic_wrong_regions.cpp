#include "inelastic_wrong_regions.h"

#include "domain.h"
#include "error.h"
#include "region.h"

#include "fmt/format.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <string>

using namespace LAMMPS_NS;
using namespace Inelastic_NS;

namespace {

constexpr double EVERYTHING = 1.0e300;    // a reach that no wall exceeds
constexpr int CAPS = 2, SIDE = 2;         // faces of cones and cylinders: two caps, then the side
// A face open by the region's command is 1 in LAMMPS; any other number but 0 opens it, too.
constexpr int OPENED_HERE = 2;

using Point = std::array<double, 3>;
using OpenFaces = std::array<int, 6>;

bool has_style(const Region *region, const char *style)
{ return strcmp(region->style, style) == 0; }

// Calls of LAMMPS while a region has other open faces.
class OtherFaces {
 public:
  OtherFaces(Region *region, const OpenFaces &faces) : region_(region), open_(region->openflag)
  {
    std::copy(region->open_faces, region->open_faces + 6, faces_.begin());
    std::copy(faces.begin(), faces.end(), region->open_faces);
    region->openflag = std::any_of(faces.begin(), faces.end(), [](int face) {
      return face != 0;
    });
  }
  ~OtherFaces()
  {
    std::copy(faces_.begin(), faces_.end(), region_->open_faces);
    region_->openflag = open_;
  }
  OtherFaces(const OtherFaces &) = delete;
  OtherFaces &operator=(const OtherFaces &) = delete;

 private:
  Region *region_;
  int open_;
  OpenFaces faces_;
};

// Calls do(part, from_outside) for each basic region that a region consists of. Of what is seen
// from outside LAMMPS turns the sides of the parts over.
template <typename F> void for_each_part(Region *region, bool turned, const F &do_with)
{
  const bool outside = (region->interior == 0) != turned;
  if (!region->reglist) {
    do_with(region, outside || region->openflag);
    return;
  }
  for (int k = 0; k < region->nregion; ++k) for_each_part(region->reglist[k], outside, do_with);
}

// The corners of a cube, none of which is inside the region, or of the largest one tried: LAMMPS
// takes 1e20 for the square of an infinite distance. The sides of the cube differ a little, so that
// no corner lies on an axis.
std::array<Point, 8> corners_outside(Region *region, double size)
{
  constexpr double LARGEST = 1.0e9;
  std::array<Point, 8> corners;
  for (;; size *= 4.0) {
    bool inside = false;
    for (int k = 0; k < 8; ++k) {
      Point &x = corners[k];
      x = {k & 1 ? size : -size, 0.97 * (k & 2 ? size : -size), 0.94 * (k & 4 ? size : -size)};
      inside = inside || region->inside(x[0], x[1], x[2]);
    }
    if (!inside || size >= LARGEST) return corners;
  }
}

// A face that is farther away than this is at infinity: LAMMPS writes 1e20, and loses in its
// round-off where along that face a sphere is.
double far_away(double size_of_box)
{ return std::min(1.0e8 * size_of_box, 1.0e9); }

// Whether the lower and the upper face in each direction are at infinity.
struct Endless {
  bool below[3] = {}, above[3] = {};
  bool any() const { return below[0] || below[1] || below[2] || above[0] || above[1] || above[2]; }
};

// The place of a block that is nearest to a far corner has, in directions without an end, the
// coordinate of that corner.
Endless ends_of_block(Region *block, double size)
{
  const OtherFaces closed(block, {});
  Endless ends;
  for (const double far : {-far_away(size), far_away(size)}) {
    double x[3] = {far, far, far};
    const int count = block->surface_exterior(x, EVERYTHING);
    const Region::Contact &seen = block->contact[0];
    const double away[3] = {seen.delx, seen.dely, seen.delz};
    for (int d = 0; d < 3; ++d)
      (far < 0.0 ? ends.below : ends.above)[d] = count == 0 || away[d] == 0.0;
  }
  return ends;
}

// Cones and prisms are convex: the mean of places on the surface is inside. Places on the side of a
// cone are right even where an end is at infinity, but for the coordinate along its axis.
Endless ends_of_convex(Region *region, double size)
{
  const bool cone = has_style(region, "cone");
  Point inner{};
  {
    const OtherFaces side_alone(region, cone ? OpenFaces{1, 1, 0} : OpenFaces{});
    for (Point &x : corners_outside(region, size)) {
      region->surface_exterior(x.data(), EVERYTHING);
      const Region::Contact &seen = region->contact[0];
      const double away[3] = {seen.delx, seen.dely, seen.delz};
      for (int d = 0; d < 3; ++d) inner[d] += (x[d] - away[d]) / 8;
    }
  }
  Endless ends;
  for (int d = 0; d < 3; ++d)
    for (const double far : {-far_away(size), far_away(size)}) {
      Point x = inner;
      x[d] += far;
      (far < 0.0 ? ends.below : ends.above)[d] = region->inside(x[0], x[1], x[2]) != 0;
    }
  return ends;
}

// LAMMPS projects on a straight line from the axis to the rim of a cap: without a length that is a
// division of zero by zero, and nothing is seen.
bool is_tip(Region *cone, int cap, double size)
{
  OpenFaces others = {1, 1, 1};
  others[cap] = 0;
  const OtherFaces cap_alone(cone, others);
  const std::array<Point, 8> corners = corners_outside(cone, size);
  return std::any_of(corners.begin(), corners.end(), [cone](Point x) {
    return cone->surface_exterior(x.data(), EVERYTHING) == 0;
  });
}

// Blocks and prisms have six faces, cylinders and cones three; tips are none.
bool all_faces_open(const Region *region)
{
  const bool flat = has_style(region, "block") || has_style(region, "prism");
  const bool round = has_style(region, "cone") || has_style(region, "cylinder");
  return (flat || round) &&
      std::all_of(region->open_faces, region->open_faces + (flat ? 6 : 3), [](int face) {
           return face != 0;
         });
}

// An open block is seen face by face. A face without an end in one of its directions is misplaced
// there; one at infinity is nowhere near.
bool loses_faces(Region *block, double size)
{
  const Endless ends = ends_of_block(block, size);
  for (int face = 0; face < 6; ++face)
    for (int d = 0; d < 3; ++d)
      if (!block->open_faces[face] && d != face / 2 && (ends.below[d] || ends.above[d]))
        return true;
  return false;
}

// From outside LAMMPS looks for the edges of a prism between corners at infinity; from inside for
// the upper faces, beginning at the lower ones.
bool loses_corners(Region *prism, bool from_outside, double size)
{
  const Endless ends = ends_of_convex(prism, size);
  if (from_outside) return ends.any();
  for (int d = 0; d < 3; ++d)
    if (ends.below[d] && !ends.above[d]) return true;
  return false;
}

void open_tips_of_cone(Region *cone, double size)
{
  for (int cap = 0; cap < CAPS; ++cap)
    if (cone->open_faces[cap] == 0 || cone->open_faces[cap] == OPENED_HERE)
      cone->open_faces[cap] = is_tip(cone, cap, size) ? OPENED_HERE : 0;
}

}    // namespace

double WrongRegions::size_of_box() const
{
  double size = 0.0;
  for (int d = 0; d < 3; ++d)
    size = std::max({size, std::abs(domain->boxlo[d]), std::abs(domain->boxhi[d])});
  return size;
}

void WrongRegions::open_tips(Region *region) const
{
  const double size = size_of_box();
  for_each_part(region, false, [size](Region *part, bool from_outside) {
    if (from_outside && has_style(part, "cone")) open_tips_of_cone(part, size);
  });
}

// `region` is `used` or a part of it. LAMMPS turns the sides of the parts over where it looks at a
// union or an intersection from outside.
void WrongRegions::refuse(Region *region, const Region *used, bool turned) const
{
  const std::string what = region == used
      ? fmt::format("region {} is", used->id)
      : fmt::format("region {}, a part of region {}, is", region->id, used->id);
  const bool outside = (region->interior == 0) != turned;
  if (!region->reglist) {
    refuse_part(region, outside || region->openflag, what);
    return;
  }
  refuse_joined(region, outside, what);
  for (int k = 0; k < region->nregion; ++k) refuse(region->reglist[k], used, outside);
}

void WrongRegions::refuse_joined(const Region *region, bool outside, const std::string &what) const
{
  // LAMMPS keeps those surface points of a part that lie in the other parts, and drops all others.
  if (has_style(region, "union") && outside)
    error->all(
        FLERR,
        "Fix inelastic: {} a union seen from outside, of whose parts LAMMPS does not show the "
        "walls: list the parts instead, each with side out",
        what);
  if (region->openflag)
    error->all(
        FLERR,
        "Fix inelastic: {} a union or an intersection with open faces, of which LAMMPS shows one "
        "side over the other: open those of the parts",
        what);
}

void WrongRegions::refuse_part(Region *region, bool from_outside, const std::string &what) const
{
  if (has_style(region, "ellipsoid"))
    error->all(FLERR,
               "Fix inelastic: {} an ellipsoid, whose wall LAMMPS shows too late: use a sphere, a "
               "cylinder or a cone",
               what);
  if (has_style(region, "cylinder") && region->open_faces[SIDE])
    error->all(
        FLERR,
        "Fix inelastic: {} a cylinder with an open side, whose rims LAMMPS does not show: use a "
        "cone with two equal radii",
        what);

  const double size = size_of_box();
  if (has_style(region, "cone") && ends_of_convex(region, size).any())
    error->all(
        FLERR,
        "Fix inelastic: {} a cone with an end at infinity (INF), of which LAMMPS misplaces the "
        "side: write a number beyond the box instead of INF, or use a cylinder",
        what);
  if (has_style(region, "block") && region->openflag && loses_faces(region, size))
    error->all(
        FLERR,
        "Fix inelastic: {} a block with open faces and faces at infinity (INF), of which LAMMPS "
        "misplaces the others: write a number beyond the box instead of INF",
        what);
  if (has_style(region, "prism") && loses_corners(region, from_outside, size))
    error->all(
        FLERR,
        "Fix inelastic: {} a prism with faces at infinity (INF), of which LAMMPS misplaces the "
        "others: write a number beyond the box instead of INF",
        what);

  if (from_outside && has_style(region, "cone")) open_tips_of_cone(region, size);
  if (all_faces_open(region))
    error->all(FLERR,
               "Fix inelastic: {} a {} with all faces open, of which nothing is left: "
               "leave it out",
               what, region->style);
}
