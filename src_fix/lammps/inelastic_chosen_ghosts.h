// The ghosts of other ranks' atoms whose values a projection needs, a small part of those that the
// neighbour list needs. Every message between ranks carries these alone, in their own precision.
//
// The functions are called by a fix's pack and unpack functions: `first` and `list` are what LAMMPS
// hands to those, the first ghost of a message and the owned atoms of its ghosts.

#ifndef INELASTIC_CHOSEN_GHOSTS_H
#define INELASTIC_CHOSEN_GHOSTS_H

#include <cstring>
#include <map>
#include <vector>

namespace LAMMPS_NS::Inelastic_NS {

class ChosenGhosts {
 public:
  // Begins a choice: `chosen` is per atom, ghosts included. A reverse communication of one number
  // per atom must follow, which tells the other side.
  void begin(const std::vector<char> &chosen)
  {
    chosen_ = chosen;
    ghosts_.clear();
    owned_.clear();
  }

  int pack_choice(int n, int first, double *buffer)
  {
    std::vector<int> &ghosts = ghosts_[first];
    for (int k = 0; k < n; ++k) {
      buffer[k] = chosen_[first + k];
      if (chosen_[first + k]) ghosts.push_back(first + k);
    }
    return n;
  }

  void unpack_choice(int n, const int *list, const double *buffer)
  {
    std::vector<int> &owned = owned_[list];
    for (int k = 0; k < n; ++k)
      if (buffer[k] != 0.0) {
        owned.push_back(list[k]);
        chosen_[list[k]] = 1;    // this may be a ghost itself, of a message yet to come
      }
  }

  // Vectors of 4 numbers per atom, of which 3 travel.
  template <typename Real> int pack_ghosts(int first, const Real *values, double *buffer) const
  { return pack(ghosts_.at(first), values, buffer); }

  template <typename Real> int pack_owned(const int *list, const Real *values, double *buffer) const
  { return pack(owned_.at(list), values, buffer); }

  template <typename Real> void set_ghosts(int first, const double *buffer, Real *values) const
  {
    for_each(ghosts_.at(first), buffer, values, [](Real &mine, Real other) {
      mine = other;
    });
  }

  template <typename Real>
  void add_to_owned(const int *list, const double *buffer, Real *values) const
  {
    for_each(owned_.at(list), buffer, values, [](Real &mine, Real other) {
      mine += other;
    });
  }

 private:
  template <typename Real>
  static int pack(const std::vector<int> &atoms, const Real *values, double *buffer)
  {
    char *out = reinterpret_cast<char *>(buffer);
    for (const int i : atoms) {
      std::memcpy(out, values + 4 * static_cast<std::size_t>(i), 3 * sizeof(Real));
      out += 3 * sizeof(Real);
    }
    return static_cast<int>((3 * sizeof(Real) * atoms.size() + sizeof(double) - 1) /
                            sizeof(double));
  }

  template <typename Real, typename Combine>
  static void for_each(const std::vector<int> &atoms, const double *buffer, Real *values,
                       Combine combine)
  {
    const char *in = reinterpret_cast<const char *>(buffer);
    for (const int i : atoms) {
      Real vector[3];
      std::memcpy(vector, in, sizeof(vector));
      in += sizeof(vector);
      for (int d = 0; d < 3; ++d) combine(values[4 * static_cast<std::size_t>(i) + d], vector[d]);
    }
  }

  std::vector<char> chosen_;
  std::map<int, std::vector<int>> ghosts_;           // by `first`
  std::map<const int *, std::vector<int>> owned_;    // by `list`
};

}    // namespace LAMMPS_NS::Inelastic_NS

#endif
