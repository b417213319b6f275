// The contacts of the last step, kept per atom so that they follow the atoms through neighbour list
// rebuilds and from rank to rank: the first guess of the next step, and what makes a contact at rest a
// spring (gap_rules.h).

#ifndef INELASTIC_CONTACT_MEMORY_H
#define INELASTIC_CONTACT_MEMORY_H

#include "lmptype.h"

#include <algorithm>
#include <vector>

namespace LAMMPS_NS {

class ContactMemory {
 public:
  struct Contact {
    double force = 0.0;        // [force] of the last step
    double sustained = 0.0;    // [force] what it has carried for long (next_sustained)
    // [length] the gap at which the spring has this force; the next step may have another compliance
    double spring_gap = NONE;    // no spring
  };
  static constexpr double NONE = -1.0e300;

  // A contact's sustained force grows by a factor a step from a small part of its first force, so that no
  // impact, which takes a few steps, is among it. (With a factor of 2 a column of springs gives back a
  // tenth of an impact, for it takes some steps itself to stop it.)
  static double next_sustained(double last, double force)
  {
    constexpr double FIRST_PART = 1.0e-4, GROWTH = 1.25;
    return last > 0.0 ? std::min(force, GROWTH * last) : FIRST_PART * force;
  }

  // The most contacts that a ghost tells its owned atom; what is beyond loses only a first guess, and
  // is rigid until it is at rest again.
  static constexpr int SHARED_PARTNERS = 16;

  void resize(int atoms) { remembered_.resize(atoms); }

  void forget(int atom) { remembered_[atom].clear(); }

  // partner: the other atom's ID, or minus the wall's number.
  void remember(int atom, tagint partner, const Contact &contact)
  { remembered_[atom].push_back({partner, contact}); }

  // Without a force when nothing is remembered. Of two contacts with one partner (in the tip of a cone, or
  // through two periodic boundaries) nobody knows which is which: they are never at rest.
  Contact find(int atom, tagint partner) const
  {
    const Entry *found = nullptr;
    for (const Entry &entry : remembered_[atom]) {
      if (entry.partner != partner) continue;
      if (found) return {found->contact.force, 0.0, NONE};
      found = &entry;
    }
    return found ? found->contact : Contact{};
  }

  int number_of_partners(int atom) const { return static_cast<int>(remembered_[atom].size()); }

  void copy(int from, int to) { remembered_[to] = remembered_[from]; }

  // Buffer layout: number of partners, then partner, force, sustained force and spring gap of each.
  static constexpr int packed_size(int partners) { return 1 + 4 * partners; }

  // At most `partners` of them.
  int pack(int atom, double *buffer, int partners) const
  {
    const int packed = std::min(partners, number_of_partners(atom));
    int m = 0;
    buffer[m++] = packed;
    for (int k = 0; k < packed; ++k) {
      const Entry &entry = remembered_[atom][k];
      buffer[m++] = static_cast<double>(entry.partner);
      buffer[m++] = entry.contact.force;
      buffer[m++] = entry.contact.sustained;
      buffer[m++] = entry.contact.spring_gap;
    }
    return m;
  }

  // Adds what is in the buffer to what the atom has.
  int unpack(int atom, const double *buffer)
  {
    int m = 0;
    const int partners = static_cast<int>(buffer[m++]);
    for (int k = 0; k < partners; ++k, m += 4)
      remember(atom, static_cast<tagint>(buffer[m]), {buffer[m + 1], buffer[m + 2], buffer[m + 3]});
    return m;
  }

 private:
  struct Entry {
    tagint partner;
    Contact contact;
  };
  std::vector<std::vector<Entry>> remembered_;
};

}    // namespace LAMMPS_NS

#endif
