#include "inelastic_packed_kernels.h"

#include "inelastic_vectorise.h"

#include <algorithm>

namespace inelastic::packed {

namespace {

  template <typename Real>
  inline __attribute__((always_inline)) auto &at(Vector<Real> *vectors, std::uint32_t offset)
  { return reinterpret_cast<Vector<Real> *>(reinterpret_cast<char *>(vectors) + offset)->lanes; }

  template <typename Real>
  inline __attribute__((always_inline)) const auto &at(const Vector<Real> *vectors,
                                                       std::uint32_t offset)
  {
    return reinterpret_cast<const Vector<Real> *>(reinterpret_cast<const char *>(vectors) + offset)
        ->lanes;
  }

  // Adds the changes of a block to the sums of their particles. Constraints that follow one another
  // mostly have the same first particle (they come from its list of neighbours). Its sum is kept in
  // a register: one that was just written is slow to read again. (Constraints in an order in which
  // neighbours have no particle in common, and every sum written, took a tenth longer for all of an
  // iteration, measured.)
  template <typename Real, template <typename> typename Set>
  inline __attribute__((always_inline)) void scatter(const Pass<Real, Set> &pass, std::size_t begin,
                                                     std::size_t end, const Real *change)
  {
    using Lanes = typename Vector<Real>::Lanes;
    std::size_t c = begin;
    while (c < end) {
      const std::uint32_t first = pass.ends[c].first;
      Lanes pushes = {0, 0, 0, 0};
      do {
        const Lanes push = pass.normal[c].lanes * change[c - begin];
        pushes += push;
        at(pass.sum, pass.ends[c].second) -= push;
        ++c;
      } while (c < end && pass.ends[c].first == first);
      at(pass.sum, first) += pushes;
    }
  }

  // Writes the four terms that a gap at the end of the step consists of: n_d dv_d of the three
  // directions, and the gap without impulses.
  template <typename Arrays, typename Real>
  inline __attribute__((always_inline)) void split_gap(const Arrays &arrays, std::size_t c,
                                                       Vector<Real> &terms)
  {
    using Lanes = typename Vector<Real>::Lanes;
    const Ends &ends = arrays.ends[c];
    const Lanes opening = at(arrays.velocity, ends.first) - at(arrays.velocity, ends.second);
    terms.lanes = arrays.normal[c].lanes * (opening + Lanes{0, 0, 0, 1});
  }

  // Writes the sums over the lanes of each of four vectors.
  template <typename Real>
  inline __attribute__((always_inline)) void add_up(const Vector<Real> *terms, Vector<Real> &sums)
  {
    using Lanes = typename Vector<Real>::Lanes;
    const Lanes &a = terms[0].lanes, &b = terms[1].lanes, &c = terms[2].lanes, &d = terms[3].lanes;
    const Lanes ab = Lanes{a[0], b[0], a[1], b[1]} + Lanes{a[2], b[2], a[3], b[3]};
    const Lanes cd = Lanes{c[0], d[0], c[1], d[1]} + Lanes{c[2], d[2], c[3], d[3]};
    sums.lanes = Lanes{ab[0], ab[1], cd[0], cd[1]} + Lanes{ab[2], ab[3], cd[2], cd[3]};
  }

  // Writes the gaps of a block, four at a time: up to three more are written than there are.
  template <typename Arrays, typename Real>
  inline __attribute__((always_inline)) void gather(const Arrays &arrays, std::size_t begin,
                                                    std::size_t end, Vector<Real> *gap)
  {
    Vector<Real> terms[4];
    std::size_t c = begin;
    for (; c + 4 <= end; c += 4, ++gap) {
      for (std::size_t k = 0; k < 4; ++k) split_gap(arrays, c + k, terms[k]);
      add_up(terms, *gap);
    }
    if (c == end) return;
    for (std::size_t k = 0; k < 4; ++k) split_gap(arrays, std::min(c + k, end - 1), terms[k]);
    add_up(terms, *gap);
  }

  // The part of advance_impulses between its gathers and its scatters makes the next changes of a
  // block, `next`, from the gaps that the present ones leave, and adds to the sums and maxima that
  // the pass returns.
  template <typename Real, template <typename> typename Set>
  inline __attribute__((always_inline)) void step_block(const Pass<Real, Set> &pass,
                                                        std::size_t begin, std::size_t size,
                                                        const Real *gap, Real *next, Passed &passed)
  {
    Real uphill = 0, curved = 0, steep = 0, lowest = 0, most = 0, heaviest = 0, since_start = 0,
         unsolved = 0, beyond_blur = 0;
    const Real *const diagonal = pass.diagonal + begin;
    const Real *const compliance = pass.compliance + begin;
    const Set<Real> *const set = pass.set + begin;
    const Real *const inverse_target = pass.inverse_target + begin;
    Real *const unbound = pass.unbound + begin;
    Real *const change_before = pass.change_before + begin;
    Real *const gap_before = pass.gap_before + begin;
    const Real step = pass.step, step_before = pass.step_before, along = pass.along,
               beyond = pass.beyond, back = pass.back, blur = pass.blur;
#pragma omp simd simdlen(16) reduction(+ : uphill, curved, steep) reduction(min : lowest) \
    reduction(max : most, heaviest, since_start, unsolved, beyond_blur)
    for (std::size_t k = 0; k < size; ++k) {
      const Real present = set[k].project(unbound[k]);
      const Real here = gap[k] + compliance[k] * present;
      const Real per_diagonal = 1 / diagonal[k];
      const Real down = -step * here * per_diagonal;
      const Real down_before = -step_before * gap_before[k] * per_diagonal;
      const Real last_change = present - change_before[k];
      const Real free = present + down + along * (last_change + down - down_before) +
          beyond * down + back * (unbound[k] - present);
      const Real value = set[k].project(free);
      const Real opened = here - gap_before[k];
      uphill += here * last_change;
      curved += opened * last_change;
      const Real larger = present > change_before[k] ? present : change_before[k];
      steep += set[k].is_loaded(larger) ? opened * opened * per_diagonal : 0;
      const Real under_force = set[k].is_loaded(present) ? here : 0;
      lowest = here < lowest ? here : lowest;
      most = under_force > most ? under_force : most;
      const Real load = set[k].load(value) * diagonal[k];
      heaviest = load > heaviest ? load : heaviest;
      const Real far = (value > 0 ? value : -value) * diagonal[k];
      since_start = far > since_start ? far : since_start;
      const Real left = here < 0 ? -here : under_force;
      const Real part = left * inverse_target[k];
      unsolved = part > unsolved ? part : unsolved;
      const Real clear = (left - blur) * inverse_target[k];
      beyond_blur = clear > beyond_blur ? clear : beyond_blur;
      unbound[k] = free;
      change_before[k] = present;
      gap_before[k] = here;
      next[k] = value;
    }
    passed.uphill += uphill;
    passed.curved += curved;
    passed.steep += steep;
    passed.least_gap = std::min(passed.least_gap, static_cast<double>(lowest));
    passed.most_under_force = std::max(passed.most_under_force, static_cast<double>(most));
    passed.heaviest = std::max(passed.heaviest, static_cast<double>(heaviest));
    passed.since_start = std::max(passed.since_start, static_cast<double>(since_start));
    passed.unsolved = std::max(passed.unsolved, static_cast<double>(unsolved));
    passed.unblurred = std::max(passed.unblurred, static_cast<double>(beyond_blur));
  }

  template <typename Real, template <typename> typename Set>
  inline __attribute__((always_inline)) Passed advance(const Pass<Real, Set> &pass)
  {
    Passed passed;
    Vector<Real> gaps[(BLOCK + 3) / 4];
    Real next[BLOCK];
    for (std::size_t begin = 0; begin < pass.count; begin += BLOCK) {
      const std::size_t end = std::min(begin + BLOCK, pass.count);
      gather(pass, begin, end, gaps);
      step_block(pass, begin, end - begin, reinterpret_cast<const Real *>(gaps), next, passed);
      scatter(pass, begin, end, next);
    }
    return passed;
  }

  template <typename Real> inline __attribute__((always_inline)) void move(const Move<Real> &m)
  {
    using Lanes = typename Vector<Real>::Lanes;
    for (std::size_t i = 0; i < m.count; ++i) {
      Lanes next = m.sum[i].lanes * m.inverse_mass[i];
      next[3] = 0;
      m.velocity[i].lanes = next;
      m.sum[i].lanes = Lanes{0, 0, 0, 0};
    }
  }

  template <typename Real>
  inline __attribute__((always_inline)) void turn_rods(const std::vector<Rod<Real>> &rods,
                                                       Vector<Real> *sum)
  {
    using Lanes = typename Vector<Real>::Lanes;
    for (const Rod<Real> &rod : rods) {
      Lanes &first = at(sum, rod.particle[0]);
      Lanes &second = at(sum, rod.particle[1]);
      const Lanes axis = rod.axis.lanes;
      const Lanes moment = first * rod.arm[0] + second * rod.arm[1];
      const Lanes terms = axis * moment;
      const Lanes spin = moment - axis * (terms[0] + terms[1] + terms[2]);
      const Lanes slide = (first + second) * axis[3];
      first = slide + spin * rod.arm[0];
      second = slide + spin * rod.arm[1];
    }
  }

  // Changes the order to y, z, x, by one instruction.
  template <typename Lanes> inline __attribute__((always_inline)) void rotate(Lanes &a)
  { a = Lanes{a[1], a[2], a[0], a[3]}; }

  template <typename Lanes>
  inline __attribute__((always_inline)) void add_cross(const Lanes &a, const Lanes &b, Lanes &sum)
  {
    Lanes a_rotated = a, b_rotated = b;
    rotate(a_rotated);
    rotate(b_rotated);
    Lanes cross = a * b_rotated - a_rotated * b;
    rotate(cross);
    sum += cross;
  }

  template <typename Real>
  inline __attribute__((always_inline)) void turn(const std::vector<Rod<Real>> &rods,
                                                  const std::vector<Body<Real>> &bodies,
                                                  const Member<Real> *members, Vector<Real> *sum)
  {
    using Lanes = typename Vector<Real>::Lanes;
    turn_rods(rods, sum);
    for (const Body<Real> &body : bodies) {
      Lanes total = {0, 0, 0, 0}, moment = {0, 0, 0, 0};
      for (int k = body.first; k < body.last_original; ++k) {
        const Lanes push = sum[members[k].particle].lanes;
        total += push;
        add_cross(members[k].arm.lanes, push, moment);
      }
      const Lanes spin = body.inverse_inertia[0].lanes * moment[0] +
          body.inverse_inertia[1].lanes * moment[1] + body.inverse_inertia[2].lanes * moment[2];
      const Lanes slide = total * body.inverse_mass;
      for (int k = body.first; k < body.end; ++k) {
        Lanes next = slide;
        add_cross(spin, members[k].arm.lanes, next);
        sum[members[k].particle].lanes = next;
      }
    }
  }

}    // namespace

INELASTIC_CLONES Passed advance_impulses(const Pass<float, AdmissibleSet> &pass)
{ return advance(pass); }
INELASTIC_CLONES Passed advance_impulses(const Pass<double, AdmissibleSet> &pass)
{ return advance(pass); }

INELASTIC_CLONES void find_gaps(const Look<float> &look)
{ gather(look, 0, look.count, look.gap); }
INELASTIC_CLONES void find_gaps(const Look<double> &look)
{ gather(look, 0, look.count, look.gap); }

INELASTIC_CLONES void turn_bodies(const std::vector<Rod<float>> &rods,
                                  const std::vector<Body<float>> &bodies,
                                  const Member<float> *members, Vector<float> *sum)
{ turn(rods, bodies, members, sum); }
INELASTIC_CLONES void turn_bodies(const std::vector<Rod<double>> &rods,
                                  const std::vector<Body<double>> &bodies,
                                  const Member<double> *members, Vector<double> *sum)
{ turn(rods, bodies, members, sum); }

INELASTIC_CLONES void move_particles(const Move<float> &arrays)
{ move(arrays); }
INELASTIC_CLONES void move_particles(const Move<double> &arrays)
{ move(arrays); }

}    // namespace inelastic::packed
