#include "fix_inelastic.h"

#include "make_solver.h"
#include "npz.h"

#include "atom.h"
#include "comm.h"
#include "domain.h"
#include "error.h"
#include "force.h"
#include "group.h"
#include "memory.h"
#include "modify.h"
#include "neigh_list.h"
#include "neighbor.h"
#include "output.h"
#include "pair.h"
#include "region.h"
#include "update.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <limits>

using namespace LAMMPS_NS;
using namespace FixConst;

namespace {

constexpr int MAX_ROUNDS = 100;    // of adding constraints; a handful is usual
// Per step. Each one squares the error where a body turns little; one that turns by a radian takes
// up to twenty.
constexpr int MAX_RELINEARISATIONS = 40;
constexpr double REGULAR_OVERLAP = 2.0;    // in eps; more is a bad start
constexpr double PUSH_LIMIT =
    0.05;    // of the sum of radii, per regular step, out of a bad overlap
constexpr double RELINEARISE_BEYOND = 1.1;    // in eps, overlap at the end of the step
// [radians] Beyond, where a body ends says little about the wall that it has met.
constexpr double HALF_A_TURN = 3.14;
constexpr double SHORTEST_STEP = 1.0e-6;    // of the regular one: below, something else is wrong
constexpr double SHORTEST_UNSOLVED = 1.0e-3;    // below, it is not the step that is too long
constexpr double COINCIDENT = 1.0e-10;          // of the sum of radii: no normal can be computed
constexpr double EXPECTED_IN_EPS = 1.0e-7;      // how well the predicted motion must be met ...
constexpr double EXPECTED_RELATIVE =
    1.0e-12;    // ... beside the round-off of positions and velocities
// Of the largest coordinate: an overlap of two spheres is not known better than that. Each of the
// three coordinates of either is rounded by up to half of the machine epsilon.
constexpr double POSITIONS_RESOLVED = 2.0 * std::numeric_limits<double>::epsilon();
// Of the part of the box that a rank owns: LAMMPS brings an atom back from the next part alone.
constexpr double MOST_STRAYED = 0.5;
constexpr double SIMILAR_RADII = 1.1;    // up to here one cutoff for all pairs wastes little

constexpr double NEAR = 0.2;             // of the largest radius: pairs to be looked at again
constexpr double FIRST_MARGIN = 0.02;    // of the smallest radius
constexpr double OUTSIDE = -1.0;         // in place of the radius of a sphere outside the group
constexpr double EXTREME = 1.0e300;      // below or above every value that is compared
constexpr int SHARED_PARTNERS = 16;    // that a copy tells its owner; more lose only a first guess
constexpr int REDUCED_SUMS = 4;
constexpr int REDUCED_MAXIMA = 8;

struct Reduced {
  double sums[REDUCED_SUMS];
  double maxima[REDUCED_MAXIMA];
};

void combine(void *in, void *inout, int *count, MPI_Datatype *)
{
  const auto *from = static_cast<const Reduced *>(in);
  auto *to = static_cast<Reduced *>(inout);
  for (int k = 0; k < *count; ++k) {
    for (int s = 0; s < REDUCED_SUMS; ++s) to[k].sums[s] += from[k].sums[s];
    for (int m = 0; m < REDUCED_MAXIMA; ++m)
      to[k].maxima[m] = std::max(to[k].maxima[m], from[k].maxima[m]);
  }
}

double dot(const double *a, const double *b)
{ return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

double norm(const double *a)
{ return std::sqrt(dot(a, a)); }

// Whether the distance at the end of the step, linearised, |a| + h a.opening / |a|, is more than
// `reach` > 0. Of a = `away` and what a.opening adds to a.a over the step; no root for listed pairs.
bool ends_beyond(double reach, const double *away, double h, const double *opening)
{
  const double square = dot(away, away);
  const double end = square + h * dot(away, opening);
  return end > 0.0 && end * end > reach * reach * square;
}

}    // namespace

/* ---------------------------------------------------------------------- */

FixInelastic::FixInelastic(LAMMPS *lmp, int narg, char **arg) :
    Fix(lmp, narg, arg), tolerance_(0.0), solver_name_("apgd"), max_iterations_(100000),
    warn_only_(false), shorten_(false), frozen_bit_(0), record_every_(0), scene_(lmp),
    first_list_of_run_(false), list_(nullptr), looked_(false), margin_(-1.0), came_back_(false),
    relinearised_(false), solved_relinearised_(false), relinearisations_(0), phase_(Phase::CONTACT),
    bad_overlap_(false), pushed_before_(false), left_overlap_(EXTREME), unexpected_overlap_(0.0),
    state_(nullptr), largest_radius_(0.0), one_cutoff_(true), list_reach_(0.0),
    spread_at_start_(0.0), growth_(0.0), strayed_(0.0), own_width_{EXTREME, EXTREME, EXTREME},
    regular_timestep_(0.0), setting_timestep_(false), expecting_(false), goes_on_(false),
    ended_pushing_(false), kick_(0.0), largest_kick_(0.0), output_{}, wall_force_step_(-1),
    max_atoms_(0), max_contacts_(0), exchanging_(Exchange::VECTORS), exchanged_(nullptr),
    exchanged_single_(nullptr)
{
  begin_summary();
  if (narg < 4) utils::missing_cmd_args(FLERR, "fix inelastic", error);

  tolerance_ = utils::numeric(FLERR, arg[3], false, lmp);
  if (!(tolerance_ > 0.0) || std::isinf(tolerance_))
    error->all(FLERR, 3, "Fix inelastic tolerance must be a length greater than 0, not {}", arg[3]);

  auto is_keyword = [](const char *word) {
    for (const char *keyword :
         {"region", "rigid", "solver", "maxiter", "frozen", "record", "shorten"})
      if (strcmp(word, keyword) == 0) return true;
    return false;
  };
  std::vector<std::string> regions;
  int iarg = 4;
  while (iarg < narg) {
    const std::string keyword = arg[iarg];
    if (!is_keyword(arg[iarg]))
      error->all(FLERR, iarg,
                 "Unknown fix inelastic keyword {}: use region, rigid, solver, maxiter, frozen, "
                 "record or shorten",
                 keyword);
    if (iarg + 2 > narg) utils::missing_cmd_args(FLERR, "fix inelastic " + keyword, error);
    const std::string value = arg[iarg + 1];
    iarg += 2;
    if (keyword == "region") {
      regions.push_back(value);
      while (iarg < narg && !is_keyword(arg[iarg])) regions.emplace_back(arg[iarg++]);
    } else if (keyword == "rigid") {
      const std::string inertia = iarg < narg ? arg[iarg] : "nothing";
      if (inertia != "point" && inertia != "solid")
        error->all(FLERR, iarg - 1,
                   "Fix inelastic needs rigid FIX-ID point or rigid FIX-ID solid (the mass of each "
                   "sphere in its centre, or a solid ball), not {}",
                   inertia);
      ++iarg;
      rigid_ = std::make_unique<RigidMotion>(lmp, value,
                                             inertia == "point" ? RigidMotion::Inertia::POINT
                                                                : RigidMotion::Inertia::SOLID);
    } else if (keyword == "solver") {
      solver_name_ = value;
    } else if (keyword == "maxiter") {
      max_iterations_ = utils::bnumeric(FLERR, value, false, lmp);
      if (max_iterations_ < 1)
        error->all(FLERR, iarg - 1, "Fix inelastic maxiter must be at least 1, not {}", value);
      if (iarg < narg && strcmp(arg[iarg], "warn") == 0) {
        warn_only_ = true;
        ++iarg;
      }
    } else if (keyword == "frozen") {
      const int frozen_group = group->find(value);
      if (frozen_group < 0)
        error->all(FLERR, iarg - 1, "Fix inelastic frozen group {} does not exist", value);
      frozen_bit_ = group->bitmask[frozen_group];
    } else if (keyword == "record") {
      if (iarg + 2 > narg || strcmp(arg[iarg], "every") != 0)
        error->all(FLERR, iarg - 1, "Fix inelastic record needs: record FILE every N");
      record_file_ = value;
      record_every_ = utils::inumeric(FLERR, arg[iarg + 1], false, lmp);
      if (record_every_ < 1)
        error->all(FLERR, iarg + 1, "Fix inelastic record every must be at least 1, not {}",
                   record_every_);
      if (record_file_.find('*') == std::string::npos)
        error->all(FLERR, iarg - 1,
                   "Fix inelastic record file {} must contain a *, which becomes the step",
                   record_file_);
      iarg += 2;
    } else if (keyword == "shorten") {
      shorten_ = utils::logical(FLERR, value, false, lmp) == 1;
    }
  }
  solver_ = inelastic::make_solver(solver_name_);
  if (!solver_)
    error->all(FLERR, "Fix inelastic solver must be apgd or uzawa, not {}", solver_name_);
  walls_ = std::make_unique<RegionWalls>(lmp, regions);
  walls_->init();
  array_flag = walls_->empty() ? 0 : 1;
  size_array_rows = walls_->number_of_walls();
  size_array_cols = 3;
  extarray = 0;

  if (!atom->radius_flag)
    error->all(FLERR, "Fix inelastic needs spheres with a radius: use atom_style sphere");
  if (!atom->tag_enable) error->all(FLERR, "Fix inelastic needs atom IDs: use atom_modify id yes");

  virial_global_flag = virial_peratom_flag = thermo_virial = 1;
  vector_flag = 1;
  size_vector = OUTPUT_SIZE;
  extvector = 0;
  global_freq = 1;
  peratom_flag = 1;
  size_peratom_cols = 5;
  peratom_freq = 1;
  local_flag = 1;
  size_local_cols = 10;
  size_local_rows = 0;
  local_freq = 1;
  force_reneighbor = 1;
  next_reneighbor = -1;
  comm_forward = 3;
  // LAMMPS sizes its buffers by these; most messages are shorter.
  comm_reverse = ContactMemory::packed_size(SHARED_PARTNERS);
  maxexchange_dynamic = 1;
  create_attribute = 1;
  maxexchange = carried_size() + ContactMemory::packed_size(0);

  MPI_Op_create(&combine, 1, &reduction_);
  MPI_Type_contiguous(sizeof(Reduced) / sizeof(double), MPI_DOUBLE, &reduction_type_);
  MPI_Type_commit(&reduction_type_);

  FixInelastic::grow_arrays(atom->nmax);
  for (int i = 0; i < atom->nlocal; ++i) FixInelastic::set_arrays(i);
  atom->add_callback(Atom::GROW);
  atom->add_callback(Atom::RESTART);
}

FixInelastic::~FixInelastic()
{
  if (copymode) return;
  // LAMMPS is ending where there is no update any more.
  if (update && update->dt != regular_timestep_ && restart_global) set_timestep(regular_timestep_);
  atom->delete_callback(id, Atom::GROW);
  atom->delete_callback(id, Atom::RESTART);
  memory->destroy(state_);
  memory->destroy(array_atom);
  memory->destroy(array_local);
  MPI_Op_free(&reduction_);
  MPI_Type_free(&reduction_type_);
}

int FixInelastic::setmask()
{ return POST_NEIGHBOR | POST_FORCE | POST_RUN; }

int FixInelastic::modify_param(int narg, char **arg)
{
  if (strcmp(arg[0], "tolerance") != 0) return 0;
  if (narg < 2) utils::missing_cmd_args(FLERR, "fix_modify tolerance", error);
  const double tolerance = utils::numeric(FLERR, arg[1], false, lmp);
  if (!(tolerance > 0.0) || std::isinf(tolerance))
    error->all(FLERR, "Fix inelastic tolerance must be a length greater than 0, not {}", arg[1]);
  tolerance_ = tolerance;
  return 2;
}

/* ---------------------------------------------------------------------- */

void FixInelastic::init()
{
  if (modify->get_fix_by_style("^inelastic$").size() > 1)
    error->all(FLERR, "More than one fix inelastic: one fix must hold all contacts");
  if (!rigid_) {
    for (Fix *fix : modify->get_fix_list()) {
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
  if (utils::strmatch(update->integrate_style, "^respa"))
    error->all(FLERR, "Fix inelastic does not work with run_style respa: use run_style verlet");
  if (update->whichflag == 2)
    error->all(FLERR, "Fix inelastic does not work with minimize: unfix it first");
  if (!(update->dt > 0.0))
    error->all(FLERR, "Fix inelastic needs a timestep greater than 0, not {}", update->dt);

  const int walls_before = walls_->number_of_walls();
  walls_->init();
  if (walls_->number_of_walls() != walls_before)
    error->all(
        FLERR,
        "Fix inelastic: its regions have {} walls, and had {} when the fix was defined: define "
        "fix {} again after its regions",
        walls_->number_of_walls(), walls_before, id);
  walls_->warn();
  scene_.init({groupbit, frozen_bit_, rigid_ != nullptr});
  // With newton off LAMMPS makes its buffers for reverse communication as large as the pair style
  // needs them, whatever fixes need.
  if (!force->newton && force->pair)
    force->pair->comm_reverse_off = std::max(force->pair->comm_reverse_off, comm_reverse);
  if (rigid_) rigid_->init();
  first_list_of_run_ = true;
  wall_force_.assign(3 * static_cast<std::size_t>(walls_->number_of_walls()), 0.0);
  wall_force_total_ = wall_force_;
  wall_force_step_ = -1;

  double radii[2] = {0.0, -EXTREME};
  for (int i = 0; i < atom->nlocal; ++i) {
    if (!(atom->mask[i] & groupbit)) continue;
    radii[0] = std::max(radii[0], atom->radius[i]);
    radii[1] = std::max(radii[1], -atom->radius[i]);
  }
  reduce(nullptr, 0, radii, 2);
  largest_radius_ = radii[0];
  const double smallest_radius = -radii[1];
  if (largest_radius_ > 0.0 && !(smallest_radius > 0.0))
    error->all(FLERR, "Fix inelastic: an atom of group {} has no radius: set its diameter",
               group->names[igroup]);
  if (largest_radius_ > 0.0 && tolerance_ >= smallest_radius)
    error->all(
        FLERR,
        "Fix inelastic: the tolerance {:.4g}, the largest overlap allowed, must be below the "
        "smallest radius of group {}, {:.4g}",
        tolerance_, group->names[igroup], smallest_radius);
  if (margin_ < 0.0 && largest_radius_ > 0.0) margin_ = FIRST_MARGIN * smallest_radius;

  // With equal radii the pair style's own list serves, and no second one is built.
  one_cutoff_ = largest_radius_ <= SIMILAR_RADII * smallest_radius;
  neighbor->add_request(this, one_cutoff_ ? NeighConst::REQ_DEFAULT : NeighConst::REQ_SIZE);

  restore_timestep();
  regular_timestep_ = update->dt;
  expecting_ = false;
  if (pushed_before_) left_overlap_ = EXTREME;
  pushed_before_ = false;
  begin_summary();
}

void FixInelastic::init_list(int, NeighList *list)
{ list_ = list; }

void FixInelastic::setup_post_neighbor()
{ post_neighbor(); }

void FixInelastic::post_neighbor()
{
  const double *const *const x = atom->x;
  position_at_build_.resize(3 * static_cast<std::size_t>(atom->nlocal));
  radius_at_build_.assign(atom->radius, atom->radius + atom->nlocal);
  for (int i = 0; i < atom->nlocal; ++i) std::copy_n(x[i], 3, &position_at_build_[3 * i]);

  double largest[2] = {0.0, 0.0};
  for (int i = 0; i < atom->nlocal; ++i) {
    if (!(atom->mask[i] & groupbit)) continue;
    largest[0] = std::max(largest[0], atom->radius[i]);
    for (int d = 0; d < 3; ++d) largest[1] = std::max(largest[1], std::abs(x[i][d]));
  }
  reduce(nullptr, 0, largest, 2);
  largest_radius_ = largest[0];
  const double resolution = POSITIONS_RESOLVED * (largest[1] + largest_radius_);
  if (tolerance_ < resolution)
    error->all(FLERR,
               "Fix inelastic: the tolerance {:.4g} is below the round-off of positions: with "
               "coordinates of up to {:.4g} give at least {:.2g}",
               tolerance_, largest[1], 1.05 * resolution);
  const double widest = 2.0 * largest_radius_ + neighbor->skin;
  const double listed = one_cutoff_ ? neighbor->cutneighmin : neighbor->cutneighmax;
  if (listed < widest * (1.0 - 1.0e-12))
    error->all(
        FLERR,
        "Fix inelastic: the neighbour list reaches {:.6g} between centres but needs {:.6g}: give "
        "pair_style zero a cutoff of at least the largest diameter, {:.6g}",
        listed, widest, 2.0 * largest_radius_);
  // A motion that all share costs no reach, but takes atoms away from their rank and their box.
  for (int d = 0; d < 3; ++d) {
    own_width_[d] = EXTREME;
    if (domain->periodicity[d] || comm->nprocs > 1) {
      const double part = domain->triclinic
          ? domain->subhi_lamda[d] - domain->sublo_lamda[d]
          : (domain->subhi[d] - domain->sublo[d]) / domain->prd[d];
      own_width_[d] = part * domain->prd[d];
    }
  }
  measure_farthest();
  list_reach_ = one_cutoff_ ? listed - 2.0 * largest_radius_ : neighbor->skin;
  if (rigid_)
    fail_together(rigid_->find_bodies(problem_, *this, groupbit, frozen_bit_, first_list_of_run_));
  first_list_of_run_ = false;
}

// In setup LAMMPS has whole-step velocities and applies only half a kick before the next move.
// Projecting from there gives the same velocity as projecting the whole step's prediction, because
// it lies between that prediction and its projection.
void FixInelastic::setup(int vflag)
{
  expecting_ = false;
  goes_on_ = true;
  scene_.remember_box();
  // Without diameters a run sets up bodies of point masses, and does no more.
  if (rigid_ && largest_radius_ == 0.0) return;
  if (rigid_) {
    rigid_->measure(problem_);
    fail_together(rigid_->disagreement(problem_));
  }
  check_volume();
  advance(vflag, 0.5);
  if (!rigid_) return;
  // Fix rigid/small takes the forces of its first half kick in its own setup. Where it is defined
  // before this fix it has taken them without the contacts, and is asked again.
  for (Fix *fix : modify->get_fix_list()) {
    if (fix == this) return;
    if (fix == rigid_->fix()) return fix->setup(vflag);
  }
}

// Far too many spheres would be found out too, but only after very long solves. Those in bodies and
// frozen ones may overlap one another, and out of a box without walls they may be pushed.
void FixInelastic::check_volume()
{
  const bool closed = !domain->nonperiodic || (!walls_->empty() && domain->nonperiodic == 1);
  if (warn_only_ || !closed || domain->dimension == 2) return;
  const double unit_sphere = 4.0 / 3.0 * std::acos(-1.0);
  double volume = 0.0;
  for (int i = 0; i < atom->nlocal; ++i)
    if ((atom->mask[i] & groupbit) && !(atom->mask[i] & frozen_bit_) && !is_member(i))
      volume += unit_sphere * std::pow(atom->radius[i], 3);
  reduce(&volume, 1, nullptr, 0);
  // Centres are in the box.
  const double widest = 2.0 * largest_radius_;
  const double room = (domain->xprd + widest) * (domain->yprd + widest) * (domain->zprd + widest);
  if (volume > room)
    error->all(FLERR,
               "Fix inelastic: the scene leaves no room for the spheres: they have a volume of "
               "{:.4g}, the box of {:.4g}. Fewer or smaller ones, or a larger box, are needed",
               volume, domain->xprd * domain->yprd * domain->zprd);
}

void FixInelastic::post_force(int vflag)
{ advance(vflag, 1.0); }

// A shortened time step stays until the next step, which `run pre no` takes with it, and restart files
// tell the regular one.
void FixInelastic::post_run()
{
  goes_on_ = false;
  ended_pushing_ = restart_peratom != 0;
  // Restart files and the next run start from the momentum alone.
  // (Bodies: the last step has done so, because fix rigid/small is out of reach here.)
  for (int i = 0; i < atom->nlocal; ++i)
    for (int d = 0; d < 3; ++d) {
      atom->v[i][d] -= state_[i][PUSH_HELD + d];
      state_[i][PUSH_HELD + d] = 0.0;
    }
  restart_peratom = 0;
  if (comm->me == 0) log_run();
  log_times();
  begin_summary();
}

void FixInelastic::begin_summary()
{
  run_iterations_ = run_largest_overlap_ = run_largest_excess_ = run_deepest_start_ = 0.0;
  run_steps_ = run_unconverged_ = run_shortened_ = run_pushed_ = run_unexpected_ = 0;
  run_constraint_iterations_ = 0.0;
  clock_.reset();
}

void FixInelastic::log_run() const
{
  utils::logmesg(
      lmp,
      "Fix inelastic: {} projections, {:.0f} iterations, largest overlap {:.6g} = {:.4g} "
      "tolerances, {} shortened steps\n",
      run_steps_, run_iterations_, run_largest_overlap_, run_largest_overlap_ / tolerance_,
      run_shortened_);
  if (run_largest_excess_ > 0.0)
    utils::logmesg(
        lmp,
        "  {} left overlaps of up to {:.6g} beyond 2 tolerances: a shorter timestep, or shorten "
        "yes, avoids them\n",
        rigid_ ? "turning bodies, or the curvature of walls," : "the curvature of walls",
        run_largest_excess_);
  if (run_pushed_ > 0)
    utils::logmesg(
        lmp,
        "  {} steps began with overlaps of more than 2 tolerances, up to {:.6g}, and pushed "
        "them apart; in {} of them such an overlap had appeared that no step had left\n",
        run_pushed_, run_deepest_start_, run_unexpected_);
  if (run_unconverged_ > 0)
    utils::logmesg(lmp, "  {} projections did not reach the tolerance within maxiter\n",
                   run_unconverged_);
}

// Collective.
void FixInelastic::log_times() const
{
  double mine[PhaseClock::OUTSIDE + 1], sums[PhaseClock::OUTSIDE + 1];
  for (int phase = 0; phase < PhaseClock::OUTSIDE; ++phase)
    mine[phase] = clock_.seconds(static_cast<PhaseClock::Phase>(phase));
  mine[PhaseClock::OUTSIDE] = run_constraint_iterations_;
  MPI_Reduce(mine, sums, PhaseClock::OUTSIDE + 1, MPI_DOUBLE, MPI_SUM, 0, world);
  if (comm->me != 0) return;
  for (double &sum : sums) sum /= comm->nprocs;
  std::string text = fmt::format(
      "  seconds: collect {:.3f}, solve {:.3f}, communicate {:.3f}, check {:.3f}, apply {:.3f}",
      sums[PhaseClock::COLLECT], sums[PhaseClock::SOLVE], sums[PhaseClock::COMMUNICATE],
      sums[PhaseClock::CHECK], sums[PhaseClock::APPLY]);
  if (sums[PhaseClock::OUTSIDE] > 0.0)
    text += fmt::format("; solve takes {:.1f} us an iteration, {:.2f} ns a constraint",
                        1.0e6 * sums[PhaseClock::SOLVE] / run_iterations_,
                        1.0e9 * sums[PhaseClock::SOLVE] / sums[PhaseClock::OUTSIDE]);
  utils::logmesg(lmp, text + "\n");
}

/* ----------------------------------------------------------------------
   one step
------------------------------------------------------------------------- */

void FixInelastic::advance(int vflag, double kick_steps)
{
  const PhaseClock::Within within(clock_, PhaseClock::CHECK);
  v_init(vflag);
  restore_timestep();
  // Together, and before a time step is shortened for what is no number.
  const std::string broken = break_in_run();
  fail_together(broken.empty() ? not_finite(kick_steps) : broken);
  if (expecting_) check_expected();

  spread_at_start_ = spread_since_build(nullptr);
  inelastic::ProjectionResult result;
  bool no_room = false;     // for certain, in this step as long as it was at first
  bool appeared = false;    // on any rank, an overlap that no step has left
  while (true) {
    worst_.clear();
    // Where the list cannot reach as far as atoms would move there is no use in solving first.
    if (shorten_ && spread_at_start_ < list_reach_) {
      const double motion = unhindered_spread(kick_steps);
      if (spread_at_start_ + update->dt * motion > list_reach_)
        shorten_step(room_in_list(unhindered_spread(0.0), motion));
    }
    predict(kick_steps);
    phase_ = Phase::CONTACT;
    collect();
    result = project(max_iterations_);
    double maxima[3] = {bad_overlap_ ? 1.0 : 0.0, output_[OVERLAP], unexpected_overlap_};
    reduce(nullptr, 0, maxima, 3);
    bad_overlap_ = maxima[0] > 0.0;
    output_[OVERLAP] = maxima[1];
    appeared = maxima[2] > 0.0;
    if (record_every_ > 0 && kick_steps == 1.0 && update->ntimestep % record_every_ == 0)
      record_problem(result);
    if (bad_overlap_) push_apart(result);
    if (result.status != inelastic::Status::CONVERGED) {
      const bool infeasible = result.status == inelastic::Status::INFEASIBLE;
      no_room = no_room || infeasible;
      // Where the gaps at the end of the step were not to be had, those of a shorter one may be.
      if (shorten_ && (relinearised_ || infeasible) &&
          update->dt > SHORTEST_UNSOLVED * regular_timestep_) {
        shorten_step(0.5);
        continue;
      }
      unconverged(result, no_room);
    }
    if (!list_reaches(motion())) {
      if (!shorten_ || spread_at_start_ >= list_reach_) {
        const double needed = spread_at_start_ + problem_.timestep * spread(motion().data());
        error->all(
            FLERR,
            "Fix inelastic: step {}: spheres move by up to {:.6g} relative to one another, further "
            "than the neighbour list reaches ({:.6g}): set the skin of the neighbor command to at "
            "least {:.6g}, or lower the timestep, or use shorten yes",
            update->ntimestep, needed, list_reach_, 1.2 * needed);
      }
      const double motion_found = spread(motion().data());
      shorten_step(room_in_list(motion_found, motion_found));
    } else if (part_of_farthest() >= 1.0) {
      if (!shorten_)
        error->all(
            FLERR,
            "Fix inelastic: step {}: spheres move further than LAMMPS can follow them between "
            "two neighbour lists, {:.3g} times as far: lower the timestep, or use shorten yes",
            update->ntimestep, part_of_farthest());
      shorten_step(0.5);
    } else if (shorten_ && output_[EXCESS] > 0.0) {
      shorten_step(0.5);
    } else {
      break;
    }
  }

  if (appeared) warn_of_unexpected_overlap();
  update_outputs(result);
  apply_forces(kick_steps);
  // A whole-step velocity holds half of the push before and half of the one after it.
  restart_peratom = bad_overlap_ || pushed_before_;
  pushed_before_ = bad_overlap_;
  const bool certain = result.status == inelastic::Status::CONVERGED && entangled_.empty();
  left_overlap_ = certain
      ? REGULAR_OVERLAP * tolerance_ + (bad_overlap_ ? output_[OVERLAP] : 0.0) + output_[EXCESS]
      : EXTREME;
  restart_global = update->dt != regular_timestep_;
  remember_contacts();

  // Rebuild before the list could fall short, with room for the next step to be half as fast again.
  const double next_start = spread_since_build(motion().data());
  const double next_motion = problem_.timestep * spread(motion().data());
  const bool short_of_reach = next_start + 1.5 * next_motion > list_reach_ || growth_ > 0.0;
  next_reneighbor = short_of_reach || strayed_ > MOST_STRAYED ? update->ntimestep + 1 : -1;

  // More pairs at once when the last projection had to come back for some, fewer otherwise.
  margin_ *= came_back_ ? 1.1 : 0.95;
  margin_ = std::clamp(margin_, 4.0 * tolerance_, std::max(4.0 * tolerance_, list_reach_));
  expecting_ = true;
}

inelastic::ProjectionResult FixInelastic::project(long max_iterations)
{
  const PhaseClock::Within within(clock_, PhaseClock::SOLVE);
  // Further than the list reaches no step goes: such a one is shortened, or it is an error.
  constexpr double BEYOND_REACH = 10.0;
  const double reach = (shorten_ ? 1.0 : BEYOND_REACH) * list_reach_;
  const inelastic::ProjectionResult result = inelastic::project(
      problem_, *this, *solver_, {tolerance_, max_iterations, reach}, MAX_ROUNDS, *this, velocity_);
  if (result.status != inelastic::Status::CONVERGED) note_worst(result);
  run_constraint_iterations_ +=
      static_cast<double>(result.iterations) * static_cast<double>(problem_.contacts.size());
  return result;
}

// Names a force or velocity of this rank that is no number; empty if there is none.
std::string FixInelastic::not_finite(double kick_steps) const
{
  for (int i = 0; i < atom->nlocal; ++i) {
    if (!(atom->mask[i] & groupbit)) continue;
    const bool moves = !(atom->mask[i] & frozen_bit_);
    const double kick = moves ? kick_steps * update->dt * force->ftm2v / mass(i) : 0.0;
    const double *const v = atom->v[i];
    const double *const f = atom->f[i];
    const double after[3] = {v[0] + kick * f[0], v[1] + kick * f[1], v[2] + kick * f[2]};
    if (std::isfinite(norm(v)) && std::isfinite(norm(after))) continue;
    return !std::isfinite(norm(v))
        ? fmt::format("the velocity of atom {} is not a finite number", atom->tag[i])
        : fmt::format("the force on atom {} is not a finite number, or too large to be one",
                      atom->tag[i]);
  }
  return "";
}

// Without a setup the next step follows from the last one's forces: what the end of the run has taken
// out of the velocities, or somebody has changed since, is missing. Empty if nothing is.
std::string FixInelastic::break_in_run()
{
  if (!expecting_) return "";
  const bool went_on = goes_on_;
  goes_on_ = true;
  if (!went_on && ended_pushing_)
    return "run pre no cannot go on from a step that was pushing overlaps apart: leave out pre no";
  return scene_.change_of_box();
}

// Every other fix and force has done its work: the velocities that the step would end with.
void FixInelastic::predict(double kick_steps)
{
  const PhaseClock::Within within(clock_, PhaseClock::COLLECT);
  const int nlocal = atom->nlocal;
  const int nall = nlocal + atom->nghost;
  const int *const mask = atom->mask;
  kick_ = kick_steps * update->dt;
  problem_.timestep = update->dt;
  problem_.resize(nall);
  for (int i = 0; i < nall; ++i) {
    const bool moves = (mask[i] & groupbit) && !(mask[i] & frozen_bit_);
    problem_.inverse_mass[i] = moves ? 1.0 / mass(i) : 0.0;
  }
  for (int i = 0; i < nlocal; ++i) {
    if (is_member(i)) continue;
    const double kick_per_force = kick_ * force->ftm2v * problem_.inverse_mass[i];
    // What pushed overlaps apart is no momentum; between runs it is not in the velocity.
    const double *const push = state_[i] + PUSH_NEXT;
    for (int d = 0; d < 3; ++d)
      problem_.predicted_velocity[3 * i + d] =
          atom->v[i][d] - (kick_steps == 1.0 ? push[d] : 0.0) + kick_per_force * atom->f[i][d];
  }
  share_with_copies(problem_.predicted_velocity.data());
  if (rigid_) {
    rigid_->measure(problem_);
    rigid_->predict(problem_, *this, kick_ * force->ftm2v, expecting_, state_, EXPECTED_V);
  }
  message_.clear();
}

void FixInelastic::collect()
{
  const PhaseClock::Within within(clock_, PhaseClock::COLLECT);
  problem_.contacts.clear();
  origin_.clear();
  wall_constraint_.clear();
  bad_overlap_ = false;
  unexpected_overlap_ = 0.0;
  output_[OVERLAP] = output_[EXCESS] = 0.0;
  relinearisations_ = 0;
  came_back_ = relinearised_ = solved_relinearised_ = looked_ = false;
  collect_pairs();
  if (!walls_->empty()) collect_walls();

  fail_together(message_);
}

// More than a step can leave behind.
bool FixInelastic::is_bad(double gap) const
{ return gap < -REGULAR_OVERLAP * tolerance_; }

// The gap that a constraint asks to be kept. `size` is the sum of radii (of one sphere for a wall).
double FixInelastic::effective_gap(double gap_now, double size) const
{
  if (!is_bad(gap_now)) return gap_now;
  if (phase_ == Phase::CONTACT) return 0.0;
  const double limit = PUSH_LIMIT * size * problem_.timestep / regular_timestep_;
  return std::max(gap_now, -std::max(limit, REGULAR_OVERLAP * tolerance_));
}

template <typename Visitor> void FixInelastic::for_each_listed_pair(Visitor &&visit) const
{
  const int *const mask = atom->mask;
  const tagint *const tag = atom->tag;
  const int nlocal = atom->nlocal;
  std::size_t slot = 0;
  for (int ii = 0; ii < list_->inum; ++ii) {
    const int i = list_->ilist[ii];
    const int *const neighbours = list_->firstneigh[i];
    const int count = list_->numneigh[i];
    if (!(mask[i] & groupbit)) {
      slot += count;
      continue;
    }
    for (int jj = 0; jj < count; ++jj, ++slot) {
      const int j = neighbours[jj] & NEIGHMASK;
      if (!(mask[j] & groupbit)) continue;
      // Without newton a pair across ranks is on both lists: one of them takes it.
      if (j >= nlocal && !force->newton_pair && tag[i] > tag[j]) continue;
      if (rigid_ && problem_.bodies.body[i] >= 0 &&
          problem_.bodies.body[i] == problem_.bodies.body[j])
        continue;
      visit(slot, i, j);
    }
  }
}

void FixInelastic::collect_pairs()
{
  const double *const *const x = atom->x;
  const double *const radius = atom->radius;
  const double h = problem_.timestep;
  const double *const velocity = problem_.predicted_velocity.data();

  std::size_t slots = 0;
  for (int ii = 0; ii < list_->inum; ++ii) slots += list_->numneigh[list_->ilist[ii]];
  listed_pair_taken_.assign(slots, 0);

  for_each_listed_pair([&](std::size_t slot, int i, int j) {
    const double away[3] = {x[i][0] - x[j][0], x[i][1] - x[j][1], x[i][2] - x[j][2]};
    const double opening[3] = {velocity[3 * i] - velocity[3 * j],
                               velocity[3 * i + 1] - velocity[3 * j + 1],
                               velocity[3 * i + 2] - velocity[3 * j + 2]};
    const double reach = radius[i] + radius[j] + margin_;
    if (dot(away, away) > reach * reach && ends_beyond(reach, away, h, opening)) return;
    take_pair(slot, i, j);
  });
}

void FixInelastic::take_pair(std::size_t slot, int i, int j)
{
  const double *const xi = atom->x[i];
  const double *const xj = atom->x[j];
  listed_pair_taken_[slot] = 1;
  if (problem_.inverse_mass[i] + problem_.inverse_mass[j] == 0.0) return;
  const double away[3] = {xi[0] - xj[0], xi[1] - xj[1], xi[2] - xj[2]};
  const double distance = norm(away);
  const double size = atom->radius[i] + atom->radius[j];
  if (!(distance > COINCIDENT * size)) {
    message_ = fmt::format("the centres of atoms {} and {} coincide: move one of them",
                           atom->tag[i], atom->tag[j]);
    return;
  }
  const double normal[3] = {away[0] / distance, away[1] / distance, away[2] / distance};
  const double gap = distance - size;
  note_overlap(gap, i, atom->tag[j]);
  if (rigid_ && (rigid_->is_incomplete(i) || rigid_->is_incomplete(j))) {
    message_ = fmt::format("atoms {} and {} meet where a rank does not see all of their bodies: "
                           "raise comm_modify cutoff",
                           atom->tag[i], atom->tag[j]);
    return;
  }
  if (atom->tag[i] == atom->tag[j]) {
    if (is_bad(gap))
      message_ = fmt::format("atom {} overlaps its own periodic image: the box is too small",
                             atom->tag[i]);
    return;
  }
  problem_.contacts.add(i, j, normal, effective_gap(gap, size),
                        kick_ * force->ftm2v * memory_.force(i, atom->tag[j]));
  origin_.push_back({0, gap, size, 0.0});
}

// Of a sphere with another one, or with a wall (minus its number).
void FixInelastic::note_overlap(double gap, int i, tagint partner)
{
  output_[OVERLAP] = std::max(output_[OVERLAP], -gap);
  if (!is_bad(gap)) return;
  bad_overlap_ = true;
  if (-gap <= std::max(left_overlap_, unexpected_overlap_)) return;
  unexpected_overlap_ = -gap;
  unexpected_ = partner < 0 ? fmt::format("atom {} overlaps wall {}", atom->tag[i], -partner)
                            : fmt::format("atoms {} and {} overlap", atom->tag[i], partner);
}

// Collective. Once a run; the summary counts the steps.
void FixInelastic::warn_of_unexpected_overlap()
{
  if (++run_unexpected_ > 1) return;
  struct {
    double depth;
    int rank;
  } mine = {unexpected_overlap_, comm->me}, deepest;
  MPI_Allreduce(&mine, &deepest, 1, MPI_DOUBLE_INT, MPI_MAXLOC, world);
  const std::string who = said_by(deepest.rank, unexpected_);
  if (comm->me == 0)
    error->warning(
        FLERR,
        "Fix inelastic: step {}: {} by {:.4g} ({:.3g} tolerances), which no earlier step has "
        "left: something else has moved or changed the spheres, the box, a region or the "
        "group. Such overlaps are pushed apart without momentum; the summary counts the "
        "steps",
        update->ntimestep, who, deepest.depth, deepest.depth / tolerance_);
}

// Looks at the walls from where atoms are, as far as the step takes them.
const std::vector<RegionWalls::Look> &FixInelastic::looks(const double *velocity, double beyond)
{
  looks_.clear();
  const double h = problem_.timestep;
  for (int i = 0; i < atom->nlocal; ++i) {
    if (problem_.inverse_mass[i] == 0.0) continue;
    const double *const x = atom->x[i];
    const double reach = atom->radius[i] + beyond + h * norm(velocity + 3 * i);
    if (reach >= clear_of_walls_[i]) looks_.push_back({i, {x[0], x[1], x[2]}, reach});
  }
  return looks_;
}

// Looks from where the step takes those atoms for which the constraint of a wall may be inexact. A
// constraint that was set by an earlier look is set again wherever its wall is now.
const std::vector<RegionWalls::Look> &
FixInelastic::looks_at_end(const std::vector<double> &velocity)
{
  const std::vector<double> &moved = rigid_ ? rigid_->motion() : velocity;
  looks_.clear();
  const double h = problem_.timestep;
  std::unordered_set<int> followed;
  for (std::size_t c = 0; c < origin_.size(); ++c)
    if (origin_[c].wall != 0 && origin_[c].followed &&
        rigid_->angle_turned(problem_, problem_.contacts.first[c]) < HALF_A_TURN)
      followed.insert(problem_.contacts.first[c]);
  for (int i = 0; i < atom->nlocal; ++i) {
    if (problem_.inverse_mass[i] == 0.0 || (walls_->exact() && !is_member(i))) continue;
    const double *const x = atom->x[i];
    const double *const v = &moved[3 * i];
    const double reach = followed.count(i) ? EXTREME : atom->radius[i] + (rigid_ ? margin_ : 0.0);
    if (reach + h * norm(v) < clear_of_walls_[i]) continue;
    looks_.push_back({i, {x[0] + h * v[0], x[1] + h * v[1], x[2] + h * v[2]}, reach});
  }
  return looks_;
}

void FixInelastic::collect_walls()
{
  const double *const velocity = problem_.predicted_velocity.data();
  // A look further than needed tells for most atoms that no other is, in this step. (Not where parts
  // of a region hide others.)
  const double further = walls_->exact() ? 2.0 * largest_radius_ : 0.0;
  clear_of_walls_.assign(atom->nlocal, 0.0);
  const std::vector<RegionWalls::Look> &far = looks(velocity, margin_ + further);
  if (walls_->exact())
    for (const RegionWalls::Look &look : far) clear_of_walls_[look.atom] = look.reach;
  walls_->view(
      far, false,
      [&](const RegionWalls::Look &look, const WallView &view) {
        clear_of_walls_[look.atom] = 0.0;
        const double gap = view.distance - atom->radius[look.atom];
        note_overlap(view.distance_now - atom->radius[look.atom], look.atom, -view.wall);
        const double opening = problem_.timestep * dot(view.normal, velocity + 3 * look.atom);
        if (gap + std::min(0.0, opening) <= margin_) take_wall(look, view);
      },
      [&](const RegionWalls::Look &look, const std::string &region) {
        message_ = fmt::format("the centre of atom {} is on the wrong side of region {}",
                               atom->tag[look.atom], region);
      });
}

void FixInelastic::take_wall(const RegionWalls::Look &look, const WallView &view)
{
  const int i = look.atom;
  const double size = atom->radius[i];
  const double gap_now = view.distance_now - size;
  const double motion = view.distance_now - view.distance;
  wall_constraint_[wall_key(i, view.wall)] = problem_.contacts.size();
  problem_.contacts.add(i, problem_.particles, view.normal, effective_gap(gap_now, size) - motion,
                        kick_ * force->ftm2v * memory_.force(i, -view.wall));
  origin_.push_back({view.wall, gap_now, size, motion});
}

long FixInelastic::refine(const std::vector<double> &velocity, inelastic::ContactProblem &)
{
  const PhaseClock::Within within(clock_, PhaseClock::COLLECT);
  message_.clear();
  solved_relinearised_ = relinearised_;
  if (rigid_) rigid_->turn(problem_, velocity);
  long added = add_violated_pairs(velocity);
  if (!walls_->empty()) added += add_violated_walls(velocity);
  long relinearised = 0;
  const bool walls_curve = !walls_->empty() && (rigid_ || !walls_->exact());
  output_[EXCESS] = 0.0;
  if (rigid_ || walls_curve) {
    ++relinearisations_;
    if (rigid_) relinearised += relinearise_pairs(velocity);
    if (walls_curve) relinearised += relinearise_walls(velocity);
  }
  double sums[2] = {static_cast<double>(added), static_cast<double>(relinearised)};
  reduce(sums, 2, &output_[EXCESS], 1);
  came_back_ = came_back_ || sums[0] > 0.0;
  relinearised_ = relinearised_ || sums[1] > 0.0;
  fail_together(message_);
  return added + relinearised;
}

// After the first look of a step only pairs that were near each other then need another one, as long
// as no end of the step has moved far since.
long FixInelastic::add_violated_pairs(const std::vector<double> &velocity)
{
  const double *const *const x = atom->x;
  const double *const radius = atom->radius;
  const double h = problem_.timestep;
  const double *const moved = motion().data();
  auto square_at_end = [&](int i, int j) {
    double away[3];
    for (int d = 0; d < 3; ++d)
      away[d] = x[i][d] - x[j][d] + h * (moved[3 * i + d] - moved[3 * j + d]);
    return dot(away, away);
  };
  auto stays_apart = [&](int i, int j, double distance) {
    const double away[3] = {x[i][0] - x[j][0], x[i][1] - x[j][1], x[i][2] - x[j][2]};
    const double opening[3] = {velocity[3 * i] - velocity[3 * j],
                               velocity[3 * i + 1] - velocity[3 * j + 1],
                               velocity[3 * i + 2] - velocity[3 * j + 2]};
    return ends_beyond(distance, away, h, opening) &&
        !(rigid_ && square_at_end(i, j) < distance * distance);
  };
  const std::size_t before = problem_.contacts.size();
  auto look_at = [&](std::size_t slot, int i, int j) {
    const double touching = radius[i] + radius[j] - tolerance_;
    if (!stays_apart(i, j, touching) && !is_entangled(i, j)) take_pair(slot, i, j);
  };
  const double near = NEAR * largest_radius_;
  if (looked_ && 2.0 * h * change_since_look(velocity) < near) {
    for (const NearPair &pair : near_pairs_)
      if (!listed_pair_taken_[pair.slot]) look_at(pair.slot, pair.first, pair.second);
  } else {
    near_pairs_.clear();
    for_each_listed_pair([&](std::size_t slot, int i, int j) {
      if (listed_pair_taken_[slot] || stays_apart(i, j, radius[i] + radius[j] + near)) return;
      near_pairs_.push_back({slot, i, j});
      look_at(slot, i, j);
    });
    looked_ = true;
    velocity_looked_at_ = velocity;
    if (rigid_) motion_looked_at_ = motion();
  }
  return static_cast<long>(problem_.contacts.size() - before);
}

// Largest change of a velocity, or of a motion, since all pairs were looked at.
double FixInelastic::change_since_look(const std::vector<double> &velocity) const
{
  auto largest = [](const std::vector<double> &a, const std::vector<double> &b) {
    double most = 0.0;
    for (std::size_t k = 0; k < a.size(); k += 3) {
      const double change[3] = {a[k] - b[k], a[k + 1] - b[k + 1], a[k + 2] - b[k + 2]};
      most = std::max(most, dot(change, change));
    }
    return std::sqrt(most);
  };
  const double change = largest(velocity, velocity_looked_at_);
  return rigid_ ? std::max(change, largest(motion(), motion_looked_at_)) : change;
}

long FixInelastic::add_violated_walls(const std::vector<double> &velocity)
{
  const std::size_t before = problem_.contacts.size();
  walls_->view(
      looks(velocity.data(), 0.0), false,
      [&](const RegionWalls::Look &look, const WallView &view) {
        const double gap = view.distance - atom->radius[look.atom];
        const double opening = problem_.timestep * dot(view.normal, &velocity[3 * look.atom]);
        if (gap + opening < -tolerance_ && !wall_constraint_.count(wall_key(look.atom, view.wall)))
          take_wall(look, view);
      },
      [](const RegionWalls::Look &, const std::string &) {
      });
  return static_cast<long>(problem_.contacts.size() - before);
}

// The distance between turning bodies is not convex. What the end of the step lacks beside the
// linearised gap is put into the gap of the constraint, so that it is exact for this velocity; where
// the end has more, nothing changes. The normal stays that of the positions from which the force
// acts: along any other, two opposite forces would be a couple, and angular momentum would not be
// kept. What is lacking is made up along it, hence the division.
long FixInelastic::relinearise_pairs(const std::vector<double> &velocity)
{
  const double *const *const x = atom->x;
  const double *const radius = atom->radius;
  const double h = problem_.timestep;
  const std::vector<double> &moved = rigid_->motion();
  constexpr double LEAST_ALONG = 0.5;    // the line between the spheres turns by 60 degrees
  inelastic::ContactSet &contacts = problem_.contacts;
  long changed = 0;
  double away[3];
  auto gap_at_end = [&](int i, int j) {
    for (int d = 0; d < 3; ++d)
      away[d] = x[i][d] - x[j][d] + h * (moved[3 * i + d] - moved[3 * j + d]);
    return norm(away) - radius[i] - radius[j];
  };
  auto relinearised_gap = [&](std::size_t c, double gap) {
    const double *const n = &contacts.normal[3 * c];
    double opening = 0.0;
    for (int d = 0; d < 3; ++d)
      opening +=
          n[d] * (velocity[3 * contacts.first[c] + d] - velocity[3 * contacts.second[c] + d]);
    const double along = std::max(LEAST_ALONG, dot(n, away) / norm(away));
    const double lacking = gap - wanted_gap(origin_[c].gap_now, origin_[c].size);
    return (lacking < 0.0 ? lacking / along : lacking) - h * opening;
  };

  const bool may_change = relinearisations_ <= MAX_RELINEARISATIONS;
  for (std::size_t c = 0; c < contacts.size(); ++c) {
    const int i = contacts.first[c], j = contacts.second[c];
    if (origin_[c].wall != 0 || !(is_member(i) || is_member(j))) continue;
    if (is_entangled(i, j)) continue;
    const double gap = gap_at_end(i, j);
    const bool too_deep = ends_too_deep(origin_[c].gap_now, origin_[c].size, gap);
    if ((too_deep || origin_[c].followed) && may_change)
      changed += follow(c, relinearised_gap(c, gap), too_deep);
  }
  return changed;
}

// Notes the excess as well: what starts with a bad overlap may keep it, but not get deeper. It is
// asked for more, which costs no shorter step where it is not to be had.
bool FixInelastic::ends_too_deep(double gap_now, double size, double gap_at_end)
{
  const double allowed = is_bad(gap_now) ? gap_now : 0.0;
  output_[EXCESS] = std::max(output_[EXCESS], allowed - gap_at_end - REGULAR_OVERLAP * tolerance_);
  return wanted_gap(gap_now, size) - gap_at_end > RELINEARISE_BEYOND * tolerance_;
}

// Sets the gap of a constraint to one that is exact for the present velocity, or to the linearised
// one if that is smaller. One that was set for an earlier velocity is set again, so that no force
// keeps apart what has moved on meanwhile, and the step does not depend on how it was found. Returns
// how many constraints changed.
long FixInelastic::follow(std::size_t c, double exact_gap, bool too_deep)
{
  inelastic::ContactSet &contacts = problem_.contacts;
  Origin &origin = origin_[c];
  const double linear_gap = effective_gap(origin.gap_now, origin.size) - origin.wall_motion;
  const double gap = std::min(exact_gap, linear_gap);
  if (!too_deep) {
    const bool worth_it = contacts.impulse[c] > 0.0 &&
        gap - contacts.gap[c] > RELINEARISE_BEYOND * tolerance_ &&
        relinearisations_ <= MAX_RELINEARISATIONS / 2;
    if (!worth_it) return 0;
  }
  contacts.gap[c] = gap;
  origin.followed = is_member(contacts.first[c]) ||
      (origin.wall == 0 && is_member(contacts.second[c]));
  return 1;
}

// Gap at the end of the step for which the constraint is just met.
double FixInelastic::wanted_gap(double gap_now, double size) const
{ return is_bad(gap_now) ? gap_now - effective_gap(gap_now, size) : 0.0; }

bool FixInelastic::same_plane(std::size_t c, const double *normal) const
{
  constexpr double SAME = 1.0e-12;    // of 1 - cos of the angle between two unit vectors
  return dot(&problem_.contacts.normal[3 * c], normal) > 1.0 - SAME;
}

// From where a body ends, a part of an intersection of regions may not show the wall that a constraint was
// set for: the plane tells how far it is.
long FixInelastic::follow_unseen(const std::vector<double> &velocity,
                                 const std::unordered_set<std::size_t> &seen,
                                 const std::vector<RegionWalls::Look> &beyond)
{
  std::unordered_set<int> skipped;
  for (const RegionWalls::Look &look : beyond) skipped.insert(look.atom);
  long changed = 0;
  for (const auto &[key, c] : wall_constraint_) {
    const Origin &origin = origin_[c];
    const int i = problem_.contacts.first[c];
    if (!origin.followed || seen.count(c) || skipped.count(i) ||
        rigid_->angle_turned(problem_, i) >= HALF_A_TURN)
      continue;
    const double *const n = &problem_.contacts.normal[3 * c];
    const double turning =
        problem_.timestep * (dot(n, &motion()[3 * i]) - dot(n, &velocity[3 * i]));
    const double linear_gap = effective_gap(origin.gap_now, origin.size) - origin.wall_motion;
    changed += follow(c, linear_gap + turning, false);
  }
  return changed;
}

// Inside a concave wall the distance is not convex: where a sphere ends up overlapping, the wall's
// tangent plane at that end is added. The planes seen before stay: all of them bound the container
// from outside, and at the tip of a cone a sphere rests on several.
long FixInelastic::relinearise_walls(const std::vector<double> &velocity)
{
  long changed = 0;
  const double h = problem_.timestep;
  auto add_plane = [&](const RegionWalls::Look &look, const WallView &view, bool too_deep) {
    if (relinearisations_ > MAX_RELINEARISATIONS) return;
    const int i = look.atom;
    const auto existing = wall_constraint_.find(wall_key(i, view.wall));
    const bool known = existing != wall_constraint_.end();
    const double *const n = view.normal;
    const double *const x = atom->x[i];
    const double from_here[3] = {look.where[0] - x[0], look.where[1] - x[1], look.where[2] - x[2]};
    const double gap_there = view.distance - atom->radius[i];
    const double gap_here = gap_there - dot(n, from_here);
    const double wall_motion = view.distance_now - view.distance;
    // A region can show a wall late: from inside one part of a union the others are not seen. An obstacle
    // that is overlapped is seen; its plane at the end of the step may lie beyond where the sphere is now.
    const double to_plane = gap_here + wall_motion;
    const double gap_now = known ? origin_[existing->second].gap_now
        : view.convex            ? std::max(0.0, to_plane)
                                 : to_plane;
    note_overlap(gap_now, i, -view.wall);
    // Exact for this motion, also where a body turns.
    const double turning = is_member(i) ? h * (dot(n, &motion()[3 * i]) - dot(n, &velocity[3 * i]))
                                        : 0.0;
    const double gap = gap_here + turning - wanted_gap(gap_now, atom->radius[i]);
    if (known && same_plane(existing->second, n)) {
      changed += follow(existing->second, gap, too_deep);
      return;
    }
    if (!too_deep) return;
    ++changed;
    wall_constraint_[wall_key(i, view.wall)] = problem_.contacts.size();
    problem_.contacts.add(i, problem_.particles, view.normal, gap, 0.0);
    origin_.push_back({view.wall, gap_now, atom->radius[i], wall_motion, is_member(i)});
  };

  const std::vector<RegionWalls::Look> &ends = looks_at_end(velocity);
  const bool inexact_only = !rigid_;
  std::vector<RegionWalls::Look> beyond;
  std::unordered_set<std::size_t> seen;
  walls_->view(
      ends, inexact_only,
      [&](const RegionWalls::Look &look, const WallView &view) {
        const auto existing = wall_constraint_.find(wall_key(look.atom, view.wall));
        const bool known = existing != wall_constraint_.end();
        if (known) seen.insert(existing->second);
        const double gap_now = known ? origin_[existing->second].gap_now : 0.0;
        const double gap = view.distance - atom->radius[look.atom];
        const bool too_deep = ends_too_deep(gap_now, atom->radius[look.atom], gap);
        if (too_deep || (known && origin_[existing->second].followed))
          add_plane(look, view, too_deep);
      },
      [&](const RegionWalls::Look &look, const std::string &) {
        beyond.push_back(look);
      });
  if (rigid_) changed += follow_unseen(velocity, seen, beyond);

  double number_beyond = static_cast<double>(beyond.size());
  reduce(&number_beyond, 1, nullptr, 0);
  if (number_beyond > 0.0) {
    for (const RegionWalls::Look &look : beyond)
      output_[EXCESS] = std::max(output_[EXCESS], atom->radius[look.atom]);
    walls_->view(
        last_inside(beyond), inexact_only,
        [&](const RegionWalls::Look &look, const WallView &view) {
          add_plane(look, view, true);
        },
        [](const RegionWalls::Look &, const std::string &) {
        });
  }
  return changed;
}

// From beyond a wall nothing is seen: how far along the step each of these centres is still inside.
// Collective.
std::vector<RegionWalls::Look>
FixInelastic::last_inside(const std::vector<RegionWalls::Look> &beyond)
{
  constexpr int BISECTIONS = 12;
  std::vector<double> inside(beyond.size(), 0.0),
      outside(beyond.size(), 1.0);    // parts of the step
  auto looks_at = [&](const std::vector<double> &part) {
    std::vector<RegionWalls::Look> looks = beyond;
    for (std::size_t k = 0; k < beyond.size(); ++k)
      for (int d = 0; d < 3; ++d)
        looks[k].where[d] += (part[k] - 1.0) * (beyond[k].where[d] - atom->x[beyond[k].atom][d]);
    return looks;
  };
  for (int step = 0; step < BISECTIONS; ++step) {
    std::vector<double> middle(beyond.size());
    for (std::size_t k = 0; k < beyond.size(); ++k) middle[k] = 0.5 * (inside[k] + outside[k]);
    const std::vector<RegionWalls::Look> looks = looks_at(middle);
    std::vector<char> out(beyond.size(), 0);
    walls_->view(
        looks, !rigid_,
        [](const RegionWalls::Look &, const WallView &) {
        },
        [&](const RegionWalls::Look &look, const std::string &) {
          out[&look - looks.data()] = 1;
        });
    for (std::size_t k = 0; k < beyond.size(); ++k) (out[k] ? outside : inside)[k] = middle[k];
  }
  return looks_at(inside);
}

// Beyond the regular overlaps: the smallest motion, added to the step's but not kept as momentum,
// that takes the spheres apart at a bounded speed.
void FixInelastic::push_apart(inelastic::ProjectionResult &result)
{
  const inelastic::ContactSet contacts = problem_.contacts;
  std::copy_n(velocity_.begin(), 3 * static_cast<std::size_t>(problem_.particles),
              problem_.predicted_velocity.begin());
  phase_ = Phase::PUSH;
  relinearisations_ = 0;
  if (rigid_) find_entangled();
  for (std::size_t c = 0; c < problem_.contacts.size(); ++c) {
    const Origin &origin = origin_[c];
    if (is_bad(origin.gap_now))
      problem_.contacts.gap[c] = effective_gap(origin.gap_now, origin.size) - origin.wall_motion;
    problem_.contacts.impulse[c] = 0.0;
    if (origin.wall == 0) disentangle(c);
  }
  const inelastic::ProjectionResult pushed =
      project(std::max(0L, max_iterations_ - result.iterations));
  result.iterations += pushed.iterations;
  result.status = inelastic::worse(result.status, pushed.status);
  result.round_off = std::max(result.round_off, pushed.round_off);
  result.residual.feasibility = std::max(result.residual.feasibility, pushed.residual.feasibility);
  result.residual.complementarity =
      std::max(result.residual.complementarity, pushed.residual.complementarity);

  problem_.contacts = contacts;
  origin_.resize(contacts.size());
  if (rigid_) rigid_->note_push(problem_, velocity_);
}

// Two bodies that are deep in one another overlap at several places, whose normals may ask for
// opposite motions. Such bodies are pushed along the line between their centres instead, which takes
// them apart whatever their shapes; what else is between them waits until they are less entangled.
void FixInelastic::find_entangled()
{
  entangled_.clear();
  const inelastic::ContactSet &contacts = problem_.contacts;
  for (std::size_t c = 0; c < contacts.size(); ++c) {
    const int i = contacts.first[c], j = contacts.second[c];
    if (origin_[c].wall == 0 && (is_member(i) || is_member(j)) &&
        origin_[c].gap_now < -PUSH_LIMIT * origin_[c].size)
      entangled_.insert(pair_of_bodies(i, j));
  }
}

bool FixInelastic::is_entangled(int i, int j) const
{ return phase_ == Phase::PUSH && !entangled_.empty() && entangled_.count(pair_of_bodies(i, j)); }

void FixInelastic::disentangle(std::size_t c)
{
  constexpr double NEVER = 1.0e3;    // of the sum of radii, a gap that no step closes
  inelastic::ContactSet &contacts = problem_.contacts;
  const int i = contacts.first[c], j = contacts.second[c];
  if (!is_entangled(i, j)) return;
  if (!is_bad(origin_[c].gap_now)) {
    contacts.gap[c] = NEVER * origin_[c].size;
    return;
  }
  double apart[3];
  for (int d = 0; d < 3; ++d)
    apart[d] =
        atom->x[i][d] - rigid_->arm(problem_, i)[d] - atom->x[j][d] + rigid_->arm(problem_, j)[d];
  const double distance = norm(apart);
  if (distance > COINCIDENT * origin_[c].size)
    for (int d = 0; d < 3; ++d) contacts.normal[3 * c + d] = apart[d] / distance;
}

// The same for all pairs of spheres of two bodies (or of a body and a free sphere).
std::uint64_t FixInelastic::pair_of_bodies(int i, int j) const
{
  auto number = [this](int k) {
    const int body = problem_.bodies.body[k];
    return static_cast<std::uint32_t>(body < 0 ? problem_.bodies.size() + k : body);
  };
  const std::uint64_t a = number(i), b = number(j);
  return std::min(a, b) << 32 | std::max(a, b);
}

void FixInelastic::apply_forces(double kick_steps)
{
  const PhaseClock::Within within(clock_, PhaseClock::APPLY);
  const double h = problem_.timestep;
  const int *const mask = atom->mask;
  for (int i = 0; i < atom->nlocal; ++i) {
    double *const state = state_[i];
    if (!(mask[i] & groupbit)) {
      state[EXPECTED_RADIUS] = OUTSIDE;
      continue;
    }
    state[EXPECTED_RADIUS] = atom->radius[i];
    if (is_member(i)) {
      for (int d = 0; d < 3; ++d) {
        atom->f[i][d] += contact_force_[3 * i + d];
        state[EXPECTED_X + d] = atom->x[i][d] + h * motion()[3 * i + d];
      }
      const bool whole_kick = kick_steps == 1.0;
      const bool last = whole_kick && update->ntimestep == update->laststep;
      rigid_->finish(problem_, i, {kick_ * force->ftm2v, whole_kick, last}, contact_force_.data(),
                     atom->f[i]);
      rigid_->velocity_after(problem_, i, state + EXPECTED_V);
      continue;
    }
    const bool moves = problem_.inverse_mass[i] > 0.0;
    for (int d = 0; d < 3; ++d) {
      const double v = velocity_[3 * i + d];
      if (moves) {
        const double without =
            atom->v[i][d] + kick_ * force->ftm2v * problem_.inverse_mass[i] * atom->f[i][d];
        atom->f[i][d] += (v - without) / (kick_ * force->ftm2v * problem_.inverse_mass[i]);
      }
      const double push = bad_overlap_ && moves ? v - problem_.predicted_velocity[3 * i + d] : 0.0;
      if (kick_steps == 1.0) state[PUSH_HELD + d] = 0.5 * (state[PUSH_NEXT + d] + push);
      state[PUSH_NEXT + d] = push;
      state[EXPECTED_V + d] = v;
      state[EXPECTED_X + d] = atom->x[i][d] + h * v;
    }
  }
}

// Compares what moved with what the last step predicted.
void FixInelastic::check_expected()
{
  const double h = problem_.timestep;    // of the step that is over, shortened or not
  std::string message;
  for (int i = 0; i < atom->nlocal && message.empty(); ++i) {
    if (!(atom->mask[i] & groupbit)) continue;
    const double *const state = state_[i];
    if (state[EXPECTED_RADIUS] == OUTSIDE) {
      message =
          fmt::format("atom {} has joined group {} during the run: change groups between runs",
                      atom->tag[i], group->names[igroup]);
      break;
    }
    if (atom->radius[i] != state[EXPECTED_RADIUS]) {
      const std::string changing = scene_.fixes_that_change_radii();
      message = fmt::format("the radius of atom {} has changed during the run by {:.3g}, and the "
                            "contacts do not follow it: change radii between runs{}{}",
                            atom->tag[i], atom->radius[i] - state[EXPECTED_RADIUS],
                            changing.empty() ? "" : ". Fixes that may have:", changing);
      break;
    }
    double off[3] = {atom->x[i][0] - state[EXPECTED_X], atom->x[i][1] - state[EXPECTED_X + 1],
                     atom->x[i][2] - state[EXPECTED_X + 2]};
    domain->minimum_image(FLERR, off);
    const double faster[3] = {atom->v[i][0] - state[EXPECTED_V],
                              atom->v[i][1] - state[EXPECTED_V + 1],
                              atom->v[i][2] - state[EXPECTED_V + 2]};
    const bool frozen = (atom->mask[i] & frozen_bit_) != 0;
    const double round_off = EXPECTED_RELATIVE *
        (norm(atom->x[i]) + largest_radius_ + h * (norm(&state[EXPECTED_V]) + largest_kick_)) *
        (rigid_ ? rigid_->round_off_growth(i) : 1.0);
    const double allowed = (frozen ? 1.0 : EXPECTED_IN_EPS) * tolerance_ + round_off;
    const double position_error = norm(off);
    const double velocity_error = frozen ? 0.0 : h * norm(faster);
    if (position_error <= allowed && velocity_error <= allowed) continue;

    if (frozen) {
      message = fmt::format(
          "frozen atom {} is {:.3g} away from where its velocity takes it: give it the velocity "
          "that it moves "
          "with (command velocity), the same during a step, or none if nothing moves it",
          atom->tag[i], position_error);
      break;
    }
    std::string later;
    bool passed = false;
    const auto &fixes = modify->get_fix_list();
    for (std::size_t k = 0; k < fixes.size(); ++k) {
      if (fixes[k] == this)
        passed = true;
      else if ((passed && (modify->fmask[k] & POST_FORCE)) || (modify->fmask[k] & END_OF_STEP))
        later += fmt::format(" {} ({})", fixes[k]->id, fixes[k]->style);
    }
    std::string unfrozen;
    for (const Fix *fix : modify->get_fix_by_style("^move$"))
      if (atom->mask[i] & fix->groupbit)
        unfrozen =
            fmt::format("atom {} is moved by fix {} (move) and is not frozen: name its group "
                        "with the keyword frozen",
                        atom->tag[i], fix->id);
    if (!unfrozen.empty()) {
      message = unfrozen;
      break;
    }
    const std::string mover = !is_member(i) ? "nve or nve/sphere"
                                            : fmt::format("{} (without its keywords gravity and "
                                                          "langevin, forces not taken early)",
                                                          rigid_->fix()->id);
    message = fmt::format("atom {} did not move as predicted: its {} is off by {:.3g}. Move it "
                          "with fix {} alone; define every fix that adds forces before fix {}; let "
                          "nothing else change velocities{}{}",
                          atom->tag[i], position_error > velocity_error ? "position" : "velocity",
                          position_error > velocity_error ? position_error : norm(faster), mover,
                          id, later.empty() ? "" : ". Fixes that may have:", later);
  }
  if (rigid_) {
    double failed = message.empty() ? 0.0 : 1.0;
    reduce(&failed, 1, nullptr, 0);
    // Masses and moments agreed when the run began.
    if (failed > 0.0) {
      rigid_->measure(problem_);
      if (!rigid_->disagreement(problem_).empty())
        message = fmt::format("the spheres of a body have moved against one another: another fix "
                              "moves them beside fix {}",
                              rigid_->fix()->id);
    }
  }
  fail_together(message);
}

/* ----------------------------------------------------------------------
   the neighbour list's reach
------------------------------------------------------------------------- */

// The largest difference between two of the vectors (3 doubles each) of this fix's atoms, from above:
// the diagonal of their bounding box, or the diameter of a ball about its centre.
double FixInelastic::spread(const double *values)
{
  double maxima[6];
  std::fill_n(maxima, 6, -EXTREME);
  for (int i = 0; i < atom->nlocal; ++i) {
    if (!(atom->mask[i] & groupbit)) continue;
    for (int d = 0; d < 3; ++d) {
      maxima[d] = std::max(maxima[d], values[3 * i + d]);
      maxima[3 + d] = std::max(maxima[3 + d], -values[3 * i + d]);
    }
  }
  reduce(nullptr, 0, maxima, 6);
  const double extent[3] = {maxima[0] + maxima[3], maxima[1] + maxima[4], maxima[2] + maxima[5]};
  if (extent[0] < 0.0) return 0.0;
  double farthest = 0.0;
  for (int i = 0; i < atom->nlocal; ++i) {
    if (!(atom->mask[i] & groupbit)) continue;
    double from_centre[3];
    for (int d = 0; d < 3; ++d)
      from_centre[d] = values[3 * i + d] - 0.5 * (maxima[d] - maxima[3 + d]);
    farthest = std::max(farthest, dot(from_centre, from_centre));
  }
  reduce(nullptr, 0, &farthest, 1);
  return std::min(norm(extent), 2.0 * std::sqrt(farthest));
}

// Pairs that are not listed were at least list_reach_ apart when the list was built.
bool FixInelastic::list_reaches(const std::vector<double> &motion)
{ return spread_at_start_ + update->dt * spread(motion.data()) <= list_reach_; }

// LAMMPS brings an atom back into a periodic box from the next image alone, and hands it to the next
// rank alone (with two ranks in a direction, the other one is the next on both sides).
void FixInelastic::measure_farthest()
{
  double narrowest[3];
  for (int d = 0; d < 3; ++d)
    narrowest[d] = domain->triclinic ? domain->sublo_lamda[d] - domain->subhi_lamda[d]
                                     : (domain->sublo[d] - domain->subhi[d]) / domain->prd[d];
  reduce(nullptr, 0, narrowest, 3);
  for (int d = 0; d < 3; ++d) {
    const bool tiled = comm->layout == Comm::LAYOUT_TILED;
    const int ranks = tiled ? comm->nprocs : comm->procgrid[d];
    farthest_[d] = domain->periodicity[d] ? 1.0 : EXTREME;
    if (ranks > 2) farthest_[d] = std::min(farthest_[d], -narrowest[d]);
  }
}

// Collective: how far some atom will have gone since the list was built, as a part of that.
double FixInelastic::part_of_farthest()
{
  if (std::min({farthest_[0], farthest_[1], farthest_[2]}) == EXTREME) return 0.0;
  const double *const inverse = domain->h_inv;
  double part = 0.0;
  for (int i = 0; i < atom->nlocal; ++i) {
    double gone[3];
    for (int d = 0; d < 3; ++d)
      gone[d] = atom->x[i][d] - position_at_build_[3 * i + d] + update->dt * motion()[3 * i + d];
    const double of_box[3] = {inverse[0] * gone[0] + inverse[5] * gone[1] + inverse[4] * gone[2],
                              inverse[1] * gone[1] + inverse[3] * gone[2], inverse[2] * gone[2]};
    for (int d = 0; d < 3; ++d) part = std::max(part, std::abs(of_box[d]) / farthest_[d]);
  }
  reduce(nullptr, 0, &part, 1);
  return part;
}

// The part of the time step for which the list would reach, with some reserve, where velocities have
// the spread `whole` in the whole step and `none` before its forces: in a part s, whose kick is
// smaller, they have at most (1 - s) none + s whole.
double FixInelastic::room_in_list(double none, double whole) const
{
  constexpr double RESERVE = 0.9;
  const double room = RESERVE * (list_reach_ - spread_at_start_) / update->dt;
  return 2.0 * room / (none + std::sqrt(none * none + 4.0 * (whole - none) * room));
}

// The spread of the velocities with the forces alone. Bodies turn in other ways: this is about it.
double FixInelastic::unhindered_spread(double kick_steps)
{
  unhindered_.resize(3 * static_cast<std::size_t>(atom->nlocal));
  for (int i = 0; i < atom->nlocal; ++i) {
    const bool moves = (atom->mask[i] & groupbit) && !(atom->mask[i] & frozen_bit_);
    const double kick_per_force = moves ? kick_steps * update->dt * force->ftm2v / mass(i) : 0.0;
    for (int d = 0; d < 3; ++d)
      unhindered_[3 * i + d] = atom->v[i][d] + kick_per_force * atom->f[i][d];
  }
  return spread(unhindered_.data());
}

// Spread of the displacements since the list was built, at present or after a step's motion.
double FixInelastic::spread_since_build(const double *motion)
{
  displacement_.resize(3 * static_cast<std::size_t>(atom->nlocal));
  for (int i = 0; i < atom->nlocal; ++i)
    for (int d = 0; d < 3; ++d)
      displacement_[3 * i + d] = atom->x[i][d] - position_at_build_[3 * i + d] +
          (motion ? problem_.timestep * motion[3 * i + d] : 0.0);
  growth_ = strayed_ = 0.0;
  for (int i = 0; i < atom->nlocal; ++i) {
    growth_ = std::max(growth_, atom->radius[i] - radius_at_build_[i]);
    for (int d = 0; d < 3; ++d)
      strayed_ = std::max(strayed_, std::abs(displacement_[3 * i + d]) / own_width_[d]);
  }
  double maxima[2] = {growth_, strayed_};
  reduce(nullptr, 0, maxima, 2);
  growth_ = maxima[0];
  strayed_ = maxima[1];
  return spread(displacement_.data()) + 2.0 * growth_;
}

// After a shortened step.
void FixInelastic::restore_timestep()
{
  if (restart_global && update->dt != regular_timestep_) set_timestep(regular_timestep_);
  restart_global = 0;
}

// The timestep command, also where no init() follows (run pre no). The fix's own changes return to
// the regular step.
void FixInelastic::reset_dt()
{
  if (!setting_timestep_) regular_timestep_ = update->dt;
}

void FixInelastic::set_timestep(double timestep)
{
  setting_timestep_ = true;
  update->update_time();
  update->dt = timestep;
  update->dt_default = 0;
  if (force->pair) force->pair->reset_dt();
  for (Fix *fix : modify->get_fix_list()) fix->reset_dt();
  output->reset_dt();
  setting_timestep_ = false;
}

void FixInelastic::shorten_step(double factor)
{
  const double timestep = factor * update->dt;
  if (timestep < SHORTEST_STEP * regular_timestep_)
    error->all(FLERR, "Fix inelastic: step {}: no time step above {:.3g} keeps the spheres apart{}",
               update->ntimestep, timestep,
               worst_.empty() ? " and within reach of the neighbour list: lower the timestep"
                              : ": " + worst_);
  if (update->dt == regular_timestep_) {
    output_[SHORTENED_STEPS] += 1.0;
    run_shortened_ += 1;
  }
  set_timestep(timestep);
}

/* ----------------------------------------------------------------------
   output
------------------------------------------------------------------------- */

void FixInelastic::update_outputs(const inelastic::ProjectionResult &result)
{
  const PhaseClock::Within within(clock_, PhaseClock::APPLY);
  const inelastic::ContactSet &contacts = problem_.contacts;
  const int nlocal = atom->nlocal;
  const double force_per_impulse = 1.0 / (kick_ * force->ftm2v);

  contact_force_.assign(3 * static_cast<std::size_t>(problem_.particles + 1), 0.0);
  contact_count_.assign(3 * static_cast<std::size_t>(problem_.particles + 1), 0.0);
  if (vflag_atom) {
    virial_diagonal_.assign(contact_force_.size(), 0.0);
    virial_off_diagonal_.assign(contact_force_.size(), 0.0);
  }
  std::fill(wall_force_.begin(), wall_force_.end(), 0.0);
  wall_force_step_ = -1;
  std::size_t active = 0;
  for (const double impulse : contacts.impulse)
    if (impulse > 0.0) ++active;
  if (static_cast<int>(active) > max_contacts_) {
    max_contacts_ = static_cast<int>(active) * 5 / 4 + 16;
    memory->grow(array_local, max_contacts_, 10, "inelastic:array_local");
  }

  double counts[2] = {0.0, 0.0};
  int row = 0;
  // The angular momentum of a body is carried along: so is its round-off.
  if (!rigid_ || !expecting_) largest_kick_ = 0.0;
  for (std::size_t c = 0; c < contacts.size(); ++c) {
    if (!(contacts.impulse[c] > 0.0)) continue;
    const int i = contacts.first[c];
    const int j = contacts.second[c];
    const double *const n = &contacts.normal[3 * c];
    const double strength = contacts.impulse[c] * force_per_impulse;
    const Origin &origin = origin_[c];
    const bool is_wall = origin.wall != 0;
    counts[is_wall] += 1.0;
    largest_kick_ = std::max(
        largest_kick_, contacts.impulse[c] * (problem_.inverse_mass[i] + problem_.inverse_mass[j]));
    contact_count_[3 * i + is_wall] += 1.0;
    for (int d = 0; d < 3; ++d) {
      contact_force_[3 * i + d] += strength * n[d];
      contact_force_[3 * j + d] -= strength * n[d];
      if (is_wall) wall_force_[3 * (origin.wall - 1) + d] -= strength * n[d];
    }
    if (!is_wall) contact_count_[3 * j] += 1.0;

    const double to_point = atom->radius[i] + (is_wall ? origin.gap_now : 0.5 * origin.gap_now);
    double *const out = array_local[row++];
    out[0] = static_cast<double>(atom->tag[i]);
    out[1] = is_wall ? -origin.wall : static_cast<double>(atom->tag[j]);
    for (int d = 0; d < 3; ++d) {
      out[2 + d] = atom->x[i][d] - to_point * n[d];
      out[5 + d] = n[d];
    }
    out[8] = origin.gap_now;
    out[9] = strength;

    if (evflag) {
      const double arm = is_wall ? to_point : origin.size + origin.gap_now;
      double v[6] = {arm * strength * n[0] * n[0], arm * strength * n[1] * n[1],
                     arm * strength * n[2] * n[2], arm * strength * n[0] * n[1],
                     arm * strength * n[0] * n[2], arm * strength * n[1] * n[2]};
      tally_virial(i, is_wall ? i : j, v);
    }
  }
  size_local_rows = row;
  share_virial();

  sum_over_copies(contact_force_.data());
  sum_over_copies(contact_count_.data());
  for (int i = 0; i < nlocal; ++i) {
    array_atom[i][0] = contact_count_[3 * i];
    array_atom[i][1] = contact_count_[3 * i + 1];
    for (int d = 0; d < 3; ++d) array_atom[i][2 + d] = contact_force_[3 * i + d];
  }

  double sums[3] = {counts[0], counts[1], static_cast<double>(contacts.size())};
  reduce(sums, 3, &largest_kick_, 1);
  output_[PARTICLE_CONTACTS] = sums[0];
  output_[WALL_CONTACTS] = sums[1];
  output_[CONSTRAINTS] = sums[2];
  output_[ITERATIONS] = static_cast<double>(result.iterations);
  output_[FEASIBILITY] = result.residual.feasibility;
  output_[COMPLEMENTARITY] = result.residual.complementarity;
  output_[ROUNDS] = result.rounds;
  output_[TOTAL_ITERATIONS] += static_cast<double>(result.iterations);

  ++run_steps_;
  run_iterations_ += static_cast<double>(result.iterations);
  run_largest_overlap_ = std::max(run_largest_overlap_, output_[OVERLAP]);
  run_largest_excess_ = std::max(run_largest_excess_, output_[EXCESS]);
  if (bad_overlap_) {
    ++run_pushed_;
    run_deepest_start_ = std::max(run_deepest_start_, output_[OVERLAP]);
  }
}

// Half to each side; a wall's half goes to the sphere as well.
void FixInelastic::tally_virial(int i, int j, const double *v)
{
  if (vflag_global)
    for (int k = 0; k < 6; ++k) virial[k] += v[k];
  if (vflag_atom)
    for (int k = 0; k < 3; ++k) {
      virial_diagonal_[3 * i + k] += 0.5 * v[k];
      virial_diagonal_[3 * j + k] += 0.5 * v[k];
      virial_off_diagonal_[3 * i + k] += 0.5 * v[3 + k];
      virial_off_diagonal_[3 * j + k] += 0.5 * v[3 + k];
    }
}

void FixInelastic::share_virial()
{
  if (!vflag_atom) return;
  sum_over_copies(virial_diagonal_.data());
  sum_over_copies(virial_off_diagonal_.data());
  for (int i = 0; i < atom->nlocal; ++i)
    for (int k = 0; k < 3; ++k) {
      vatom[i][k] += virial_diagonal_[3 * i + k];
      vatom[i][3 + k] += virial_off_diagonal_[3 * i + k];
    }
}

double FixInelastic::compute_vector(int n)
{ return output_[n]; }

double FixInelastic::compute_array(int wall, int direction)
{
  if (wall_force_step_ != update->ntimestep) {
    MPI_Allreduce(wall_force_.data(), wall_force_total_.data(),
                  static_cast<int>(wall_force_.size()), MPI_DOUBLE, MPI_SUM, world);
    wall_force_step_ = update->ntimestep;
  }
  return wall_force_total_[3 * wall + direction];
}

/* ----------------------------------------------------------------------
   what is remembered from step to step, and follows the atoms
------------------------------------------------------------------------- */

// Both atoms of a contact remember it, those of other ranks included: the next neighbour list may
// show the pair from the other side, and atoms may migrate before it is built.
void FixInelastic::remember_contacts()
{
  const PhaseClock::Within within(clock_, PhaseClock::APPLY);
  const inelastic::ContactSet &contacts = problem_.contacts;
  const double force_per_impulse = 1.0 / (kick_ * force->ftm2v);
  for (int i = 0; i < problem_.particles; ++i) memory_.forget(i);
  for (std::size_t c = 0; c < contacts.size(); ++c) {
    if (!(contacts.impulse[c] > 0.0)) continue;
    const int i = contacts.first[c];
    const int j = contacts.second[c];
    const int wall = origin_[c].wall;
    const double strength = contacts.impulse[c] * force_per_impulse;
    memory_.remember(i, wall ? -wall : atom->tag[j], strength);
    if (!wall) memory_.remember(j, atom->tag[i], strength);
  }
  exchange(Exchange::MEMORY, true, false);
  double most = 0.0;
  for (int i = 0; i < atom->nlocal; ++i)
    most = std::max(most, static_cast<double>(memory_.number_of_partners(i)));
  reduce(nullptr, 0, &most, 1);
  maxexchange = carried_size() + ContactMemory::packed_size(static_cast<int>(most));
}

void FixInelastic::grow_arrays(int nmax)
{
  memory->grow(state_, nmax, STATE_SIZE, "inelastic:state");
  memory->grow(array_atom, nmax, size_peratom_cols, "inelastic:array_atom");
  memory_.resize(nmax);
  if (rigid_) rigid_->resize(nmax);
  max_atoms_ = nmax;
}

void FixInelastic::copy_arrays(int i, int j, int)
{
  std::copy_n(state_[i], STATE_SIZE, state_[j]);
  std::copy_n(array_atom[i], size_peratom_cols, array_atom[j]);
  memory_.copy(i, j);
  if (rigid_) rigid_->copy(i, j);
}

void FixInelastic::set_arrays(int i)
{
  std::fill_n(state_[i], STATE_SIZE, 0.0);
  std::fill_n(array_atom[i], size_peratom_cols, 0.0);
  memory_.forget(i);
  if (rigid_) rigid_->forget(i);
  // An atom that is created during a run moves on from where it is.
  std::copy_n(atom->x[i], 3, state_[i] + EXPECTED_X);
  std::copy_n(atom->v[i], 3, state_[i] + EXPECTED_V);
  state_[i][EXPECTED_RADIUS] = atom->radius[i];
}

int FixInelastic::pack_exchange(int i, double *buffer)
{
  double *out = std::copy_n(state_[i], STATE_SIZE, buffer);
  if (rigid_) out += rigid_->pack(i, out);
  out += memory_.pack(i, out, memory_.number_of_partners(i));
  return static_cast<int>(out - buffer);
}

int FixInelastic::unpack_exchange(int i, double *buffer)
{
  std::copy_n(buffer, STATE_SIZE, state_[i]);
  std::fill_n(array_atom[i], size_peratom_cols, 0.0);
  memory_.forget(i);
  double *in = buffer + STATE_SIZE;
  if (rigid_) in += rigid_->unpack(i, in);
  in += memory_.unpack(i, in);
  return static_cast<int>(in - buffer);
}

// Restart files that are written during a run hold velocities with the push in them: it goes along,
// with the velocity that it belongs to. Most atoms have none. Where none has, the file holds nothing
// of this fix: LAMMPS would refuse change_box after it.
int FixInelastic::pack_restart(int i, double *buffer)
{
  const int size = size_restart(i);
  if (size == 0) return size;
  double *out = buffer;
  *out++ = size;
  if (size == 1) return size;
  out = std::copy_n(atom->v[i], 3, out);
  out = std::copy_n(state_[i] + PUSH_HELD, 3, out);
  if (rigid_) rigid_->pack_held(i, out);
  return size;
}

void FixInelastic::unpack_restart(int i, int nth)
{
  const double *in = atom->extra[i];
  for (int k = 0; k < nth; ++k) in += static_cast<int>(*in);
  const int size = static_cast<int>(*in++);
  if (size == 1) return;
  // A velocity that was set since is all momentum.
  if (!std::equal(in, in + 3, atom->v[i])) return;
  for (int d = 0; d < 3; ++d) atom->v[i][d] -= in[3 + d];
  if (rigid_ && size == maxsize_restart()) rigid_->unpack_held(i, in + 6);
}

int FixInelastic::size_restart(int i)
{
  if (!restart_peratom) return 0;
  const double *const held = state_[i] + PUSH_HELD;
  const bool pushed = held[0] != 0.0 || held[1] != 0.0 || held[2] != 0.0;
  return pushed || (rigid_ && rigid_->has_held(i)) ? maxsize_restart() : 1;
}

int FixInelastic::maxsize_restart()
{ return 7 + (rigid_ ? RigidMotion::HELD_SIZE : 0); }

// A file that is written while a step is shortened holds its time step: the regular one goes along.
// In other files there is nothing of this fix.
void FixInelastic::write_restart(FILE *file)
{
  if (comm->me != 0) return;
  const double timesteps[2] = {update->dt, regular_timestep_};
  const int size = sizeof(timesteps);
  fwrite(&size, sizeof(size), 1, file);
  fwrite(timesteps, sizeof(timesteps), 1, file);
}

// A time step that was set since stays.
void FixInelastic::restart(char *buffer)
{
  double timesteps[2];
  std::memcpy(timesteps, buffer, sizeof(timesteps));
  if (update->dt == timesteps[0]) set_timestep(timesteps[1]);
}

/* ----------------------------------------------------------------------
   communication
------------------------------------------------------------------------- */

bool FixInelastic::has_copies() const
{ return comm->nprocs > 1 || atom->nghost > 0; }

void FixInelastic::sum_over_copies(double *per_particle)
{
  exchanged_ = per_particle;
  exchange(Exchange::VECTORS, true, true);
}

void FixInelastic::share_with_copies(double *per_particle)
{
  exchanged_ = per_particle;
  exchange(Exchange::VECTORS, false, true);
}

void FixInelastic::choose_copies(const std::vector<char> &chosen)
{
  chosen_copies_.begin(chosen);
  exchange(Exchange::CHOICE, true, false);
}

void FixInelastic::sum_over_chosen_copies(double *per_particle)
{
  exchanged_ = per_particle;
  exchange(Exchange::CHOSEN, true, true);
}

void FixInelastic::sum_over_chosen_copies(float *per_particle)
{
  exchanged_single_ = per_particle;
  exchange(Exchange::CHOSEN_SINGLE, true, true);
}

// `reverse`: copies tell their originals; `forward`, after that: originals tell their copies.
void FixInelastic::exchange(Exchange what, bool reverse, bool forward)
{
  if (!has_copies()) return;
  const PhaseClock::Within within(clock_, PhaseClock::COMMUNICATE);
  exchanging_ = what;
  if (reverse) comm->reverse_comm(this);
  if (forward) comm->forward_comm(this);
}

void FixInelastic::reduce(double *sums, int number_of_sums, double *maxima, int number_of_maxima)
{
  if (comm->nprocs == 1) return;
  const PhaseClock::Within within(clock_, PhaseClock::COMMUNICATE);
  Reduced mine{};
  std::copy_n(sums, number_of_sums, mine.sums);
  std::fill_n(mine.maxima, REDUCED_MAXIMA, -EXTREME);
  std::copy_n(maxima, number_of_maxima, mine.maxima);
  Reduced all{};
  MPI_Allreduce(&mine, &all, 1, reduction_type_, reduction_, world);
  std::copy_n(all.sums, number_of_sums, sums);
  std::copy_n(all.maxima, number_of_maxima, maxima);
}

int FixInelastic::pack_forward_comm(int n, int *list, double *buffer, int, int *)
{
  if (n == 0) return 0;
  if (exchanging_ == Exchange::CHOSEN)
    return chosen_copies_.pack_originals(list, exchanged_, buffer);
  if (exchanging_ == Exchange::CHOSEN_SINGLE)
    return chosen_copies_.pack_originals(list, exchanged_single_, buffer);
  for (int k = 0; k < n; ++k) std::copy_n(exchanged_ + 3 * list[k], 3, buffer + 3 * k);
  return 3 * n;
}

void FixInelastic::unpack_forward_comm(int n, int first, double *buffer)
{
  if (n == 0) return;
  if (exchanging_ == Exchange::CHOSEN)
    chosen_copies_.set_copies(first, buffer, exchanged_);
  else if (exchanging_ == Exchange::CHOSEN_SINGLE)
    chosen_copies_.set_copies(first, buffer, exchanged_single_);
  else
    std::copy_n(buffer, 3 * n, exchanged_ + 3 * first);
}

int FixInelastic::pack_reverse_comm(int n, int first, double *buffer)
{
  constexpr int MEMORY_SIZE = ContactMemory::packed_size(SHARED_PARTNERS);
  if (n == 0) return 0;
  switch (exchanging_) {
    case Exchange::MEMORY:
      for (int k = 0; k < n; ++k)
        memory_.pack(first + k, buffer + k * MEMORY_SIZE, SHARED_PARTNERS);
      return n * MEMORY_SIZE;
    case Exchange::CHOICE:
      return chosen_copies_.pack_choice(n, first, buffer);
    case Exchange::CHOSEN:
      return chosen_copies_.pack_copies(first, exchanged_, buffer);
    case Exchange::CHOSEN_SINGLE:
      return chosen_copies_.pack_copies(first, exchanged_single_, buffer);
    case Exchange::VECTORS:
      break;
  }
  std::copy_n(exchanged_ + 3 * first, 3 * n, buffer);
  return 3 * n;
}

void FixInelastic::unpack_reverse_comm(int n, int *list, double *buffer)
{
  constexpr int MEMORY_SIZE = ContactMemory::packed_size(SHARED_PARTNERS);
  if (n == 0) return;
  switch (exchanging_) {
    case Exchange::MEMORY:
      for (int k = 0; k < n; ++k) memory_.unpack(list[k], buffer + k * MEMORY_SIZE);
      return;
    case Exchange::CHOICE:
      chosen_copies_.unpack_choice(n, list, buffer);
      return;
    case Exchange::CHOSEN:
      chosen_copies_.add_to_originals(list, buffer, exchanged_);
      return;
    case Exchange::CHOSEN_SINGLE:
      chosen_copies_.add_to_originals(list, buffer, exchanged_single_);
      return;
    case Exchange::VECTORS:
      break;
  }
  for (int k = 0; k < n; ++k)
    for (int d = 0; d < 3; ++d) exchanged_[3 * list[k] + d] += buffer[3 * k + d];
}

/* ----------------------------------------------------------------------
   when things go wrong
------------------------------------------------------------------------- */

// Collective: stops with the message of the first rank that has one.
void FixInelastic::fail_together(const std::string &message)
{
  int speaker = message.empty() ? comm->nprocs : comm->me;
  if (comm->nprocs > 1) {
    const PhaseClock::Within within(clock_, PhaseClock::COMMUNICATE);
    int mine = speaker;
    MPI_Allreduce(&mine, &speaker, 1, MPI_INT, MPI_MIN, world);
  }
  if (speaker == comm->nprocs) return;
  error->all(FLERR, "Fix inelastic: step {}: {}", update->ntimestep, said_by(speaker, message));
}

// Collective: the text of one of the ranks.
std::string FixInelastic::said_by(int rank, std::string text) const
{
  int length = static_cast<int>(text.size());
  MPI_Bcast(&length, 1, MPI_INT, rank, world);
  text.resize(length);
  MPI_Bcast(text.data(), length, MPI_CHAR, rank, world);
  return text;
}

// Collective: the constraint of all ranks that is farthest from being met.
void FixInelastic::note_worst(const inelastic::ProjectionResult &result)
{
  struct {
    double size;
    int rank;
  } mine = {-1.0, comm->me}, worst;
  worst_.clear();
  if (result.worst != inelastic::ProjectionResult::NONE) {
    const std::size_t c = result.worst;
    const int wall = origin_[c].wall;
    const tagint first = atom->tag[problem_.contacts.first[c]];
    const std::string sides = wall
        ? fmt::format("atom {} and wall {}", first, wall)
        : fmt::format("atoms {} and {}", first, atom->tag[problem_.contacts.second[c]]);
    mine.size = std::abs(result.worst_gap);
    worst_ = result.worst_gap < 0.0
        ? fmt::format("{} overlap by {:.4g} at its end", sides, mine.size)
        : fmt::format("{} keep a gap of {:.4g} under a force", sides, mine.size);
  }
  MPI_Allreduce(&mine, &worst, 1, MPI_DOUBLE_INT, MPI_MAXLOC, world);
  worst_ = said_by(worst.rank, worst_);
}

// Collective: by which a body would turn in the step without contacts [radians].
double FixInelastic::largest_angle()
{
  double angle = 0.0;
  for (int i = 0; i < atom->nlocal; ++i)
    if (is_member(i)) angle = std::max(angle, rigid_->angle_predicted(problem_, i));
  reduce(nullptr, 0, &angle, 1);
  return angle;
}

void FixInelastic::unconverged(const inelastic::ProjectionResult &result, bool no_room)
{
  // Up to here a residual can come down, but need not.
  constexpr double NEAR_ROUND_OFF = 10.0;
  // In half of the iterations or more; without room it stays, and otherwise falls by half or faster.
  constexpr double STILL_FALLS = 0.7;
  constexpr double UNSEEN = 100.0;
  constexpr double LONG_ARC = 1.0;    // [radians]
  ++run_unconverged_;
  const std::string named = worst_.empty() ? "" : ": " + worst_;    // numbers may not be finite
  std::string message, cause;
  if (no_room) {
    const std::string shorter = result.status == inelastic::Status::INFEASIBLE
        ? ""
        : fmt::format(", and {} iterations found none for a time step of only {:.3g}",
                      result.iterations, update->dt);
    message = fmt::format("step {}: no velocities keep the surfaces apart{}{}, where {:.4g} is "
                          "allowed",
                          update->ntimestep, shorter, named, tolerance_);
    // With the gaps of the present positions alone there were velocities.
    const bool at_end_alone = solved_relinearised_ && !shorten_;
    cause = at_end_alone
        ? fmt::format("There are some for the gaps as they change at first, and none for those at "
                      "the end of the step, until which {}: lower the timestep, or use shorten yes",
                      rigid_ ? "bodies turn" : "walls curve")
        : "The scene leaves no room for the spheres: walls or frozen spheres close in, or there "
          "are too many spheres";
  } else {
    message = fmt::format("step {}: {} iterations left an overlap of {:.4g} and a gap under a "
                          "force of {:.4g}, where {:.4g} is allowed{}",
                          update->ntimestep, result.iterations, result.residual.feasibility,
                          result.residual.complementarity, tolerance_, named);
    const std::string help = fmt::format(
        "raise maxiter ({}), raise the tolerance, or lower the timestep", max_iterations_);
    double before = result.trend.earlier();
    const double now = result.trend.least();
    // Of constraints that were found after the last iteration it knows nothing.
    if (result.residual.feasibility > UNSEEN * now)
      before = std::numeric_limits<double>::infinity();
    if (tolerance_ < NEAR_ROUND_OFF * result.round_off)
      cause =
          fmt::format("The tolerance is below the round-off of these forces: raise it to {:.2g}",
                      NEAR_ROUND_OFF * result.round_off);
    else if (now < STILL_FALLS * before && std::isfinite(before))
      cause = fmt::format("The residual is still coming down, as it does where there is room "
                          "(from {:.3g} to {:.3g} lately): {}",
                          before, now, help);
    else if (std::isfinite(before))
      cause =
          fmt::format("The residual no longer comes down (from {:.3g} to {:.3g} lately): the scene "
                      "leaves no room for the spheres, or needs far more iterations: {}",
                      before, now, help);
    else
      cause = fmt::format("Either the scene leaves no room for the spheres, or: {}", help);
  }
  // Gaps that follow spheres on long arcs may contradict one another where there is room enough.
  const double angle = rigid_ && relinearised_ ? largest_angle() : 0.0;
  if (angle > LONG_ARC)
    cause = fmt::format("Bodies spin by up to {:.3g} radians in this step: lower the timestep{}",
                        angle, shorten_ ? "" : ", or use shorten yes");
  if (!warn_only_) error->all(FLERR, "Fix inelastic: {}. {}", message, cause);
  if (comm->me == 0) error->warning(FLERR, "Fix inelastic: {}", message);
}

/* ----------------------------------------------------------------------
   record
------------------------------------------------------------------------- */

// One .npz per recorded step; ../doc/fix_inelastic.md lists its arrays.
void FixInelastic::record_problem(const inelastic::ProjectionResult &result)
{
  constexpr int PER_ATOM = 17;
  constexpr int PER_CONTACT = 10;
  constexpr int PER_BODY = 8;
  const inelastic::RigidBodies &rigid_bodies = problem_.bodies;
  std::vector<double> atoms, contacts, bodies;
  for (int i = 0; i < atom->nlocal; ++i) {
    if (!(atom->mask[i] & groupbit)) continue;
    const double *const predicted = &problem_.predicted_velocity[3 * i];
    const double *const projected = &velocity_[3 * i];
    const double *const x = atom->x[i];
    for (const double value : {static_cast<double>(atom->tag[i]), problem_.inverse_mass[i],
                               atom->radius[i], x[0], x[1], x[2], predicted[0], predicted[1],
                               predicted[2], projected[0], projected[1], projected[2], mass(i)})
      atoms.push_back(value);
    const double free[4] = {};
    if (!is_member(i)) {
      atoms.insert(atoms.end(), free, free + 4);
      continue;
    }
    const int b = rigid_bodies.body[i];
    const int place = rigid_bodies.place[i];
    const double molecule = static_cast<double>(atom->molecule[i]);
    atoms.push_back(molecule);
    atoms.insert(atoms.end(), &rigid_bodies.arm[3 * place], &rigid_bodies.arm[3 * place] + 3);
    if (place != rigid_bodies.start[b]) continue;
    bodies.push_back(molecule);
    bodies.push_back(rigid_bodies.inverse_mass[b]);
    bodies.insert(bodies.end(), &rigid_bodies.inverse_inertia[6 * b],
                  &rigid_bodies.inverse_inertia[6 * b] + 6);
  }
  for (std::size_t c = 0; c < problem_.contacts.size(); ++c) {
    const int j = problem_.contacts.second[c];
    const double *const n = &problem_.contacts.normal[3 * c];
    const Origin &origin = origin_[c];
    const int i = problem_.contacts.first[c];
    const tagint partner = origin.wall ? -origin.wall : atom->tag[j];
    const double guess = kick_ * force->ftm2v * memory_.force(i, partner);
    for (const double value : {static_cast<double>(atom->tag[i]), static_cast<double>(partner),
                               n[0], n[1], n[2], problem_.contacts.gap[c], origin.gap_now,
                               origin.wall_motion, problem_.contacts.impulse[c], guess})
      contacts.push_back(value);
  }
  const std::vector<double> all_atoms = gather(atoms);
  const std::vector<double> all_contacts = gather(contacts);
  const std::vector<double> all_bodies = gather(bodies);
  std::string message;
  if (comm->me == 0) {
    const std::size_t number = all_atoms.size() / PER_ATOM;
    std::vector<std::size_t> order(number);
    for (std::size_t k = 0; k < number; ++k) order[k] = k;
    std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
      return all_atoms[PER_ATOM * a] < all_atoms[PER_ATOM * b];
    });
    auto column = [&](int from, int width) {
      std::vector<double> values;
      for (const std::size_t k : order)
        for (int d = 0; d < width; ++d) values.push_back(all_atoms[PER_ATOM * k + from + d]);
      return values;
    };
    auto contact_column = [&](int from, int width) {
      std::vector<double> values;
      for (std::size_t k = 0; k < all_contacts.size() / PER_CONTACT; ++k)
        for (int d = 0; d < width; ++d) values.push_back(all_contacts[PER_CONTACT * k + from + d]);
      return values;
    };
    auto integers = [](const std::vector<double> &values) {
      return std::vector<std::int64_t>(values.begin(), values.end());
    };
    inelastic::NpzWriter file;
    file.add("step", static_cast<double>(update->ntimestep));
    file.add("timestep", problem_.timestep);
    file.add("tolerance", tolerance_);
    file.add("iterations", static_cast<double>(result.iterations));
    file.add("id", integers(column(0, 1)));
    file.add("inverse_mass", column(1, 1));
    file.add("radius", column(2, 1));
    file.add("position", column(3, 3), 3);
    file.add("predicted_velocity", column(6, 3), 3);
    file.add("velocity", column(9, 3), 3);
    file.add("mass", column(12, 1));
    if (rigid_) {
      auto body_column = [&](int from, int width) {
        std::vector<double> values;
        for (std::size_t k = 0; k < all_bodies.size() / PER_BODY; ++k)
          for (int d = 0; d < width; ++d) values.push_back(all_bodies[PER_BODY * k + from + d]);
        return values;
      };
      file.add("molecule", integers(column(13, 1)));
      file.add("arm", column(14, 3), 3);
      file.add("body_molecule", integers(body_column(0, 1)));
      file.add("body_inverse_mass", body_column(1, 1));
      file.add("body_inverse_inertia", body_column(2, 6), 6);
    }
    file.add("id1", integers(contact_column(0, 1)));
    file.add("id2", integers(contact_column(1, 1)));
    file.add("normal", contact_column(2, 3), 3);
    file.add("gap", contact_column(5, 1));
    file.add("gap_now", contact_column(6, 1));
    file.add("wall_motion", contact_column(7, 1));
    file.add("impulse", contact_column(8, 1));
    file.add("impulse_guess", contact_column(9, 1));
    const std::string path = utils::star_subst(record_file_, update->ntimestep, 0);
    if (!file.write(path))
      message = fmt::format("cannot write the record {}: {}", path, utils::getsyserror());
  }
  fail_together(message);
}

std::vector<double> FixInelastic::gather(std::vector<double> mine) const
{
  int count = static_cast<int>(mine.size());
  std::vector<int> counts(comm->nprocs), offsets(comm->nprocs, 0);
  MPI_Gather(&count, 1, MPI_INT, counts.data(), 1, MPI_INT, 0, world);
  for (int rank = 1; rank < comm->nprocs; ++rank)
    offsets[rank] = offsets[rank - 1] + counts[rank - 1];
  std::vector<double> all(comm->me == 0 ? offsets.back() + counts.back() : 0);
  MPI_Gatherv(mine.data(), count, MPI_DOUBLE, all.data(), counts.data(), offsets.data(), MPI_DOUBLE,
              0, world);
  return all;
}

double FixInelastic::mass(int i) const
{ return atom->rmass ? atom->rmass[i] : atom->mass[atom->type[i]]; }

double FixInelastic::memory_usage()
{
  const double per_atom = STATE_SIZE + size_peratom_cols + 20.0;
  const double per_contact = 20.0 + 10.0;
  return sizeof(double) *
      (per_atom * max_atoms_ + per_contact * static_cast<double>(problem_.contacts.size()));
}
