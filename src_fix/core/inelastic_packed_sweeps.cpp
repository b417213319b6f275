#include "inelastic_packed_sweeps.h"

#include "inelastic_vector3.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <type_traits>

namespace inelastic {

namespace {

  // As many colours as a mask has bits; constraints of the last one have a group each.
  constexpr int COLOURS = 64, LAST = COLOURS - 1;

  // At most so many lanes for each constraint, beside a group for each colour.
  constexpr std::size_t MOST_LANES = 2;

  // As in inelastic_packed_iterations.cpp.
  constexpr std::size_t FEW = 10;
  constexpr float IDLE_GAP = 5.0f;

  // Vectors of 4 numbers, as the host takes them.
  template <typename Vectors> float *numbers(Vectors &vectors)
  {
    static_assert(sizeof(vectors[0]) == 4 * sizeof(float));
    return reinterpret_cast<float *>(vectors.data());
  }

  template <typename Group> constexpr bool HAS_BODIES = std::is_same_v<Group, swept::BodyGroup>;

  // Writes L by columns, the lower triangle with L L^T = A, of an inverse inertia A (xx yy zz xy xz
  // yz). Where impulses do not turn the body about some axis, the column that is left over is 0.
  void find_root(const double *a, double scale, double *l)
  {
    // Below it a diagonal entry is round-off of the others.
    constexpr double NOTHING = 1.0e-12;
    const double least = NOTHING * (a[0] + a[1] + a[2]);
    std::fill(l, l + 9, 0.0);
    if (a[0] > least) {
      l[0] = std::sqrt(a[0]);
      l[1] = a[3] / l[0];
      l[2] = a[4] / l[0];
    }
    const double second = a[1] - l[1] * l[1];
    if (second > least) {
      l[4] = std::sqrt(second);
      l[5] = (a[5] - l[1] * l[2]) / l[4];
    }
    const double third = a[2] - l[2] * l[2] - l[5] * l[5];
    if (third > least) l[8] = std::sqrt(third);
    for (int k = 0; k < 9; ++k) l[k] *= scale;
  }

}    // namespace

template <typename Group> void PackedSweeps<Group>::Packed::clear()
{
  groups.clear();
  rest.clear();
  colour_end.clear();
}

template <typename Group>
bool PackedSweeps<Group>::prepare(const ContactProblem &problem,
                                  const std::vector<double> &diagonal,
                                  const std::vector<double> &gap, double idle_gap,
                                  const Scales &scales, const ContactTargets &targets,
                                  const std::vector<double> &change, double tolerance, Host &host)
{
  const ContactSet &contacts = problem.contacts;
  given_ = {&problem, &diagonal, &gap, scales, &targets};
  idle_gap_ = static_cast<float>(idle_gap / scales.length);
  start_ = contacts.impulse;
  of_impulses_ = contacts.set;
  mobility_unit_ = problem.timestep * (scales.impulse / scales.length);
  find_movers(problem);
  std::vector<std::size_t> near, far;
  for (std::size_t c = 0; c < gap.size(); ++c)
    (of_impulses_[c].is_loaded(start_[c]) || !(gap[c] > idle_gap) ? near : far).push_back(c);
  has_ghosts_ = host.has_ghosts();
  turns_ = has_ghosts_ ? host.turns() : 1;
  turn_ = has_ghosts_ ? host.turn() : 0;
  if (has_ghosts_) find_shared(problem, near, gap.size(), host);

  for (Packed *const some : {&at_cuts_, &inside_, &idle_}) some->clear();
  std::size_t lanes = 0;
  for (const bool at_cuts : {true, false}) {
    std::vector<std::size_t> chosen, places;
    std::vector<int> first, second;
    for (const std::size_t c : near)
      if (is_at_cut(contacts.first[c], contacts.second[c]) == at_cuts) {
        chosen.push_back(c);
        first.push_back(mover_[contacts.first[c]]);
        second.push_back(mover_[contacts.second[c]]);
      }
    Packed &packed = at_cuts ? at_cuts_ : inside_;
    lanes += colour(first, second, packed, places);
    for (std::size_t k = 0; k < chosen.size(); ++k) write(chosen[k], packed, places[k]);
  }
  far_ = std::move(far);

  told_.assign(problem.slots(), Vector{});
  heard_ = told_;
  list_shared(host);
  begin_search(change, tolerance);
  set_targets();
  return lanes <= MOST_LANES * near.size() + 2 * COLOURS * WIDTH;
}

// Begins with impulses that have not changed yet.
template <typename Group>
void PackedSweeps<Group>::begin_search(const std::vector<double> &change, double tolerance)
{
  states_.resize(static_cast<std::size_t>(movers_) + 1);
  stop(states_);
  before_ = states_;
  targets_.begin(*given_.problem, given_.scales, *given_.targets, change, tolerance);
}

template <typename Group>
void PackedSweeps<Group>::go_on(double idle_gap, const std::vector<double> &change,
                                double tolerance)
{
  start_ = given_.problem->contacts.impulse;
  idle_gap_ = static_cast<float>(idle_gap / given_.scales.length);
  for (Packed *const some : {&at_cuts_, &inside_, &idle_})
    for (std::size_t place = 0; place < some->lanes(); ++place)
      if (!some->is_empty(place)) write_start(*some, place);
  begin_search(change, tolerance);
  // Of what is far only this is packed: as long as something is far, nothing else is idle.
  std::vector<std::size_t> near, far;
  for (const std::size_t c : far_) ((*given_.gap)[c] > idle_gap ? far : near).push_back(c);
  write_idle(near);
  far_ = std::move(far);
  wake_near();
  set_targets();
}

// Numbers what moves: slots, or bodies and the particles that are in none. One mover more stands
// for the lanes that are empty.
template <typename Group> void PackedSweeps<Group>::find_movers(const ContactProblem &problem)
{
  const int slots = problem.slots();
  mover_.resize(slots);
  movers_ = slots;
  for (int i = 0; i < slots; ++i) mover_[i] = i;
  if constexpr (HAS_BODIES<Group>) {
    const RigidBodies &bodies = problem.bodies;
    movers_ = static_cast<int>(bodies.size());
    for (int i = 0; i < slots; ++i) mover_[i] = problem.is_member(i) ? bodies.body[i] : movers_++;
  }
  mobility_.assign(movers_, 0.0f);
  moves_.assign(movers_, 0);
  for (int i = 0; i < slots; ++i) {
    const double inverse_mass = problem.is_member(i)
        ? problem.bodies.inverse_mass[problem.bodies.body[i]]
        : problem.inverse_mass[i];
    mobility_[mover_[i]] = static_cast<float>(inverse_mass * mobility_unit_);
    moves_[mover_[i]] = problem.is_mobile(i);
  }
  is_copy_.assign(slots, 0);
  if constexpr (HAS_BODIES<Group>) find_bodies(problem.bodies);
}

template <typename Group> void PackedSweeps<Group>::find_bodies(const RigidBodies &bodies)
{
  spin_root_.resize(9 * bodies.size());
  arm_.assign(3 * mover_.size(), 0.0);
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    find_root(&bodies.inverse_inertia[6 * b], std::sqrt(mobility_unit_), &spin_root_[9 * b]);
    for (int k = bodies.start[b]; k < bodies.start[b + 1]; ++k) {
      const std::size_t slot = bodies.member[k];
      is_copy_[slot] = k >= bodies.start[b] + bodies.originals[b];
      std::copy_n(&bodies.arm[3 * static_cast<std::size_t>(k)], 3, &arm_[3 * slot]);
    }
  }
}

// Returns what a unit impulse of a constraint adds to its own gap through one of its sides.
template <typename Group>
double PackedSweeps<Group>::mobility_of(const ContactProblem &problem, std::size_t c,
                                        int slot) const
{ return problem.timestep * problem.mobility(slot, &problem.contacts.normal[3 * c]); }

// Finds the movers that other ranks have constraints of, and what from_other_ranks needs of those
// that have the same turn: of particles sums of n n^T over these constraints, of bodies sums of the
// roots of mobilities. Collective.
template <typename Group>
void PackedSweeps<Group>::find_shared(const ContactProblem &problem,
                                      const std::vector<std::size_t> &working,
                                      std::size_t constraints, Host &host)
{
  const ContactSet &contacts = problem.contacts;
  const std::size_t slots = mover_.size();
  std::vector<double> count(slots, 0.0), sums(NUMBERS * slots, 0.0);
  for (std::size_t c = 0; c < constraints; ++c)
    for (const int slot : {contacts.first[c], contacts.second[c]}) count[slot] += 1.0;
  for (const std::size_t c : working) {
    const double *const n = &contacts.normal[3 * c];
    for (const int slot : {contacts.first[c], contacts.second[c]}) {
      double *const of_slot = &sums[NUMBERS * slot];
      if constexpr (HAS_BODIES<Group>) {
        of_slot[0] += std::sqrt(mobility_of(problem, c, slot));
      } else {
        const int row[6] = {0, 1, 2, 0, 0, 1}, column[6] = {0, 1, 2, 1, 2, 2};
        for (int k = 0; k < 6; ++k) of_slot[k] += n[row[k]] * n[column[k]];
      }
    }
  }
  const std::vector<double> all_count = of_all_ranks(count, 1, host);
  const std::vector<double> none(sums.size(), 0.0);
  std::vector<double> all_sums;
  for (int turn = 0; turn < turns_; ++turn) {
    const std::vector<double> of_turn = of_all_ranks(turn == turn_ ? sums : none, NUMBERS, host);
    if (turn == turn_) all_sums = of_turn;
  }
  shared_.assign(movers_, 0);
  of_others_.assign(NUMBERS * static_cast<std::size_t>(movers_), 0.0f);
  for (std::size_t i = 0; i < slots; ++i) {
    const std::size_t m = mover_[i];
    if (problem.is_wall(static_cast<int>(i)) || !moves_[m]) continue;
    // A slot of a particle that is in no constraint need not hear of others.
    const bool is_here = HAS_BODIES<Group> || count[i] > 0.5;
    if (is_here && all_count[i] > count[i] + 0.5) shared_[m] = 1;
    for (std::size_t k = 0; k < NUMBERS; ++k)
      of_others_[NUMBERS * m + k] += static_cast<float>(
          (is_copy_[i] ? 0.0 : all_sums[NUMBERS * i + k]) - sums[NUMBERS * i + k]);
  }
}

// Returns sums over all ranks of `numbers` numbers per slot. Collective.
template <typename Group>
std::vector<double> PackedSweeps<Group>::of_all_ranks(const std::vector<double> &mine,
                                                      std::size_t numbers, Host &host)
{
  const std::size_t slots = mine.size() / numbers;
  std::vector<double> all = mine, three(3 * slots);
  for (std::size_t from = 0; from < numbers; from += 3) {
    const std::size_t count = std::min<std::size_t>(3, numbers - from);
    for (std::size_t i = 0; i < slots; ++i)
      for (std::size_t k = 0; k < 3; ++k)
        three[3 * i + k] = k < count ? mine[numbers * i + from + k] : 0.0;
    host.sum_over_ghosts(three.data());
    for (std::size_t i = 0; i < slots; ++i)
      for (std::size_t k = 0; k < count; ++k) all[numbers * i + from + k] = three[3 * i + k];
  }
  return all;
}

// Tells whether other ranks have constraints of either side, too.
template <typename Group> bool PackedSweeps<Group>::is_at_cut(int first, int second) const
{ return has_ghosts_ && (is_shared(first) || is_shared(second)); }

template <typename Group> bool PackedSweeps<Group>::is_shared(int slot) const
{ return moves_[mover_[slot]] && shared_[mover_[slot]]; }

// Returns the bound of the sum of |A_cd| over the constraints d of other ranks [time / mass].
template <typename Group>
double PackedSweeps<Group>::from_other_ranks(const ContactProblem &problem, std::size_t c) const
{
  double sum = 0.0;
  for (const int slot : {problem.contacts.first[c], problem.contacts.second[c]}) {
    const std::size_t m = mover_[slot];
    if (!is_shared(slot)) continue;
    const double mobility = mobility_of(problem, c, slot);
    if constexpr (HAS_BODIES<Group>) {
      sum += std::sqrt(mobility) * std::max(0.0f, of_others_[m]);
    } else {
      // By the inequality of Cauchy and Schwarz: (sum |n . n_d|)^2 <= count sum (n . n_d)^2.
      const float *const t = &of_others_[6 * m];
      const double *const n = &problem.contacts.normal[3 * c];
      const double squares = t[0] * n[0] * n[0] + t[1] * n[1] * n[1] + t[2] * n[2] * n[2] +
          2.0 * (t[3] * n[0] * n[1] + t[4] * n[0] * n[2] + t[5] * n[1] * n[2]);
      const double count = t[0] + t[1] + t[2];
      sum += mobility * std::sqrt(std::max(0.0, count * squares));
    }
  }
  return sum;
}

// Adds groups of empty lanes.
template <typename Group>
void PackedSweeps<Group>::add_groups(Packed &packed, std::size_t count) const
{
  const std::size_t from = packed.lanes();
  packed.groups.resize(packed.groups.size() + count);
  packed.rest.resize(packed.groups.size());
  for (std::size_t place = from; place < packed.lanes(); ++place) clear_lane(packed, place);
}

template <typename Group>
void PackedSweeps<Group>::clear_lane(Packed &packed, std::size_t place) const
{
  Group &group = packed.groups[place / WIDTH];
  Rest &rest = packed.rest[place / WIDTH];
  const int lane = static_cast<int>(place % WIDTH);
  group.first[lane] = group.second[lane] = static_cast<std::uint32_t>(movers_ * sizeof(State));
  for (swept::Eight *const numbers :
       {&group.give, &group.least, &group.now, &group.before, &group.inverse_target})
    (*numbers)[lane] = 0.0f;
  group.gap[lane] = 1.0f;
  if constexpr (HAS_BODIES<Group>) {
    group.first_row[lane] = group.second_row[lane] = swept::Eight{};
  } else {
    for (int d = 0; d < 4; ++d) group.row[lane % 4][4 * (lane / 4) + d] = 0.0f;
  }
  rest.source[lane] = swept::NONE;
  rest.first[lane] = rest.second[lane] = 0;
  rest.root[lane] = rest.part[lane] = 0.0f;
  rest.least_target[lane] = 1.0f;    // any that can be divided by
}

// Colours constraints, given by the movers of both sides, and adds groups for them. `places` gets
// the place of each. Returns how many lanes were added.
template <typename Group>
std::size_t PackedSweeps<Group>::colour(const std::vector<int> &first,
                                        const std::vector<int> &second, Packed &packed,
                                        std::vector<std::size_t> &places)
{
  std::vector<std::uint64_t> taken(movers_, 0);
  std::vector<unsigned char> colours(first.size());
  std::size_t counts[COLOURS] = {};
  for (std::size_t k = 0; k < first.size(); ++k) {
    const bool one = moves_[first[k]], other = moves_[second[k]];
    const std::uint64_t both = (one ? taken[first[k]] : 0) | (other ? taken[second[k]] : 0);
    const int colour = ~both == 0 ? LAST : std::min(LAST, __builtin_ctzll(~both));
    colours[k] = static_cast<unsigned char>(colour);
    ++counts[colour];
    const std::uint64_t bit = colour == LAST ? 0 : std::uint64_t{1} << colour;
    if (one) taken[first[k]] |= bit;
    if (other) taken[second[k]] |= bit;
  }
  std::size_t next[COLOURS];
  const std::size_t from = packed.lanes();
  for (int colour = 0; colour < COLOURS; ++colour) {
    if (counts[colour] == 0) continue;
    next[colour] = packed.lanes();
    if (colour < LAST) {
      add_groups(packed, (counts[colour] + WIDTH - 1) / WIDTH);
      packed.colour_end.push_back(packed.groups.size());
    }
    for (std::size_t k = 0; colour == LAST && k < counts[colour]; ++k) {
      add_groups(packed, 1);
      packed.colour_end.push_back(packed.groups.size());
    }
  }
  places.resize(first.size());
  for (std::size_t k = 0; k < first.size(); ++k) {
    places[k] = next[colours[k]];
    next[colours[k]] += colours[k] == LAST ? WIDTH : 1;
  }
  return packed.lanes() - from;
}

template <typename Group>
void PackedSweeps<Group>::write(std::size_t c, Packed &packed, std::size_t place) const
{
  const ContactProblem &problem = *given_.problem;
  const ContactSet &contacts = problem.contacts;
  const Scales &scales = given_.scales;
  Group &group = packed.groups[place / WIDTH];
  Rest &rest = packed.rest[place / WIDTH];
  const int lane = static_cast<int>(place % WIDTH);
  const double unit = scales.impulse / scales.length;
  const double whole = (*given_.diagonal)[c] + (has_ghosts_ ? from_other_ranks(problem, c) : 0.0);
  // All is divided by the same number, which is kept in single precision.
  rest.root[lane] = static_cast<float>(std::sqrt(whole * unit));
  const auto root = static_cast<double>(rest.root[lane]);
  const int first = mover_[contacts.first[c]], second = mover_[contacts.second[c]];
  group.first[lane] = static_cast<std::uint32_t>(first * sizeof(State));
  group.second[lane] = static_cast<std::uint32_t>(second * sizeof(State));
  group.give[lane] = static_cast<float>(contacts.compliance[c] / whole);
  write_rows(problem, c, root, group, lane);
  rest.source[lane] = c;
  rest.first[lane] = contacts.first[c];
  rest.second[lane] = contacts.second[c];
  write_start(packed, place);
}

// Writes what each search begins with.
template <typename Group>
void PackedSweeps<Group>::write_start(Packed &packed, std::size_t place) const
{
  Group &group = packed.groups[place / WIDTH];
  Rest &rest = packed.rest[place / WIDTH];
  const auto lane = place % WIDTH;
  const std::size_t c = rest.source[lane];
  const Scales &scales = given_.scales;
  const double per_length = 1.0 / scales.length;
  const auto root = static_cast<double>(rest.root[lane]);
  group.gap[lane] = static_cast<float>((*given_.gap)[c] * per_length / root);
  group.least[lane] =
      static_cast<float>(of_impulses_[c].changes_of(start_[c]).least / scales.impulse * root);
  group.now[lane] = group.before[lane] = 0.0f;
  rest.least_target[lane] = static_cast<float>(given_.targets->least()[c] * per_length);
  rest.part[lane] = static_cast<float>(given_.targets->part()[c]);
}

template <typename Group>
void PackedSweeps<Group>::write_rows(const ContactProblem &problem, std::size_t c, double root,
                                     Group &group, int lane) const
{
  const ContactSet &contacts = problem.contacts;
  const double *const n = &contacts.normal[3 * c];
  if constexpr (!HAS_BODIES<Group>) {
    for (int d = 0; d < 3; ++d)
      group.row[lane % 4][4 * (lane / 4) + d] = static_cast<float>(n[d] / root);
  } else {
    for (const bool is_first : {true, false}) {
      const int slot = is_first ? contacts.first[c] : contacts.second[c];
      swept::Eight &row = is_first ? group.first_row[lane] : group.second_row[lane];
      row = swept::Eight{};
      if (!problem.is_mobile(slot)) continue;
      const double by = (is_first ? 1.0 : -1.0) / root;
      const double slide = by * std::sqrt(static_cast<double>(mobility_[mover_[slot]]));
      for (int d = 0; d < 3; ++d) row[d] = static_cast<float>(slide * n[d]);
      if (!problem.is_member(slot)) continue;
      double moment[3];
      cross(&arm_[3 * static_cast<std::size_t>(slot)], n, moment);
      const double *const l = &spin_root_[9 * static_cast<std::size_t>(mover_[slot])];
      for (int d = 0; d < 3; ++d) row[4 + d] = static_cast<float>(by * dot(l + 3 * d, moment));
    }
  }
}

template <typename Group>
void PackedSweeps<Group>::copy(const Packed &from, std::size_t source, Packed &to,
                               std::size_t place)
{
  const Group &a = from.groups[source / WIDTH];
  const Rest &rest_a = from.rest[source / WIDTH];
  Group &b = to.groups[place / WIDTH];
  Rest &rest_b = to.rest[place / WIDTH];
  const int i = static_cast<int>(source % WIDTH), j = static_cast<int>(place % WIDTH);
  b.first[j] = a.first[i];
  b.second[j] = a.second[i];
  b.gap[j] = a.gap[i];
  b.give[j] = a.give[i];
  b.least[j] = a.least[i];
  b.now[j] = a.now[i];
  b.before[j] = a.before[i];
  b.inverse_target[j] = a.inverse_target[i];
  if constexpr (HAS_BODIES<Group>) {
    b.first_row[j] = a.first_row[i];
    b.second_row[j] = a.second_row[i];
  } else {
    for (int d = 0; d < 4; ++d) b.row[j % 4][4 * (j / 4) + d] = a.row[i % 4][4 * (i / 4) + d];
  }
  rest_b.source[j] = rest_a.source[i];
  rest_b.first[j] = rest_a.first[i];
  rest_b.second[j] = rest_a.second[i];
  rest_b.root[j] = rest_a.root[i];
  rest_b.least_target[j] = rest_a.least_target[i];
  rest_b.part[j] = rest_a.part[i];
}

// Sets the states of what impulses have not moved.
template <typename Group> void PackedSweeps<Group>::stop(std::vector<State> &states) const
{
  std::fill(states.begin(), states.end(), State{});
  if constexpr (!HAS_BODIES<Group>)
    for (int m = 0; m < movers_; ++m) states[m].lanes[3] = mobility_[m];
}

template <typename Group>
swept::Swept PackedSweeps<Group>::sweep(double along, double blur, Host &host)
{
  const auto by = static_cast<float>(along), blurred = static_cast<float>(blur);
  swept::lead_on(states_, before_, by);
  swept::Swept swept;
  const auto visit = [&](Packed &some, std::size_t from, std::size_t to) {
    swept::sweep(some.groups.data() + from, to - from, states_.data(), by, blurred, swept);
  };
  const std::size_t at_cuts = at_cuts_.groups.size(), inside = inside_.groups.size();
  // Ranks of the first turn begin with their constraints at cuts, those of the second visit theirs
  // after half of the others: messages arrive before somebody waits for them.
  const std::size_t begun = turn_ > 0 ? inside / 2 : 0;
  visit(inside_, 0, begun);
  if (turn_ > 0) hear(0, states_, host);
  if (has_ghosts_) keep_before_visit(by);
  visit(at_cuts_, 0, at_cuts);
  if (has_ghosts_) tell_changes(host);
  visit(inside_, begun, inside);
  if (turn_ == 0) hear(0, states_, host);
  if (turns_ > 1) hear(1, states_, host);
  return swept;
}

// Lists the slots of the movers that other ranks have constraints of, too.
template <typename Group> void PackedSweeps<Group>::list_shared(Host &host)
{
  shared_slots_.clear();
  if (!has_ghosts_) return;
  std::vector<char> chosen(mover_.size());
  for (std::size_t i = 0; i < mover_.size(); ++i) {
    chosen[i] = is_shared(static_cast<int>(i));
    if (chosen[i]) shared_slots_.push_back(static_cast<int>(i));
  }
  before_visit_.resize(shared_slots_.size());
  // A body's images on this rank move with it; those of a particle are movers of their own.
  host.choose_told(chosen, !HAS_BODIES<Group>);
}

// Keeps what a visit to the constraints at cuts changes: of particles the states that other ranks
// share, of bodies the impulses, led on.
template <typename Group> void PackedSweeps<Group>::keep_before_visit(float along)
{
  if constexpr (HAS_BODIES<Group>) {
    changes_.resize(at_cuts_.lanes());
    for (std::size_t k = 0; k < changes_.size(); ++k) {
      const Group &group = at_cuts_.groups[k / WIDTH];
      const auto lane = k % WIDTH;
      changes_[k] = group.now[lane] + along * (group.now[lane] - group.before[lane]);
    }
  } else {
    for (std::size_t k = 0; k < shared_slots_.size(); ++k)
      before_visit_[k] = states_[shared_slots_[k]];
  }
}

// Finds what the constraints at cuts have changed since keep_before_visit, and tells others.
template <typename Group> void PackedSweeps<Group>::tell_changes(Host &host)
{
  if constexpr (HAS_BODIES<Group>) {
    for (std::size_t k = 0; k < changes_.size(); ++k)
      changes_[k] = at_cuts_.groups[k / WIDTH].now[k % WIDTH] - changes_[k];
    sum_up_changes();
  } else {
    for (std::size_t k = 0; k < shared_slots_.size(); ++k) {
      const int i = shared_slots_[k];
      told_[i].lanes = states_[i].lanes - before_visit_[k].lanes;
    }
  }
  host.tell(numbers(told_));
}

// Sums up the impulses of changes_, in scaled units, for each member of a shared body, in packed
// units.
template <typename Group> void PackedSweeps<Group>::sum_up_changes()
{
  if constexpr (HAS_BODIES<Group>) {
    for (const int slot : shared_slots_) told_[slot] = Vector{};
    for (std::size_t place = 0; place < changes_.size(); ++place) {
      if (changes_[place] == 0.0f) continue;
      const Group &group = at_cuts_.groups[place / WIDTH];
      const Rest &rest = at_cuts_.rest[place / WIDTH];
      const auto lane = place % WIDTH;
      for (const bool is_first : {true, false}) {
        const int slot = is_first ? rest.first[lane] : rest.second[lane];
        if (!is_shared(slot)) continue;
        const swept::Eight &row = is_first ? group.first_row[lane] : group.second_row[lane];
        const float by = changes_[place] / std::sqrt(mobility_[mover_[slot]]);
        for (int d = 0; d < 3; ++d) told_[slot].lanes[d] += by * row[d];
      }
    }
  }
}

// Adds to the states what the ranks of a turn have told.
template <typename Group>
void PackedSweeps<Group>::hear(int turn, std::vector<State> &states, Host &host)
{
  if (!has_ghosts_) return;
  if constexpr (HAS_BODIES<Group>) {
    for (const int slot : shared_slots_) heard_[slot] = Vector{};
    host.hear(turn, numbers(heard_));
    push_bodies(states);
  } else {
    host.hear(turn, numbers(states));
  }
}

// Adds to the states of shared movers what the impulses of heard_ make of them. Of a particle that
// this rank has several times every slot hears the same: the first of them counts.
template <typename Group> void PackedSweeps<Group>::push_bodies(std::vector<State> &states) const
{
  if constexpr (HAS_BODIES<Group>) {
    for (const int i : shared_slots_) {
      if (is_copy_[i]) continue;
      const std::size_t m = mover_[i];
      const typename Vector::Lanes push = heard_[i].lanes;
      const float slide = std::sqrt(mobility_[m]);
      swept::Eight &state = states[m].lanes;
      for (int d = 0; d < 3; ++d) state[d] += slide * push[d];
      if (9 * m >= spin_root_.size()) continue;
      const double s[3] = {push[0], push[1], push[2]};
      double moment[3];
      cross(&arm_[3 * static_cast<std::size_t>(i)], s, moment);
      for (int d = 0; d < 3; ++d)
        state[4 + d] += static_cast<float>(dot(&spin_root_[9 * m + 3 * d], moment));
    }
  }
}

template <typename Group> void PackedSweeps<Group>::refresh(Host &host)
{
  for (const swept::When when : {swept::When::NOW, swept::When::BEFORE}) {
    std::vector<State> &states = when == swept::When::NOW ? states_ : before_;
    stop(states);
    swept::add_impulses(at_cuts_.groups, when, states.data());
    swept::add_impulses(inside_.groups, when, states.data());
    if (!has_ghosts_) continue;
    if constexpr (HAS_BODIES<Group>) {
      changes_.resize(at_cuts_.lanes());
      for (std::size_t k = 0; k < changes_.size(); ++k) {
        const Group &group = at_cuts_.groups[k / WIDTH];
        const swept::Eight &impulse = when == swept::When::NOW ? group.now : group.before;
        changes_[k] = impulse[k % WIDTH];
      }
      sum_up_changes();
    } else {
      for (const int slot : shared_slots_) told_[slot].lanes = states[slot].lanes;
    }
    host.tell(numbers(told_));
    for (int turn = 0; turn < turns_; ++turn) hear(turn, states, host);
  }
}

// Returns the change of velocity of each slot.
template <typename Group>
const std::vector<typename PackedSweeps<Group>::Vector> &PackedSweeps<Group>::velocities()
{
  velocity_.resize(mover_.size());
  for (std::size_t i = 0; i < mover_.size(); ++i) {
    const std::size_t m = mover_[i];
    if constexpr (HAS_BODIES<Group>) {
      const swept::Eight &state = states_[m].lanes;
      const double slide = std::sqrt(static_cast<double>(mobility_[m]));
      double v[3] = {slide * state[0], slide * state[1], slide * state[2]};
      if (9 * m < spin_root_.size()) {
        const double *const l = &spin_root_[9 * m];
        double spin[3], turning[3];
        for (int d = 0; d < 3; ++d)
          spin[d] = l[d] * state[4] + l[3 + d] * state[5] + l[6 + d] * state[6];
        cross(spin, &arm_[3 * i], turning);
        for (int d = 0; d < 3; ++d) v[d] += turning[d];
      }
      velocity_[i].lanes = typename Vector::Lanes{
          static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2]), 0.0f};
    } else {
      velocity_[i].lanes = states_[m].lanes;
    }
  }
  return velocity_;
}

template <typename Group> bool PackedSweeps<Group>::sets_targets(long sweep)
{
  if (sweep < 2) return false;
  int below = 0;    // 2^below is the largest power of two that is not more
  while ((sweep >> (below + 1)) > 0) ++below;
  const long quarter = below > 2 ? 1L << (below - 2) : 2;
  return sweep % quarter == 0;
}

template <typename Group> void PackedSweeps<Group>::set_targets()
{
  targets_.set(velocities());
  for (Packed *const some : {&at_cuts_, &inside_}) set_targets(*some, 0);
}

// Sets the targets of the groups from a place on.
template <typename Group>
void PackedSweeps<Group>::set_targets(Packed &packed, std::size_t from) const
{
  swept::set_targets(packed.groups.data() + from, packed.rest.data() + from,
                     packed.groups.size() - from, targets_.changed().data(), targets_.most());
}

template <typename Group> void PackedSweeps<Group>::keep_velocities()
{ targets_.keep(velocities()); }

template <typename Group> double PackedSweeps<Group>::moved_since_kept(double accuracy)
{
  targets_.compare(velocities());
  float most = 0.0f;
  for (const Packed *const some : {&at_cuts_, &inside_})
    for (std::size_t g = 0; g < some->groups.size(); ++g) {
      const Group &group = some->groups[g];
      const Rest &rest = some->rest[g];
      for (int lane = 0; lane < WIDTH; ++lane) {
        if (!(group.now[lane] > group.least[lane])) continue;
        const int i = rest.first[lane], j = rest.second[lane];
        most = std::max(most,
                        targets_.moved(i, j) /
                            targets_.free_target(i, j, rest.least_target[lane], rest.part[lane]));
      }
    }
  return accuracy * static_cast<double>(most);
}

// Packs constraints as idle ones, where none are packed so far.
template <typename Group>
void PackedSweeps<Group>::write_idle(const std::vector<std::size_t> &constraints)
{
  if (constraints.empty()) return;
  add_groups(idle_, (constraints.size() + WIDTH - 1) / WIDTH);
  for (std::size_t k = 0; k < constraints.size(); ++k) write(constraints[k], idle_, k);
}

template <typename Group> void PackedSweeps<Group>::look_at_idle(double least_idle_gap)
{
  // What was far from closed at the start is packed now: many searches end before.
  write_idle(far_);
  far_.clear();
  set_idle(least_idle_gap);
  wake_near();
}

// Returns a gap that was looked at last, as a length in packed units.
template <typename Group> float PackedSweeps<Group>::looked_gap(std::size_t place) const
{ return looked_[place / WIDTH].gap[place % WIDTH]; }

// Makes the idle constraints working whose gaps are not above idle_gap_. Their lanes are left empty
// until half of all are: looks are frequent, and wake a few of many.
template <typename Group> void PackedSweeps<Group>::wake_near()
{
  looked_.resize(idle_.groups.size());
  swept::look(idle_.groups, idle_.rest.data(), states_.data(), looked_.data());
  std::vector<std::size_t> near;
  std::size_t empty = 0;
  for (std::size_t place = 0; place < idle_.lanes(); ++place) {
    if (looked_gap(place) > idle_gap_) continue;    // that of an empty lane is 0
    if (idle_.is_empty(place))
      ++empty;
    else
      near.push_back(place);
  }
  if (near.empty()) return;
  wake(near);
  for (const std::size_t place : near) clear_lane(idle_, place);
  if (2 * (empty + near.size()) > idle_.lanes()) close_up_idle();
}

// Makes idle constraints working, given by their places in ascending order.
template <typename Group> void PackedSweeps<Group>::wake(const std::vector<std::size_t> &near)
{
  for (const bool at_cuts : {true, false}) {
    std::vector<std::size_t> chosen, places;
    std::vector<int> first, second;
    for (const std::size_t place : near) {
      const Rest &rest = idle_.rest[place / WIDTH];
      const int one = rest.first[place % WIDTH], other = rest.second[place % WIDTH];
      if (is_at_cut(one, other) != at_cuts) continue;
      chosen.push_back(place);
      first.push_back(mover_[one]);
      second.push_back(mover_[other]);
    }
    Packed &packed = at_cuts ? at_cuts_ : inside_;
    const std::size_t from = packed.groups.size();
    colour(first, second, packed, places);
    for (std::size_t k = 0; k < chosen.size(); ++k) copy(idle_, chosen[k], packed, places[k]);
    set_targets(packed, from);
  }
}

// Idle constraints move up to where lanes are empty.
template <typename Group> void PackedSweeps<Group>::close_up_idle()
{
  std::size_t kept = 0;
  for (std::size_t place = 0; place < idle_.lanes(); ++place)
    if (!idle_.is_empty(place)) copy(idle_, place, idle_, kept++);
  const std::size_t groups = (kept + WIDTH - 1) / WIDTH;
  idle_.groups.resize(groups);
  idle_.rest.resize(groups);
  for (std::size_t place = kept; place < idle_.lanes(); ++place) clear_lane(idle_, place);
}

// Returns the largest residual of working constraints, as a length in packed units, and lists those
// that have no impulse, with their gaps.
template <typename Group>
float PackedSweeps<Group>::look_at(const Packed &packed, std::vector<Unloaded> &unloaded)
{
  looked_.resize(packed.groups.size());
  const float residual =
      swept::look(packed.groups, packed.rest.data(), states_.data(), looked_.data());
  for (std::size_t g = 0; g < packed.groups.size(); ++g)
    for (unsigned lanes = looked_[g].unloaded; lanes != 0; lanes &= lanes - 1) {
      const std::size_t place = g * WIDTH + __builtin_ctz(lanes);
      if (!packed.is_empty(place) && !of_impulses_[packed.rest[g].source[place % WIDTH]].may_pull())
        unloaded.push_back({place, looked_gap(place)});
    }
  return residual;
}

// Sets the gap above which a constraint without an impulse is idle: by the present residual, or
// `least_idle_gap` where that is more. Makes working constraints idle that have no impulse and are
// far from closed.
template <typename Group> void PackedSweeps<Group>::set_idle(double least_idle_gap)
{
  std::vector<Unloaded> at_cuts, inside;
  const float residual = std::max(look_at(at_cuts_, at_cuts), look_at(inside_, inside));
  idle_gap_ = std::max(static_cast<float>(least_idle_gap), IDLE_GAP * residual);
  make_idle(at_cuts, at_cuts_);
  make_idle(inside, inside_);
}

// Constraints that stay working move up within their colour.
template <typename Group>
void PackedSweeps<Group>::make_idle(const std::vector<Unloaded> &unloaded, Packed &packed)
{
  std::vector<std::size_t> far;
  for (const Unloaded &one : unloaded)
    if (one.gap > idle_gap_) far.push_back(one.place);
  if (far.size() <= packed.lanes() / FEW) return;
  std::size_t idle = idle_.lanes();
  while (idle > 0 && idle_.is_empty(idle - 1)) --idle;
  add_groups(idle_, (idle + far.size() + WIDTH - 1) / WIDTH - idle_.groups.size());
  for (const std::size_t place : far) copy(packed, place, idle_, idle++);
  Packed kept;
  auto next = far.begin();
  std::size_t begin = 0;
  std::vector<std::size_t> of_colour;
  for (const std::size_t end : packed.colour_end) {
    of_colour.clear();
    for (std::size_t place = begin * WIDTH; place < end * WIDTH; ++place) {
      if (next != far.end() && *next == place)
        ++next;
      else if (!packed.is_empty(place))
        of_colour.push_back(place);
    }
    begin = end;
    if (of_colour.empty()) continue;
    std::size_t to = kept.lanes();
    add_groups(kept, (of_colour.size() + WIDTH - 1) / WIDTH);
    kept.colour_end.push_back(kept.groups.size());
    for (const std::size_t place : of_colour) copy(packed, place, kept, to++);
  }
  packed = std::move(kept);
}

template <typename Group>
void PackedSweeps<Group>::impulses(const Scales &scales, std::vector<double> &impulse) const
{
  for (std::size_t c = 0; c < impulse.size(); ++c) impulse[c] = of_impulses_[c].idle();
  for (const Packed *const some : {&at_cuts_, &inside_})
    for (std::size_t g = 0; g < some->groups.size(); ++g) {
      const Group &group = some->groups[g];
      const Rest &rest = some->rest[g];
      for (int lane = 0; lane < WIDTH; ++lane) {
        if (rest.source[lane] == swept::NONE || !(group.now[lane] > group.least[lane])) continue;
        const std::size_t c = rest.source[lane];
        impulse[c] = of_impulses_[c].project(
            start_[c] + scales.impulse * static_cast<double>(group.now[lane] / rest.root[lane]));
      }
    }
}

template class PackedSweeps<swept::ParticleGroup>;
template class PackedSweeps<swept::BodyGroup>;

}    // namespace inelastic
