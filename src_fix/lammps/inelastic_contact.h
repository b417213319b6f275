// A contact: two particles, or a particle and a wall, which a step keeps apart. It has a row in the
// problem (inelastic_contact_set.h) for each plane that does so: one, at curved walls also more.

#ifndef INELASTIC_CONTACT_H
#define INELASTIC_CONTACT_H

#include "inelastic_contact_law.h"
#include "inelastic_vector3.h"

#include "lmptype.h"

#include <array>

namespace LAMMPS_NS::Inelastic_NS {

struct Contact {
  // In place of a closed gap, which is never negative.
  static constexpr double NOT_CLOSED = -1.0;

  tagint partner;    // of the first particle: the other one's ID, or minus the wall's number
  double gap_now;    // [length] at the present positions
  double size;       // [length] the sum of the two radii; the radius at a wall

  double force = 0.0;    // [force] of the last step
  // [length] The gap at which it counts as closed (inelastic_gap_rules.h).
  double closed_gap = NOT_CLOSED;
  double length_to_stop = 0.0;     // [length] what the contact has to stop (inelastic_gap_rules.h)
  inelastic::Demand asked = {};    // what the law asks for; an inelastic contact nothing
  double predicted_speed = 0.0;    // [length / time] n.u without contacts; set if there is a law

  // The part of the accuracy to which the contact is solved (inelastic_contact_set.h). Surfaces may
  // collide hundreds of times: errors of the speeds with which they part add up.
  double refinement() const { return asked.parts ? 1.0 / 16.0 : 1.0; }

  bool is_with_wall() const { return partner < 0; }
  int wall() const { return static_cast<int>(-partner); }
};

// Tells whether two unit vectors are the same normal of a wall, to about a millionth: planes of one
// that a step has left and come back to differ by as much.
inline bool is_same_normal(const double *a, const double *b)
{
  constexpr double SAME = 1.0e-12;    // of 1 - cos of the angle between them
  return inelastic::dot(a, b) > 1.0 - SAME;
}

// What stands beside a row of the problem.
struct Row {
  int contact;                // its place in Step::contacts
  double wall_motion;         // [length] by how much the wall closes the row's gap during the step
  bool as_at_start = true;    // the row asks for what it asked for at the start of the step
  bool followed = false;      // the gap was set by where an earlier solution of the step ends
  bool asks_for_gap = false;    // at the start of the step, for no less
};

// How the gap of a row came nearer to what the end of the step asks for, in the last round that
// changed it.
struct Approach {
  double change = 0.0;    // [length] that was asked for
  double part = 1.0;      // the part of it by which the gap was changed
};

// A contact as the contact law sees it (inelastic_law_contacts.h).
struct LawState {
  std::array<double, inelastic::ContactLaw::MOST_REMEMBERED> remembered;
  inelastic::Impulse impulse;    // over its rows, when the step is solved
  double last_impulse = 0.0;     // [mass length / time] in the last step
  bool known = false;            // something was remembered of it
  bool kept = false;             // something is to be remembered of it
};

}    // namespace LAMMPS_NS::Inelastic_NS

#endif
