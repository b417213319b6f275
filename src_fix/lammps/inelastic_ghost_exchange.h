// Ranks talk to one another here: the forward and reverse communication of ghosts that the core's
// solvers need (inelastic_host.h), global sums and maxima, and errors, which all ranks give
// together.

#ifndef INELASTIC_GHOST_EXCHANGE_H
#define INELASTIC_GHOST_EXCHANGE_H

#include "inelastic_chosen_ghosts.h"
#include "inelastic_first_guess.h"
#include "inelastic_host.h"
#include "inelastic_law_memory.h"
#include "inelastic_phase_clock.h"
#include "inelastic_shared_particles.h"

#include "pointers.h"

#include <algorithm>
#include <string>
#include <vector>

namespace LAMMPS_NS {
class Fix;
}

namespace LAMMPS_NS::Inelastic_NS {

class GhostExchange final : public inelastic::Host, protected Pointers {
 public:
  // LAMMPS's communication calls back the pack and unpack functions of a fix, which must call those
  // below.
  GhostExchange(class LAMMPS *lmp, Fix *fix, PhaseClock &clock);
  ~GhostExchange() override;
  GhostExchange(const GhostExchange &) = delete;
  GhostExchange &operator=(const GhostExchange &) = delete;

  // The largest messages, in numbers per atom: LAMMPS sizes its buffers by these.
  static constexpr int FORWARD_SIZE = MOST_NUMBERS;
  static constexpr int REVERSE_SIZE =
      std::max(FirstGuesses::packed_size(FirstGuesses::ENTRIES_PER_MESSAGE),
               LawMemory::packed_size(LawMemory::ENTRIES_PER_MESSAGE));
  static_assert(REVERSE_SIZE >= MOST_NUMBERS);

  void sum_over_ghosts(double *per_particle, int numbers) override;
  void sum_over_ranks(double *of_walls, int count) override;
  void choose_ghosts(const std::vector<char> &chosen) override;
  void sum_over_chosen_ghosts(double *per_particle) override;
  void sum_over_chosen_ghosts(float *per_particle) override;
  void choose_shared(const std::vector<char> &chosen, bool images) override;
  void send(const float *per_particle) override;
  void receive(int colour, float *per_particle) override;
  void share_with_ghosts(double *per_particle, int numbers) override;
  void reduce(double *sums, int number_of_sums, double *maxima, int number_of_maxima) override;
  bool has_ghosts() const override;
  int rank_colours() const override;
  int rank_colour() const override;

  // Gives an owned atom and all its ghosts the least of their values. Collective.
  void least_over_ghosts(double *per_particle, int numbers);

  // Adds to each owned atom the contacts that its ghosts remember.
  void gather(FirstGuesses &guesses);
  void gather(LawMemory &memory);

  int pack_forward(int n, const int *list, double *buffer) const;
  void unpack_forward(int n, int first, const double *buffer);
  int pack_reverse(int n, int first, double *buffer);
  void unpack_reverse(int n, const int *list, const double *buffer);

  // Collective: an error of all ranks, with the message of the first rank that has one; nothing if
  // all messages are empty.
  void fail_together(const std::string &message);

  // Collective: the text of one of the ranks.
  std::string said_by(int rank, std::string text) const;

  // Collective: the rank whose value is largest.
  int rank_of_largest(double value, double *largest) const;

  // Collective: the values of all ranks one after the other, on rank 0; nothing on other ranks.
  std::vector<double> gather(std::vector<double> mine) const;
  // The same on every rank.
  std::vector<double> gather_on_all(const std::vector<double> &mine) const;

 private:
  // The pack and unpack functions work on one of these.
  enum class Exchange { SUMS, LEAST, GUESSES, LAW_MEMORY, CHOICE, CHOSEN, CHOSEN_SINGLE };

  void exchange(Exchange what, bool reverse, bool forward);

  Fix *fix_;
  PhaseClock &clock_;
  MPI_Op reduction_;
  MPI_Datatype reduction_type_;
  Exchange exchanging_ = Exchange::SUMS;
  double *exchanged_ = nullptr;          // SUMS, LEAST, CHOSEN
  int numbers_ = 3;                      // per particle; CHOSEN: 4
  float *exchanged_single_ = nullptr;    // 4 numbers per particle
  FirstGuesses *exchanged_guesses_ = nullptr;
  LawMemory *exchanged_law_memory_ = nullptr;
  ChosenGhosts chosen_ghosts_;
  SharedParticles shared_particles_;
};

}    // namespace LAMMPS_NS::Inelastic_NS

#endif
