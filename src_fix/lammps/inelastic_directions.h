// Directions in which something outside holds a cluster (inelastic_clusters.h).

#ifndef INELASTIC_DIRECTIONS_H
#define INELASTIC_DIRECTIONS_H

#include <array>
#include <cstddef>

namespace LAMMPS_NS::Inelastic_NS {

// Directions that span a part of space: orthonormal vectors.
class Directions {
 public:
  static constexpr std::size_t SUMS = 6;
  // Adds n n^T of a normal to a symmetric matrix, given as xx yy zz xy xz yz.
  static void add(const double *normal, double *matrix);
  // Takes the range of such a sum.
  void span_range(const double *matrix);

  bool span_space() const { return number_ == 3; }
  // Returns a vector without its part along these directions.
  std::array<double, 3> without(const std::array<double, 3> &vector) const;

 private:
  std::array<double, 3> unit_[3] = {};
  int number_ = 0;
};

}    // namespace LAMMPS_NS::Inelastic_NS

#endif
