// The bodies of a fix rigid/small, as the projection needs them: who belongs to which, their
// momenta with all forces that are not contacts, and where exactly a step takes them.
//
// LAMMPS's fix moves the bodies. Here its step is computed beforehand: angular momentum L in the
// space frame, angular velocity w = I^-1 L at the present orientation, and the orientation after the
// step by LAMMPS's Richardson iteration,
//
//   u_1 = |1 + h/2 w|,   u_2 = |1 + h/4 w'| |1 + h/4 w|,   turn = |2 u_2 - u_1|      (quaternions)
//
// where |.| normalises and w' = I^-1 L at the half turn |1 + h/4 w|. After the step LAMMPS's atoms
// have the velocity v + w' x r, so that L cannot be read from them when the three moments differ: it
// is carried along from step to step.

#ifndef INELASTIC_RIGID_MOTION_H
#define INELASTIC_RIGID_MOTION_H

#include "contact_problem.h"
#include "host.h"
#include "molecule_sizes.h"
#include "pointers.h"

#include <array>
#include <string>
#include <vector>

namespace LAMMPS_NS {

class Fix;

class RigidMotion : protected Pointers {
 public:
  enum class Inertia { POINT, SOLID };    // of each sphere: all mass in its centre, or a solid ball

  RigidMotion(class LAMMPS *lmp, std::string fix_id, Inertia inertia);

  // Finds the fix. Errors: there is none, or another style than rigid/small.
  void init();
  Fix *fix() const { return fix_; }

  // Puts the bodies into the problem, all particles of the fix's group: to be called when atoms or
  // copies have changed. Collective. Returns what is wrong on this rank, empty if nothing is: a body
  // of which it sees a part only. Errors: a body that is not all in the group, or holds frozen
  // spheres, and copies that do not reach far enough. `first_of_run`: bodies are counted afresh.
  std::string find_bodies(inelastic::ContactProblem &problem, inelastic::Host &host, int groupbit,
                          int frozen_bit, bool first_of_run);

  // Arms and inertia at the present positions.
  void measure(inelastic::ContactProblem &problem);

  // Compares mass and moments of LAMMPS's bodies with these and says which are otherwise; empty if
  // none of this rank's are.
  std::string disagreement(const inelastic::ContactProblem &problem);

  bool is_member(const inelastic::ContactProblem &problem, int i) const
  { return problem.bodies.body[i] >= 0; }
  bool is_incomplete(int i) const { return incomplete_[i]; }

  // From the centre of mass of its body to a particle; nothing for a free one.
  const double *arm(const inelastic::ContactProblem &problem, int i) const
  {
    static constexpr double NONE[3] = {};
    return is_member(problem, i) ? &problem.bodies.arm[3 * problem.bodies.place[i]] : NONE;
  }

  // Sets the members' predicted velocities, copies included. `kick` is time per mass that turns
  // a force into a velocity. At the start of a run (`carried` false) momenta are the atoms'.
  // `expected` holds, from the column given, the velocity that each atom was predicted to have.
  void predict(inelastic::ContactProblem &problem, inelastic::Host &host, double kick, bool carried,
               const double *const *expected, int column);

  // What the step does with bodies of these velocities (3 per particle): afterwards `motion` is the
  // mean velocity of every particle during the step, free ones included.
  void turn(const inelastic::ContactProblem &problem, const std::vector<double> &velocity);
  const std::vector<double> &motion() const { return motion_; }

  // By how much the step of the last turn() turns the body of a member [radians].
  double angle_turned(const inelastic::ContactProblem &problem, int i) const;
  // The same without the contacts, after predict().
  double angle_predicted(const inelastic::ContactProblem &problem, int i) const;

  // Velocity of a member after the step of the last turn().
  void velocity_after(const inelastic::ContactProblem &problem, int i, double *velocity) const;

  // Takes the part of the members' velocities beyond the predicted ones as a push, which is no
  // momentum.
  void note_push(const inelastic::ContactProblem &problem, const std::vector<double> &velocity);

  // By how much the steps of a run have magnified the round-off of a local atom's position: how fast a
  // body turns, and where to, is known no better than its arms, which may be short.
  double round_off_growth(int i) const
  {
    const double angle = carried_[i].angle;
    return (1.0 + angle) * (1.0 + angle);
  }

  struct Kick {
    double strength;    // time, in units that turn a force into a momentum
    bool whole;         // not the half kick at the start of a run
    bool last;          // of a run: no push stays in the velocities that it leaves behind
  };

  // Adds to the force on a local member what replaces the last step's push by this one's, and keeps
  // both, as well as the angular momentum after the last turn(). `contact_force` (3 per particle)
  // only tells how large the moments were.
  void finish(const inelastic::ContactProblem &problem, int i, const Kick &kick,
              const double *contact_force, double *force);

  // Per atom, travelling with it
  void resize(int atoms) { carried_.resize(atoms, Carried{}); }
  void copy(int from, int to) { carried_[to] = carried_[from]; }
  void forget(int i) { carried_[i] = Carried{}; }
  int pack(int i, double *buffer) const;
  int unpack(int i, const double *buffer);
  // The push in the velocities at a whole step, for restart files.
  static constexpr int HELD_SIZE = 6;
  bool has_held(int i) const;
  void pack_held(int i, double *buffer) const;
  void unpack_held(int i, const double *buffer);
  static constexpr int CARRIED_SIZE = 19;

 private:
  struct Push {
    std::array<double, 3> velocity;    // of the centre of mass
    std::array<double, 3> angular_momentum;
  };
  // Of the atom's body; each of its atoms has a copy.
  struct Carried {
    std::array<double, 3> angular_momentum;    // after the last move, push included
    Push next;                                 // part of the motion after the last move
    Push held;                                 // at whole steps
    // The angular momentum of earlier pushes that is still in the motion: forces on spheres in a line
    // cannot take away what lies along it, until the line has turned.
    std::array<double, 3> left_over;
    double angle;    // the largest one turned in a step of this run, by motion and by moments of
                     // contacts [radians]
  };
  struct Body {
    double mass;
    double inertia[6];          // xx yy zz xy xz yz, about the centre of mass
    double point_inertia[6];    // as if the spheres were point masses ...
    double point_inverse[6];    // ... and its inverse, or pseudo-inverse
    bool collinear;             // the centres of all spheres lie on a line
    double velocity[3];         // predicted
    double angular_momentum[3];
    double turned[4];          // by the step, a quaternion
    double velocity_end[3];    // of the centre of mass
    double angular_momentum_end[3];
    double angular_velocity_end[3];    // as LAMMPS has it after the step
    Push push;
  };

  std::string fix_id_;
  Inertia inertia_;
  Fix *fix_;
  static constexpr int NONE = -1;
  MoleculeSizes molecules_;
  std::vector<int> last_sphere_;    // per molecule: room for find_bodies, NONE between its calls
  std::vector<int> copy_of_;        // per member: which of the body's originals it is
  std::vector<Body> bodies_;        // beside those of the problem
  std::vector<char> incomplete_;    // per particle: of a body of which this rank has only a part
  std::vector<double> motion_;
  std::vector<double> linear_, change_, carried_part_;    // per particle
  std::vector<double> predicted_;                         // per particle
  std::vector<Carried> carried_;                          // per owned atom
  bool pushing_;

  double mass(int i) const;
  double angle_of_first_momentum(const inelastic::ContactProblem &problem, int b) const;
  void count_spheres(int groupbit, int frozen_bit);
  void check_reach(double extent) const;
  std::string explained(const std::string &message, inelastic::Host &host) const;
  void difference(const inelastic::RigidBodies &bodies, std::size_t b, const double *velocity,
                  const double *reference, Push &push) const;
};

}    // namespace LAMMPS_NS

#endif
