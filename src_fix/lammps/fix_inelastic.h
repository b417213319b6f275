/* -*- c++ -*- ----------------------------------------------------------
   Inelastic contacts between hard spheres by projection of the predicted
   velocity (Faure, Lefebvre-Lepot and Semin, ESAIM: Proceedings 28 (2009) 13;
   Maury, Numer. Math. 102 (2006) 649).

   The physics and the solvers are in ../core. This class holds the rooms in
   which one step is made, and answers LAMMPS's calls.
------------------------------------------------------------------------- */

#ifdef FIX_CLASS
// clang-format off
FixStyle(inelastic,FixInelastic);
// clang-format on
#else

#ifndef LMP_FIX_INELASTIC_H
#define LMP_FIX_INELASTIC_H

#include "atom_state.h"
#include "constraints.h"
#include "contact_output.h"
#include "fix_settings.h"
#include "ghost_exchange.h"
#include "hold_still.h"
#include "law_contacts.h"
#include "motion_check.h"
#include "phase_clock.h"
#include "problem_record.h"
#include "push_apart.h"
#include "region_walls.h"
#include "rest.h"
#include "rigid_motion.h"
#include "run_summary.h"
#include "solver.h"
#include "sphere_motion.h"
#include "squeezed_grains.h"
#include "step.h"
#include "step_length.h"
#include "unsolved_step.h"

#include "fix.h"

#include <memory>
#include <string>
#include <vector>

namespace LAMMPS_NS {

class FixInelastic : public Fix {
 public:
  FixInelastic(class LAMMPS *, int, char **);
  ~FixInelastic() override;

  int setmask() override;
  void init() override;
  void init_list(int, class NeighList *) override;
  void setup_post_neighbor() override;
  void setup(int) override;
  void post_neighbor() override;
  void post_force(int) override;
  void post_run() override;
  void reset_dt() override;

  void grow_arrays(int) override;
  void copy_arrays(int, int, int) override;
  void set_arrays(int) override;
  int pack_exchange(int, double *) override;
  int unpack_exchange(int, double *) override;
  int pack_restart(int, double *) override;
  void unpack_restart(int, int) override;
  int size_restart(int) override;
  int maxsize_restart() override;

  int pack_forward_comm(int, int *, double *, int, int *) override;
  void unpack_forward_comm(int, int, double *) override;
  int pack_reverse_comm(int, int, double *) override;
  void unpack_reverse_comm(int, int *, double *) override;

  double compute_vector(int) override;
  double compute_array(int, int) override;
  int modify_param(int, char **) override;
  void write_restart(FILE *) override;
  void restart(char *) override;
  double memory_usage() override;

 private:
  // In the order in which they need one another.
  Settings settings_;
  PhaseClock clock_;
  Step step_;
  GhostExchange ranks_;
  AtomState state_;
  LawContacts laws_;
  std::unique_ptr<RigidMotion> bodies_;    // null in a scene of free spheres
  SphereMotion spheres_;
  Movers movers_;    // the free spheres, then the bodies
  RegionWalls walls_;
  Constraints constraints_;
  std::unique_ptr<inelastic::Solver> solver_;
  PushApart push_apart_;
  StepLength length_;
  Rest rest_;
  HoldStill hold_still_;
  MotionCheck check_;
  UnsolvedStep unsolved_;
  SqueezedGrains squeezed_;
  ContactOutput output_;
  RunSummary summary_;
  ProblemRecord record_;
  std::string law_in_restart_;    // the law whose memory a restart file holds; empty for none

  void announce_to_lammps();
  void find_lost_memory() const;
  void warn_of_lost_memory() const;
  void begin_run();
  void check_scene();
  void find_frozen();
  void check_group() const;
  void check_run() const;
  void check_volume();
  void begin_summary();
  void advance(int vflag, Kick kick);
  inelastic::ProjectionResult solve();
  void refine(inelastic::ProjectionResult &result);
  void predict();
  inelastic::ProjectionResult project(long max_iterations);
  void finish(const inelastic::ProjectionResult &result);
};

}    // namespace LAMMPS_NS

#endif
#endif
