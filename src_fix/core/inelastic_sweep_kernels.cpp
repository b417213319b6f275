#include "inelastic_sweep_kernels.h"

#include "inelastic_admissible_set.h"
#include "inelastic_target_formula.h"
#include "inelastic_vectorise.h"

#include <algorithm>

namespace inelastic::swept {

// Every pass is written for vectors of eight numbers, and of four: processors without registers for
// eight take three times as long for eight as for two times four.

namespace {

#define INELASTIC_INLINE inline __attribute__((always_inline))

  struct Wide {
    using Numbers = Eight;
    static constexpr int COUNT = 8;
  };
  struct Narrow {
    using Numbers = Four;
    static constexpr int COUNT = 4;
  };

  template <typename State> INELASTIC_INLINE auto &at(State *states, std::uint32_t offset)
  { return reinterpret_cast<State *>(reinterpret_cast<char *>(states) + offset)->lanes; }

  template <typename State>
  INELASTIC_INLINE const auto &at(const State *states, std::uint32_t offset)
  {
    return reinterpret_cast<const State *>(reinterpret_cast<const char *>(states) + offset)->lanes;
  }

  // Gives the numbers of a vector from a place on: all of them, or a half.
  template <typename Size> INELASTIC_INLINE typename Size::Numbers &part(Eight &whole, int from)
  { return reinterpret_cast<typename Size::Numbers *>(&whole)[from / Size::COUNT]; }
  template <typename Size>
  INELASTIC_INLINE const typename Size::Numbers &part(const Eight &whole, int from)
  { return reinterpret_cast<const typename Size::Numbers *>(&whole)[from / Size::COUNT]; }

  // Writes the lanes of two vectors, one after the other, that are named. (Compilers without this
  // function, such as GCC 11, make more instructions of it.)
  template <int... PLACES, typename Vector, typename V>
  INELASTIC_INLINE void pick(const Vector &a, const Vector &b, V &picked)
  {
#if defined(__has_builtin)
#if __has_builtin(__builtin_shufflevector)
#define INELASTIC_SHUFFLES
#endif
#endif
#ifdef INELASTIC_SHUFFLES
    picked = __builtin_shufflevector(a, b, PLACES...);
#else
    constexpr int WIDTH_OF_EACH = sizeof(Vector) / sizeof(float);
    picked = V{(PLACES < WIDTH_OF_EACH ? a[PLACES % WIDTH_OF_EACH] : b[PLACES % WIDTH_OF_EACH])...};
#endif
  }

  INELASTIC_INLINE void join(const Four &low, const Four &high, Eight &both)
  { pick<0, 1, 2, 3, 4, 5, 6, 7>(low, high, both); }

  // Writes the sums of the lanes that are picked in two ways.
  template <int A, int B, int C, int D, int E, int F, int G, int H>
  INELASTIC_INLINE void add_picked(const Eight &a, const Eight &b, Eight &sums)
  {
    Eight even, odd;
    pick<A, B, C, D, E, F, G, H>(a, b, even);
    pick<A + 2, B + 2, C + 2, D + 2, E + 2, F + 2, G + 2, H + 2>(a, b, odd);
    sums = even + odd;
  }

  template <int A, int B, int C, int D>
  INELASTIC_INLINE void add_picked(const Four &a, const Four &b, Four &sums)
  {
    Four even, odd;
    pick<A, B, C, D>(a, b, even);
    pick<A + 2, B + 2, C + 2, D + 2>(a, b, odd);
    sums = even + odd;
  }

  // Writes the sums over the four numbers of each half of four vectors: those of the lower halves
  // first.
  INELASTIC_INLINE void add_up(const Eight *t, Eight &sums)
  {
    Eight ab, cd;
    add_picked<0, 8, 1, 9, 4, 12, 5, 13>(t[0], t[1], ab);
    add_picked<0, 8, 1, 9, 4, 12, 5, 13>(t[2], t[3], cd);
    add_picked<0, 1, 8, 9, 4, 5, 12, 13>(ab, cd, sums);
  }

  // Writes the sums over the numbers of each of four vectors.
  INELASTIC_INLINE void add_up(const Four *t, Four &sums)
  {
    Four ab, cd;
    add_picked<0, 4, 1, 5>(t[0], t[1], ab);
    add_picked<0, 4, 1, 5>(t[2], t[3], cd);
    add_picked<0, 1, 4, 5>(ab, cd, sums);
  }

  // The states of some constraints of a group: kept, where registers have room for them.
  template <typename Group, typename Size> struct Loaded {};
  template <> struct Loaded<ParticleGroup, Wide> {
    Eight first[4], second[4];
  };

  INELASTIC_INLINE void load(const ParticleGroup &group, const ParticleGroup::State *states,
                             Loaded<ParticleGroup, Wide> &loaded)
  {
    for (int k = 0; k < 4; ++k) {
      join(at(states, group.first[k]), at(states, group.first[k + 4]), loaded.first[k]);
      join(at(states, group.second[k]), at(states, group.second[k + 4]), loaded.second[k]);
    }
  }

  template <typename Group, typename Size>
  INELASTIC_INLINE void load(const Group &, const typename Group::State *, Loaded<Group, Size> &)
  {
  }

  // opening() writes row . u of the constraints of a group from a place on.
  INELASTIC_INLINE void opening(const ParticleGroup &group, int, const ParticleGroup::State *states,
                                Loaded<ParticleGroup, Wide> &loaded, Eight &sums)
  {
    Eight terms[4];
    load(group, states, loaded);
    for (int k = 0; k < 4; ++k) terms[k] = group.row[k] * (loaded.first[k] - loaded.second[k]);
    add_up(terms, sums);
  }

  INELASTIC_INLINE void opening(const ParticleGroup &group, int from,
                                const ParticleGroup::State *states, Loaded<ParticleGroup, Narrow> &,
                                Four &sums)
  {
    Four terms[4];
    for (int k = 0; k < 4; ++k)
      terms[k] = part<Narrow>(group.row[k], from) *
          (at(states, group.first[from + k]) - at(states, group.second[from + k]));
    add_up(terms, sums);
  }

  INELASTIC_INLINE void opening(const BodyGroup &group, int, const BodyGroup::State *states,
                                Loaded<BodyGroup, Wide> &, Eight &sums)
  {
    Eight terms[WIDTH], low, high;
    for (int k = 0; k < WIDTH; ++k)
      terms[k] = group.first_row[k] * at(states, group.first[k]) +
          group.second_row[k] * at(states, group.second[k]);
    add_up(terms, low);
    add_up(terms + 4, high);
    Eight slides, spins;
    pick<0, 1, 2, 3, 8, 9, 10, 11>(low, high, slides);
    pick<4, 5, 6, 7, 12, 13, 14, 15>(low, high, spins);
    sums = slides + spins;
  }

  INELASTIC_INLINE void opening(const BodyGroup &group, int from, const BodyGroup::State *states,
                                Loaded<BodyGroup, Narrow> &, Four &sums)
  {
    Four terms[4];
    for (int k = 0; k < 4; ++k) {
      const Eight &first = at(states, group.first[from + k]);
      const Eight &second = at(states, group.second[from + k]);
      const Eight &first_row = group.first_row[from + k], &second_row = group.second_row[from + k];
      terms[k] = part<Narrow>(first_row, 0) * part<Narrow>(first, 0) +
          part<Narrow>(first_row, 4) * part<Narrow>(first, 4) +
          part<Narrow>(second_row, 0) * part<Narrow>(second, 0) +
          part<Narrow>(second_row, 4) * part<Narrow>(second, 4);
    }
    add_up(terms, sums);
  }

  // Writes the inverse masses of two particles, each for all numbers of its state.
  INELASTIC_INLINE void mobilities(const Eight &states, Eight &mobility)
  { pick<3, 3, 3, 3, 7, 7, 7, 7>(states, states, mobility); }

  // Adds the changes of two impulses, of constraints K and K + 4, to their states.
  template <int K>
  INELASTIC_INLINE void push_two(const ParticleGroup &group, const Eight &change,
                                 const Loaded<ParticleGroup, Wide> &loaded,
                                 ParticleGroup::State *states)
  {
    constexpr int J = K + 4;
    Eight by, of_first, of_second;
    pick<K, K, K, K, J, J, J, J>(change, change, by);
    mobilities(loaded.first[K], of_first);
    mobilities(loaded.second[K], of_second);
    const Eight first = loaded.first[K] + group.row[K] * (by * of_first);
    const Eight second = loaded.second[K] - group.row[K] * (by * of_second);
    at(states, group.first[K]) = Four{first[0], first[1], first[2], first[3]};
    at(states, group.first[J]) = Four{first[4], first[5], first[6], first[7]};
    at(states, group.second[K]) = Four{second[0], second[1], second[2], second[3]};
    at(states, group.second[J]) = Four{second[4], second[5], second[6], second[7]};
  }

  // push() adds changes of the impulses of the constraints of a group from a place on to the
  // states.
  INELASTIC_INLINE void push(const ParticleGroup &group, int, const Eight &change,
                             const Loaded<ParticleGroup, Wide> &loaded,
                             ParticleGroup::State *states)
  {
    push_two<0>(group, change, loaded, states);
    push_two<1>(group, change, loaded, states);
    push_two<2>(group, change, loaded, states);
    push_two<3>(group, change, loaded, states);
  }

  INELASTIC_INLINE void push(const ParticleGroup &group, int from, const Four &change,
                             const Loaded<ParticleGroup, Narrow> &, ParticleGroup::State *states)
  {
    for (int k = 0; k < 4; ++k) {
      const Four &row = part<Narrow>(group.row[k], from);
      Four &first = at(states, group.first[from + k]);
      first += row * (change[k] * first[3]);
      Four &second = at(states, group.second[from + k]);
      second -= row * (change[k] * second[3]);
    }
  }

  template <typename Size>
  INELASTIC_INLINE void push(const BodyGroup &group, int from, const typename Size::Numbers &change,
                             const Loaded<BodyGroup, Size> &, BodyGroup::State *states)
  {
    constexpr int COUNT = Size::COUNT;
    for (int k = 0; k < COUNT; ++k) {
      const int c = from + k;
      for (int half = 0; half < WIDTH; half += COUNT)
        part<Size>(at(states, group.first[c]), half) +=
            part<Size>(group.first_row[c], half) * change[k];
      for (int half = 0; half < WIDTH; half += COUNT)
        part<Size>(at(states, group.second[c]), half) +=
            part<Size>(group.second_row[c], half) * change[k];
    }
  }

  template <typename Size> INELASTIC_INLINE double largest_of(const typename Size::Numbers &values)
  {
    double most = 0.0;
    for (int k = 0; k < Size::COUNT; ++k) most = std::max(most, static_cast<double>(values[k]));
    return most;
  }

  using Set = HalfLine<float>;

  // Writes the gaps of constraints with some impulses, of which `opened` is what all make of them.
  template <typename Size, typename Group>
  INELASTIC_INLINE void find_gap(const Group &group, const Rest *springs, int from,
                                 const typename Size::Numbers &impulse,
                                 const typename Size::Numbers &opened, typename Size::Numbers &gap)
  {
    if (springs)
      gap = part<Size>(group.gap, from) + part<Size>(springs->give, from) * impulse + opened;
    else
      gap = part<Size>(group.gap, from) + opened;
  }

  template <typename Size, typename Group>
  INELASTIC_INLINE void sweep_all(Group *groups, const Rest *springs, std::size_t count,
                                  typename Group::State *states, float along, float blur,
                                  Swept &swept)
  {
    using V = typename Size::Numbers;
    V uphill = {}, most = {}, of_target = {}, farthest = {};
    for (std::size_t g = 0; g < count; ++g) {
      Group &group = groups[g];
      for (int from = 0; from < WIDTH; from += Size::COUNT) {
        Loaded<Group, Size> loaded;
        V opened, gap, next;
        opening(group, from, states, loaded, opened);
        const V now = part<Size>(group.now, from);
        const V led = now + along * (now - part<Size>(group.before, from));
        find_gap<Size>(group, springs ? springs + g : nullptr, from, led, opened, gap);
        const V free = led - gap;
        Set::project(free, part<Size>(group.idle, from), next);
        const V change = next - led;
        uphill -= change * (next - now);
        const V size = change > 0 ? change : -change;
        most = size > most ? size : most;
        const V ratio = (size - blur) * part<Size>(group.inverse_target, from);
        of_target = ratio > of_target ? ratio : of_target;
        const V far = next > 0 ? next : -next;
        farthest = far > farthest ? far : farthest;
        part<Size>(group.before, from) = now;
        part<Size>(group.now, from) = next;
        push(group, from, change, loaded, states);
      }
    }
    for (int k = 0; k < Size::COUNT; ++k) swept.uphill += static_cast<double>(uphill[k]);
    swept.change = std::max(swept.change, largest_of<Size>(most));
    swept.of_target = std::max(swept.of_target, largest_of<Size>(of_target));
    swept.farthest = std::max(swept.farthest, largest_of<Size>(farthest));
  }

  template <typename Size, typename Group>
  INELASTIC_INLINE double unsolved_of_all(const std::vector<Group> &groups, const Rest *springs,
                                          const typename Group::State *states, float blur)
  {
    using V = typename Size::Numbers;
    V unsolved = {};
    for (const Group &group : groups) {
      for (int from = 0; from < WIDTH; from += Size::COUNT) {
        Loaded<Group, Size> loaded;
        V opened, gap, open;
        opening(group, from, states, loaded, opened);
        const V &now = part<Size>(group.now, from);
        find_gap<Size>(group, springs, from, now, opened, gap);
        Set::find_open(now, part<Size>(group.idle, from), gap, open);
        const V left = open > -gap ? open : -gap;
        const V ratio = (left - blur) * part<Size>(group.inverse_target, from);
        unsolved = ratio > unsolved ? ratio : unsolved;
      }
      if (springs) ++springs;
    }
    return largest_of<Size>(unsolved);
  }

  template <typename Size, typename Group>
  INELASTIC_INLINE float look_at_all(const std::vector<Group> &groups, const Rest *rest,
                                     const Rest *springs, const typename Group::State *states,
                                     Looked *looked)
  {
    using V = typename Size::Numbers;
    V residual = {};
    for (const Group &group : groups) {
      unsigned unloaded = 0;
      for (int from = 0; from < WIDTH; from += Size::COUNT) {
        Loaded<Group, Size> loaded;
        V opened, scaled, open;
        opening(group, from, states, loaded, opened);
        const V &now = part<Size>(group.now, from), &idle = part<Size>(group.idle, from);
        find_gap<Size>(group, springs ? rest : nullptr, from, now, opened, scaled);
        const V gap = scaled * part<Size>(rest->root, from);
        part<Size>(looked->gap, from) = gap;
        Set::find_open(now, idle, gap, open);
        const V left = open > -gap ? open : -gap;
        residual = left > residual ? left : residual;
        const V &before = part<Size>(group.before, from);
        const V most = now > before ? now : before, fewest = now < before ? now : before;
        for (int k = 0; k < Size::COUNT; ++k)
          unloaded |= unsigned{most[k] == 0.0f && fewest[k] == 0.0f &&
                               !Set::above(idle[k]).is_loaded(now[k])}
              << (from + k);
      }
      looked->unloaded = static_cast<std::uint8_t>(unloaded);
      ++rest;
      ++looked;
    }
    return static_cast<float>(largest_of<Size>(residual));
  }

  template <typename Size, typename Group>
  INELASTIC_INLINE void set_all_targets(Group *groups, const Rest *rest, std::size_t count,
                                        const float *changed, float most)
  {
    using V = typename Size::Numbers;
    const V bound = most - V{};
    for (std::size_t g = 0; g < count; ++g)
      for (int from = 0; from < WIDTH; from += Size::COUNT) {
        V less;
        for (int k = 0; k < Size::COUNT; ++k)
          less[k] = std::min(changed[rest[g].first[from + k]], changed[rest[g].second[from + k]]);
        const V &least = part<Size>(rest[g].least_target, from);
        const V by_velocity = part<Size>(rest[g].part, from) * less;
        V free, target;
        find_free_target(by_velocity, least, free);
        bound_target(free, bound, target);
        part<Size>(groups[g].inverse_target, from) = part<Size>(rest[g].root, from) / target;
      }
  }

  template <typename Size, typename Group>
  INELASTIC_INLINE void add_all(const std::vector<Group> &groups, When when,
                                typename Group::State *states)
  {
    for (const Group &group : groups)
      for (int from = 0; from < WIDTH; from += Size::COUNT) {
        Loaded<Group, Size> loaded;
        load(group, states, loaded);
        push(group, from, part<Size>(when == When::NOW ? group.now : group.before, from), loaded,
             states);
      }
  }

  // Two states of particles, which lie on multiples of 16 bytes.
  typedef float Two __attribute__((vector_size(32), may_alias, aligned(16)));

  template <typename State>
  INELASTIC_INLINE void lead_all_on(std::vector<State> &states, std::vector<State> &before,
                                    float along)
  {
    const std::size_t twos = states.size() * sizeof(State) / sizeof(Two);
    // A deduced type would be aligned as all vectors of this size.
    Two *const now = reinterpret_cast<Two *>(states.data());
    Two *const last = reinterpret_cast<Two *>(before.data());
    for (std::size_t i = 0; i < twos; ++i) {
      const Two was = now[i];
      now[i] = was + along * (was - last[i]);
      last[i] = was;
    }
    for (std::size_t i = twos * sizeof(Two) / sizeof(State); i < states.size(); ++i) {
      const auto was = states[i].lanes;
      states[i].lanes = was + along * (was - before[i].lanes);
      before[i].lanes = was;
    }
  }

  // Tells whether the clones below that have registers for eight numbers are the ones that run.
  bool is_wide()
  {
#ifdef INELASTIC_HAS_CLONES
    static const bool wide = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
    return wide;
#elif defined(__AVX2__)
    return true;
#else
    return false;
#endif
  }

  // The passes over groups of each kind, by vectors of eight and of four numbers.
#define INELASTIC_PASSES(GROUP)                                                                 \
  INELASTIC_CLONES void wide_sweep(GROUP *groups, const Rest *springs, std::size_t count,       \
                                   GROUP::State *states, float along, float blur, Swept &swept) \
  { sweep_all<Wide>(groups, springs, count, states, along, blur, swept); }                      \
  INELASTIC_CLONES double wide_unsolved(const std::vector<GROUP> &groups, const Rest *springs,  \
                                        const GROUP::State *states, float blur)                 \
  { return unsolved_of_all<Wide>(groups, springs, states, blur); }                              \
  INELASTIC_CLONES float wide_look(const std::vector<GROUP> &groups, const Rest *rest,          \
                                   const Rest *springs, const GROUP::State *states,             \
                                   Looked *looked)                                              \
  { return look_at_all<Wide>(groups, rest, springs, states, looked); }                          \
  INELASTIC_CLONES void wide_targets(GROUP *groups, const Rest *rest, std::size_t count,        \
                                     const float *changed, float most)                          \
  { set_all_targets<Wide>(groups, rest, count, changed, most); }                                \
  INELASTIC_CLONES void wide_add(const std::vector<GROUP> &groups, When when,                   \
                                 GROUP::State *states)                                          \
  { add_all<Wide>(groups, when, states); }

  INELASTIC_PASSES(ParticleGroup)
  INELASTIC_PASSES(BodyGroup)

}    // namespace

#define INELASTIC_CHOICES(GROUP)                                                             \
  void sweep(GROUP *groups, const Rest *springs, std::size_t count, GROUP::State *states,    \
             float along, float blur, Swept &swept)                                          \
  {                                                                                          \
    if (is_wide())                                                                           \
      wide_sweep(groups, springs, count, states, along, blur, swept);                        \
    else                                                                                     \
      sweep_all<Narrow>(groups, springs, count, states, along, blur, swept);                 \
  }                                                                                          \
  double find_unsolved(const std::vector<GROUP> &groups, const Rest *springs,                \
                       const GROUP::State *states, float blur)                               \
  {                                                                                          \
    return is_wide() ? wide_unsolved(groups, springs, states, blur)                          \
                     : unsolved_of_all<Narrow>(groups, springs, states, blur);               \
  }                                                                                          \
  float look(const std::vector<GROUP> &groups, const Rest *rest, const Rest *springs,        \
             const GROUP::State *states, Looked *looked)                                     \
  {                                                                                          \
    return is_wide() ? wide_look(groups, rest, springs, states, looked)                      \
                     : look_at_all<Narrow>(groups, rest, springs, states, looked);           \
  }                                                                                          \
  void set_targets(GROUP *groups, const Rest *rest, std::size_t count, const float *changed, \
                   float most)                                                               \
  {                                                                                          \
    is_wide() ? wide_targets(groups, rest, count, changed, most)                             \
              : set_all_targets<Narrow>(groups, rest, count, changed, most);                 \
  }                                                                                          \
  void add_impulses(const std::vector<GROUP> &groups, When when, GROUP::State *states)       \
  { is_wide() ? wide_add(groups, when, states) : add_all<Narrow>(groups, when, states); }

INELASTIC_CHOICES(ParticleGroup)
INELASTIC_CHOICES(BodyGroup)

INELASTIC_CLONES void lead_on(std::vector<ParticleGroup::State> &states,
                              std::vector<ParticleGroup::State> &before, float along)
{ lead_all_on(states, before, along); }
INELASTIC_CLONES void lead_on(std::vector<BodyGroup::State> &states,
                              std::vector<BodyGroup::State> &before, float along)
{ lead_all_on(states, before, along); }

}    // namespace inelastic::swept
