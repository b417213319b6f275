// Mass and moments of inertia of bodies at the present positions of their spheres, and whether
// LAMMPS's own bodies have the same.

#ifndef INELASTIC_BODY_INERTIA_H
#define INELASTIC_BODY_INERTIA_H

#include "inelastic_contact_problem.h"
#include "inelastic_settings.h"

#include "pointers.h"

#include <string>
#include <vector>

namespace LAMMPS_NS::Inelastic_NS {

constexpr double SPHERE_MOMENT = 0.4;    // of a solid ball, in m R^2

// Symmetric matrices are xx yy zz xy xz yz.
struct BodyInertia {
  double mass;
  double inertia[6];          // about the centre of mass
  double point_inertia[6];    // as if the spheres were point masses ...
  double point_inverse[6];    // ... and its inverse, or pseudo-inverse
  bool collinear;             // the centres of all spheres lie on a line
};

class BodyInertias : protected Pointers {
 public:
  BodyInertias(class LAMMPS *lmp, Inertia kind) : Pointers(lmp), kind_(kind) {}

  const BodyInertia &operator[](std::size_t body) const { return inertias_[body]; }
  Inertia kind() const { return kind_; }

  // Sets arms, inverse masses and inverse inertias of the problem's bodies. `original_of` tells of
  // each member which of its body's originals it is.
  void measure(inelastic::ContactProblem &problem, const std::vector<int> &original_of);

  // Compares mass and moments of the bodies of a fix rigid/small with these. Says which are
  // otherwise; empty if none of this rank's are.
  std::string disagreement(const inelastic::ContactProblem &problem, const std::string &fix_id);

 private:
  void measure_masses(inelastic::RigidBodies &bodies, std::size_t b);
  std::string compare(const inelastic::ContactProblem &problem, const std::string &fix_id, int i,
                      int b, double mass, const double *moments) const;
  std::string other_moments(const inelastic::RigidBodies &bodies, const std::string &fix_id, int i,
                            int b, const double *moments) const;

  Inertia kind_;
  std::vector<BodyInertia> inertias_;    // beside the bodies of the problem
};

}    // namespace LAMMPS_NS::Inelastic_NS

#endif
