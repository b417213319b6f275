// The keywords of fix inelastic, read once when the fix is defined.

#ifndef INELASTIC_SETTINGS_H
#define INELASTIC_SETTINGS_H

#include "inelastic_contact_law.h"
#include "inelastic_lammps_versions.h"

#include <memory>
#include <string>
#include <vector>

namespace LAMMPS_NS {
class LAMMPS;
}

namespace LAMMPS_NS::Inelastic_NS {

// The mass of each sphere of a body: all of it in the centre, or that of a solid ball.
enum class Inertia { POINT, SOLID };

struct Settings {
  // EPS, the largest overlap allowed [length]. It must be above the round-off of positions. Errors
  // of velocities are bounded by the accuracy.
  double tolerance = 0.0;
  // A: a step is solved to this fraction of what contacts change in it, where that is below EPS.
  double accuracy = 1.0e-3;
  // The name that make_solver() of the core knows.
  std::string solver = "sweeps";
  // Iterations in one time step. Beyond, the run stops, or goes on with a warning.
  long max_iterations = 100000;
  bool warn_only = false;
  // A step may be made shorter than `timestep` where the whole step leaves an overlap.
  bool shorten = false;
  // Particles that their contacts hold come to rest (inelastic_rest.h).
  bool rest = true;
  // Locked bodies are taken apart while a run pushes a start apart (inelastic_locked_bodies.h).
  bool unlock = false;
  // The group of the fix, and the group of spheres that nothing moves (0 = none).
  int group_bit = 0;
  std::string frozen_group;    // empty: there is none
  int frozen_bit = 0;
  // Regions whose surfaces are walls, in the order in which the walls are numbered.
  std::vector<std::string> regions;
  // The fix rigid/small whose bodies take part; empty in a scene of free spheres.
  std::string rigid_fix;
  Inertia inertia = Inertia::POINT;
  // The contact law, and the words that name it; null for the inelastic one.
  std::unique_ptr<inelastic::ContactLaw> law;
  std::string law_words;
  // File name with a *, and the number of steps between two records (0 = no records).
  std::string record_file;
  int record_every = 0;

  bool has_bodies() const { return !rigid_fix.empty(); }
};

// Reads `fix ID group inelastic EPS keyword value ...`. Errors: what LAMMPS cannot read, and values
// that are not allowed.
Settings read_settings(LAMMPS *lmp, int narg, char **arg, int group_bit);

// Reads EPS [length]. Errors: anything but a finite number greater than 0, which the error points
// to if it knows the argument's index.
double read_tolerance(LAMMPS *lmp, const char *text, int argument = NO_WORD);

// Reads the accuracy in the same way. Errors: anything but a number greater than 0 and at most 1.
double read_accuracy(LAMMPS *lmp, const char *text, int argument = NO_WORD);

}    // namespace LAMMPS_NS::Inelastic_NS

#endif
