#include "fix_inelastic.h"

#include "atom.h"
#include "comm.h"
#include "domain.h"
#include "error.h"
#include "force.h"
#include "group.h"
#include "modify.h"
#include "neighbor.h"
#include "pair.h"
#include "update.h"

#include <algorithm>
#include <cmath>

using namespace LAMMPS_NS;
using namespace Inelastic_NS;
using namespace FixConst;

FixInelastic::FixInelastic(LAMMPS *lmp, int narg, char **arg) :
    Fix(lmp, narg, arg), settings_(read_settings(lmp, narg, arg, groupbit)), step_(settings_),
    ranks_(lmp, this, clock_), state_(lmp, step_), laws_(lmp, step_, state_.law_memory()),
    bodies_(settings_.has_bodies() ? new RigidMotion(lmp, step_, ranks_, state_) : nullptr),
    spheres_(lmp, step_, ranks_, state_), walls_(lmp, settings_.regions),
    constraints_(lmp, step_, ranks_, clock_, state_.first_guesses(), laws_, walls_, movers_),
    length_(lmp, step_, ranks_), files_(lmp, step_, length_),
    rest_(lmp, step_, ranks_, state_, movers_), check_(lmp, this, step_, ranks_, state_, movers_),
    output_(lmp, step_, ranks_), unrest_(lmp, step_, output_), summary_(lmp, step_, clock_),
    trials_(lmp, step_, constraints_, length_, movers_, ranks_, summary_, clock_, [this] {
      predict();
    })
{
  movers_.add(&spheres_);
  if (bodies_) movers_.add(bodies_.get());
  walls_.init();
  output_.set_walls(walls_.number_of_walls());
  if (!atom->radius_flag)
    error->all(FLERR, "Fix inelastic needs spheres with a radius: use atom_style sphere");
  if (!atom->tag_enable) error->all(FLERR, "Fix inelastic needs atom IDs: use atom_modify id yes");
  announce_to_lammps();
  files_.find_lost_memory(id, style);
  begin_summary();

  FixInelastic::grow_arrays(atom->nmax);
  for (int i = 0; i < atom->nlocal; ++i) FixInelastic::set_arrays(i);
  atom->add_callback(Atom::GROW);
  atom->add_callback(Atom::RESTART);
}

// The flags of Fix that tell LAMMPS what the fix has and needs.
void FixInelastic::announce_to_lammps()
{
  array_flag = walls_.empty() ? 0 : 1;
  size_array_rows = walls_.number_of_walls();
  size_array_cols = 3;
  extarray = 0;
  virial_global_flag = virial_peratom_flag = thermo_virial = 1;
  vector_flag = 1;
  size_vector = ContactOutput::VECTOR_SIZE;
  extvector = 0;
  global_freq = 1;
  peratom_flag = 1;
  size_peratom_cols = ContactOutput::PER_ATOM_COLUMNS;
  peratom_freq = 1;
  local_flag = 1;
  size_local_cols = output_.local_columns();
  size_local_rows = 0;
  local_freq = 1;
  force_reneighbor = 1;
  next_reneighbor = -1;
  // LAMMPS sizes its buffers by these; most messages are shorter.
  comm_forward = GhostExchange::FORWARD_SIZE;
  comm_reverse = GhostExchange::REVERSE_SIZE;
  maxexchange_dynamic = 1;
  maxexchange = state_.exchange_size();
  create_attribute = 1;
  // Restart files hold what the law remembers.
  restart_global = restart_peratom = laws_.has_law() ? 1 : 0;
}

FixInelastic::~FixInelastic()
{
  if (copymode) return;
  // LAMMPS is ending where there is no update any more.
  if (update) {
    length_.restore();
    files_.warn_of_lost_memory(id, output_.vector(ContactOutput::HELD_CONTACTS));
  }
  atom->delete_callback(id, Atom::GROW);
  atom->delete_callback(id, Atom::RESTART);
  // The output owns them.
  array_atom = array_local = nullptr;
}

int FixInelastic::setmask()
{ return POST_NEIGHBOR | POST_FORCE | POST_RUN; }

int FixInelastic::modify_param(int narg, char **arg)
{
  const std::string keyword = arg[0];
  if (keyword != "tolerance" && keyword != "accuracy") return 0;
  if (narg < 2) utils::missing_cmd_args(FLERR, "fix_modify " + keyword, error);
  if (keyword == "tolerance")
    settings_.tolerance = read_tolerance(lmp, arg[1]);
  else
    settings_.accuracy = read_accuracy(lmp, arg[1]);
  return 2;
}

/* ----------------------------------------------------------------------
   the start of a run
------------------------------------------------------------------------- */

// LAMMPS calls this for write_restart, write_data and balance, too, after which `run pre no` goes
// on as if nothing had been: what begins a run is in begin_run().
void FixInelastic::init()
{
  check_run();
  check_scene();
  check_.check_other_fixes();
  if (laws_.has_law()) laws_.follow_ids();
  state_.measure_messages(ranks_);
  maxexchange = state_.exchange_size();
  // With newton off LAMMPS makes its buffers for reverse communication as large as the pair style
  // needs them, whatever fixes need.
  if (!force->newton && force->pair)
    force->pair->comm_reverse_off = std::max(force->pair->comm_reverse_off, comm_reverse);
  // With equal radii the pair style's own list serves, and no second one is built. A list that is
  // of another kind than the last one is empty until a run is set up.
  constexpr int NO_RUN = 0;
  if (update->whichflag != NO_RUN) length_.list().choose_list();
  neighbor->add_request(
      this, length_.list().has_one_cutoff() ? NeighConst::REQ_DEFAULT : NeighConst::REQ_SIZE);
}

// LAMMPS sets the run up: the list is new, and no step has been made.
void FixInelastic::begin_run()
{
  walls_.warn();
  check_.begin_run();
  constraints_.begin_run(length_.list().smallest_radius());
  length_.begin_run();
  constraints_.overlaps().begin_run();
  trials_.begin_run();
  begin_summary();
}

// Checks what the fix was given when it was defined, which may be gone or changed since, also where
// no run is set up (`run pre no`). Collective.
void FixInelastic::check_scene()
{
  check_group();
  const int walls_before = walls_.number_of_walls();
  walls_.init();
  if (walls_.number_of_walls() != walls_before)
    error->all(
        FLERR,
        "Fix inelastic: its regions have {} walls, and had {} when the fix was defined: define "
        "fix {} again after its regions",
        walls_.number_of_walls(), walls_before, id);
  find_frozen();
  if (bodies_) bodies_->find_fix();
  length_.list().measure_radii();
}

// Groups can be deleted, and their numbers be given to other ones.
void FixInelastic::find_frozen()
{
  if (settings_.frozen_group.empty()) return;
  const int frozen = group->find(settings_.frozen_group);
  if (frozen < 0)
    error->all(FLERR, "Fix inelastic: its frozen group {} does not exist any more",
               settings_.frozen_group);
  settings_.frozen_bit = group->bitmask[frozen];
  bigint outside = 0, all_outside = 0;
  for (int i = 0; i < atom->nlocal; ++i)
    if ((atom->mask[i] & settings_.frozen_bit) && !(atom->mask[i] & groupbit)) ++outside;
  MPI_Allreduce(&outside, &all_outside, 1, MPI_LMP_BIGINT, MPI_SUM, world);
  if (all_outside > 0)
    error->all(FLERR,
               "Fix inelastic: spheres, {} of the frozen group {}, are not in group {}, whose "
               "contacts the fix makes: others would pass through them",
               all_outside, settings_.frozen_group, group->names[igroup]);
}

void FixInelastic::check_group() const
{
  if (modify->get_fix_by_style("^inelastic$").size() > 1)
    error->all(FLERR, "More than one fix inelastic: one fix must hold all contacts");
  if (bodies_) return;
  for (const Fix *fix : modify->get_fix_list()) {
    int moves = 0, any = 0;
    for (int i = 0; i < atom->nlocal; ++i)
      if (fix->rigid_flag && (atom->mask[i] & fix->groupbit) && (atom->mask[i] & groupbit))
        moves = 1;
    MPI_Allreduce(&moves, &any, 1, MPI_INT, MPI_MAX, world);
    if (any)
      error->all(FLERR,
                 "Fix inelastic: fix {} ({}) makes rigid bodies of spheres of group {}: add the "
                 "keyword rigid {} point, or solid",
                 fix->id, fix->style, group->names[igroup], fix->id);
  }
}

void FixInelastic::check_run() const
{
  if (utils::strmatch(update->integrate_style, "^respa"))
    error->all(FLERR, "Fix inelastic does not work with run_style respa: use run_style verlet");
  if (update->whichflag == 2)
    error->all(FLERR, "Fix inelastic does not work with minimize: unfix it first");
  if (!(update->dt > 0.0))
    error->all(FLERR, "Fix inelastic needs a timestep greater than 0, not {}", update->dt);
}

void FixInelastic::init_list(int, NeighList *list)
{ constraints_.use(list); }

void FixInelastic::setup_post_neighbor()
{
  begin_run();
  movers_.begin_run();
  post_neighbor();
}

void FixInelastic::post_neighbor()
{
  length_.list_built();
  if (movers_.any_turns()) ranks_.fail_together(movers_.find());
}

// In setup LAMMPS has whole-step velocities and applies only half a kick before the next move.
// Projecting from there gives the same velocity as projecting the whole step's prediction, because
// it lies between that prediction and its projection.
void FixInelastic::setup(int vflag)
{
  check_.set_up();
  // Without diameters `run 0` sets up bodies of point masses, and does no more.
  if (movers_.any_turns() && step_.largest_radius == 0.0 && update->nsteps == 0) return;
  if (movers_.any_turns()) ranks_.fail_together(movers_.measure());
  check_volume();
  advance(vflag, Kick::HALF);
  if (!movers_.fix()) return;
  // Fix rigid/small takes the forces of its first half kick in its own setup. Where it is defined
  // before this fix it has taken them without the contacts, and is asked again.
  for (Fix *fix : modify->get_fix_list()) {
    if (fix == this) return;
    if (fix == movers_.fix()) return fix->setup(vflag);
  }
}

// Refuses far too many spheres, which the solver would find, too, but only after very long solves.
// Spheres in bodies and frozen ones do not count, since they may overlap one another; boxes without
// walls are not checked, since spheres may be pushed out of them.
void FixInelastic::check_volume()
{
  const bool closed = !domain->nonperiodic || (!walls_.empty() && domain->nonperiodic == 1);
  if (settings_.warn_only || !closed || domain->dimension == 2) return;
  const double unit_sphere = 4.0 / 3.0 * std::acos(-1.0);
  double volume = 0.0;
  for (int i = 0; i < atom->nlocal; ++i)
    if (step_.is_mobile(atom, i) && !step_.is_member(i))
      volume += unit_sphere * std::pow(atom->radius[i], 3);
  ranks_.reduce(&volume, 1, nullptr, 0);
  // Centres are in the box.
  const double widest = 2.0 * step_.largest_radius;
  const double room = (domain->xprd + widest) * (domain->yprd + widest) * (domain->zprd + widest);
  if (volume > room)
    error->all(FLERR,
               "Fix inelastic: the scene leaves no room for the spheres: they have a volume of "
               "{:.4g}, the box of {:.4g}. Fewer or smaller ones, or a larger box, are needed",
               volume, domain->xprd * domain->yprd * domain->zprd);
}

void FixInelastic::begin_summary()
{
  summary_.begin(length_.shortened_steps());
  trials_.begin_summary();
  constraints_.overlaps().begin_count();
}

/* ----------------------------------------------------------------------
   one step
------------------------------------------------------------------------- */

void FixInelastic::post_force(int vflag)
{ advance(vflag, Kick::WHOLE); }

void FixInelastic::advance(int vflag, Kick kick)
{
  const PhaseClock::Within within(clock_, PhaseClock::CHECK);
  v_init(vflag);
  if (check_.goes_on_without_setup()) check_scene();
  // Where all atoms have left the box LAMMPS says so itself.
  if (step_.has_bodies && step_.largest_radius == 0.0 && group->count(igroup) > 0)
    error->all(
        FLERR,
        "Fix inelastic: no atom of group {} has a radius: set diameters before a run of more "
        "than 0 steps",
        group->names[igroup]);
  length_.restore();
  step_.begin(kick);
  check_.before_step();
  inelastic::ProjectionResult result = trials_.solve();
  if (rest_.look(result) && trials_.refine(result)) rest_.look_again();
  {
    const PhaseClock::Within solving(clock_, PhaseClock::SOLVE);
    const HoldStill::Constraints constraints = {[this] {
                                                  return constraints_.add_violated();
                                                },
                                                [this] {
                                                  return constraints_.excess();
                                                }};
    result.iterations += rest_.hold(constraints, trials_.least_length());
  }
  finish(result);
}

// Every other fix and force has done its work: sets up the problem, with the velocities that the
// step would end with. Collective.
void FixInelastic::predict()
{
  const PhaseClock::Within within(clock_, PhaseClock::COLLECT);
  const int nall = atom->nlocal + atom->nghost;
  inelastic::ContactProblem &problem = step_.problem;
  step_.impulse_per_force = step_.kicks() * update->dt * force->ftm2v;
  problem.timestep = update->dt;
  problem.resize(nall, walls_.number_of_walls());
  for (int i = 0; i < nall; ++i)
    problem.inverse_mass[i] = step_.is_mobile(atom, i) ? 1.0 / mass_of(atom, i) : 0.0;
  if (laws_.has_law()) {
    step_.velocity_before.assign(problem.predicted_velocity.size(), 0.0);
    movers_.find_velocity_before(step_.velocity_before);
  }
  movers_.predict();
  rest_.compare_loads();
}

// The step is solved: gives it to LAMMPS, to the output, and to the next step.
void FixInelastic::finish(const inelastic::ProjectionResult &result)
{
  trials_.end_step(result);
  unrest_.end_step();
  OverlapWatch &overlaps = constraints_.overlaps();
  overlaps.warn_of_unexpected();
  {
    const PhaseClock::Within within(clock_, PhaseClock::APPLY);
    if (laws_.has_law()) laws_.take_impulses();
    output_.take(result, length_.shortened_steps(),
                 {vflag_global != 0, vflag_atom != 0, virial, vatom});
    array_local = output_.local();
    size_local_rows = output_.local_rows();
    summary_.add_step(result);
    movers_.apply(output_.contact_force());
    check_.after_step(output_.largest_change());
  }
  const bool solved = result.status == inelastic::Status::CONVERGED;
  overlaps.end_step(solved && constraints_.entangled().empty(),
                    trials_.push_apart().deepest_at_end());
  restart_peratom = overlaps.pushes_in_velocity() || laws_.has_law();
  restart_global = length_.is_shortened() || laws_.has_law();
  {
    const PhaseClock::Within within(clock_, PhaseClock::APPLY);
    if (laws_.has_law()) laws_.remember(ranks_);
    state_.remember_contacts(ranks_);
  }
  maxexchange = state_.exchange_size();
  next_reneighbor = length_.needs_new_list() ? update->ntimestep + 1 : -1;
  constraints_.adapt_margin(length_.list().reach());
}

// The time step stays shortened until the next step, also with `run pre no`; restart files tell the
// regular one. Pushes are taken out of the velocities: restart files and the next run start from
// momentum alone. (For bodies the last step has done so, because fix rigid/small is out of reach
// here.)
void FixInelastic::post_run()
{
  check_.end_run(constraints_.overlaps().pushes_in_velocity());
  state_.take_out_pushes();
  restart_peratom = laws_.has_law();
  unrest_.look();
  summary_.log(length_.shortened_steps(), constraints_.overlaps().unexpected_steps(),
               trials_.counts(), trials_.push_apart().left(), trials_.energy(), unrest_);
  begin_summary();
}

// The timestep command calls this, also where no init() follows (run pre no).
void FixInelastic::reset_dt()
{ length_.timestep_was_set(); }

/* ----------------------------------------------------------------------
   output, and what follows the atoms
------------------------------------------------------------------------- */

// Collective.
double FixInelastic::compute_vector(int n)
{
  if (n != ContactOutput::REST_SPEED && n != ContactOutput::NET_FORCE) return output_.vector(n);
  unrest_.look();
  return n == ContactOutput::REST_SPEED ? unrest_.speed() : unrest_.net_force();
}

double FixInelastic::compute_array(int wall, int direction)
{ return output_.wall_force(wall, direction); }

void FixInelastic::grow_arrays(int nmax)
{
  state_.grow(nmax);
  output_.grow(nmax);
  array_atom = output_.per_atom();
}

void FixInelastic::copy_arrays(int i, int j, int)
{
  state_.copy(i, j);
  output_.copy(i, j);
}

void FixInelastic::set_arrays(int i)
{
  state_.begin(i);
  output_.clear(i);
}

int FixInelastic::pack_exchange(int i, double *buffer)
{ return state_.pack_exchange(i, buffer); }

int FixInelastic::unpack_exchange(int i, double *buffer)
{
  output_.clear(i);
  return state_.unpack_exchange(i, buffer);
}

int FixInelastic::pack_restart(int i, double *buffer)
{ return state_.pack_restart(i, buffer, restart_peratom != 0); }

void FixInelastic::unpack_restart(int i, int nth)
{ state_.unpack_restart(i, nth, files_.has_memory(), laws_.has_law() && files_.is_of_same_law()); }

int FixInelastic::size_restart(int i)
{ return state_.restart_size(i, restart_peratom != 0); }

int FixInelastic::maxsize_restart()
{ return state_.largest_restart_size(); }

void FixInelastic::write_restart(FILE *file)
{
  if (comm->me == 0) files_.write(file);
}

// LAMMPS calls this before unpack_restart().
void FixInelastic::restart(char *buffer)
{ files_.read(buffer); }

double FixInelastic::memory_usage()
{
  const double per_atom = state_.memory_usage() + size_peratom_cols + 20.0;
  const double contacts = static_cast<double>(step_.problem.contacts.size());
  return sizeof(double) * (per_atom * atom->nmax + ContactOutput::PER_CONTACT * contacts);
}

/* ----------------------------------------------------------------------
   messages between ranks
------------------------------------------------------------------------- */

int FixInelastic::pack_forward_comm(int n, int *list, double *buffer, int, int *)
{ return ranks_.pack_forward(n, list, buffer); }

void FixInelastic::unpack_forward_comm(int n, int first, double *buffer)
{ ranks_.unpack_forward(n, first, buffer); }

int FixInelastic::pack_reverse_comm(int n, int first, double *buffer)
{ return ranks_.pack_reverse(n, first, buffer); }

void FixInelastic::unpack_reverse_comm(int n, int *list, double *buffer)
{ ranks_.unpack_reverse(n, list, buffer); }
