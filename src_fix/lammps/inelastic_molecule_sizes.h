// A MoleculeSizes knows how many spheres the body of each molecule has, over all ranks. Every rank
// knows all molecules; what that costs depends on their number, not on how large their IDs are.

#ifndef INELASTIC_MOLECULE_SIZES_H
#define INELASTIC_MOLECULE_SIZES_H

#include "lmptype.h"

#include <mpi.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace LAMMPS_NS::Inelastic_NS {

class MoleculeSizes {
 public:
  struct Molecule {
    std::int64_t id;
    std::int64_t spheres;
    std::int64_t outside;    // of them not in the fix's group
    std::int64_t frozen;
  };
  static constexpr int NONE = -1;

  // Takes an entry for each sphere of this rank, in any order, and adds up those of all ranks.
  // Collective.
  void count(std::vector<Molecule> mine, MPI_Comm world)
  {
    add_up(mine);
    constexpr int NUMBERS = sizeof(Molecule) / sizeof(std::int64_t);
    int ranks;
    MPI_Comm_size(world, &ranks);
    static_assert(sizeof(std::int64_t) == sizeof(long long), "MPI_LONG_LONG");
    // LAMMPS's own mpi.h, of builds without MPI, takes no constants and knows no MPI_INT64_T.
    int count = NUMBERS * static_cast<int>(mine.size());
    std::vector<int> counts(ranks), offsets(ranks, 0);
    MPI_Allgather(&count, 1, MPI_INT, counts.data(), 1, MPI_INT, world);
    for (int rank = 1; rank < ranks; ++rank) offsets[rank] = offsets[rank - 1] + counts[rank - 1];
    molecules_.resize((offsets.back() + counts.back()) / NUMBERS);
    MPI_Allgatherv(mine.data(), count, MPI_LONG_LONG, molecules_.data(), counts.data(),
                   offsets.data(), MPI_LONG_LONG, world);
    add_up(molecules_);
    consecutive_ = molecules_.empty() ||
        molecules_.back().id - molecules_.front().id + 1 ==
            static_cast<std::int64_t>(molecules_.size());
  }

  // Ascending by ID.
  const std::vector<Molecule> &all() const { return molecules_; }

  // Returns the place of a molecule among all; NONE if it had no body when they were counted.
  int place(tagint id) const
  {
    if (molecules_.empty() || id < molecules_.front().id || id > molecules_.back().id) return NONE;
    if (consecutive_) return static_cast<int>(id - molecules_.front().id);
    const auto found = std::lower_bound(molecules_.begin(), molecules_.end(), id, before);
    return found->id == id ? static_cast<int>(found - molecules_.begin()) : NONE;
  }

 private:
  static bool before(const Molecule &molecule, std::int64_t id) { return molecule.id < id; }

  static void add_up(std::vector<Molecule> &entries)
  {
    std::sort(entries.begin(), entries.end(), [](const Molecule &a, const Molecule &b) {
      return a.id < b.id;
    });
    std::size_t kept = 0;
    for (std::size_t k = 0; k < entries.size(); ++k) {
      if (kept == 0 || entries[kept - 1].id != entries[k].id) {
        entries[kept++] = entries[k];
        continue;
      }
      Molecule &sum = entries[kept - 1];
      sum.spheres += entries[k].spheres;
      sum.outside += entries[k].outside;
      sum.frozen += entries[k].frozen;
    }
    entries.resize(kept);
  }

  std::vector<Molecule> molecules_;
  bool consecutive_ = true;
};

}    // namespace LAMMPS_NS::Inelastic_NS

#endif
