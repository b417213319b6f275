// The vector passes of one iteration of inelastic_gradient_search.h, over packed arrays.
//
// Packed arrays hold the problem in the order and in the units in which the passes are fast, in
// single (Real = float) or double precision. Vectors have four numbers, so that one instruction
// works on all of them. Lengths are in units of Scales::length, velocities in units of that length
// over the time step, impulses in units of Scales::impulse (inelastic_packed_iterations.h).
//
// An iteration consists of advance_impulses, which reads every constraint once, then, for particles
// in bodies, turn_bodies, and move_particles. Each is compiled for several instruction sets.

#pragma once

#include "inelastic_admissible_set.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace inelastic::packed {

// Constraints are worked on in blocks, which stay in the fastest cache.
constexpr std::size_t BLOCK = 256;

// A vector holds x, y, z and a fourth number.
template <typename Real> struct alignas(4 * sizeof(Real)) Vector {
  typedef Real Lanes __attribute__((vector_size(4 * sizeof(Real))));
  Lanes lanes;
};

template <typename Real>
void set_lanes(Vector<Real> &vector, double x, double y, double z, double fourth)
{
  vector.lanes = typename Vector<Real>::Lanes{static_cast<Real>(x), static_cast<Real>(y),
                                              static_cast<Real>(z), static_cast<Real>(fourth)};
}

// The place of a slot's vector in an array, in bytes, and the slot at a place.
template <typename Real> std::uint32_t place(int slot)
{ return static_cast<std::uint32_t>(slot * sizeof(Vector<Real>)); }
template <typename Real> std::size_t index(std::uint32_t place)
{ return place / sizeof(Vector<Real>); }

// The vectors of a constraint's two slots (inelastic_unknowns.h) are at these places, in bytes from
// the start of an array, as addresses take them.
struct Ends {
  std::uint32_t first, second;
};

// advance_impulses works on these arrays; those of constraints have `count` entries. All changes of
// impulses are since the start of the search. `Set` is the class of the admissible sets
// (inelastic_admissible_set.h).
template <typename Real, template <typename> typename Set> struct Pass {
  std::size_t count;
  const Ends *ends;
  const Vector<Real>
      *normal;               // the fourth number: the gap that the first impulses end the step with
  const Real *diagonal;      // of A
  const Real *compliance;    // 0 for rigid constraints
  const Set<Real> *set;      // which changes leave an admissible impulse
  const Real *inverse_target;      // 1 / the target of the residual
  const Vector<Real> *velocity;    // per slot: change of velocity of the present changes
  Real *unbound;               // the present changes before projection; replaced by the next ones
  Real *change_before;         // the changes before; replaced by the present ones
  Real *gap_before;            // the gaps of the changes before; replaced by the present ones
  Vector<Real> *sum;           // per slot: sum of the next changes; zero before
  Real step, step_before;      // 1 / L, and that of the pass before
  Real along, beyond, back;    // the weights of inelastic_momentum.h
  Real blur;                   // a residual below this may be round-off
};

// A pass returns these sums and maxima over the constraints. D is the diagonal of A: the algorithm
// works in impulses scaled by the root of D. The last change is present impulses - those before.
struct Passed {
  double uphill = 0.0;    // last change . gaps; > 0: the dual function rises along it
  double curved = 0.0;    // last change^T A last change
  // |A last change|^2 by D^-1, over the constraints with an impulse now or before
  double steep = 0.0;
  double least_gap = 0.0;           // least present gap at the end of the step, at most 0
  double most_under_force = 0.0;    // largest present gap where an impulse acts, at least 0
  double heaviest = 0.0;            // largest of the next impulses, times D: a length
  double since_start = 0.0;         // largest of the next changes, times D
  // Largest present residual as a part of its target; the same with the residual less the blur
  double unsolved = 0.0, unblurred = 0.0;
};

// Makes a gradient step from the present changes and the step of the momentum, and projects. `sum`
// gets the sums of the next changes.
Passed advance_impulses(const Pass<float, AdmissibleSet> &pass);
Passed advance_impulses(const Pass<double, AdmissibleSet> &pass);

// find_gaps works on these arrays of `count` constraints.
template <typename Real> struct Look {
  std::size_t count;
  const Ends *ends;
  const Vector<Real> *normal;
  const Vector<Real> *velocity;    // as in Pass
  Vector<Real> *gap;               // four in each
};

// Writes the present gaps at the end of the step, of constraints without an impulse.
void find_gaps(const Look<float> &look);
void find_gaps(const Look<double> &look);

// The members of a rigid body (inelastic_rigid_bodies.h) are those from `first` to before `end` of
// an array.
template <typename Real> struct Body {
  int first, last_original, end;
  Real inverse_mass;
  Vector<Real> inverse_inertia[3];    // its columns, in units that fit those of the arms
};

template <typename Real> struct Member {
  Vector<Real> arm;
  int particle;
};

// A rod is a body of two members without copies whose arms lie on an axis of symmetry of its
// inertia, such as a dimer. With M the mass and s_k the impulses on its particles,
//
//   dv_k = (1/M) sum_l s_l + b_k w,   w = the part of sum_l b_l s_l across the axis
//
// where b_k is the arm along the axis over the root of the inertia across it. Most bodies are rods,
// and the general way takes three times as long.
template <typename Real> struct Rod {
  Vector<Real> axis;            // the fourth number is the inverse mass
  Real arm[2];                  // b
  std::uint32_t particle[2];    // places of the particles' vectors, in bytes
};

// Replaces, for particles in bodies, sums of impulses by changes of velocity.
void turn_bodies(const std::vector<Rod<float>> &rods, const std::vector<Body<float>> &bodies,
                 const Member<float> *members, Vector<float> *sum);
void turn_bodies(const std::vector<Rod<double>> &rods, const std::vector<Body<double>> &bodies,
                 const Member<double> *members, Vector<double> *sum);

// move_particles works on these arrays, which are per slot (inelastic_unknowns.h).
template <typename Real> struct Move {
  std::size_t count;
  const Real *inverse_mass;    // 1 for particles in bodies, whose sums are changes of velocity
  Vector<Real> *sum;           // sums of the changes of impulses; left at zero
  Vector<Real> *velocity;      // set to the changes of velocity; the fourth number is 0
};

void move_particles(const Move<float> &arrays);
void move_particles(const Move<double> &arrays);

}    // namespace inelastic::packed
