// The iterations of accelerated_gradient.h on packed arrays (packed_kernels.h): this class packs a
// problem, runs the passes in the order that the exchange between ranks needs, and unpacks
// impulses.
//
// Constraints without an impulse whose gaps are far from closed are idle: iterations leave them out
// until they are looked at and found to be near. The others are working. Each rank chooses for
// itself; nothing is communicated for it.
//
// Constraints and n particles are packed as normals with gaps, diagonal entries and impulses, one
// for each constraint, and n + 1 vectors (contact_problem.h has the dummy particle). Everything has
// units in which the largest length is near 1, so that single precision can hold it.

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
  // Packs a problem with its present impulses. `free_gap` is w(0), `diagonal` that of A, `gap` is
  // w of impulses near the present ones, one number per constraint each (contact_problem.h).
  // Constraints without an impulse whose gap is above `idle_gap` [length] are idle. Collective, like
  // finish.
  void prepare(const ContactProblem &problem, const std::vector<double> &free_gap,
               const std::vector<double> &diagonal, const std::vector<double> &gap, double idle_gap,
               const Scales &scales, Host &host);

  // Begins an iteration: makes a projected gradient step of 1 / L from the present impulses plus
  // `momentum` times their last change. The next impulses become the present ones. `momentum` must
  // be that of the last finish, 0 after prepare. Returns sums and maxima over this rank's
  // constraints.
  packed::Passed advance(double momentum, double step);

  // Ends an iteration: computes the changes of velocity of the present impulses, and those of the
  // impulses ahead by this momentum.
  void finish(Host &host, double momentum);

  // Makes the idle constraints working whose gaps under the impulses ahead are not above
  // `idle_gap`, in packed units, and idle the working ones without an impulse whose gaps are, where
  // they are more than a few. Call it between finish and advance.
  void look(double idle_gap);

  // Makes the idle constraints working whose gaps are not above `idle_gap` by these gaps, one per
  // constraint of the problem [length].
  void join(const std::vector<double> &gap, const Scales &scales);

  // Writes the present impulses, in the order of the problem's constraints.
  void impulses(const Scales &scales, std::vector<double> &impulse) const
  { unpack(impulse_, scales, impulse); }
  // Writes the impulses that the last iteration started from: what advance returned is of these.
  void impulses_before(const Scales &scales, std::vector<double> &impulse) const
  { unpack(impulse_before_, scales, impulse); }

 private:
  using Vector = packed::Vector<Real>;

  struct Constraints {
    std::vector<std::size_t> source;    // the place in the problem
    std::vector<packed::Ends> ends;
    std::vector<Vector> normal;    // the fourth number is w(0)
    std::vector<Real> diagonal, compliance;

    std::size_t size() const { return source.size(); }
    void resize(std::size_t count);
    // Copies constraint k of `other` to place `to`.
    void copy(const Constraints &other, std::size_t k, std::size_t to);
  };

  void pack(const ContactSet &contacts, const std::vector<std::size_t> &places,
            const std::vector<double> &free_gap, const std::vector<double> &diagonal,
            const Scales &scales, Constraints &packed);
  void wake(const std::vector<std::size_t> &near, const Real *gap);
  void rest();
  void pack_bodies(const RigidBodies &bodies, double mobility_unit);
  bool pack_rod(const RigidBodies &bodies, std::size_t b, double mobility_unit);
  void pack_body(const RigidBodies &bodies, std::size_t b, double mobility_unit);
  packed::Pass<Real> pass(double momentum, double step);
  void unpack(const std::vector<Real> &packed, const Scales &scales,
              std::vector<double> &impulse) const;

  Constraints working_, idle_;
  std::vector<Real> impulse_, impulse_before_, gap_before_;    // of the working ones
  std::vector<Vector> looked_;        // gaps of the idle ones, four in each
  Real idle_gap_ = 0;                 // above it a constraint without an impulse is idle
  std::vector<Real> inverse_mass_;    // per particle; 1 for particles in bodies
  std::vector<Vector> sum_, velocity_, ahead_;
  std::vector<packed::Rod<Real>> rods_;
  std::vector<packed::Body<Real>> bodies_;       // bodies that are no rods
  std::vector<packed::Member<Real>> members_;    // of all bodies, as in RigidBodies::member
};

}    // namespace inelastic
