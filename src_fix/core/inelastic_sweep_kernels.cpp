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

  // The states of some constraints of a batch: kept, where registers have room for them.
  template <typename Batch, typename Size> struct Loaded {};
  template <> struct Loaded<ParticleBatch, Wide> {
    Eight first[4], second[4];
  };

  INELASTIC_INLINE void load(const ParticleBatch &batch, const ParticleBatch::State *states,
                             Loaded<ParticleBatch, Wide> &loaded)
  {
    for (int k = 0; k < 4; ++k) {
      join(at(states, batch.first[k]), at(states, batch.first[k + 4]), loaded.first[k]);
      join(at(states, batch.second[k]), at(states, batch.second[k + 4]), loaded.second[k]);
    }
  }

  template <typename Batch, typename Size>
  INELASTIC_INLINE void load(const Batch &, const typename Batch::State *, Loaded<Batch, Size> &)
  {
  }

  // opening() writes row . u of the constraints of a batch from a place on.
  INELASTIC_INLINE void opening(const ParticleBatch &batch, int, const ParticleBatch::State *states,
                                Loaded<ParticleBatch, Wide> &loaded, Eight &sums)
  {
    Eight terms[4];
    load(batch, states, loaded);
    for (int k = 0; k < 4; ++k) terms[k] = batch.row[k] * (loaded.first[k] - loaded.second[k]);
    add_up(terms, sums);
  }

  INELASTIC_INLINE void opening(const ParticleBatch &batch, int from,
                                const ParticleBatch::State *states, Loaded<ParticleBatch, Narrow> &,
                                Four &sums)
  {
    Four terms[4];
    for (int k = 0; k < 4; ++k)
      terms[k] = part<Narrow>(batch.row[k], from) *
          (at(states, batch.first[from + k]) - at(states, batch.second[from + k]));
    add_up(terms, sums);
  }

  INELASTIC_INLINE void opening(const BodyBatch &batch, int, const BodyBatch::State *states,
                                Loaded<BodyBatch, Wide> &, Eight &sums)
  {
    Eight terms[WIDTH], low, high;
    for (int k = 0; k < WIDTH; ++k)
      terms[k] = batch.first_row[k] * at(states, batch.first[k]) +
          batch.second_row[k] * at(states, batch.second[k]);
    add_up(terms, low);
    add_up(terms + 4, high);
    Eight slides, spins;
    pick<0, 1, 2, 3, 8, 9, 10, 11>(low, high, slides);
    pick<4, 5, 6, 7, 12, 13, 14, 15>(low, high, spins);
    sums = slides + spins;
  }

  INELASTIC_INLINE void opening(const BodyBatch &batch, int from, const BodyBatch::State *states,
                                Loaded<BodyBatch, Narrow> &, Four &sums)
  {
    Four terms[4];
    for (int k = 0; k < 4; ++k) {
      const Eight &first = at(states, batch.first[from + k]);
      const Eight &second = at(states, batch.second[from + k]);
      const Eight &first_row = batch.first_row[from + k], &second_row = batch.second_row[from + k];
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
  INELASTIC_INLINE void push_two(const ParticleBatch &batch, const Eight &change,
                                 const Loaded<ParticleBatch, Wide> &loaded,
                                 ParticleBatch::State *states)
  {
    constexpr int J = K + 4;
    Eight by, of_first, of_second;
    pick<K, K, K, K, J, J, J, J>(change, change, by);
    mobilities(loaded.first[K], of_first);
    mobilities(loaded.second[K], of_second);
    const Eight first = loaded.first[K] + batch.row[K] * (by * of_first);
    const Eight second = loaded.second[K] - batch.row[K] * (by * of_second);
    at(states, batch.first[K]) = Four{first[0], first[1], first[2], first[3]};
    at(states, batch.first[J]) = Four{first[4], first[5], first[6], first[7]};
    at(states, batch.second[K]) = Four{second[0], second[1], second[2], second[3]};
    at(states, batch.second[J]) = Four{second[4], second[5], second[6], second[7]};
  }

  // push() adds changes of the impulses of the constraints of a batch from a place on to the
  // states.
  INELASTIC_INLINE void push(const ParticleBatch &batch, int, const Eight &change,
                             const Loaded<ParticleBatch, Wide> &loaded,
                             ParticleBatch::State *states)
  {
    push_two<0>(batch, change, loaded, states);
    push_two<1>(batch, change, loaded, states);
    push_two<2>(batch, change, loaded, states);
    push_two<3>(batch, change, loaded, states);
  }

  INELASTIC_INLINE void push(const ParticleBatch &batch, int from, const Four &change,
                             const Loaded<ParticleBatch, Narrow> &, ParticleBatch::State *states)
  {
    for (int k = 0; k < 4; ++k) {
      const Four &row = part<Narrow>(batch.row[k], from);
      Four &first = at(states, batch.first[from + k]);
      first += row * (change[k] * first[3]);
      Four &second = at(states, batch.second[from + k]);
      second -= row * (change[k] * second[3]);
    }
  }

  template <typename Size>
  INELASTIC_INLINE void push(const BodyBatch &batch, int from, const typename Size::Numbers &change,
                             const Loaded<BodyBatch, Size> &, BodyBatch::State *states)
  {
    constexpr int COUNT = Size::COUNT;
    for (int k = 0; k < COUNT; ++k) {
      const int c = from + k;
      for (int half = 0; half < WIDTH; half += COUNT)
        part<Size>(at(states, batch.first[c]), half) +=
            part<Size>(batch.first_row[c], half) * change[k];
      for (int half = 0; half < WIDTH; half += COUNT)
        part<Size>(at(states, batch.second[c]), half) +=
            part<Size>(batch.second_row[c], half) * change[k];
    }
  }

  template <typename Size> INELASTIC_INLINE double largest_of(const typename Size::Numbers &values)
  {
    double most = 0.0;
    for (int k = 0; k < Size::COUNT; ++k) most = std::max(most, static_cast<double>(values[k]));
    return most;
  }

  using Set = AdmissibleSet<float>;

  // Writes the gaps of constraints with some impulses, of which `opened` is what all make of them.
  template <typename Size, typename Batch>
  INELASTIC_INLINE void find_gap(const Batch &batch, const Details *springs, int from,
                                 const typename Size::Numbers &impulse,
                                 const typename Size::Numbers &opened, typename Size::Numbers &gap)
  {
    if (springs)
      gap = part<Size>(batch.gap, from) + part<Size>(springs->compliance, from) * impulse + opened;
    else
      gap = part<Size>(batch.gap, from) + opened;
  }

  template <typename Size, typename Batch>
  INELASTIC_INLINE void sweep_all(Batch *batches, const Details *springs, std::size_t count,
                                  typename Batch::State *states, float along, float blur,
                                  Swept &swept)
  {
    using V = typename Size::Numbers;
    V uphill = {}, most = {}, of_target = {}, since_start = {};
    for (std::size_t g = 0; g < count; ++g) {
      Batch &batch = batches[g];
      for (int from = 0; from < WIDTH; from += Size::COUNT) {
        Loaded<Batch, Size> loaded;
        V opened, gap, next;
        opening(batch, from, states, loaded, opened);
        const V now = part<Size>(batch.now, from);
        const V extrapolated = now + along * (now - part<Size>(batch.before, from));
        find_gap<Size>(batch, springs ? springs + g : nullptr, from, extrapolated, opened, gap);
        const V free = extrapolated - gap;
        Set::project(free, part<Size>(batch.idle, from), next);
        const V change = next - extrapolated;
        uphill -= change * (next - now);
        const V size = change > 0 ? change : -change;
        most = size > most ? size : most;
        const V ratio = (size - blur) * part<Size>(batch.inverse_target, from);
        of_target = ratio > of_target ? ratio : of_target;
        const V far = next > 0 ? next : -next;
        since_start = far > since_start ? far : since_start;
        part<Size>(batch.before, from) = now;
        part<Size>(batch.now, from) = next;
        push(batch, from, change, loaded, states);
      }
    }
    for (int k = 0; k < Size::COUNT; ++k) swept.uphill += static_cast<double>(uphill[k]);
    swept.change = std::max(swept.change, largest_of<Size>(most));
    swept.of_target = std::max(swept.of_target, largest_of<Size>(of_target));
    swept.since_start = std::max(swept.since_start, largest_of<Size>(since_start));
  }

  template <typename Size, typename Batch>
  INELASTIC_INLINE double unsolved_of_all(const Array<Batch> &batches, const Details *springs,
                                          const typename Batch::State *states, float blur)
  {
    using V = typename Size::Numbers;
    V unsolved = {};
    for (const Batch &batch : batches) {
      for (int from = 0; from < WIDTH; from += Size::COUNT) {
        Loaded<Batch, Size> loaded;
        V opened, gap, open;
        opening(batch, from, states, loaded, opened);
        const V &now = part<Size>(batch.now, from);
        find_gap<Size>(batch, springs, from, now, opened, gap);
        Set::find_open(now, part<Size>(batch.idle, from), gap, open);
        const V left = open > -gap ? open : -gap;
        const V ratio = (left - blur) * part<Size>(batch.inverse_target, from);
        unsolved = ratio > unsolved ? ratio : unsolved;
      }
      if (springs) ++springs;
    }
    return largest_of<Size>(unsolved);
  }

  template <typename Size, typename Batch>
  INELASTIC_INLINE float look_at_all(const Array<Batch> &batches, const Details *details,
                                     const Details *springs, const typename Batch::State *states,
                                     Looked *looked)
  {
    using V = typename Size::Numbers;
    V residual = {};
    for (const Batch &batch : batches) {
      unsigned unloaded = 0;
      for (int from = 0; from < WIDTH; from += Size::COUNT) {
        Loaded<Batch, Size> loaded;
        V opened, scaled, open;
        opening(batch, from, states, loaded, opened);
        const V &now = part<Size>(batch.now, from), &idle = part<Size>(batch.idle, from);
        find_gap<Size>(batch, springs ? details : nullptr, from, now, opened, scaled);
        const V gap = scaled * part<Size>(details->root, from);
        part<Size>(looked->gap, from) = gap;
        Set::find_open(now, idle, gap, open);
        const V left = open > -gap ? open : -gap;
        residual = left > residual ? left : residual;
        const V &before = part<Size>(batch.before, from);
        const V most = now > before ? now : before, fewest = now < before ? now : before;
        for (int k = 0; k < Size::COUNT; ++k)
          unloaded |= unsigned{most[k] == 0.0f && fewest[k] == 0.0f &&
                               !Set::above(idle[k]).is_loaded(now[k])}
              << (from + k);
      }
      looked->unloaded = static_cast<std::uint8_t>(unloaded);
      ++details;
      ++looked;
    }
    return static_cast<float>(largest_of<Size>(residual));
  }

  template <typename Size, typename Batch>
  INELASTIC_INLINE void set_all_targets(Batch *batches, const Details *details, std::size_t count,
                                        const float *changed, float most)
  {
    using V = typename Size::Numbers;
    const V bound = most - V{};
    for (std::size_t g = 0; g < count; ++g)
      for (int from = 0; from < WIDTH; from += Size::COUNT) {
        V less;
        for (int k = 0; k < Size::COUNT; ++k)
          less[k] =
              std::min(changed[details[g].first[from + k]], changed[details[g].second[from + k]]);
        const V &least = part<Size>(details[g].least_target, from);
        const V by_velocity = part<Size>(details[g].part, from) * less;
        V free, target;
        find_free_target(by_velocity, least, free);
        bound_target(free, bound, target);
        part<Size>(batches[g].inverse_target, from) = part<Size>(details[g].root, from) / target;
      }
  }

  template <typename Size, typename Batch>
  INELASTIC_INLINE void add_all(const Array<Batch> &batches, When when,
                                typename Batch::State *states)
  {
    for (const Batch &batch : batches)
      for (int from = 0; from < WIDTH; from += Size::COUNT) {
        Loaded<Batch, Size> loaded;
        load(batch, states, loaded);
        push(batch, from, part<Size>(when == When::NOW ? batch.now : batch.before, from), loaded,
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

  // The passes over batches of each kind, by vectors of eight and of four numbers.
#define INELASTIC_PASSES(BATCH)                                                                 \
  INELASTIC_CLONES void wide_sweep(BATCH *batches, const Details *springs, std::size_t count,   \
                                   BATCH::State *states, float along, float blur, Swept &swept) \
  { sweep_all<Wide>(batches, springs, count, states, along, blur, swept); }                     \
  INELASTIC_CLONES double wide_unsolved(const Array<BATCH> &batches, const Details *springs,    \
                                        const BATCH::State *states, float blur)                 \
  { return unsolved_of_all<Wide>(batches, springs, states, blur); }                             \
  INELASTIC_CLONES float wide_look(const Array<BATCH> &batches, const Details *details,         \
                                   const Details *springs, const BATCH::State *states,          \
                                   Looked *looked)                                              \
  { return look_at_all<Wide>(batches, details, springs, states, looked); }                      \
  INELASTIC_CLONES void wide_targets(BATCH *batches, const Details *details, std::size_t count, \
                                     const float *changed, float most)                          \
  { set_all_targets<Wide>(batches, details, count, changed, most); }                            \
  INELASTIC_CLONES void wide_add(const Array<BATCH> &batches, When when, BATCH::State *states)  \
  { add_all<Wide>(batches, when, states); }

  INELASTIC_PASSES(ParticleBatch)
  INELASTIC_PASSES(BodyBatch)

}    // namespace

#define INELASTIC_CHOICES(BATCH)                                                              \
  void sweep(BATCH *batches, const Details *springs, std::size_t count, BATCH::State *states, \
             float along, float blur, Swept &swept)                                           \
  {                                                                                           \
    if (is_wide())                                                                            \
      wide_sweep(batches, springs, count, states, along, blur, swept);                        \
    else                                                                                      \
      sweep_all<Narrow>(batches, springs, count, states, along, blur, swept);                 \
  }                                                                                           \
  double find_unsolved(const Array<BATCH> &batches, const Details *springs,                   \
                       const BATCH::State *states, float blur)                                \
  {                                                                                           \
    return is_wide() ? wide_unsolved(batches, springs, states, blur)                          \
                     : unsolved_of_all<Narrow>(batches, springs, states, blur);               \
  }                                                                                           \
  float look(const Array<BATCH> &batches, const Details *details, const Details *springs,     \
             const BATCH::State *states, Looked *looked)                                      \
  {                                                                                           \
    return is_wide() ? wide_look(batches, details, springs, states, looked)                   \
                     : look_at_all<Narrow>(batches, details, springs, states, looked);        \
  }                                                                                           \
  void set_targets(BATCH *batches, const Details *details, std::size_t count,                 \
                   const float *changed, float most)                                          \
  {                                                                                           \
    is_wide() ? wide_targets(batches, details, count, changed, most)                          \
              : set_all_targets<Narrow>(batches, details, count, changed, most);              \
  }                                                                                           \
  void add_impulses(const Array<BATCH> &batches, When when, BATCH::State *states)             \
  { is_wide() ? wide_add(batches, when, states) : add_all<Narrow>(batches, when, states); }

INELASTIC_CHOICES(ParticleBatch)
INELASTIC_CHOICES(BodyBatch)

INELASTIC_CLONES void extrapolate(std::vector<ParticleBatch::State> &states,
                                  std::vector<ParticleBatch::State> &before, float along)
{ lead_all_on(states, before, along); }
INELASTIC_CLONES void extrapolate(std::vector<BodyBatch::State> &states,
                                  std::vector<BodyBatch::State> &before, float along)
{ lead_all_on(states, before, along); }

}    // namespace inelastic::swept
