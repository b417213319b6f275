// What the contact law remembers of contacts, also in restart files. It is physics and must not be
// lost, unlike the first guesses of inelastic_first_guess.h.

#ifndef INELASTIC_LAW_MEMORY_H
#define INELASTIC_LAW_MEMORY_H

#include "inelastic_contact_law.h"
#include "inelastic_contact_memory.h"

#include "lmptype.h"

#include <array>
#include <unordered_map>
#include <vector>

namespace LAMMPS_NS::Inelastic_NS {

struct LawEntry {
  tagint partner;                  // the other atom's ID, or minus the wall's number
  std::array<double, 3> normal;    // unit vector from the partner to this atom
  inelastic::Demand demand;        // in the last step
  double impulse;                  // [mass length / time] in the last step, as of a whole kick
  // [length / time] with which the surfaces part at the end of that step, where LAMMPS's velocities
  // are the mean of those before and after; without that of a wall
  double speed;
  std::array<double, inelastic::ContactLaw::MOST_REMEMBERED> remembered;

  double along(const double *other_normal) const;

  static constexpr int SIZE = 9 + inelastic::ContactLaw::MOST_REMEMBERED;
  double *pack(double *out) const;
  const double *unpack(const double *in);
};

class LawMemory : public ContactMemory<LawEntry> {
 public:
  void resize(int atoms);
  void forget(int atom);
  void copy(int from, int to);

  // What is remembered names partners by the IDs of that time, and commands between runs can change
  // IDs (delete_atoms does). Therefore an atom keeps the ID, too, that it had when it remembered.
  void set_owner(int atom, tagint id) { owner_[atom] = id; }
  tagint owner(int atom) const { return owner_[atom]; }

  // Gives the partners of an atom the IDs that they have now. What is remembered of partners that
  // are not there is forgotten.
  void rename_partners(int atom, const std::unordered_map<tagint, tagint> &id_now);

  // Tells whether something is remembered of a wall.
  bool remembers_wall(int atom) const;

  // Buffer layout, also of restart files: the owner's ID, then that of ContactMemory.
  static constexpr int packed_size(int entries) { return 1 + ContactMemory::packed_size(entries); }
  static int size_of_packed(const double *buffer)
  { return packed_size(static_cast<int>(buffer[1])); }
  int pack(int atom, double *buffer) const
  { return pack(atom, 0, number_of_entries(atom), buffer); }
  int unpack(int atom, const double *buffer);

  // Ghosts tell their owned atoms what they remember in as many messages as it takes.
  static constexpr int ENTRIES_PER_MESSAGE = 4;
  int pack_unsent(int atom, double *buffer);
  // Counts the entries of atoms from `begin` to `end` that were not in a message.
  long number_unsent(int begin, int end) const;

 private:
  int pack(int atom, int begin, int end, double *buffer) const;

  std::vector<tagint> owner_;
  std::vector<int> sent_;    // so many entries of an atom were in a message
};

}    // namespace LAMMPS_NS::Inelastic_NS

#endif
