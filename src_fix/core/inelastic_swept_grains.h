// What coloured sweeps move, by number: particles that turn with nothing, and bodies. Their states
// (inelastic_sweep_kernels.h) are linear in the impulses. One grain more, which nothing moves,
// stands for lanes that are empty.

#pragma once

#include "inelastic_contact_problem.h"
#include "inelastic_packed_batches.h"
#include "inelastic_packed_kernels.h"

#include <cmath>
#include <vector>

namespace inelastic {

template <typename Batch> class SweptGrains {
 public:
  using State = typename Batch::State;
  using Vector = packed::Vector<float>;

  // Numbers the grains of a problem. A mobility, 1 / mass, is in these units.
  void find(const ContactProblem &problem, double mobility_unit);

  int number() const { return static_cast<int>(moves_.size()); }
  std::size_t slots() const { return grain_.size(); }
  int of(int slot) const { return grain_[slot]; }
  const std::vector<char> &moves() const { return moves_; }
  // Whether a slot is a further image of a body's member.
  bool is_copy(int slot) const { return is_copy_[slot]; }
  // The root of the inverse mass, in double and in single precision.
  double slide(int slot) const { return std::sqrt(static_cast<double>(mobility_[of(slot)])); }
  float slide_in_single(int slot) const { return std::sqrt(mobility_[of(slot)]); }

  // Writes the places of the states, and the rows of a constraint, of which root^2 is the diagonal.
  void write_rows(const ContactProblem &problem, std::size_t c, double root, Batch &batch,
                  int lane) const;

  // Sets the states of what impulses have not moved.
  void stop(std::vector<State> &states) const;
  // Adds to the state of a body what an impulse on a member makes of it.
  void push(int slot, const Vector &impulse, std::vector<State> &states) const;
  // Writes the velocity of each slot.
  void velocities(const std::vector<State> &states, std::vector<Vector> &velocity) const;

 private:
  void find_bodies(const RigidBodies &bodies, double mobility_unit);
  bool is_body(std::size_t grain) const { return 9 * grain < spin_root_.size(); }

  std::vector<int> grain_;         // per slot
  std::vector<char> is_copy_;      // per slot
  std::vector<char> moves_;        // per grain: whether impulses move it
  std::vector<float> mobility_;    // per grain: the inverse mass, in packed units
  // Per body 9: F of F F^T = I^-1 by columns, in packed units; per member of a body its arm.
  std::vector<double> spin_root_, arm_;
};

}    // namespace inelastic
