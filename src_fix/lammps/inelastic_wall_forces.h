// The forces of contacts on each wall [force]: what this rank adds up in a step, and the sums over
// all ranks, which are made when somebody asks for them.

#ifndef INELASTIC_WALL_FORCES_H
#define INELASTIC_WALL_FORCES_H

#include <mpi.h>

#include <algorithm>
#include <cstddef>
#include <vector>

namespace LAMMPS_NS::Inelastic_NS {

class WallForces {
 public:
  void set_walls(int walls) { total_ = mine_ = std::vector<double>(3 * walls, 0.0); }

  void clear()
  {
    std::fill(mine_.begin(), mine_.end(), 0.0);
    is_known_ = false;
  }

  // The force on a wall (0 = the first one), 3 numbers, of this rank's contacts.
  double *of(int wall) { return &mine_[3 * static_cast<std::size_t>(wall)]; }

  // One component of the force on a wall, on all ranks. Collective.
  double total(int wall, int direction, MPI_Comm world)
  {
    if (!is_known_)
      MPI_Allreduce(mine_.data(), total_.data(), static_cast<int>(mine_.size()), MPI_DOUBLE,
                    MPI_SUM, world);
    is_known_ = true;
    return total_[3 * static_cast<std::size_t>(wall) + direction];
  }

 private:
  std::vector<double> mine_, total_;    // 3 per wall
  bool is_known_ = false;               // total_ is that of the step
};

}    // namespace LAMMPS_NS::Inelastic_NS

#endif
