// What the contact law remembers of contacts, kept per atom so that it follows the atoms through
// neighbour list rebuilds, from rank to rank and into restart files. It is physics and must not be
// lost, unlike the first guesses of contact_memory.h. Both atoms of a contact have a copy.

#ifndef INELASTIC_LAW_MEMORY_H
#define INELASTIC_LAW_MEMORY_H

#include "contact_law.h"

#include "lmptype.h"

#include <array>
#include <unordered_map>
#include <vector>

namespace LAMMPS_NS {

class LawMemory {
 public:
  struct Entry {
    tagint partner;                  // the other atom's ID, or minus the wall's number
    std::array<double, 3> normal;    // unit vector from the partner to this atom
    inelastic::Demand demand;        // in the last step
    double impulse;                  // [mass length / time] in the last step, as of a whole kick
    // [length / time] with which the surfaces part at the end of that step, where LAMMPS's
    // velocities are the mean of those before and after; without that of a wall
    double speed;
    std::array<double, inelastic::ContactLaw::MOST_REMEMBERED> remembered;
  };

  void resize(int atoms);
  void forget(int atom);
  void remember(int atom, const Entry &entry) { entries_[atom].push_back(entry); }
  void copy(int from, int to)
  {
    entries_[to] = entries_[from];
    owner_[to] = owner_[from];
  }

  // Partners are known by the IDs that atoms have when they remember: commands between runs can
  // give them others (delete_atoms does). Therefore an atom keeps the one that it had.
  void set_owner(int atom, tagint id) { owner_[atom] = id; }
  tagint owner(int atom) const { return owner_[atom]; }

  // Gives the partners of an atom the IDs that they have now. What is remembered of partners that
  // are not there is forgotten.
  void rename_partners(int atom, const std::unordered_map<tagint, tagint> &id_now);

  // Returns the contact with a partner that lies on the side of the normal; nullptr if there is
  // none. (Two contacts with one partner are on different sides: through two periodic boundaries,
  // or in the tip of a cone.)
  const Entry *find(int atom, tagint partner, const double *normal) const;

  // Tells whether something is remembered of a wall.
  bool remembers_wall(int atom) const;

  int number_of_entries(int atom) const { return static_cast<int>(entries_[atom].size()); }

  // Buffer layout: the owner's ID, number of entries, then the numbers of each.
  static constexpr int ENTRY_SIZE = 9 + inelastic::ContactLaw::MOST_REMEMBERED;
  static constexpr int packed_size(int entries) { return 2 + ENTRY_SIZE * entries; }
  static int size_of_packed(const double *buffer)
  { return packed_size(static_cast<int>(buffer[1])); }
  int pack(int atom, double *buffer) const;
  // Adds what is in the buffer to what the atom has. Returns how many numbers it read.
  int unpack(int atom, const double *buffer);

  // Ghosts tell their owned atoms what they remember in as many messages as it takes.
  static constexpr int ENTRIES_PER_MESSAGE = 4;
  int pack_unsent(int atom, double *buffer);
  // Counts the entries of atoms from `begin` to `end` that were not in a message.
  long number_unsent(int begin, int end) const;

 private:
  int pack(int atom, int begin, int end, double *buffer) const;

  std::vector<std::vector<Entry>> entries_;
  std::vector<tagint> owner_;
  std::vector<int> sent_;    // so many entries of an atom were in a message
};

}    // namespace LAMMPS_NS

#endif
