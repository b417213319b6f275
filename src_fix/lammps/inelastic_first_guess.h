// The first guesses of the next step: the contact forces of the last one, and the gaps at which
// contacts are closed (inelastic_gap_rules.h).

#ifndef INELASTIC_FIRST_GUESS_H
#define INELASTIC_FIRST_GUESS_H

#include "inelastic_contact.h"
#include "inelastic_contact_memory.h"

#include <algorithm>

namespace LAMMPS_NS::Inelastic_NS {

struct FirstGuess {
  tagint partner = 0;                         // the other atom's ID, or minus the wall's number
  double force = 0.0;                         // [force] of the last step
  double closed_gap = Contact::NOT_CLOSED;    // [length] the gap at which the contact is closed

  // Of two contacts with one partner nobody knows which is which: both are the first one.
  double along(const double * /*normal*/) const { return 1.0; }

  static constexpr int SIZE = 3;
  double *pack(double *out) const
  {
    *out++ = static_cast<double>(partner);
    *out++ = force;
    *out++ = closed_gap;
    return out;
  }
  const double *unpack(const double *in)
  {
    partner = static_cast<tagint>(*in++);
    force = *in++;
    closed_gap = *in++;
    return in;
  }
};

class FirstGuesses : public ContactMemory<FirstGuess> {
 public:
  // The most contacts that a ghost tells its owned atom; further ones lose their first guess.
  static constexpr int ENTRIES_PER_MESSAGE = 16;

  int pack_message(int atom, double *buffer) const
  { return pack(atom, 0, std::min(ENTRIES_PER_MESSAGE, number_of_entries(atom)), buffer); }
};

}    // namespace LAMMPS_NS::Inelastic_NS

#endif
