// Every factor of EPS in the fix, on one axis: overlaps to the left, gaps to the right [EPS].
//
//   3     2          1     0.8  0.75    0.5       0       0.5       1            4
//   |-----|----------|------|-----|------|--------|--------|--------|------------|
//   KEPT  REGULAR  ALLOWED  WHOLE LEFT  CLOSED         CLOSED   ALLOWED        MARGIN
//
//   0 to CLOSED         counts as closed where it is: nothing of it is given back
//   CLOSED to WHOLE     is given back, more and more
//   LEFT                what free spheres that would end beyond ALLOWED are first asked to leave
//   up to ALLOWED       what a step may leave; beyond it constraints change
//   up to REGULAR       what turning bodies, curved walls, and steps without room may leave
//   beyond REGULAR      a bad start, which is pushed apart

#ifndef INELASTIC_THRESHOLDS_H
#define INELASTIC_THRESHOLDS_H

namespace LAMMPS_NS::Inelastic_NS::in_eps {

// Positions are not known better; to correct them would give velocities that no force makes.
constexpr double CLOSED = 0.5;
// Half of what room is left beyond CLOSED, so that one answer of a chain is mostly enough.
constexpr double LEFT = 0.75;
// Where an overlap gives back the accuracy's part of what the contact stops: below ALLOWED, so that
// what rests does not come there.
constexpr double WHOLE = 0.8;
// The promise of the fix: EPS itself.
constexpr double ALLOWED = 1.0;
// Curvature and turning are followed to within ALLOWED; as much again may be residual.
constexpr double REGULAR = 2.0;
// Regular overlaps beside a bad one are kept to within the residual.
constexpr double KEPT = REGULAR + ALLOWED;
// The least gap within which pairs get a constraint though nothing closes it: residuals of a few
// contacts do.
constexpr double MARGIN = 4.0;

// Small against all of these: what a solution beside particles at rest may add, by which the next
// start may know an overlap otherwise (by other sums), and how well LAMMPS must meet a prediction.
constexpr double ADDED_BESIDE_REST = 0.1;
constexpr double KNOWN_OTHERWISE = 0.1;
constexpr double PREDICTED = 1.0e-7;

static_assert(CLOSED < LEFT && LEFT < WHOLE && WHOLE < ALLOWED && ALLOWED < REGULAR &&
              REGULAR < KEPT && KEPT < MARGIN);
static_assert(CLOSED + ADDED_BESIDE_REST < LEFT && REGULAR + KNOWN_OTHERWISE < KEPT &&
              PREDICTED < ADDED_BESIDE_REST);

}    // namespace LAMMPS_NS::Inelastic_NS::in_eps

#endif
