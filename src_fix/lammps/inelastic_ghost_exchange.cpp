#include "inelastic_ghost_exchange.h"

#include "inelastic_step.h"

#include "atom.h"
#include "comm.h"
#include "error.h"
#include "fix.h"
#include "update.h"

#include <algorithm>

using namespace LAMMPS_NS;
using namespace Inelastic_NS;

namespace {

constexpr int REDUCED_SUMS = 5;
constexpr int REDUCED_MAXIMA = 8;

struct Reduced {
  double sums[REDUCED_SUMS];
  double maxima[REDUCED_MAXIMA];
};

void combine(void *in, void *inout, int *count, MPI_Datatype *)
{
  const auto *from = static_cast<const Reduced *>(in);
  auto *to = static_cast<Reduced *>(inout);
  for (int k = 0; k < *count; ++k) {
    for (int s = 0; s < REDUCED_SUMS; ++s) to[k].sums[s] += from[k].sums[s];
    for (int m = 0; m < REDUCED_MAXIMA; ++m)
      to[k].maxima[m] = std::max(to[k].maxima[m], from[k].maxima[m]);
  }
}

}    // namespace

GhostExchange::GhostExchange(LAMMPS *lmp, Fix *fix, PhaseClock &clock) :
    Pointers(lmp), fix_(fix), clock_(clock), shared_particles_(world)
{
  MPI_Op_create(&combine, 1, &reduction_);
  MPI_Type_contiguous(sizeof(Reduced) / sizeof(double), MPI_DOUBLE, &reduction_type_);
  MPI_Type_commit(&reduction_type_);
}

GhostExchange::~GhostExchange()
{
  MPI_Op_free(&reduction_);
  MPI_Type_free(&reduction_type_);
}

bool GhostExchange::has_ghosts() const
{ return comm->nprocs > 1 || atom->nghost > 0; }

int GhostExchange::rank_colours() const
{ return comm->nprocs > 1 ? 2 : 1; }

// In a grid of ranks those that share a face have different colours, but across a periodic face
// with an odd number of ranks between.
int GhostExchange::rank_colour() const
{
  const bool in_grid = comm->layout != Comm::LAYOUT_TILED;
  const int place = in_grid ? comm->myloc[0] + comm->myloc[1] + comm->myloc[2] : comm->me;
  return comm->nprocs > 1 ? place % 2 : 0;
}

void GhostExchange::sum_over_ghosts(double *per_particle, int numbers)
{
  exchanged_ = per_particle;
  numbers_ = numbers;
  exchange(Exchange::SUMS, true, true);
}

void GhostExchange::sum_over_ranks(double *of_walls, int count)
{
  if (comm->nprocs == 1) return;
  const PhaseClock::Within within(clock_, PhaseClock::COMMUNICATE);
  const std::vector<double> mine(of_walls, of_walls + count);
  MPI_Allreduce(mine.data(), of_walls, count, MPI_DOUBLE, MPI_SUM, world);
}

void GhostExchange::least_over_ghosts(double *per_particle, int numbers)
{
  exchanged_ = per_particle;
  numbers_ = numbers;
  exchange(Exchange::LEAST, true, true);
}

void GhostExchange::share_with_ghosts(double *per_particle, int numbers)
{
  exchanged_ = per_particle;
  numbers_ = numbers;
  exchange(Exchange::SUMS, false, true);
}

void GhostExchange::choose_ghosts(const std::vector<char> &chosen)
{
  chosen_ghosts_.begin(chosen);
  exchange(Exchange::CHOICE, true, false);
}

void GhostExchange::sum_over_chosen_ghosts(double *per_particle)
{
  exchanged_ = per_particle;
  exchange(Exchange::CHOSEN, true, true);
}

void GhostExchange::sum_over_chosen_ghosts(float *per_particle)
{
  exchanged_single_ = per_particle;
  exchange(Exchange::CHOSEN_SINGLE, true, true);
}

void GhostExchange::choose_shared(const std::vector<char> &chosen, bool images)
{
  const PhaseClock::Within within(clock_, PhaseClock::COMMUNICATE);
  std::vector<double> owner(2 * static_cast<std::size_t>(atom->nlocal + atom->nghost));
  for (int i = 0; i < atom->nlocal; ++i) {
    owner[2 * i] = comm->me;
    owner[2 * i + 1] = i;
  }
  share_with_ghosts(owner.data(), 2);
  shared_particles_.choose(chosen, owner, images, rank_colour());
}

void GhostExchange::send(const float *per_particle)
{
  const PhaseClock::Within within(clock_, PhaseClock::COMMUNICATE);
  shared_particles_.send(per_particle);
}

void GhostExchange::receive(int colour, float *per_particle)
{
  const PhaseClock::Within within(clock_, PhaseClock::COMMUNICATE);
  shared_particles_.receive(colour, per_particle);
}

void GhostExchange::gather(FirstGuesses &guesses)
{
  exchanged_guesses_ = &guesses;
  exchange(Exchange::GUESSES, true, false);
}

// A ghost may get more to tell from other ghosts of the same atom while it tells what it has.
void GhostExchange::gather(LawMemory &memory)
{
  if (!has_ghosts()) return;
  exchanged_law_memory_ = &memory;
  while (true) {
    double unsent =
        static_cast<double>(memory.number_unsent(atom->nlocal, atom->nlocal + atom->nghost));
    reduce(&unsent, 1, nullptr, 0);
    if (unsent == 0.0) return;
    exchange(Exchange::LAW_MEMORY, true, false);
  }
}

// In the reverse communication ghosts tell their owned atoms, in the forward communication after it
// owned atoms tell their ghosts.
void GhostExchange::exchange(Exchange what, bool reverse, bool forward)
{
  if (!has_ghosts()) return;
  const PhaseClock::Within within(clock_, PhaseClock::COMMUNICATE);
  exchanging_ = what;
  if (reverse) comm->reverse_comm(fix_);
  if (forward) comm->forward_comm(fix_);
}

int GhostExchange::pack_forward(int n, const int *list, double *buffer) const
{
  if (n == 0) return 0;
  if (exchanging_ == Exchange::CHOSEN) return chosen_ghosts_.pack_owned(list, exchanged_, buffer);
  if (exchanging_ == Exchange::CHOSEN_SINGLE)
    return chosen_ghosts_.pack_owned(list, exchanged_single_, buffer);
  for (int k = 0; k < n; ++k)
    std::copy_n(exchanged_ + numbers_ * list[k], numbers_, buffer + numbers_ * k);
  return numbers_ * n;
}

void GhostExchange::unpack_forward(int n, int first, const double *buffer)
{
  if (n == 0) return;
  if (exchanging_ == Exchange::CHOSEN)
    chosen_ghosts_.set_ghosts(first, buffer, exchanged_);
  else if (exchanging_ == Exchange::CHOSEN_SINGLE)
    chosen_ghosts_.set_ghosts(first, buffer, exchanged_single_);
  else
    std::copy_n(buffer, numbers_ * n, exchanged_ + numbers_ * first);
}

int GhostExchange::pack_reverse(int n, int first, double *buffer)
{
  if (n == 0) return 0;
  switch (exchanging_) {
    case Exchange::GUESSES: {
      int m = 0;
      for (int k = 0; k < n; ++k) m += exchanged_guesses_->pack_message(first + k, buffer + m);
      return m;
    }
    case Exchange::LAW_MEMORY: {
      int m = 0;
      for (int k = 0; k < n; ++k) m += exchanged_law_memory_->pack_unsent(first + k, buffer + m);
      return m;
    }
    case Exchange::CHOICE:
      return chosen_ghosts_.pack_choice(n, first, buffer);
    case Exchange::CHOSEN:
      return chosen_ghosts_.pack_ghosts(first, exchanged_, buffer);
    case Exchange::CHOSEN_SINGLE:
      return chosen_ghosts_.pack_ghosts(first, exchanged_single_, buffer);
    case Exchange::SUMS:
    case Exchange::LEAST:
      break;
  }
  std::copy_n(exchanged_ + numbers_ * first, numbers_ * n, buffer);
  return numbers_ * n;
}

void GhostExchange::unpack_reverse(int n, const int *list, const double *buffer)
{
  if (n == 0) return;
  switch (exchanging_) {
    case Exchange::GUESSES:
      for (int k = 0, m = 0; k < n; ++k) m += exchanged_guesses_->unpack(list[k], buffer + m);
      return;
    case Exchange::LAW_MEMORY:
      for (int k = 0, m = 0; k < n; ++k) m += exchanged_law_memory_->unpack(list[k], buffer + m);
      return;
    case Exchange::CHOICE:
      chosen_ghosts_.unpack_choice(n, list, buffer);
      return;
    case Exchange::CHOSEN:
      chosen_ghosts_.add_to_owned(list, buffer, exchanged_);
      return;
    case Exchange::CHOSEN_SINGLE:
      chosen_ghosts_.add_to_owned(list, buffer, exchanged_single_);
      return;
    case Exchange::LEAST:
    case Exchange::SUMS:
      break;
  }
  const bool sums = exchanging_ == Exchange::SUMS;
  for (int k = 0; k < n; ++k)
    for (int d = 0; d < numbers_; ++d) {
      double &owned = exchanged_[numbers_ * list[k] + d];
      const double told = *buffer++;
      owned = sums ? owned + told : std::min(owned, told);
    }
}

void GhostExchange::reduce(double *sums, int number_of_sums, double *maxima, int number_of_maxima)
{
  // More would be written beyond the message.
  if (number_of_sums > REDUCED_SUMS || number_of_maxima > REDUCED_MAXIMA)
    error->one(FLERR, "Fix inelastic: {} sums and {} maxima are reduced at once, at most {} and {}",
               number_of_sums, number_of_maxima, REDUCED_SUMS, REDUCED_MAXIMA);
  if (comm->nprocs == 1) return;
  const PhaseClock::Within within(clock_, PhaseClock::COMMUNICATE);
  Reduced mine{};
  std::copy_n(sums, number_of_sums, mine.sums);
  std::fill_n(mine.maxima, REDUCED_MAXIMA, -EXTREME);
  std::copy_n(maxima, number_of_maxima, mine.maxima);
  Reduced all{};
  MPI_Allreduce(&mine, &all, 1, reduction_type_, reduction_, world);
  std::copy_n(all.sums, number_of_sums, sums);
  std::copy_n(all.maxima, number_of_maxima, maxima);
}

void GhostExchange::fail_together(const std::string &message)
{
  int speaker = message.empty() ? comm->nprocs : comm->me;
  if (comm->nprocs > 1) {
    const PhaseClock::Within within(clock_, PhaseClock::COMMUNICATE);
    int mine = speaker;
    MPI_Allreduce(&mine, &speaker, 1, MPI_INT, MPI_MIN, world);
  }
  if (speaker == comm->nprocs) return;
  error->all(FLERR, "Fix inelastic: step {}: {}", update->ntimestep, said_by(speaker, message));
}

std::string GhostExchange::said_by(int rank, std::string text) const
{
  int length = static_cast<int>(text.size());
  MPI_Bcast(&length, 1, MPI_INT, rank, world);
  text.resize(length);
  MPI_Bcast(text.data(), length, MPI_CHAR, rank, world);
  return text;
}

int GhostExchange::rank_of_largest(double value, double *largest) const
{
  struct {
    double value;
    int rank;
  } mine = {value, comm->me}, found;
  MPI_Allreduce(&mine, &found, 1, MPI_DOUBLE_INT, MPI_MAXLOC, world);
  *largest = found.value;
  return found.rank;
}

std::vector<double> GhostExchange::gather(std::vector<double> mine) const
{
  int count = static_cast<int>(mine.size());
  std::vector<int> counts(comm->nprocs), offsets(comm->nprocs, 0);
  MPI_Gather(&count, 1, MPI_INT, counts.data(), 1, MPI_INT, 0, world);
  for (int rank = 1; rank < comm->nprocs; ++rank)
    offsets[rank] = offsets[rank - 1] + counts[rank - 1];
  std::vector<double> all(comm->me == 0 ? offsets.back() + counts.back() : 0);
  MPI_Gatherv(mine.data(), count, MPI_DOUBLE, all.data(), counts.data(), offsets.data(), MPI_DOUBLE,
              0, world);
  return all;
}

std::vector<double> GhostExchange::gather_on_all(const std::vector<double> &mine) const
{
  int count = static_cast<int>(mine.size());
  std::vector<int> counts(comm->nprocs), offsets(comm->nprocs, 0);
  MPI_Allgather(&count, 1, MPI_INT, counts.data(), 1, MPI_INT, world);
  for (int rank = 1; rank < comm->nprocs; ++rank)
    offsets[rank] = offsets[rank - 1] + counts[rank - 1];
  std::vector<double> all(offsets.back() + counts.back());
  MPI_Allgatherv(mine.data(), count, MPI_DOUBLE, all.data(), counts.data(), offsets.data(),
                 MPI_DOUBLE, world);
  return all;
}
