// What ranks tell one another of the particles that several of them have, in single messages from
// rank to rank. LAMMPS's own communication passes a value on from face to face of the grid of
// ranks, and waits in every call; here a rank goes on with its work while its messages travel.

#ifndef INELASTIC_TOLD_PARTICLES_H
#define INELASTIC_TOLD_PARTICLES_H

#include <mpi.h>

#include <array>
#include <vector>

namespace LAMMPS_NS::Inelastic_NS {

class ToldParticles {
 public:
  explicit ToldParticles(MPI_Comm world);
  ~ToldParticles();
  ToldParticles(const ToldParticles &) = delete;
  ToldParticles &operator=(const ToldParticles &) = delete;

  // Finds out who has which of the chosen particles. `chosen` and `owner` are per atom, ghosts
  // included: of each particle the rank that owns it and its place there, 3 numbers per atom, the
  // third without meaning. `turn` is this rank's. Collective.
  void choose(const std::vector<char> &chosen, const std::vector<double> &owner, bool images,
              int turn);

  // As Host::tell and Host::hear.
  void tell(const float *per_particle);
  void hear(int turn, float *per_particle);

 private:
  // A rank that has chosen particles of this one, and the atoms that messages are of, in their
  // order.
  struct Other {
    int rank, turn;
    std::vector<int> told, heard;
    std::vector<float> out, in;
  };
  // A vector of one atom, told to another atom of this rank.
  struct OfImage {
    int told, heard;
    std::array<float, 3> vector;
  };
  using Lists = std::vector<std::vector<int>>;    // a list for each rank

  Lists exchange(const Lists &to_ranks) const;
  Lists copies_of_owned(const std::vector<char> &chosen, const std::vector<double> &owner) const;
  void finish_telling();

  MPI_Comm world_;
  int me_ = 0, ranks_ = 1;
  int turn_ = 0;
  std::vector<Other> others_;
  std::vector<OfImage> images_;
  std::vector<MPI_Request> telling_;
};

}    // namespace LAMMPS_NS::Inelastic_NS

#endif
