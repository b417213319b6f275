// What the solvers need from whatever runs them: the exchange between ranks and global reductions.
// A host with one rank and no periodic images has nothing to do (SerialHost).

#pragma once

#include <vector>

namespace inelastic {

class Host {
 public:
  // Per-particle vectors (3 doubles each; owned particles first, then copies of particles that other
  // ranks own): add the copies' values to their owners, then give every copy its owner's sum.
  virtual void sum_over_copies(double *per_particle) = 0;

  // Whether there are copies at all, on any rank: where not, none need be chosen.
  virtual bool has_copies() const = 0;

  // The same for those copies alone that their rank has chosen, in the last call of choose_copies;
  // the values of the others are neither added nor replaced. Particles have 4 numbers each here, of
  // which the last has no meaning. `chosen` is per particle; what it says of owned ones has none.
  virtual void choose_copies(const std::vector<char> &chosen) = 0;
  virtual void sum_over_chosen_copies(double *per_particle) = 0;
  virtual void sum_over_chosen_copies(float *per_particle) = 0;

  // Per-particle vectors (3 doubles each): give every copy its owner's value. For those who set up
  // a problem: the copies need predicted velocities too.
  virtual void share_with_copies(double *per_particle) = 0;

  // Global sums and global maxima of a few numbers, in one communication.
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
