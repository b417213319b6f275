#include "inelastic_packed_sweeps.h"

#include "inelastic_search.h"

#include <cmath>

namespace inelastic {

namespace {

  // At most so many lanes for each constraint, beside a batch for each colour.
  constexpr std::size_t MOST_LANES = 2;

  bool is_loaded(const swept::Lanes &batch, int lane)
  { return AdmissibleSet<float>::above(batch.idle[lane]).is_loaded(batch.now[lane]); }

}    // namespace

template <typename Batch>
bool PackedSweeps<Batch>::prepare(const Start &start, double idle_gap, Host &host)
{
  const ContactProblem &problem = start.problem;
  const ContactSet &contacts = problem.contacts;
  given_.emplace(start);
  idle_gap_ = static_cast<float>(idle_gap / start.scales.length);
  start_ = contacts.impulse;
  of_impulses_ = contacts.set;
  grains_.find(problem, problem.timestep * (start.scales.impulse / start.scales.length));
  std::vector<std::size_t> near, far;
  for (std::size_t c = 0; c < start.gap.size(); ++c)
    (contacts.is_loaded(c) || !(start.gap[c] > idle_gap) ? near : far).push_back(c);
  shared_.find(problem, near, host);
  const bool has_springs = contacts.has_springs();
  for (Packed *const some : {&at_cuts_, &inside_, &idle_})
    some->clear(grains_.number(), has_springs);
  const std::size_t lanes = pack(true, near) + pack(false, near);
  far_ = std::move(far);
  grains_.stop(states_);
  before_ = states_;
  targets_.begin(*given_);
  set_targets();
  return lanes <= MOST_LANES * near.size() + 2 * ConstraintColours::NUMBER * WIDTH;
}

// Packs those of some constraints that are at cuts, or those that are not. Returns how many lanes
// they take.
template <typename Batch>
std::size_t PackedSweeps<Batch>::pack(bool at_cuts, const std::vector<std::size_t> &constraints)
{
  const ContactSet &contacts = given_->problem.contacts;
  std::vector<std::size_t> chosen;
  std::vector<int> first, second;
  for (const std::size_t c : constraints) {
    if (shared_.is_at_cut(contacts.first[c], contacts.second[c]) != at_cuts) continue;
    chosen.push_back(c);
    first.push_back(contacts.first[c]);
    second.push_back(contacts.second[c]);
  }
  Packed &packed = at_cuts ? at_cuts_ : inside_;
  const std::vector<std::size_t> places = packed.add(colour(first, second));
  for (std::size_t k = 0; k < chosen.size(); ++k) write(chosen[k], packed, places[k]);
  return packed.lanes();
}

// Colours constraints, given by the slots of both sides.
template <typename Batch>
ConstraintColours PackedSweeps<Batch>::colour(const std::vector<int> &first,
                                              const std::vector<int> &second) const
{
  std::vector<int> one(first.size()), other(first.size());
  for (std::size_t k = 0; k < first.size(); ++k) {
    one[k] = grains_.of(first[k]);
    other[k] = grains_.of(second[k]);
  }
  return {one, other, grains_.moves()};
}

template <typename Batch>
void PackedSweeps<Batch>::go_on(const Start &start, const Refined &refined)
{
  const ContactSet &contacts = start.problem.contacts;
  const std::size_t known = start_.size();
  // By how much gaps have changed, as a length in packed units.
  if (!refined.gaps.empty()) {
    std::vector<float> by(known, 0.0f);
    for (const ChangedGap &gap : refined.gaps)
      by[gap.constraint] = static_cast<float>(gap.by / start.scales.length);
    for (Packed *const some : {&at_cuts_, &inside_, &idle_}) open(*some, by);
  }
  given_.emplace(start);
  of_impulses_ = contacts.set;
  start_.resize(contacts.size(), 0.0);
  // Idle constraints have the gaps of the centre. Those that are packed now are known with what the
  // impulses have changed since.
  std::vector<std::size_t> more = std::move(far_);
  far_.clear();
  for (std::size_t c = known; c < contacts.size(); ++c) more.push_back(c);
  const std::size_t from = idle_.used();
  idle_.resize_for(from + more.size());
  for (std::size_t k = 0; k < more.size(); ++k) write(more[k], idle_, from + k);
  look_at(idle_, looked_.idle);
  for (std::size_t place = from; place < from + more.size(); ++place) {
    const std::size_t g = place / WIDTH, lane = place % WIDTH;
    float &gap = idle_.batch(place).gap[lane];
    gap -= looked_.idle[g].gap[lane] / idle_.details[g].root[lane] - gap;
  }
  set_targets();
  wake_near();
}

// Adds lengths to the gaps of packed constraints, by the constraint.
template <typename Batch>
void PackedSweeps<Batch>::open(Packed &packed, const std::vector<float> &by) const
{
  for (std::size_t place = 0; place < packed.lanes(); ++place) {
    if (packed.is_empty(place)) continue;
    const swept::Details &details = packed.details_of(place);
    const auto lane = place % WIDTH;
    packed.batch(place).gap[lane] += by[details.source[lane]] / details.root[lane];
  }
}

template <typename Batch> void PackedSweeps<Batch>::recentre(double idle_gap, Host &host)
{
  const std::vector<Vector> moved = velocities();
  start_ = given_->problem.contacts.impulse;
  idle_gap_ = static_cast<float>(idle_gap / given_->scales.length);
  for (Packed *const some : {&at_cuts_, &inside_, &idle_})
    for (std::size_t g = 0; g < some->batches.size(); ++g) {
      Batch &batch = some->batches[g];
      const swept::Eight before = batch.before - batch.now;
      for (std::size_t place = g * WIDTH; place < (g + 1) * WIDTH; ++place)
        if (!some->is_empty(place)) write_start(*some, place);
      batch.before = before;
    }
  grains_.stop(states_);
  targets_.recentre(*given_, moved);
  // Of what is far only this is packed: as long as something is far, nothing else is idle.
  std::vector<std::size_t> near, far;
  for (const std::size_t c : far_) (given_->gap[c] > idle_gap ? far : near).push_back(c);
  write_idle(near);
  far_ = std::move(far);
  wake_near();
  refresh(host);
  set_targets();
}

template <typename Batch>
void PackedSweeps<Batch>::write(std::size_t c, Packed &packed, std::size_t place) const
{
  const ContactProblem &problem = given_->problem;
  const ContactSet &contacts = problem.contacts;
  Batch &batch = packed.batch(place);
  swept::Details &details = packed.details_of(place);
  const int lane = static_cast<int>(place % WIDTH);
  const double unit = given_->scales.impulse / given_->scales.length;
  const double whole = given_->diagonal[c] + shared_.from_other_ranks(problem, c);
  // All is divided by the same number, which is kept in single precision.
  details.root[lane] = static_cast<float>(std::sqrt(whole * unit));
  details.compliance[lane] = static_cast<float>(contacts.compliance[c] / whole);
  grains_.write_rows(problem, c, static_cast<double>(details.root[lane]), batch, lane);
  details.source[lane] = c;
  details.first[lane] = contacts.first[c];
  details.second[lane] = contacts.second[c];
  write_start(packed, place);
}

// Writes what belongs to the impulse that is the centre, of which there is no change yet.
template <typename Batch>
void PackedSweeps<Batch>::write_start(Packed &packed, std::size_t place) const
{
  Batch &batch = packed.batch(place);
  swept::Details &details = packed.details_of(place);
  const auto lane = place % WIDTH;
  const std::size_t c = details.source[lane];
  const Scales &scales = given_->scales;
  const double per_length = 1.0 / scales.length;
  const auto root = static_cast<double>(details.root[lane]);
  batch.gap[lane] = static_cast<float>(given_->gap[c] * per_length / root);
  batch.idle[lane] =
      static_cast<float>(of_impulses_[c].changes_of(start_[c]).idle() / scales.impulse * root);
  batch.now[lane] = batch.before[lane] = batch.inverse_target[lane] = 0.0f;
  details.least_target[lane] = static_cast<float>(given_->targets.least()[c] * per_length);
  details.part[lane] = static_cast<float>(given_->targets.part()[c]);
}

template <typename Batch>
swept::Swept PackedSweeps<Batch>::sweep(double along, double blur, Host &host)
{
  const auto by = static_cast<float>(along), blurred = static_cast<float>(blur);
  swept::extrapolate(states_, before_, by);
  swept::Swept swept;
  const auto visit = [&](Packed &some, std::size_t from, std::size_t to) {
    const swept::Details *const springs = some.springs() ? some.springs() + from : nullptr;
    swept::sweep(some.batches.data() + from, springs, to - from, states_.data(), by, blurred,
                 swept);
  };
  const std::size_t at_cuts = at_cuts_.batches.size(), inside = inside_.batches.size();
  // Ranks of the first colour begin with their constraints at cuts, those of the second visit
  // theirs after half of the others: messages arrive before somebody waits for them.
  const std::size_t begun = shared_.is_second() ? inside / 2 : 0;
  visit(inside_, 0, begun);
  if (shared_.is_second()) shared_.receive_first(states_, host);
  shared_.keep_before_visit(at_cuts_, states_, by);
  visit(at_cuts_, 0, at_cuts);
  shared_.send_changes(at_cuts_, states_, host);
  visit(inside_, begun, inside);
  if (!shared_.is_second()) shared_.receive_first(states_, host);
  shared_.receive_second(states_, host);
  return swept;
}

template <typename Batch> void PackedSweeps<Batch>::refresh(Host &host)
{
  for (const swept::When when : {swept::When::NOW, swept::When::BEFORE}) {
    std::vector<State> &states = when == swept::When::NOW ? states_ : before_;
    grains_.stop(states);
    swept::add_impulses(at_cuts_.batches, when, states.data());
    swept::add_impulses(inside_.batches, when, states.data());
    shared_.send_all(at_cuts_, when, states, host);
    shared_.receive_all(states, host);
  }
}

// Returns the change of velocity of each slot.
template <typename Batch>
const std::vector<typename PackedSweeps<Batch>::Vector> &PackedSweeps<Batch>::velocities()
{
  grains_.velocities(states_, velocity_);
  return velocity_;
}

template <typename Batch> bool PackedSweeps<Batch>::sets_targets(long sweep)
{
  if (sweep < 2) return false;
  int below = 0;    // 2^below is the largest power of two that is not more
  while ((sweep >> (below + 1)) > 0) ++below;
  const long half = below > 3 ? 1L << (below - 1) : 2;
  return sweep % half == 0;
}

template <typename Batch> void PackedSweeps<Batch>::set_targets()
{
  targets_.set(velocities());
  for (Packed *const some : {&at_cuts_, &inside_}) set_targets(*some, 0);
}

// Sets the targets of the batches from a place on.
template <typename Batch>
void PackedSweeps<Batch>::set_targets(Packed &packed, std::size_t from) const
{
  swept::set_targets(packed.batches.data() + from, packed.details.data() + from,
                     packed.batches.size() - from, targets_.changed().data(), targets_.most());
}

template <typename Batch> double PackedSweeps<Batch>::moved_since_kept(double accuracy)
{
  targets_.compare(velocities());
  float most = 0.0f;
  for (const Packed *const some : {&at_cuts_, &inside_})
    for (std::size_t g = 0; g < some->batches.size(); ++g) {
      const Batch &batch = some->batches[g];
      const swept::Details &details = some->details[g];
      for (int lane = 0; lane < WIDTH; ++lane) {
        if (!is_loaded(batch, lane)) continue;
        const int i = details.first[lane], j = details.second[lane];
        most = std::max(
            most,
            targets_.moved(i, j) /
                targets_.free_target(i, j, details.least_target[lane], details.part[lane]));
      }
    }
  return accuracy * static_cast<double>(most);
}

// Packs constraints as idle ones, where none are packed so far.
template <typename Batch>
void PackedSweeps<Batch>::write_idle(const std::vector<std::size_t> &constraints)
{
  if (constraints.empty()) return;
  idle_.resize_for(constraints.size());
  for (std::size_t k = 0; k < constraints.size(); ++k) write(constraints[k], idle_, k);
}

template <typename Batch> void PackedSweeps<Batch>::look_at_idle(double least_idle_gap)
{
  // What was far from closed at the start is packed now: many searches end before.
  write_idle(far_);
  far_.clear();
  set_idle(least_idle_gap);
  wake_near();
}

// Makes the idle constraints working whose gaps are not above idle_gap_. Their lanes are left empty
// until half of all are: looks are frequent, and wake a few of many.
template <typename Batch> void PackedSweeps<Batch>::wake_near()
{
  look_at(idle_, looked_.idle);
  std::vector<std::size_t> near;
  std::size_t empty = 0;
  for (std::size_t place = 0; place < idle_.lanes(); ++place) {
    // That of an empty lane is 0.
    if (looked_.idle[place / WIDTH].gap[place % WIDTH] > idle_gap_) continue;
    if (idle_.is_empty(place))
      ++empty;
    else
      near.push_back(place);
  }
  if (near.empty()) return;
  wake(near);
  for (const std::size_t place : near) idle_.clear_lane(place);
  if (2 * (empty + near.size()) > idle_.lanes()) idle_.close_up();
}

// Makes idle constraints working, given by their places in ascending order.
template <typename Batch> void PackedSweeps<Batch>::wake(const std::vector<std::size_t> &near)
{
  for (const bool at_cuts : {true, false}) {
    std::vector<std::size_t> chosen;
    std::vector<int> first, second;
    for (const std::size_t place : near) {
      const swept::Details &details = idle_.details_of(place);
      const auto one = static_cast<int>(details.first[place % WIDTH]);
      const auto other = static_cast<int>(details.second[place % WIDTH]);
      if (shared_.is_at_cut(one, other) != at_cuts) continue;
      chosen.push_back(place);
      first.push_back(one);
      second.push_back(other);
    }
    Packed &packed = at_cuts ? at_cuts_ : inside_;
    const std::size_t from = packed.batches.size();
    const std::vector<std::size_t> places = packed.add(colour(first, second));
    for (std::size_t k = 0; k < chosen.size(); ++k) packed.copy(idle_, chosen[k], places[k]);
    set_targets(packed, from);
  }
}

// Looks at all batches. Returns their largest residual, as a length in packed units.
template <typename Batch>
float PackedSweeps<Batch>::look_at(const Packed &packed, Looked &looked) const
{
  looked.resize(packed.batches.size());
  return swept::look(packed.batches, packed.details.data(), packed.springs(), states_.data(),
                     looked.data());
}

// Sets the gap above which a constraint without an impulse is idle: by the present residual, or
// `least_idle_gap` where that is more. Makes working constraints idle that have no impulse and are
// far from closed.
template <typename Batch> void PackedSweeps<Batch>::set_idle(double least_idle_gap)
{
  const float residual =
      std::max(look_at(at_cuts_, looked_.at_cuts), look_at(inside_, looked_.inside));
  idle_gap_ = std::max(static_cast<float>(least_idle_gap), static_cast<float>(IDLE_GAP) * residual);
  make_idle(looked_.at_cuts, at_cuts_);
  make_idle(looked_.inside, inside_);
}

// Makes constraints without an impulse idle whose gaps are far from closed, if they are more than a
// few.
template <typename Batch> void PackedSweeps<Batch>::make_idle(const Looked &looked, Packed &packed)
{
  std::vector<std::size_t> far;
  for (std::size_t g = 0; g < packed.batches.size(); ++g)
    for (unsigned lanes = looked[g].unloaded; lanes != 0; lanes &= lanes - 1) {
      const int lane = __builtin_ctz(lanes);
      const std::size_t c = packed.details[g].source[lane];
      if (looked[g].gap[lane] > idle_gap_ && c != swept::NONE && !of_impulses_[c].may_pull())
        far.push_back(g * WIDTH + static_cast<std::size_t>(lane));
    }
  if (far.size() <= packed.lanes() / FEW_IDLE) return;
  std::size_t idle = idle_.used();
  idle_.resize_for(idle + far.size());
  for (const std::size_t place : far) idle_.copy(packed, place, idle++);
  packed.leave_out(far);
}

template <typename Batch>
void PackedSweeps<Batch>::impulses(const Scales &scales, std::vector<double> &impulse) const
{
  for (std::size_t c = 0; c < impulse.size(); ++c) impulse[c] = of_impulses_[c].idle();
  for (const Packed *const some : {&at_cuts_, &inside_})
    for (std::size_t g = 0; g < some->batches.size(); ++g) {
      const Batch &batch = some->batches[g];
      const swept::Details &details = some->details[g];
      for (int lane = 0; lane < WIDTH; ++lane) {
        if (details.source[lane] == swept::NONE || !is_loaded(batch, lane)) continue;
        const std::size_t c = details.source[lane];
        impulse[c] = of_impulses_[c].project(
            start_[c] + scales.impulse * static_cast<double>(batch.now[lane] / details.root[lane]));
      }
    }
}

template class PackedSweeps<swept::ParticleBatch>;
template class PackedSweeps<swept::BodyBatch>;

}    // namespace inelastic
