/* -*- c++ -*- ----------------------------------------------------------
   Inelastic contacts between hard spheres by projection of the predicted
   velocity (Faure, Lefebvre-Lepot and Semin, ESAIM: Proceedings 28 (2009) 13;
   Maury, Numer. Math. 102 (2006) 649).

   The physics and the solvers are in ../core; this fix parses, collects the
   contacts, calls the core, adds the contact forces and reports.
------------------------------------------------------------------------- */

#ifdef FIX_CLASS
// clang-format off
FixStyle(inelastic,FixInelastic);
// clang-format on
#else

#ifndef LMP_FIX_INELASTIC_H
#define LMP_FIX_INELASTIC_H

#include "chosen_copies.h"
#include "contact_memory.h"
#include "fix.h"
#include "host.h"
#include "phase_clock.h"
#include "projection.h"
#include "region_walls.h"
#include "rigid_motion.h"
#include "scene_check.h"

#include <cstdint>
#include <memory>
#include <string>
#include <unordered_map>
#include <unordered_set>
#include <vector>

namespace LAMMPS_NS {

class FixInelastic : public Fix, private inelastic::Host, private inelastic::ConstraintSource {
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
  // Settings
  double tolerance_;    // eps, the largest overlap allowed [length]
  std::string solver_name_;
  long max_iterations_;
  bool warn_only_;
  bool shorten_;
  int frozen_bit_;
  std::string record_file_;
  int record_every_;

  // What the core works on
  std::unique_ptr<inelastic::Solver> solver_;
  inelastic::ContactProblem problem_;
  std::vector<double> velocity_;    // the projection, 3 per atom, copies included
  std::unique_ptr<RegionWalls> walls_;
  std::unique_ptr<RigidMotion> rigid_;    // null in a scene of free spheres
  SceneCheck scene_;
  bool first_list_of_run_;
  class NeighList *list_;

  // Beside each constraint of problem_.contacts
  struct Origin {
    int wall;                 // 0 = two particles, otherwise the wall's number
    double gap_now;           // at the present positions
    double size;              // sum of the radii; the radius at a wall
    double wall_motion;       // by how much the wall closes the gap during the step
    bool followed = false;    // its gap was set by where a step ends
  };
  std::vector<Origin> origin_;
  std::vector<char> listed_pair_taken_;    // per pair of the neighbour list: is it in the problem?
  std::unordered_map<std::uint64_t, std::size_t> wall_constraint_;    // atom and wall -> constraint
  struct NearPair {
    std::size_t slot;    // in listed_pair_taken_
    int first, second;
  };
  std::vector<NearPair> near_pairs_;    // when all pairs were looked at ...
  bool looked_;                         // ... in this step, ...
  std::vector<double> velocity_looked_at_, motion_looked_at_;    // ... with these
  std::vector<RegionWalls::Look> looks_;                         // room for them
  std::vector<double> clear_of_walls_;    // per local atom: in this step no wall is as near as this
  double margin_;               // what comes closer than this is in the problem from the start
  bool came_back_;              // for constraints that were not in the problem from the start
  bool relinearised_;           // about the end of the step, any of them ...
  bool solved_relinearised_;    // ... before the last solve
  int relinearisations_;        // in this step
  std::string message_;         // what went wrong on this rank while collecting
  std::string worst_;           // the constraint that is farthest from being met, after a failure

  // A bad start: overlaps beyond the regular ones are first treated as touching, then pushed apart.
  enum class Phase { CONTACT, PUSH };
  Phase phase_;
  bool bad_overlap_;
  bool pushed_before_;    // in the step before
  // The largest overlap that the last step may have left behind; infinite where one may have left any.
  double left_overlap_;
  double unexpected_overlap_;    // the largest that no step has left, at the start of this one
  std::string unexpected_;       // who overlaps so
  std::unordered_set<std::uint64_t> entangled_;    // pairs of bodies, deep in one another

  // Per atom, travelling with it. PUSH: the part of its velocity that is no momentum, after the
  // last move (NEXT) and at whole steps (HELD).
  enum StateColumn {
    EXPECTED_X = 0,
    EXPECTED_V = 3,
    PUSH_NEXT = 6,
    PUSH_HELD = 9,
    EXPECTED_RADIUS = 12,
    STATE_SIZE = 13
  };
  double **state_;
  ContactMemory memory_;

  // The neighbour list's reach
  double largest_radius_;
  bool one_cutoff_;           // the list is by one cutoff for all pairs, not by their radii
  double list_reach_;         // gap beyond which a pair may be missing from a fresh list
  double spread_at_start_;    // largest relative displacement since the list was built
  double growth_;             // of a radius since then
  double strayed_;            // largest displacement since then, of the width that a rank owns
  double own_width_[3];       // of the box, by this rank; no limit where nothing is beyond
  // Of the box, in each direction: LAMMPS loses an atom that goes further between two lists.
  double farthest_[3];
  std::vector<double> position_at_build_, radius_at_build_, displacement_, unhindered_;

  double regular_timestep_;    // as the deck sets it
  bool setting_timestep_;      // the fix itself is changing it
  bool expecting_;             // state_ holds a prediction to compare with
  bool goes_on_;               // between setup and the end of the run
  bool ended_pushing_;     // what the end of the last run took out of velocities is missing there
  double kick_;            // time for which the force acts before the next move
  double largest_kick_;    // [velocity] that one of the last contacts gave, on any rank

  // Output
  enum Output {
    ITERATIONS,
    FEASIBILITY,
    COMPLEMENTARITY,
    OVERLAP,
    PARTICLE_CONTACTS,
    WALL_CONTACTS,
    CONSTRAINTS,
    ROUNDS,
    TOTAL_ITERATIONS,
    SHORTENED_STEPS,
    EXCESS,
    OUTPUT_SIZE
  };
  double output_[OUTPUT_SIZE];
  std::vector<double> contact_force_, contact_count_;    // 3 per atom, copies included
  std::vector<double> virial_diagonal_, virial_off_diagonal_;
  std::vector<double> wall_force_;    // on each wall, this rank's share
  std::vector<double> wall_force_total_;
  bigint wall_force_step_;
  int max_atoms_;
  int max_contacts_;

  // Summary of a run
  double run_iterations_, run_largest_overlap_, run_largest_excess_;
  double run_deepest_start_;    // of the overlaps that were pushed apart
  long run_steps_, run_unconverged_, run_shortened_, run_pushed_, run_unexpected_;
  double run_constraint_iterations_;    // constraints of this rank, once for each iteration
  PhaseClock clock_;

  // Communication
  // What pack and unpack work on.
  enum class Exchange { VECTORS, MEMORY, CHOICE, CHOSEN, CHOSEN_SINGLE };
  MPI_Op reduction_;
  MPI_Datatype reduction_type_;
  Exchange exchanging_;
  double *exchanged_;          // VECTORS: 3 numbers per particle; CHOSEN: 4
  float *exchanged_single_;    // 4 numbers per particle
  ChosenCopies chosen_copies_;

  // Host
  void sum_over_copies(double *) override;
  void choose_copies(const std::vector<char> &) override;
  void sum_over_chosen_copies(double *) override;
  void sum_over_chosen_copies(float *) override;
  void share_with_copies(double *) override;
  void reduce(double *, int, double *, int) override;
  bool has_copies() const override;
  void exchange(Exchange what, bool reverse, bool forward);

  // ConstraintSource
  long refine(const std::vector<double> &, inelastic::ContactProblem &) override;

  // One step
  void advance(int vflag, double kick_steps);
  std::string break_in_run();
  std::string not_finite(double kick_steps) const;
  void check_expected();
  void check_volume();
  void predict(double kick_steps);
  void collect();
  inelastic::ProjectionResult project(long max_iterations);
  void push_apart(inelastic::ProjectionResult &);
  void find_entangled();
  bool is_entangled(int i, int j) const;
  void disentangle(std::size_t c);
  std::uint64_t pair_of_bodies(int i, int j) const;
  void apply_forces(double kick_steps);
  void update_outputs(const inelastic::ProjectionResult &);
  void remember_contacts();
  void log_run() const;
  void log_times() const;
  void record_problem(const inelastic::ProjectionResult &);

  // Constraints
  // Mean velocity of every particle during the step: bodies turn.
  const std::vector<double> &motion() const { return rigid_ ? rigid_->motion() : velocity_; }
  bool is_member(int i) const { return rigid_ && rigid_->is_member(problem_, i); }
  template <typename Visitor> void for_each_listed_pair(Visitor &&) const;
  void collect_pairs();
  void collect_walls();
  void take_pair(std::size_t slot, int i, int j);
  void take_wall(const RegionWalls::Look &, const WallView &);
  long add_violated_pairs(const std::vector<double> &velocity);
  double change_since_look(const std::vector<double> &velocity) const;
  long add_violated_walls(const std::vector<double> &velocity);
  long relinearise_pairs(const std::vector<double> &velocity);
  long relinearise_walls(const std::vector<double> &velocity);
  std::vector<RegionWalls::Look> last_inside(const std::vector<RegionWalls::Look> &beyond);
  const std::vector<RegionWalls::Look> &looks(const double *velocity, double beyond);
  const std::vector<RegionWalls::Look> &looks_at_end(const std::vector<double> &velocity);
  long follow_unseen(const std::vector<double> &velocity,
                     const std::unordered_set<std::size_t> &seen,
                     const std::vector<RegionWalls::Look> &beyond);
  bool same_plane(std::size_t c, const double *normal) const;
  double effective_gap(double gap_now, double size) const;
  double wanted_gap(double gap_now, double size) const;
  bool ends_too_deep(double gap_now, double size, double gap_at_end);
  long follow(std::size_t c, double exact_gap, bool too_deep);
  bool is_bad(double gap) const;
  void note_overlap(double gap, int i, tagint partner);
  void warn_of_unexpected_overlap();
  void begin_summary();
  std::uint64_t wall_key(int i, int wall) const
  { return static_cast<std::uint64_t>(i) * (walls_->number_of_walls() + 1) + wall; }

  // Reach and time step
  double spread(const double *values);
  double spread_since_build(const double *motion);
  bool list_reaches(const std::vector<double> &motion);
  double room_in_list(double none, double whole) const;
  void measure_farthest();
  double part_of_farthest();
  double unhindered_spread(double kick_steps);
  void shorten_step(double factor);
  void set_timestep(double timestep);
  void restore_timestep();

  void tally_virial(int i, int j, const double *virial);
  void share_virial();
  void note_worst(const inelastic::ProjectionResult &);
  double largest_angle();
  void unconverged(const inelastic::ProjectionResult &, bool no_room);
  void fail_together(const std::string &message);
  std::string said_by(int rank, std::string text) const;
  std::vector<double> gather(std::vector<double> mine) const;
  double mass(int i) const;
  int carried_size() const { return STATE_SIZE + (rigid_ ? RigidMotion::CARRIED_SIZE : 0); }
};

}    // namespace LAMMPS_NS

#endif
#endif
