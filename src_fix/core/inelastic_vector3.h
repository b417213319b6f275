// Products of vectors of three doubles. A vector is passed as a pointer to its first number,
// because the vectors of particles stand one after the other in arrays, here as in LAMMPS.

#pragma once

#include <cmath>

namespace inelastic {

inline double dot(const double *a, const double *b)
{ return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

inline double norm(const double *a)
{ return std::sqrt(dot(a, a)); }

// `result` must be neither `a` nor `b`.
inline void cross(const double *a, const double *b, double *result)
{
  result[0] = a[1] * b[2] - a[2] * b[1];
  result[1] = a[2] * b[0] - a[0] * b[2];
  result[2] = a[0] * b[1] - a[1] * b[0];
}

}    // namespace inelastic
