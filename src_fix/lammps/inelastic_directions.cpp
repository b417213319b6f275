#include "inelastic_directions.h"

#include "inelastic_vector3.h"

using namespace LAMMPS_NS::Inelastic_NS;
using inelastic::dot;
using inelastic::norm;

void Directions::add(const double *n, double *matrix)
{
  const int row[SUMS] = {0, 1, 2, 0, 0, 1}, column[SUMS] = {0, 1, 2, 1, 2, 2};
  for (std::size_t k = 0; k < SUMS; ++k) matrix[k] += n[row[k]] * n[column[k]];
}

// The column of the largest entry on the diagonal lies in the range; what is left across it has the
// range without it.
void Directions::span_range(const double *matrix)
{
  constexpr double ROUND_OFF = 1.0e-12;
  const double total = matrix[0] + matrix[1] + matrix[2];
  std::array<std::array<double, 3>, 3> a = {{{matrix[0], matrix[3], matrix[4]},
                                             {matrix[3], matrix[1], matrix[5]},
                                             {matrix[4], matrix[5], matrix[2]}}};
  for (number_ = 0; number_ < 3; ++number_) {
    int most = 0;
    for (int d = 1; d < 3; ++d)
      if (a[d][d] > a[most][most]) most = d;
    if (!(a[most][most] > ROUND_OFF * total)) return;
    std::array<double, 3> u = a[most];
    const double length = norm(u.data());
    for (double &x : u) x /= length;
    unit_[number_] = u;
    // a becomes (1 - u u^T) a (1 - u u^T).
    const double along[3] = {dot(a[0].data(), u.data()), dot(a[1].data(), u.data()),
                             dot(a[2].data(), u.data())};
    const double both = dot(along, u.data());
    for (int d = 0; d < 3; ++d)
      for (int e = 0; e < 3; ++e) a[d][e] += u[d] * u[e] * both - along[d] * u[e] - u[d] * along[e];
  }
}

std::array<double, 3> Directions::without(const std::array<double, 3> &vector) const
{
  if (span_space()) return {};
  std::array<double, 3> left = vector;
  for (int k = 0; k < number_; ++k) {
    const double along = dot(left.data(), unit_[k].data());
    for (int d = 0; d < 3; ++d) left[d] -= along * unit_[k][d];
  }
  return left;
}
