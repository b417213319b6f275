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
  // A rank that has chosen particles that this one has chosen, too, and which of these messages are
  // of, in their order.
  struct Other {
    int rank, turn;
    std::vector<int> told, heard;
    std::vector<float> out, in;
  };
  using Vector = std::array<float, 3>;
  using Lists = std::vector<std::vector<int>>;    // a list for each rank

  Lists list_particles(const std::vector<char> &chosen, const std::vector<double> &owner);
  Lists exchange(const Lists &to_ranks) const;
  Lists ranks_of_owned(const Lists &to_owners) const;
  void finish_telling();

  MPI_Comm world_;
  int me_ = 0, ranks_ = 1;
  int turn_ = 0;
  // The atoms of chosen particles, one particle after the other, and where each particle begins.
  std::vector<int> atoms_, first_atom_;
  std::vector<int> several_;         // particles of several atoms that hear one another
  std::vector<Vector> sum_, own_;    // told last: of a particle, of each atom
  std::vector<Other> others_;
  std::vector<MPI_Request> telling_;
};

}    // namespace LAMMPS_NS::Inelastic_NS

#endif
