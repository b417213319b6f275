// The iterations of accelerated_gradient.h on packed arrays (packed_kernels.h): this class packs a
// problem, runs the passes in the order that the exchange between ranks needs, and unpacks
// impulses.
//
// m constraints and n particles are packed as m normals with gaps, m diagonal entries and impulses,
// and n + 1 vectors (contact_problem.h has the dummy particle). Everything has units in which the
// largest length is near 1, so that single precision can hold it.

#pragma once

#include "contact_problem.h"
#include "host.h"
#include "packed_kernels.h"

#include <vector>

namespace inelastic {

// The units of packed numbers. Both are powers of two, so that a scene in other units takes the
// same steps bit by bit.
struct Scales {
  double length;     // [length]
  double impulse;    // [mass length / time]
};

template <typename Real> class PackedIterations {
 public:
  // Packs a problem with its present impulses. `free_gap` is w(0), `diagonal` that of A, one number
  // per constraint each (contact_problem.h). Collective, like finish.
  void prepare(const ContactProblem &problem, const std::vector<double> &free_gap,
               const std::vector<double> &diagonal, const Scales &scales, Host &host);

  // Begins an iteration: makes a projected gradient step of 1 / L from the present impulses plus
  // `momentum` times their last change. The next impulses become the present ones. `momentum` must
  // be that of the last finish, 0 after prepare. Returns sums and maxima over this rank's
  // constraints.
  packed::Passed advance(double momentum, double step);

  // Ends an iteration: computes the changes of velocity of the present impulses, and those of the
  // impulses ahead by this momentum.
  void finish(Host &host, double momentum);

  // Writes the present impulses, in the order of the problem's constraints.
  void impulses(const Scales &scales, std::vector<double> &impulse) const
  { unpack(impulse_, scales, impulse); }
  // Writes the impulses that the last iteration started from: what advance returned is of these.
  void impulses_before(const Scales &scales, std::vector<double> &impulse) const
  { unpack(impulse_before_, scales, impulse); }

 private:
  using Vector = packed::Vector<Real>;

  void set_order(std::size_t count);
  void pack_constraints(const ContactSet &contacts, const std::vector<double> &free_gap,
                        const std::vector<double> &diagonal, const Scales &scales);
  void pack_bodies(const RigidBodies &bodies, double mobility_unit);
  bool pack_rod(const RigidBodies &bodies, std::size_t b, double mobility_unit);
  void pack_body(const RigidBodies &bodies, std::size_t b, double mobility_unit);
  packed::Pass<Real> pass(double momentum, double step);
  void unpack(const std::vector<Real> &packed, const Scales &scales,
              std::vector<double> &impulse) const;

  std::vector<std::size_t> source_;    // per packed constraint: its place in the problem
  std::vector<packed::Ends> ends_;
  std::vector<Vector> normal_;    // the fourth number is w(0)
  std::vector<Real> diagonal_, compliance_, impulse_, impulse_before_, gap_before_;
  std::vector<Real> inverse_mass_;    // per particle; 1 for particles in bodies
  std::vector<Vector> sum_, velocity_, ahead_;
  std::vector<packed::Rod<Real>> rods_;
  std::vector<packed::Body<Real>> bodies_;       // bodies that are no rods
  std::vector<packed::Member<Real>> members_;    // of all bodies, as in RigidBodies::member
};

}    // namespace inelastic
