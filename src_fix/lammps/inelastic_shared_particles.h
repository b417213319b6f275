// What ranks send one another of the particles that several of them have, in single messages from
// rank to rank. LAMMPS's own communication passes a value on from face to face of the grid of
// ranks, and waits in every call; here a rank goes on with its work while its messages travel.

#ifndef INELASTIC_SHARED_PARTICLES_H
#define INELASTIC_SHARED_PARTICLES_H

#include <mpi.h>

#include <array>
#include <vector>

namespace LAMMPS_NS::Inelastic_NS {

class SharedParticles {
 public:
  explicit SharedParticles(MPI_Comm world);
  ~SharedParticles();
  SharedParticles(const SharedParticles &) = delete;
  SharedParticles &operator=(const SharedParticles &) = delete;

  // Finds out who has which of the chosen particles. `chosen` and `owner` are per atom, ghosts
  // included: of each particle the rank that owns it and its place there, 3 numbers per atom, the
  // third without meaning. `colour` is this rank's. Collective.
  void choose(const std::vector<char> &chosen, const std::vector<double> &owner, bool images,
              int colour);

  // As Host::send and Host::receive.
  void send(const float *per_particle);
  void receive(int colour, float *per_particle);

 private:
  // Another rank with which this one shares chosen particles, and the particles of the vectors in a
  // message to it and from it, in the order of the message.
  struct Other {
    int rank, colour;
    std::vector<int> sent, received;
    std::vector<float> out, in;
  };
  using Vector = std::array<float, 3>;
  using Lists = std::vector<std::vector<int>>;    // a list for each rank

  Lists list_particles(const std::vector<char> &chosen, const std::vector<double> &owner);
  Lists exchange(const Lists &to_ranks) const;
  Lists ranks_of_owned(const Lists &to_owners) const;
  void finish_sending();

  MPI_Comm world_;
  int me_ = 0, ranks_ = 1;
  int rank_colour_ = 0;
  // The atoms of chosen particles, one particle after the other, and where each particle begins.
  std::vector<int> atoms_, first_atom_;
  std::vector<int> several_;         // particles of several atoms that receive from one another
  std::vector<Vector> sum_, own_;    // sent last: of a particle, of each atom
  std::vector<Other> others_;
  std::vector<MPI_Request> sending_;
};

}    // namespace LAMMPS_NS::Inelastic_NS

#endif
