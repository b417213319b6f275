#include "inelastic_shared_particles.h"

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <tuple>
#include <utility>

using namespace LAMMPS_NS;
using namespace Inelastic_NS;

namespace {

// A chosen particle that this rank owns, by its place among the atoms; a rank that has chosen it;
// and its number there.
using Chosen = std::tuple<int, int, int>;

constexpr int VECTOR = 3;    // numbers

}    // namespace

SharedParticles::SharedParticles(MPI_Comm world)
{
  // Messages of others never come between.
  MPI_Comm_dup(world, &world_);
  MPI_Comm_rank(world_, &me_);
  MPI_Comm_size(world_, &ranks_);
}

SharedParticles::~SharedParticles()
{
  finish_sending();
  MPI_Comm_free(&world_);
}

// Sends each rank its list, and returns the lists from all of them.
SharedParticles::Lists SharedParticles::exchange(const Lists &to_ranks) const
{
  if (ranks_ == 1) return to_ranks;    // a LAMMPS without MPI has functions that do nothing
  std::vector<int> sent(ranks_), received(ranks_), out_from(ranks_, 0), in_from(ranks_, 0);
  for (int rank = 0; rank < ranks_; ++rank) sent[rank] = static_cast<int>(to_ranks[rank].size());
  MPI_Alltoall(sent.data(), 1, MPI_INT, received.data(), 1, MPI_INT, world_);
  std::partial_sum(sent.begin(), sent.end() - 1, out_from.begin() + 1);
  std::partial_sum(received.begin(), received.end() - 1, in_from.begin() + 1);
  std::vector<int> out, in(in_from.back() + received.back());
  for (const std::vector<int> &list : to_ranks) out.insert(out.end(), list.begin(), list.end());
  MPI_Alltoallv(out.data(), sent.data(), out_from.data(), MPI_INT, in.data(), received.data(),
                in_from.data(), MPI_INT, world_);
  Lists from_ranks(ranks_);
  for (int rank = 0; rank < ranks_; ++rank) {
    const auto begin = in.begin() + in_from[rank];
    from_ranks[rank].assign(begin, begin + received[rank]);
  }
  return from_ranks;
}

// Lists the chosen particles with their atoms. Returns for each rank which of its own they are:
// pairs of its place there and its number here.
SharedParticles::Lists SharedParticles::list_particles(const std::vector<char> &chosen,
                                                       const std::vector<double> &owner)
{
  const auto particle_of = [&](int atom) {
    return std::pair(static_cast<int>(owner[2 * atom]), static_cast<int>(owner[2 * atom + 1]));
  };
  atoms_.clear();
  for (int i = 0; i < static_cast<int>(owner.size() / 2); ++i)
    if (chosen[i]) atoms_.push_back(i);
  std::sort(atoms_.begin(), atoms_.end(), [&](int i, int j) {
    return std::pair(particle_of(i), i) < std::pair(particle_of(j), j);
  });
  first_atom_.clear();
  Lists to_owners(ranks_);
  for (std::size_t k = 0; k < atoms_.size(); ++k) {
    const auto particle = particle_of(atoms_[k]);
    if (k > 0 && particle == particle_of(atoms_[k - 1])) continue;
    to_owners[particle.first].push_back(particle.second);
    to_owners[particle.first].push_back(static_cast<int>(first_atom_.size()));
    first_atom_.push_back(static_cast<int>(k));
  }
  first_atom_.push_back(static_cast<int>(atoms_.size()));
  return to_owners;
}

// Returns, of the particles that this rank owns, for each rank whom it sends them to: triples of
// its number of the particle, another rank that has chosen it, and that one's number.
SharedParticles::Lists SharedParticles::ranks_of_owned(const Lists &to_owners) const
{
  const Lists from_ranks = exchange(to_owners);
  std::vector<Chosen> chosen;
  for (int rank = 0; rank < ranks_; ++rank)
    for (std::size_t k = 0; k < from_ranks[rank].size(); k += 2)
      chosen.emplace_back(from_ranks[rank][k], rank, from_ranks[rank][k + 1]);
  std::sort(chosen.begin(), chosen.end());
  Lists to_ranks(ranks_);
  for (auto begin = chosen.begin(); begin != chosen.end();) {
    const auto end = std::find_if(begin, chosen.end(), [&](const Chosen &one) {
      return std::get<0>(one) != std::get<0>(*begin);
    });
    for (auto from = begin; from != end; ++from)
      for (auto to = begin; to != end; ++to)
        if (to != from)
          for (const int number : {std::get<2>(*from), std::get<1>(*to), std::get<2>(*to)})
            to_ranks[std::get<1>(*from)].push_back(number);
    begin = end;
  }
  return to_ranks;
}

void SharedParticles::choose(const std::vector<char> &chosen, const std::vector<double> &owner,
                             bool images, int colour)
{
  finish_sending();
  others_.clear();
  several_.clear();
  rank_colour_ = colour;
  const Lists to_owners = list_particles(chosen, owner);
  const int particles = static_cast<int>(first_atom_.size()) - 1;
  sum_.resize(particles);
  own_.resize(atoms_.size());
  for (int k = 0; images && k < particles; ++k)
    if (first_atom_[k + 1] > first_atom_[k] + 1) several_.push_back(k);
  Lists sent(ranks_), names(ranks_);    // the numbers of this rank, and those of the others
  for (const std::vector<int> &list : exchange(ranks_of_owned(to_owners)))
    for (std::size_t k = 0; k < list.size(); k += 3) {
      const int rank = list[k + 1];
      // The first number of a list is this rank's colour.
      if (names[rank].empty()) names[rank].push_back(colour);
      sent[rank].push_back(list[k]);
      names[rank].push_back(list[k + 2]);
    }
  const Lists received = exchange(names);
  for (int rank = 0; rank < ranks_; ++rank) {
    if (received[rank].empty()) continue;
    Other other{rank, received[rank].front(), sent[rank], {}, {}, {}};
    other.received.assign(received[rank].begin() + 1, received[rank].end());
    other.out.resize(VECTOR * other.sent.size());
    other.in.resize(VECTOR * other.received.size());
    others_.push_back(std::move(other));
  }
}

void SharedParticles::finish_sending()
{
  for (MPI_Request &request : sending_) MPI_Wait(&request, MPI_STATUS_IGNORE);
  sending_.clear();
}

void SharedParticles::send(const float *per_particle)
{
  finish_sending();
  for (std::size_t particle = 0; particle < sum_.size(); ++particle) {
    Vector &sum = sum_[particle] = {};
    for (int k = first_atom_[particle]; k < first_atom_[particle + 1]; ++k) {
      std::copy_n(per_particle + 4 * static_cast<std::size_t>(atoms_[k]), VECTOR, own_[k].data());
      for (int d = 0; d < VECTOR; ++d) sum[d] += own_[k][d];
    }
  }
  for (Other &other : others_) {
    float *out = other.out.data();
    for (const int particle : other.sent) out = std::copy_n(sum_[particle].data(), VECTOR, out);
    sending_.emplace_back();
    MPI_Isend(other.out.data(), static_cast<int>(other.out.size()), MPI_FLOAT, other.rank, 0,
              world_, &sending_.back());
  }
}

void SharedParticles::receive(int colour, float *per_particle)
{
  const auto add = [&](int atom, const float *vector) {
    for (int d = 0; d < VECTOR; ++d)
      per_particle[4 * static_cast<std::size_t>(atom) + d] += vector[d];
  };
  if (colour == rank_colour_)
    for (const int particle : several_)
      for (int k = first_atom_[particle]; k < first_atom_[particle + 1]; ++k) {
        Vector of_others;
        for (int d = 0; d < VECTOR; ++d) of_others[d] = sum_[particle][d] - own_[k][d];
        add(atoms_[k], of_others.data());
      }
  for (Other &other : others_) {
    if (other.colour != colour) continue;
    MPI_Recv(other.in.data(), static_cast<int>(other.in.size()), MPI_FLOAT, other.rank, 0, world_,
             MPI_STATUS_IGNORE);
    const float *in = other.in.data();
    for (const int particle : other.received) {
      for (int k = first_atom_[particle]; k < first_atom_[particle + 1]; ++k) add(atoms_[k], in);
      in += VECTOR;
    }
  }
}
