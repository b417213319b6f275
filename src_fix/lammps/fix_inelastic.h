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

#include "inelastic_atom_state.h"
#include "inelastic_constraints.h"
#include "inelastic_contact_output.h"
#include "inelastic_ghost_exchange.h"
#include "inelastic_law_contacts.h"
#include "inelastic_motion_check.h"
#include "inelastic_phase_clock.h"
#include "inelastic_region_walls.h"
#include "inelastic_rest.h"
#include "inelastic_restart_files.h"
#include "inelastic_rigid_motion.h"
#include "inelastic_run_summary.h"
#include "inelastic_settings.h"
#include "inelastic_sphere_motion.h"
#include "inelastic_step.h"
#include "inelastic_step_length.h"
#include "inelastic_step_trials.h"
#include "inelastic_unrest.h"

#include "fix.h"

#include <memory>
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
  Inelastic_NS::Settings settings_;
  Inelastic_NS::PhaseClock clock_;
  Inelastic_NS::Step step_;
  Inelastic_NS::GhostExchange ranks_;
  Inelastic_NS::AtomState state_;
  Inelastic_NS::LawContacts laws_;
  std::unique_ptr<Inelastic_NS::RigidMotion> bodies_;    // null in a scene of free spheres
  Inelastic_NS::SphereMotion spheres_;
  Inelastic_NS::Movers movers_;    // the free spheres, then the bodies
  Inelastic_NS::RegionWalls walls_;
  Inelastic_NS::Constraints constraints_;
  Inelastic_NS::StepLength length_;
  Inelastic_NS::RestartFiles files_;
  Inelastic_NS::Rest rest_;
  Inelastic_NS::MotionCheck check_;
  Inelastic_NS::ContactOutput output_;
  Inelastic_NS::Unrest unrest_;
  Inelastic_NS::RunSummary summary_;
  Inelastic_NS::StepTrials trials_;

  void announce_to_lammps();
  void begin_run();
  void check_scene();
  void find_frozen();
  void check_group() const;
  void check_run() const;
  void check_volume();
  void begin_summary();
  void advance(int vflag, Inelastic_NS::Kick kick);
  void predict();
  void finish(const inelastic::ProjectionResult &result);
};

}    // namespace LAMMPS_NS

#endif
#endif
