// What is known of contacts from the last step, kept per atom so that it follows the atoms through
// neighbour list rebuilds and from rank to rank: their forces, the first guess of the next step,
// and the gaps at which they are closed (gap_rules.h).

#ifndef INELASTIC_CONTACT_MEMORY_H
#define INELASTIC_CONTACT_MEMORY_H

#include "contact.h"

#include "lmptype.h"

#include <algorithm>
#include <vector>

namespace LAMMPS_NS {

class ContactMemory {
 public:
  // The most contacts that a ghost tells its owned atom; what is beyond loses its first guess.
  static constexpr int SHARED_PARTNERS = 16;
  void resize(int atoms) { remembered_.resize(atoms); }

  void forget(int atom) { remembered_[atom].clear(); }

  struct Entry {
    tagint partner = 0;                         // the other atom's ID, or minus the wall's number
    double force = 0.0;                         // [force] of the last step
    double closed_gap = Contact::NOT_CLOSED;    // [length] the gap at which the contact is closed
  };

  void remember(int atom, const Entry &entry) { remembered_[atom].push_back(entry); }

  // An entry without force that is not closed where nothing is remembered. Of two contacts with one
  // partner (in the tip of a cone, or through two periodic boundaries) nobody knows which is which,
  // and both are the first one.
  Entry find(int atom, tagint partner) const
  {
    for (const Entry &entry : remembered_[atom])
      if (entry.partner == partner) return entry;
    return {};
  }

  int number_of_partners(int atom) const { return static_cast<int>(remembered_[atom].size()); }

  void copy(int from, int to) { remembered_[to] = remembered_[from]; }

  // Buffer layout: number of partners, then each one's entry.
  static constexpr int packed_size(int partners) { return 1 + 3 * partners; }

  // At most `partners` of them.
  int pack(int atom, double *buffer, int partners) const
  {
    const int packed = std::min(partners, number_of_partners(atom));
    int m = 0;
    buffer[m++] = packed;
    for (int k = 0; k < packed; ++k) {
      const Entry &entry = remembered_[atom][k];
      buffer[m++] = static_cast<double>(entry.partner);
      buffer[m++] = entry.force;
      buffer[m++] = entry.closed_gap;
    }
    return m;
  }

  // Adds what is in the buffer to what the atom has.
  int unpack(int atom, const double *buffer)
  {
    int m = 0;
    const int partners = static_cast<int>(buffer[m++]);
    for (int k = 0; k < partners; ++k, m += 3)
      remember(atom, {static_cast<tagint>(buffer[m]), buffer[m + 1], buffer[m + 2]});
    return m;
  }

 private:
  std::vector<std::vector<Entry>> remembered_;
};

}    // namespace LAMMPS_NS

#endif
