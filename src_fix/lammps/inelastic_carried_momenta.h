// These are the momenta that the steps of bodies carry along, kept per atom so that they follow the
// atoms: every atom of a body has a copy of its body's values.

#ifndef INELASTIC_CARRIED_MOMENTA_H
#define INELASTIC_CARRIED_MOMENTA_H

#include <array>
#include <vector>

namespace LAMMPS_NS::Inelastic_NS {

// A motion that takes a bad overlap apart and is no momentum.
struct Push {
  std::array<double, 3> velocity;    // of the centre of mass
  std::array<double, 3> angular_momentum;
};

struct Carried {
  std::array<double, 3> angular_momentum;    // after the last move, push included
  Push next;                                 // part of the motion after the last move
  Push included;                             // part of the velocities at whole steps
  // The angular momentum of earlier pushes that is still in the motion: forces on spheres in a line
  // cannot take away its part along the line, until the line has turned.
  std::array<double, 3> left_over;
  // [radians] The largest one turned in a step of this run, by motion and by moments of contacts.
  double angle;
  // Whether the body has made a step, so that the momenta above are known. Of a new body velocities
  // alone are known.
  bool continues;
};

class CarriedMomenta {
 public:
  Carried &operator[](int i) { return carried_[i]; }
  const Carried &operator[](int i) const { return carried_[i]; }

  void resize(int atoms) { carried_.resize(atoms, Carried{}); }
  void copy(int from, int to) { carried_[to] = carried_[from]; }
  void forget(int i) { carried_[i] = Carried{}; }

  // Each returns how many numbers it wrote or read.
  static constexpr int PACKED_SIZE = 20;
  int pack(int i, double *buffer) const;
  int unpack(int i, const double *buffer);

  // The push in the velocities at a whole step, for restart files.
  static constexpr int INCLUDED_SIZE = 6;
  bool has_included(int i) const;
  void pack_included(int i, double *buffer) const;
  void unpack_included(int i, const double *buffer);

  // Returns the factor by which the steps of a run have magnified the round-off of a local atom's
  // position: the rotation of a body is known no better than its arms, which may be short.
  double round_off_growth(int i) const
  {
    const double angle = carried_[i].angle;
    return (1.0 + angle) * (1.0 + angle);
  }

 private:
  std::vector<Carried> carried_;    // per owned atom
};

}    // namespace LAMMPS_NS::Inelastic_NS

#endif
