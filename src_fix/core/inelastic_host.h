// The communication that the solvers need from the program that runs them: the exchange of values
// between ranks and global reductions.
//
// A rank holds the particles that it owns and, behind them, ghosts: particles that other ranks own,
// and periodic images of its own. Every function but `send` and `receive` is collective: all ranks
// call it together. A host with one rank and without periodic images has nothing to do
// (SerialHost).

#pragma once

#include <vector>

namespace inelastic {

class Host {
 public:
  // At most so many numbers per particle, in the functions below that take them.
  static constexpr int MOST_NUMBERS = 6;

  // Adds the values of all ghosts of a particle to its owner's, then gives the sum to every ghost,
  // for each of some numbers per particle.
  virtual void sum_over_ghosts(double *per_particle, int numbers) = 0;

  // Returns whether any rank has ghosts. If none has, choose_ghosts need not be called.
  virtual bool has_ghosts() const = 0;

  // Ranks that share particles may work on them one after the other: rank_colours() is 1 or 2, the
  // same on all ranks, and rank_colour() that of this rank, from 0 on. Most neighbours should have
  // different colours.
  virtual int rank_colours() const = 0;
  virtual int rank_colour() const = 0;

  // Chooses the ghosts for sum_over_chosen_ghosts. `chosen` has one entry per slot; the entries of
  // owned particles are not read, and those of walls have no meaning.
  virtual void choose_ghosts(const std::vector<char> &chosen) = 0;

  // Replaces numbers that every rank has of the walls (inelastic_unknowns.h) by their sums over all
  // ranks. It is called in scenes alone in which contacts move a wall.
  virtual void sum_over_ranks(double *of_walls, int count) = 0;

  // Does the same as sum_over_ghosts, but for the chosen ghosts alone: the values of all other
  // ghosts are neither added nor replaced. There are 4 numbers per particle, and the fourth has no
  // meaning.
  virtual void sum_over_chosen_ghosts(double *per_particle) = 0;
  virtual void sum_over_chosen_ghosts(float *per_particle) = 0;

  // Chooses the particles that send() and receive(), which are not collective, serve. `chosen` has
  // one entry per slot; those of walls have no meaning. With `images` several slots that a rank has
  // of one particle receive from one another, too. Collective.
  virtual void choose_shared(const std::vector<char> &chosen, bool images) = 0;

  // Sends a vector per slot to all other ranks that have chosen its particle: 4 numbers per
  // particle, of which the fourth has no meaning. Does not wait for them.
  virtual void send(const float *per_particle) = 0;

  // Adds to each chosen slot what the ranks of a colour have sent of its particle, once each, and
  // nothing that the slot has sent itself. Waits for what has not arrived yet: each rank sends as
  // often as all others receive from its colour.
  virtual void receive(int colour, float *per_particle) = 0;

  // Gives every ghost the values of its owner. Programs that set up a problem need it: the ghosts
  // must have predicted velocities too.
  virtual void share_with_ghosts(double *per_particle, int numbers) = 0;

  // Replaces a few numbers by their sums over all ranks and others by their maxima, in one
  // communication.
  virtual void reduce(double *sums, int number_of_sums, double *maxima, int number_of_maxima) = 0;

 protected:
  ~Host() = default;    // not virtual: hosts are never owned through this interface
};

class SerialHost final : public Host {
 public:
  void sum_over_ghosts(double *, int) override {}
  void sum_over_ranks(double *, int) override {}
  bool has_ghosts() const override { return false; }
  int rank_colours() const override { return 1; }
  int rank_colour() const override { return 0; }
  void choose_ghosts(const std::vector<char> &) override {}
  void sum_over_chosen_ghosts(double *) override {}
  void sum_over_chosen_ghosts(float *) override {}
  void choose_shared(const std::vector<char> &, bool) override {}
  void send(const float *) override {}
  void receive(int, float *) override {}
  void share_with_ghosts(double *, int) override {}
  void reduce(double *, int, double *, int) override {}
};

}    // namespace inelastic
