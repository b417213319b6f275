// The communication that the solvers need from the program that runs them: the exchange of values
// between ranks and global reductions.
//
// A rank holds the particles that it owns and, behind them, copies of particles (LAMMPS calls them
// ghosts): of particles that other ranks own, and periodic images of its own. Every function is
// collective: all ranks call it together. A host with one rank and without periodic images has
// nothing to do (SerialHost).

#pragma once

#include <vector>

namespace inelastic {

class Host {
 public:
  // Adds the values of all copies of a particle to its owner's, then gives the sum to every copy.
  // There are 3 numbers per particle.
  virtual void sum_over_copies(double *per_particle) = 0;

  // Returns whether any rank has copies. If none has, choose_copies need not be called.
  virtual bool has_copies() const = 0;

  // Chooses the copies for sum_over_chosen_copies. `chosen` has one entry per particle; the entries
  // of owned particles are not read.
  virtual void choose_copies(const std::vector<char> &chosen) = 0;

  // Does the same as sum_over_copies, but for the chosen copies alone: the values of all other
  // copies are neither added nor replaced. There are 4 numbers per particle, and the fourth has no
  // meaning.
  virtual void sum_over_chosen_copies(double *per_particle) = 0;
  virtual void sum_over_chosen_copies(float *per_particle) = 0;

  // Gives every copy the value of its owner, 3 numbers per particle. Programs that set up a problem
  // need it: the copies must have predicted velocities too.
  virtual void share_with_copies(double *per_particle) = 0;

  // Replaces a few numbers by their sums over all ranks and others by their maxima, in one
  // communication.
  virtual void reduce(double *sums, int number_of_sums, double *maxima, int number_of_maxima) = 0;

 protected:
  ~Host() = default;    // not virtual: hosts are never owned through this interface
};

class SerialHost final : public Host {
 public:
  void sum_over_copies(double *) override {}
  bool has_copies() const override { return false; }
  void choose_copies(const std::vector<char> &) override {}
  void sum_over_chosen_copies(double *) override {}
  void sum_over_chosen_copies(float *) override {}
  void share_with_copies(double *) override {}
  void reduce(double *, int, double *, int) override {}
};

}    // namespace inelastic
