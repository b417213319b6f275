#include "inelastic_told_particles.h"

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <tuple>

using namespace LAMMPS_NS;
using namespace Inelastic_NS;

namespace {

// An atom that has chosen an owned particle: the particle's place, the rank that has the atom, and
// its place there.
using Copy = std::tuple<int, int, int>;

constexpr int VECTOR = 3;    // numbers

}    // namespace

ToldParticles::ToldParticles(MPI_Comm world)
{
  // Messages of others never come between.
  MPI_Comm_dup(world, &world_);
  MPI_Comm_rank(world_, &me_);
  MPI_Comm_size(world_, &ranks_);
}

ToldParticles::~ToldParticles()
{
  finish_telling();
  MPI_Comm_free(&world_);
}

// Sends each rank its list, and returns the lists from all of them.
ToldParticles::Lists ToldParticles::exchange(const Lists &to_ranks) const
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

// Returns, of the particles that this rank owns, for each rank what it tells: triples of its atom,
// another rank that has chosen this particle, and that one's atom.
ToldParticles::Lists ToldParticles::copies_of_owned(const std::vector<char> &chosen,
                                                    const std::vector<double> &owner) const
{
  Lists to_owners(ranks_);
  for (std::size_t i = 0; 3 * i < owner.size(); ++i) {
    if (!chosen[i]) continue;
    std::vector<int> &list = to_owners[static_cast<int>(owner[3 * i])];
    list.push_back(static_cast<int>(owner[3 * i + 1]));
    list.push_back(static_cast<int>(i));
  }
  const Lists from_ranks = exchange(to_owners);
  std::vector<Copy> copies;
  for (int rank = 0; rank < ranks_; ++rank)
    for (std::size_t k = 0; k < from_ranks[rank].size(); k += 2)
      copies.emplace_back(from_ranks[rank][k], rank, from_ranks[rank][k + 1]);
  std::sort(copies.begin(), copies.end());
  Lists tell(ranks_);
  for (auto begin = copies.begin(); begin != copies.end();) {
    const auto end = std::find_if(begin, copies.end(), [&](const Copy &copy) {
      return std::get<0>(copy) != std::get<0>(*begin);
    });
    for (auto from = begin; from != end; ++from)
      for (auto to = begin; to != end; ++to)
        if (to != from)
          for (const int number : {std::get<2>(*from), std::get<1>(*to), std::get<2>(*to)})
            tell[std::get<1>(*from)].push_back(number);
    begin = end;
  }
  return tell;
}

void ToldParticles::choose(const std::vector<char> &chosen, const std::vector<double> &owner,
                           bool images, int turn)
{
  finish_telling();
  others_.clear();
  images_.clear();
  turn_ = turn;
  Lists told(ranks_), names(ranks_);    // the atoms of this rank, and those of the others
  for (const std::vector<int> &list : exchange(copies_of_owned(chosen, owner)))
    for (std::size_t k = 0; k < list.size(); k += 3) {
      const int mine = list[k], rank = list[k + 1], other = list[k + 2];
      if (rank == me_) {
        if (images) images_.push_back({mine, other, {}});
        continue;
      }
      // The first number of a list is this rank's turn.
      if (names[rank].empty()) names[rank].push_back(turn);
      told[rank].push_back(mine);
      names[rank].push_back(other);
    }
  const Lists heard = exchange(names);
  for (int rank = 0; rank < ranks_; ++rank) {
    if (heard[rank].empty()) continue;
    Other other{rank, heard[rank].front(), told[rank], {}, {}, {}};
    other.heard.assign(heard[rank].begin() + 1, heard[rank].end());
    other.out.resize(VECTOR * other.told.size());
    other.in.resize(VECTOR * other.heard.size());
    others_.push_back(std::move(other));
  }
}

void ToldParticles::finish_telling()
{
  for (MPI_Request &request : telling_) MPI_Wait(&request, MPI_STATUS_IGNORE);
  telling_.clear();
}

void ToldParticles::tell(const float *per_particle)
{
  finish_telling();
  for (OfImage &image : images_)
    std::copy_n(per_particle + 4 * static_cast<std::size_t>(image.told), VECTOR,
                image.vector.data());
  for (Other &other : others_) {
    float *out = other.out.data();
    for (const int i : other.told)
      out = std::copy_n(per_particle + 4 * static_cast<std::size_t>(i), VECTOR, out);
    telling_.emplace_back();
    MPI_Isend(other.out.data(), static_cast<int>(other.out.size()), MPI_FLOAT, other.rank, 0,
              world_, &telling_.back());
  }
}

void ToldParticles::hear(int turn, float *per_particle)
{
  const auto add = [&](int atom, const float *vector) {
    for (int d = 0; d < VECTOR; ++d)
      per_particle[4 * static_cast<std::size_t>(atom) + d] += vector[d];
  };
  if (turn == turn_)
    for (const OfImage &image : images_) add(image.heard, image.vector.data());
  for (Other &other : others_) {
    if (other.turn != turn) continue;
    MPI_Recv(other.in.data(), static_cast<int>(other.in.size()), MPI_FLOAT, other.rank, 0, world_,
             MPI_STATUS_IGNORE);
    const float *in = other.in.data();
    for (const int i : other.heard) {
      add(i, in);
      in += VECTOR;
    }
  }
}
