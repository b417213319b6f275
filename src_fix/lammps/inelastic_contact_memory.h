// What is known of contacts from the last step, kept per atom so that it follows the atoms through
// neighbour list rebuilds and from rank to rank. Both atoms of a contact remember it.
//
// There are two memories. That of the first guesses (inelastic_first_guess.h) may lose some where a
// ghost has more contacts than a message takes: a solve then takes longer. What a contact law
// remembers (inelastic_law_memory.h) is physics, is never lost, and is in restart files. Here is
// what both have in common: how a contact is found again, and how it travels.

#ifndef INELASTIC_CONTACT_MEMORY_H
#define INELASTIC_CONTACT_MEMORY_H

#include "lmptype.h"

#include <algorithm>
#include <vector>

namespace LAMMPS_NS::Inelastic_NS {

// An Entry is found by its `partner`, the ID of the other atom or minus the number of a wall, and
// by the side of the atom on which it lies: entry.along(normal) is the cosine of the angle between
// the entry's normal and another one. It travels as Entry::SIZE numbers, which entry.pack(out)
// writes and entry.unpack(in) reads.
template <typename Entry> class ContactMemory {
 public:
  void resize(int atoms) { entries_.resize(atoms); }
  void forget(int atom) { entries_[atom].clear(); }
  void remember(int atom, const Entry &entry) { entries_[atom].push_back(entry); }
  void copy(int from, int to) { entries_[to] = entries_[from]; }

  int number_of_entries(int atom) const { return static_cast<int>(entries_[atom].size()); }

  // Returns the contact with a partner that lies on the side of the normal; nullptr if there is
  // none. (Two contacts with one partner are on different sides: through two periodic boundaries,
  // or in the tip of a cone.)
  const Entry *find(int atom, tagint partner, const double *normal) const
  {
    constexpr double SAME_SIDE = 0.1;    // the least cosine
    const Entry *found = nullptr;
    double nearest = SAME_SIDE;
    for (const Entry &entry : entries_[atom]) {
      if (entry.partner != partner) continue;
      const double cosine = entry.along(normal);
      if (cosine <= nearest) continue;
      nearest = cosine;
      found = &entry;
    }
    return found;
  }

  // Buffer layout: number of entries, then the numbers of each.
  static constexpr int packed_size(int entries) { return 1 + Entry::SIZE * entries; }

  // Packs the entries from `begin` to before `end`. Returns how many numbers it wrote.
  int pack(int atom, int begin, int end, double *buffer) const
  {
    double *out = buffer;
    *out++ = end - begin;
    for (int k = begin; k < end; ++k) out = entries_[atom][k].pack(out);
    return static_cast<int>(out - buffer);
  }

  // Adds what is in the buffer to what the atom has. Returns how many numbers it read.
  int unpack(int atom, const double *buffer)
  {
    const double *in = buffer;
    const int count = static_cast<int>(*in++);
    for (int k = 0; k < count; ++k) {
      Entry entry;
      in = entry.unpack(in);
      remember(atom, entry);
    }
    return static_cast<int>(in - buffer);
  }

 protected:
  std::vector<std::vector<Entry>> entries_;    // per atom
};

}    // namespace LAMMPS_NS::Inelastic_NS

#endif
