#include "inelastic_sweep_kernels.h"

#include "inelastic_vectorise.h"

#include <algorithm>

namespace inelastic::swept {

namespace {

#define INELASTIC_INLINE inline __attribute__((always_inline))

  template <typename State> INELASTIC_INLINE auto &at(State *states, std::uint32_t offset)
  { return reinterpret_cast<State *>(reinterpret_cast<char *>(states) + offset)->lanes; }

  template <typename State>
  INELASTIC_INLINE const auto &at(const State *states, std::uint32_t offset)
  {
    return reinterpret_cast<const State *>(reinterpret_cast<const char *>(states) + offset)->lanes;
  }

  // Writes the lanes of two vectors, one after the other, that are named. (Compilers without this
  // function, such as GCC 11, make more instructions of it.)
  template <int... PLACES, typename Vector>
  INELASTIC_INLINE void pick(const Vector &a, const Vector &b, Eight &picked)
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
    picked =
        Eight{(PLACES < WIDTH_OF_EACH ? a[PLACES % WIDTH_OF_EACH] : b[PLACES % WIDTH_OF_EACH])...};
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

  // Writes the sums over the four numbers of each half of four vectors: those of the lower halves
  // first.
  INELASTIC_INLINE void add_up_halves(const Eight *t, Eight &sums)
  {
    Eight ab, cd;
    add_picked<0, 8, 1, 9, 4, 12, 5, 13>(t[0], t[1], ab);
    add_picked<0, 8, 1, 9, 4, 12, 5, 13>(t[2], t[3], cd);
    add_picked<0, 1, 8, 9, 4, 5, 12, 13>(ab, cd, sums);
  }

  // The states of a group's constraints: kept, where registers have room for them.
  template <typename Group> struct Loaded;
  template <> struct Loaded<ParticleGroup> {
    Eight first[4], second[4];
  };
  template <> struct Loaded<BodyGroup> {};

  INELASTIC_INLINE void load(const ParticleGroup &group, const ParticleGroup::State *states,
                             Loaded<ParticleGroup> &loaded)
  {
    for (int k = 0; k < 4; ++k) {
      join(at(states, group.first[k]), at(states, group.first[k + 4]), loaded.first[k]);
      join(at(states, group.second[k]), at(states, group.second[k + 4]), loaded.second[k]);
    }
  }

  INELASTIC_INLINE void load(const BodyGroup &, const BodyGroup::State *, Loaded<BodyGroup> &) {}

  INELASTIC_INLINE void opening(const ParticleGroup &group, const ParticleGroup::State *states,
                                Loaded<ParticleGroup> &loaded, Eight &sums)
  {
    Eight terms[4];
    load(group, states, loaded);
    for (int k = 0; k < 4; ++k) terms[k] = group.row[k] * (loaded.first[k] - loaded.second[k]);
    add_up_halves(terms, sums);
  }

  INELASTIC_INLINE void opening(const BodyGroup &group, const BodyGroup::State *states,
                                Loaded<BodyGroup> &, Eight &sums)
  {
    Eight terms[WIDTH], low, high;
    for (int k = 0; k < WIDTH; ++k)
      terms[k] = group.first_row[k] * at(states, group.first[k]) +
          group.second_row[k] * at(states, group.second[k]);
    add_up_halves(terms, low);
    add_up_halves(terms + 4, high);
    Eight slides, spins;
    pick<0, 1, 2, 3, 8, 9, 10, 11>(low, high, slides);
    pick<4, 5, 6, 7, 12, 13, 14, 15>(low, high, spins);
    sums = slides + spins;
  }

  // Adds the changes of two impulses, of constraints K and K + 4, to their states.
  template <int K>
  INELASTIC_INLINE void push_two(const ParticleGroup &group, const Eight &of_first,
                                 const Eight &of_second, const Loaded<ParticleGroup> &loaded,
                                 ParticleGroup::State *states)
  {
    constexpr int J = K + 4;
    Eight first, second;
    pick<K, K, K, K, J, J, J, J>(of_first, of_first, first);
    pick<K, K, K, K, J, J, J, J>(of_second, of_second, second);
    first = loaded.first[K] + group.row[K] * first;
    second = loaded.second[K] - group.row[K] * second;
    at(states, group.first[K]) = Four{first[0], first[1], first[2], first[3]};
    at(states, group.first[J]) = Four{first[4], first[5], first[6], first[7]};
    at(states, group.second[K]) = Four{second[0], second[1], second[2], second[3]};
    at(states, group.second[J]) = Four{second[4], second[5], second[6], second[7]};
  }

  // Adds changes of the impulses to the states.
  INELASTIC_INLINE void push(const ParticleGroup &group, const Eight &change,
                             const Loaded<ParticleGroup> &loaded, ParticleGroup::State *states)
  {
    const Eight of_first = change * group.first_mobility;
    const Eight of_second = change * group.second_mobility;
    push_two<0>(group, of_first, of_second, loaded, states);
    push_two<1>(group, of_first, of_second, loaded, states);
    push_two<2>(group, of_first, of_second, loaded, states);
    push_two<3>(group, of_first, of_second, loaded, states);
  }

  INELASTIC_INLINE void push(const BodyGroup &group, const Eight &change, const Loaded<BodyGroup> &,
                             BodyGroup::State *states)
  {
    for (int k = 0; k < WIDTH; ++k) {
      at(states, group.first[k]) += group.first_row[k] * change[k];
      at(states, group.second[k]) += group.second_row[k] * change[k];
    }
  }

  template <typename Group>
  INELASTIC_INLINE void sweep_all(Group *groups, std::size_t count, typename Group::State *states,
                                  float along, float blur, Swept &swept)
  {
    Eight uphill = {}, most = {}, of_target = {}, farthest = {};
    for (std::size_t g = 0; g < count; ++g) {
      Group &group = groups[g];
      Loaded<Group> loaded;
      Eight opened;
      opening(group, states, loaded, opened);
      const Eight now = group.now;
      const Eight led = now + along * (now - group.before);
      const Eight free = led - (group.gap + group.give * led + opened);
      const Eight next = free > group.least ? free : group.least;
      const Eight change = next - led;
      uphill -= change * (next - now);
      const Eight size = change > 0 ? change : -change;
      most = size > most ? size : most;
      const Eight part = (size - blur) * group.inverse_target;
      of_target = part > of_target ? part : of_target;
      const Eight far = next > 0 ? next : -next;
      farthest = far > farthest ? far : farthest;
      group.before = now;
      group.now = next;
      push(group, change, loaded, states);
    }
    const auto raise = [](double &maximum, float value) {
      maximum = std::max(maximum, static_cast<double>(value));
    };
    for (int k = 0; k < WIDTH; ++k) {
      swept.uphill += static_cast<double>(uphill[k]);
      raise(swept.change, most[k]);
      raise(swept.of_target, of_target[k]);
      raise(swept.farthest, farthest[k]);
    }
  }

  template <typename Group>
  INELASTIC_INLINE double unsolved_of_all(const std::vector<Group> &groups,
                                          const typename Group::State *states, float blur)
  {
    Eight unsolved = {};
    for (const Group &group : groups) {
      Loaded<Group> loaded;
      Eight opened;
      opening(group, states, loaded, opened);
      const Eight gap = group.gap + group.give * group.now + opened;
      const Eight under_force = group.now > group.least ? gap : -gap;
      const Eight left = under_force > -gap ? under_force : -gap;
      const Eight part = (left - blur) * group.inverse_target;
      unsolved = part > unsolved ? part : unsolved;
    }
    double most = 0.0;
    for (int k = 0; k < WIDTH; ++k) most = std::max(most, static_cast<double>(unsolved[k]));
    return most;
  }

  template <typename Group>
  INELASTIC_INLINE void gaps_of_all(const std::vector<Group> &groups,
                                    const typename Group::State *states, Gaps *gap)
  {
    for (const Group &group : groups) {
      Loaded<Group> loaded;
      Eight opened;
      opening(group, states, loaded, opened);
      (gap++)->lanes = group.gap + group.give * group.now + opened;
    }
  }

  template <typename Group>
  INELASTIC_INLINE void add_all(const std::vector<Group> &groups, When when,
                                typename Group::State *states)
  {
    for (const Group &group : groups) {
      Loaded<Group> loaded;
      load(group, states, loaded);
      push(group, when == When::NOW ? group.now : group.before, loaded, states);
    }
  }

  template <typename State>
  INELASTIC_INLINE void lead_all_on(std::vector<State> &states, std::vector<State> &before,
                                    float along)
  {
    for (std::size_t i = 0; i < states.size(); ++i) {
      const auto now = states[i].lanes;
      states[i].lanes = now + along * (now - before[i].lanes);
      before[i].lanes = now;
    }
  }

}    // namespace

INELASTIC_CLONES void sweep(ParticleGroup *groups, std::size_t count, ParticleGroup::State *states,
                            float along, float blur, Swept &swept)
{ sweep_all(groups, count, states, along, blur, swept); }
INELASTIC_CLONES void sweep(BodyGroup *groups, std::size_t count, BodyGroup::State *states,
                            float along, float blur, Swept &swept)
{ sweep_all(groups, count, states, along, blur, swept); }

INELASTIC_CLONES double find_unsolved(const std::vector<ParticleGroup> &groups,
                                      const ParticleGroup::State *states, float blur)
{ return unsolved_of_all(groups, states, blur); }
INELASTIC_CLONES double find_unsolved(const std::vector<BodyGroup> &groups,
                                      const BodyGroup::State *states, float blur)
{ return unsolved_of_all(groups, states, blur); }

INELASTIC_CLONES void find_gaps(const std::vector<ParticleGroup> &groups,
                                const ParticleGroup::State *states, Gaps *gap)
{ gaps_of_all(groups, states, gap); }
INELASTIC_CLONES void find_gaps(const std::vector<BodyGroup> &groups,
                                const BodyGroup::State *states, Gaps *gap)
{ gaps_of_all(groups, states, gap); }

INELASTIC_CLONES void add_impulses(const std::vector<ParticleGroup> &groups, When when,
                                   ParticleGroup::State *states)
{ add_all(groups, when, states); }
INELASTIC_CLONES void add_impulses(const std::vector<BodyGroup> &groups, When when,
                                   BodyGroup::State *states)
{ add_all(groups, when, states); }

INELASTIC_CLONES void lead_on(std::vector<ParticleGroup::State> &states,
                              std::vector<ParticleGroup::State> &before, float along)
{ lead_all_on(states, before, along); }
INELASTIC_CLONES void lead_on(std::vector<BodyGroup::State> &states,
                              std::vector<BodyGroup::State> &before, float along)
{ lead_all_on(states, before, along); }

}    // namespace inelastic::swept
