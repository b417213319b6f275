// The interface of a contact law: what a contact asks of the velocities at the end of a step, which
// impulse it may carry, and what it remembers from step to step.
//
// A contact has a unit normal n from side 2 to side 1, a gap D between the surfaces, and the
// velocity u of side 1 against side 2 (that of a wall included). Its impulse is lambda n on side 1
// and -lambda n on side 2. Every step minimises 1/2 (V - V*)^T M (V - V*) under what all contacts
// ask, and the impulses are the duals (../core/inelastic_contact_problem.h):
//
//   w = D + h n.u >= 0   or   w = h (n.u - s) >= 0,      lambda >= l,      (lambda - l) w = 0
//
// Where both are asked, w is the smaller one. A law chooses s, the speed with which the surfaces
// must part at least, and the set of impulses (../core/inelastic_admissible_set.h), which has l <=
// 0, the least one. With l = 0 a contact only pushes. With l < 0 it is held: it pulls by up to -l,
// and opens only where it pulls by as much.
//
// The inelastic law (no s, l = 0) has no class: in a scene that names no other law nobody is asked.

#pragma once

#include "inelastic_admissible_set.h"

#include <array>
#include <memory>
#include <string>
#include <vector>

namespace inelastic {

// The version of this interface. A law is built for one version, and refused by others.
constexpr int CONTACT_LAW_VERSION = 2;

// A contact at the start of a step.
struct ContactState {
  double timestep;    // h [time]
  double gap;         // D [length], negative where the surfaces overlap
  // n.u before the forces of the step act [length / time], < 0: they approach
  double speed_before;
  double predicted_speed;    // n.u with these forces, without contacts [length / time]
  // u - (n.u) n with these forces [length / time], of the two centres: neither spins nor the motion
  // of a wall are in it
  std::array<double, 3> sliding;
  std::array<double, 2> radius;    // of side 1 and side 2 [length]; 0 for a wall
  std::array<int, 2> type;         // LAMMPS's atom types; 0 for a wall
};

// What a contact asks for in a step: the gap, and which impulses it may carry. By itself that of
// the inelastic law: the surfaces do not overlap, and the contact pushes alone.
struct Demand {
  // The contact may pull, by up to an impulse [mass length / time], >= 0.
  static Demand pulls(double up_to) { return {false, 0.0, AdmissibleSet<double>::pulls(up_to)}; }
  // The surfaces part at least with a speed s [length / time], >= 0.
  static Demand parts_with(double speed) { return {true, speed, {}}; }

  // Whether s is asked for, too: w is then the smaller one of the two gaps above
  bool parts = false;
  double parting_speed = 0.0;    // s [length / time], >= 0
  AdmissibleSet<double> set;     // [mass length / time]

  bool is_inelastic() const { return !parts && !set.may_pull(); }
};

class ContactLaw {
 public:
  virtual ~ContactLaw() = default;

  // The largest number of values that a law may remember of a contact.
  static constexpr int MOST_REMEMBERED = 4;

  // Returns how many values the law remembers of each contact. They are zero when a contact begins,
  // stay with the contact when its particles change ranks, and are in restart files.
  virtual int remembers() const { return 0; }

  // Returns what a contact asks for in a step. `remembered` has remembers() values.
  virtual Demand ask(const ContactState &contact, const double *remembered) const = 0;

  // Takes the impulse that a contact has carried in a step that is solved, and sets what is
  // remembered of it. Returns whether that must be kept: such a contact belongs to the next step
  // whether it touches or not, and is in the output; any other begins anew. Where a run begins,
  // half of the last step is made again: the impulse is then the difference to the one that was
  // taken before.
  virtual bool remember(const Impulse & /*impulse*/, double * /*remembered*/) const
  { return false; }

  // Returns the solvers that find the impulses of this law, by their names in `solver NAME` of the
  // fix. Without that keyword the first one is taken. All of today's solvers serve where impulses
  // are in half lines; a law may rule out those that are not stable with what it asks for.
  virtual std::vector<std::string> solvers() const { return {"sweeps", "apgd", "uzawa"}; }

  // Changes what is remembered to what it is with the sides exchanged and n the other way: each of
  // two particles keeps a copy as it is seen from it, and either of them may be side 1 in the next
  // step. Numbers along n stay. A vector across n, such as a tangential impulse, changes its sign.
  virtual void turn_round(double * /*remembered*/) const {}
};

// Makes a law of the words that follow its name in `law NAME ...`. For words that are not allowed
// it returns nullptr, and says in `error` what is.
using MakeLaw = std::unique_ptr<ContactLaw> (*)(const std::vector<std::string> &words,
                                                std::string &error);

}    // namespace inelastic
