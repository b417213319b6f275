#include "accelerated_gradient.h"

#include "vectorise.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace inelastic {

namespace {

  // Constraints are worked on in blocks, which stay in the fastest cache, and within a block in
  // streams: neighbours in the list have a particle in common, and a sum that was just written is
  // slow to read again.
  constexpr std::size_t BLOCK = 256;
  constexpr std::size_t STREAMS = 8;

  constexpr double UNIT_ROUND_OFF = 0.5 * std::numeric_limits<double>::epsilon();
  constexpr Residual UNSOLVED = {std::numeric_limits<double>::infinity(),
                                 std::numeric_limits<double>::infinity()};

  bool within(const Residual &residual, const SolverLimits &limits)
  { return std::max(residual.feasibility, residual.complementarity) <= limits.tolerance; }

  // Whether round-off, a few 1e-7 of the largest length in single precision, is far below the
  // tolerance.
  template <typename Real> bool suffices(double largest, double tolerance)
  {
    constexpr double MOST_TOLERANCES = 3.0e5;
    return sizeof(Real) == sizeof(double) || largest < MOST_TOLERANCES * tolerance;
  }

  // x, y, z and a fourth number, so that one instruction works on all.
  template <typename Real> struct alignas(4 * sizeof(Real)) Vector {
    typedef Real Lanes __attribute__((vector_size(4 * sizeof(Real))));
    Lanes lanes;
  };

  // Where the vectors of a constraint's two particles are: in bytes, as addresses take them.
  struct Ends {
    std::uint32_t first, second;
  };

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

  // One iteration's pass over the constraints. Lengths are in units of Scales::length, velocities
  // in those of length / h, impulses in those of Scales::impulse.
  template <typename Real> struct Pass {
    std::size_t count;
    const Ends *ends;
    const Vector<Real> *normal;    // and the gap without impulses
    const Real *diagonal;
    const Real *impulse;
    Real *impulse_before;            // replaced by the next ones
    Real *gap_before;                // at the end of the step, of the impulses before; replaced
    const Vector<Real> *velocity;    // change of it, where the momentum leads to; the fourth is 0
    Vector<Real> *sum;               // of the next impulses; zero before; the fourth has no meaning
    Real momentum;
    Real step;
  };

  struct Passed {
    double uphill = 0.0;            // > 0: the momentum points uphill
    double heaviest = 0.0;          // impulse, as the length that it alone opens its gap by
    double change_squared = 0.0;    // squared norm of the change of the scaled impulses
    // Of the impulses that the pass started from:
    double curved = 0.0;    // their last change . A that change
    double least_gap = 0.0;
    double most_under_force = 0.0;    // largest gap where an impulse acts
  };

  template <typename Real>
  inline __attribute__((always_inline)) void scatter(const Pass<Real> &pass, std::size_t begin,
                                                     std::size_t end, const Real *impulse)
  {
    for (std::size_t c = begin; c < end; ++c) {
      const auto push = pass.normal[c].lanes * impulse[c];
      auto &first = at(pass.sum, pass.ends[c].first);
      auto &second = at(pass.sum, pass.ends[c].second);
      const auto first_sum = first + push, second_sum = second - push;
      first = first_sum;
      second = second_sum;
    }
  }

  // What a gap consists of, in the lanes of a vector.
  template <typename Real>
  inline __attribute__((always_inline)) void split_gap(const Pass<Real> &pass, std::size_t c,
                                                       Vector<Real> &terms)
  {
    using Lanes = typename Vector<Real>::Lanes;
    const Ends &ends = pass.ends[c];
    const Lanes opening = at(pass.velocity, ends.first) - at(pass.velocity, ends.second);
    terms.lanes = pass.normal[c].lanes * (opening + Lanes{0, 0, 0, 1});
  }

  // The sums over the lanes of each of four vectors.
  template <typename Real>
  inline __attribute__((always_inline)) void add_up(const Vector<Real> *terms, Vector<Real> &sums)
  {
    using Lanes = typename Vector<Real>::Lanes;
    const Lanes &a = terms[0].lanes, &b = terms[1].lanes, &c = terms[2].lanes, &d = terms[3].lanes;
    const Lanes ab = Lanes{a[0], b[0], a[1], b[1]} + Lanes{a[2], b[2], a[3], b[3]};
    const Lanes cd = Lanes{c[0], d[0], c[1], d[1]} + Lanes{c[2], d[2], c[3], d[3]};
    sums.lanes = Lanes{ab[0], ab[1], cd[0], cd[1]} + Lanes{ab[2], ab[3], cd[2], cd[3]};
  }

  // Gaps of a block, four at a time; up to three more are written than there are.
  template <typename Real>
  inline __attribute__((always_inline)) void gather(const Pass<Real> &pass, std::size_t begin,
                                                    std::size_t end, Vector<Real> *gap)
  {
    Vector<Real> terms[4];
    std::size_t c = begin;
    for (; c + 4 <= end; c += 4, ++gap) {
      for (std::size_t k = 0; k < 4; ++k) split_gap(pass, c + k, terms[k]);
      add_up(terms, *gap);
    }
    if (c == end) return;
    for (std::size_t k = 0; k < 4; ++k) split_gap(pass, std::min(c + k, end - 1), terms[k]);
    add_up(terms, *gap);
  }

  template <typename Real>
  inline __attribute__((always_inline)) Passed advance(const Pass<Real> &pass)
  {
    Passed passed;
    Vector<Real> gaps[(BLOCK + 3) / 4];
    const Real *const gap = reinterpret_cast<const Real *>(gaps);
    for (std::size_t begin = 0; begin < pass.count; begin += BLOCK) {
      const std::size_t end = std::min(begin + BLOCK, pass.count);
      gather(pass, begin, end, gaps);
      Real uphill = 0, change_squared = 0, curved = 0, least = 0, most = 0, heaviest = 0;
      const Real *const impulse = pass.impulse + begin;
      Real *const next = pass.impulse_before + begin;
      const Real *const diagonal = pass.diagonal + begin;
      Real *const gap_before = pass.gap_before + begin;
      const Real momentum = pass.momentum, step = pass.step;
      const Real share = 1 / (1 + momentum);
      const std::size_t size = end - begin;
#pragma omp simd simdlen(16) reduction(+ : uphill, change_squared, curved) reduction(min : least) \
    reduction(max : most, heaviest)
      for (std::size_t k = 0; k < size; ++k) {
        const Real last_change = impulse[k] - next[k];
        const Real ahead = impulse[k] + momentum * last_change;
        const Real free = ahead - step * gap[k] / diagonal[k];
        const Real value = free > 0 ? free : 0;
        const Real change = value - impulse[k];
        uphill += (ahead - value) * change * diagonal[k];
        change_squared += change * change * diagonal[k];
        // The gap ahead is as far from that of these impulses as the impulses ahead are from them.
        const Real here = (gap[k] + momentum * gap_before[k]) * share;
        const Real under_force = impulse[k] > 0 ? here : 0;
        least = here < least ? here : least;
        most = under_force > most ? under_force : most;
        curved += last_change * (here - gap_before[k]);
        gap_before[k] = here;
        next[k] = value;
        const Real load = value * diagonal[k];
        heaviest = load > heaviest ? load : heaviest;
      }
      passed.uphill += uphill;
      passed.change_squared += change_squared;
      passed.curved += curved;
      passed.least_gap = std::min(passed.least_gap, static_cast<double>(least));
      passed.most_under_force = std::max(passed.most_under_force, static_cast<double>(most));
      passed.heaviest = std::max(passed.heaviest, static_cast<double>(heaviest));
      scatter(pass, begin, end, pass.impulse_before);
    }
    return passed;
  }

  INELASTIC_CLONES Passed pass_over(const Pass<float> &pass)
  { return advance(pass); }
  INELASTIC_CLONES Passed pass_over(const Pass<double> &pass)
  { return advance(pass); }

  // One iteration's pass over the particles: from sums of impulses to velocities, and ahead.
  template <typename Real> struct Move {
    std::size_t count;
    const Real *inverse_mass;    // 1 in bodies, where `sum` is a change of velocity already
    Vector<Real> *sum;           // left at zero
    Vector<Real> *velocity;
    Vector<Real> *ahead;
    Real momentum;
  };

  template <typename Real> inline __attribute__((always_inline)) void move(const Move<Real> &m)
  {
    using Lanes = typename Vector<Real>::Lanes;
    for (std::size_t i = 0; i < m.count; ++i) {
      Lanes next = m.sum[i].lanes * m.inverse_mass[i];
      next[3] = 0;
      m.ahead[i].lanes = next + (next - m.velocity[i].lanes) * m.momentum;
      m.velocity[i].lanes = next;
      m.sum[i].lanes = Lanes{0, 0, 0, 0};
    }
  }

  INELASTIC_CLONES void move_all(const Move<float> &m)
  { move(m); }
  INELASTIC_CLONES void move_all(const Move<double> &m)
  { move(m); }

  // Rigid bodies (rigid_bodies.h) in the units of an iteration; arms in units of their own.
  template <typename Real> struct Body {
    int first, last_original, end;    // of its members
    Real inverse_mass;
    Vector<Real> inverse_inertia[3];    // its columns
  };

  template <typename Real> struct Member {
    Vector<Real> arm;
    int particle;
  };

  // A body of two members and no copies whose arms lie on a line that is an axis of symmetry of its
  // inertia, such as a dimer: v_k = (1/M) sum s + b_k w, with w the part of sum_k b_k s_k across the
  // axis, and b_k = arm / root of the inertia across it. Most bodies are; the general way takes three
  // times as long.
  template <typename Real> struct Rod {
    Vector<Real> axis;    // the fourth is the inverse mass
    Real arm[2];          // b
    std::uint32_t particle[2];
  };

  // Returns whether a body is one as far as `Real` can tell, and what it then consists of; `across` is
  // the inverse inertia there.
  template <typename Real>
  bool is_rod(const RigidBodies &rigid, std::size_t b, double *axis, double *arm, double &across)
  {
    constexpr double SAME = 8.0 * std::numeric_limits<Real>::epsilon();
    if (rigid.start[b + 1] - rigid.start[b] != 2 || rigid.originals[b] != 2) return false;
    const double *const first = &rigid.arm[3 * static_cast<std::size_t>(rigid.start[b])];
    const double *const second = first + 3;
    const double from[3] = {first[0] - second[0], first[1] - second[1], first[2] - second[2]};
    const double length = std::sqrt(from[0] * from[0] + from[1] * from[1] + from[2] * from[2]);
    if (!(length > 0.0)) return false;
    for (int d = 0; d < 3; ++d) axis[d] = from[d] / length;
    for (int k = 0; k < 2; ++k) {
      const double *const r = first + 3 * k;
      arm[k] = r[0] * axis[0] + r[1] * axis[1] + r[2] * axis[2];
      for (int d = 0; d < 3; ++d)
        if (!(std::abs(r[d] - arm[k] * axis[d]) <= SAME * length)) return false;
    }
    const double *const a = &rigid.inverse_inertia[6 * b];
    double turned[3];
    multiply(a, axis, turned);
    const double along = turned[0] * axis[0] + turned[1] * axis[1] + turned[2] * axis[2];
    across = 0.5 * (a[0] + a[1] + a[2] - along);
    const int row[6] = {0, 1, 2, 0, 0, 1}, column[6] = {0, 1, 2, 1, 2, 2};
    for (int k = 0; k < 6; ++k) {
      const double symmetric =
          (along - across) * axis[row[k]] * axis[column[k]] + (row[k] == column[k] ? across : 0.0);
      if (!(std::abs(a[k] - symmetric) <= SAME * std::max(along, across))) return false;
    }
    return across >= 0.0;
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

  // y, z, x: one instruction.
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

  // Sums of impulses become changes of velocity.
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

  INELASTIC_CLONES void turn_all(const std::vector<Rod<float>> &rods,
                                 const std::vector<Body<float>> &bodies,
                                 const Member<float> *members, Vector<float> *sum)
  { turn(rods, bodies, members, sum); }
  INELASTIC_CLONES void turn_all(const std::vector<Rod<double>> &rods,
                                 const std::vector<Body<double>> &bodies,
                                 const Member<double> *members, Vector<double> *sum)
  { turn(rods, bodies, members, sum); }

}    // namespace

// Powers of two, so that a scene in other units takes the same steps bit by bit.
struct AcceleratedProjectedGradient::Scales {
  double length;
  double impulse;
};

template <typename Real> class AcceleratedProjectedGradient::Iterations {
 public:
  void prepare(const ContactProblem &problem, const std::vector<double> &free_gap,
               const std::vector<double> &diagonal, const Scales &scales, Host &host)
  {
    const ContactSet &contacts = problem.contacts;
    const std::size_t count = contacts.size();
    interleave(count);
    ends_.resize(count);
    normal_.resize(count);
    diagonal_.resize(count);
    impulse_.resize(count);
    const double per_length = 1.0 / scales.length;
    const double per_impulse = 1.0 / scales.impulse;
    const double diagonal_unit = scales.impulse / scales.length;
    for (std::size_t k = 0; k < count; ++k) {
      const std::size_t c = source_[k];
      const double *const n = &contacts.normal[3 * c];
      ends_[k] = {static_cast<std::uint32_t>(contacts.first[c] * sizeof(Vector<Real>)),
                  static_cast<std::uint32_t>(contacts.second[c] * sizeof(Vector<Real>))};
      normal_[k].lanes = typename Vector<Real>::Lanes{
          static_cast<Real>(n[0]), static_cast<Real>(n[1]), static_cast<Real>(n[2]),
          static_cast<Real>(free_gap[c] * per_length)};
      diagonal_[k] = static_cast<Real>(diagonal[c] * diagonal_unit);
      impulse_[k] = static_cast<Real>(contacts.impulse[c] * per_impulse);
    }
    impulse_before_ = impulse_;
    gap_before_.assign(count, 0);

    const std::size_t particles = static_cast<std::size_t>(problem.particles) + 1;
    const double mobility_unit = problem.timestep * diagonal_unit;
    inverse_mass_.resize(particles);
    for (std::size_t i = 0; i < particles; ++i)
      inverse_mass_[i] = static_cast<Real>(problem.inverse_mass[i] * mobility_unit);
    add_bodies(problem, mobility_unit);
    sum_.assign(particles, Vector<Real>{});
    velocity_.assign(particles, Vector<Real>{});
    ahead_.assign(particles, Vector<Real>{});
    choose_copies(problem, host);
    const Pass<Real> pass = passing(0.0, 0.0);
    scatter(pass, 0, count, pass.impulse);
    finish(host, 0.0);
  }

  Passed advance(double momentum, double step)
  {
    const Passed passed = pass_over(passing(momentum, step));
    impulse_.swap(impulse_before_);
    return passed;
  }

  // Ends an iteration: velocities of the impulses, and where this momentum leads to.
  void finish(Host &host, double momentum)
  {
    host.sum_over_chosen_copies(reinterpret_cast<Real *>(sum_.data()));
    if (!rods_.empty() || !bodies_.empty()) turn_all(rods_, bodies_, members_.data(), sum_.data());
    move_all({velocity_.size(), inverse_mass_.data(), sum_.data(), velocity_.data(), ahead_.data(),
              static_cast<Real>(momentum)});
  }

  // Writes the impulses, or those that the last iteration started from.
  void impulses(const Scales &scales, std::vector<double> &impulse) const
  { unpack(impulse_, scales, impulse); }
  void impulses_before(const Scales &scales, std::vector<double> &impulse) const
  { unpack(impulse_before_, scales, impulse); }

 private:
  Pass<Real> passing(double momentum, double step)
  {
    return {ends_.size(),
            ends_.data(),
            normal_.data(),
            diagonal_.data(),
            impulse_.data(),
            impulse_before_.data(),
            gap_before_.data(),
            ahead_.data(),
            sum_.data(),
            static_cast<Real>(momentum),
            static_cast<Real>(step)};
  }

  // Those in contacts of this rank, and all of a body of which one is. Most copies are in none.
  void choose_copies(const ContactProblem &problem, Host &host)
  {
    if (!host.has_copies()) return;
    std::vector<char> chosen(static_cast<std::size_t>(problem.particles) + 1, 0);
    for (const int i : problem.contacts.first) chosen[i] = 1;
    for (const int i : problem.contacts.second) chosen[i] = 1;
    const RigidBodies &rigid = problem.bodies;
    for (std::size_t b = 0; b < rigid.size(); ++b) {
      char any = 0;
      for (int k = rigid.start[b]; k < rigid.start[b + 1]; ++k) any |= chosen[rigid.member[k]];
      for (int k = rigid.start[b]; k < rigid.start[b + 1]; ++k) chosen[rigid.member[k]] = any;
    }
    host.choose_copies(chosen);
  }

  void add_bodies(const ContactProblem &problem, double mobility_unit)
  {
    const RigidBodies &rigid = problem.bodies;
    rods_.clear();
    bodies_.clear();
    members_.resize(rigid.member.size());
    for (std::size_t b = 0; b < rigid.size(); ++b) {
      double axis[3], arm[2], across;
      if (is_rod<Real>(rigid, b, axis, arm, across)) {
        Rod<Real> rod;
        const double root = std::sqrt(across * mobility_unit);
        rod.axis.lanes = typename Vector<Real>::Lanes{
            static_cast<Real>(axis[0]), static_cast<Real>(axis[1]), static_cast<Real>(axis[2]),
            static_cast<Real>(rigid.inverse_mass[b] * mobility_unit)};
        for (int k = 0; k < 2; ++k) {
          const int particle = rigid.member[rigid.start[b] + k];
          rod.arm[k] = static_cast<Real>(arm[k] * root);
          rod.particle[k] = static_cast<std::uint32_t>(particle * sizeof(Vector<Real>));
          inverse_mass_[particle] = 1;
        }
        rods_.push_back(rod);
        continue;
      }
      Body<Real> body;
      body.first = rigid.start[b];
      body.last_original = rigid.start[b] + rigid.originals[b];
      body.end = rigid.start[b + 1];
      body.inverse_mass = static_cast<Real>(rigid.inverse_mass[b] * mobility_unit);
      double reach = 0.0;
      for (int k = 3 * body.first; k < 3 * body.end; ++k)
        reach = std::max(reach, std::abs(rigid.arm[k]));
      const double unit = reach > 0.0 ? std::exp2(std::ilogb(reach)) : 1.0;
      const double *const a = &rigid.inverse_inertia[6 * b];
      const double inertia_unit = mobility_unit * unit * unit;
      const int columns[3][3] = {{0, 3, 4}, {3, 1, 5}, {4, 5, 2}};
      for (int d = 0; d < 3; ++d)
        body.inverse_inertia[d].lanes =
            typename Vector<Real>::Lanes{static_cast<Real>(a[columns[d][0]] * inertia_unit),
                                         static_cast<Real>(a[columns[d][1]] * inertia_unit),
                                         static_cast<Real>(a[columns[d][2]] * inertia_unit), 0};
      for (int k = body.first; k < body.end; ++k) {
        Member<Real> &member = members_[k];
        const double *const arm = &rigid.arm[3 * k];
        member.arm.lanes = typename Vector<Real>::Lanes{static_cast<Real>(arm[0] / unit),
                                                        static_cast<Real>(arm[1] / unit),
                                                        static_cast<Real>(arm[2] / unit), 0};
        member.particle = rigid.member[k];
        inverse_mass_[member.particle] = 1;
      }
      bodies_.push_back(body);
    }
  }

  void unpack(const std::vector<Real> &packed, const Scales &scales,
              std::vector<double> &impulse) const
  {
    for (std::size_t k = 0; k < packed.size(); ++k)
      impulse[source_[k]] = scales.impulse * static_cast<double>(packed[k]);
  }

  void interleave(std::size_t count)
  {
    source_.clear();
    for (std::size_t begin = 0; begin < count; begin += BLOCK) {
      const std::size_t size = std::min(BLOCK, count - begin);
      const std::size_t length = (size + STREAMS - 1) / STREAMS;
      for (std::size_t k = 0; k < length; ++k)
        for (std::size_t place = k; place < size; place += length) source_.push_back(begin + place);
    }
  }

  std::vector<std::size_t> source_;    // of each constraint: its place in the problem
  std::vector<Ends> ends_;
  std::vector<Vector<Real>> normal_;
  std::vector<Real> diagonal_, impulse_, impulse_before_, gap_before_;
  std::vector<Real> inverse_mass_;
  std::vector<Vector<Real>> sum_, velocity_, ahead_;
  std::vector<Rod<Real>> rods_;
  std::vector<Body<Real>> bodies_;    // the others
  std::vector<Member<Real>> members_;
};

AcceleratedProjectedGradient::AcceleratedProjectedGradient() = default;
AcceleratedProjectedGradient::~AcceleratedProjectedGradient() = default;

void AcceleratedProjectedGradient::judge(const ContactProblem &problem, const SolverLimits &limits,
                                         Host &host, SolverResult &result)
{
  const std::vector<double> &impulse = problem.contacts.impulse;
  gap_.resize(impulse.size());
  gap_operator_.apply(problem, impulse.data(), gap_.data(), host);
  const Residual mine = residual(gap_.data(), impulse.data(), impulse.size());
  double maxima[2] = {mine.feasibility, mine.complementarity};
  host.reduce(nullptr, 0, maxima, 2);
  result.residual = {maxima[0], maxima[1]};
  result.converged = within(result.residual, limits);
}

template <typename Real>
void AcceleratedProjectedGradient::iterate(Iterations<Real> &iterations, ContactProblem &problem,
                                           const SolverLimits &limits, const Scales &scales,
                                           Host &host, SolverResult &result)
{
  // L is raised with a margin when a step shows it too small.
  constexpr double MARGIN = 1.05;
  // A residual within the tolerance that double precision does not confirm: round-off shows.
  constexpr long MOST_FAILURES = 4;
  // Measured: the residual comes down to 0.6-1.6 times the unit round-off of the heaviest impulse
  // (as a length), in columns, heaps and crystals of 2 to 600 particles.
  constexpr double BELOW_ROUND_OFF = 0.5;

  iterations.prepare(problem, gap_operator_.free_gap(), diagonal_, scales, host);
  const double tolerance = limits.tolerance / scales.length;
  double momentum_time = 1.0;
  double momentum = 0.0;
  double change_squared = 0.0;    // of the iteration before
  long next_check = 0;
  long failures = 0;
  while (result.iterations < limits.max_iterations) {
    const Passed passed = iterations.advance(momentum, 1.0 / curvature_);
    ++result.iterations;
    double sums[3] = {passed.uphill, passed.change_squared, passed.curved};
    double maxima[3] = {-passed.least_gap, passed.most_under_force, passed.heaviest};
    host.reduce(sums, 3, maxima, 3);
    if (!std::isfinite(sums[2])) {
      result.residual = UNSOLVED;
      return;
    }
    if (sums[2] > curvature_ * change_squared && change_squared > 0.0)
      curvature_ = MARGIN * sums[2] / change_squared;
    change_squared = sums[1];
    result.trend.see(result.iterations, scales.length * std::max(maxima[0], maxima[1]));

    if (std::max(maxima[0], maxima[1]) <= tolerance && result.iterations >= next_check) {
      iterations.impulses_before(scales, problem.contacts.impulse);
      judge(problem, limits, host, result);
      if (result.converged) return;
      if (++failures == MOST_FAILURES && sizeof(Real) < sizeof(double)) return;
      next_check = result.iterations + failures;
    }
    if (!suffices<Real>(maxima[2], tolerance)) {
      iterations.impulses(scales, problem.contacts.impulse);
      return;
    }
    result.round_off = UNIT_ROUND_OFF * scales.length * maxima[2];
    if (result.iterations % CHECK_EVERY == 0) {
      iterations.impulses_before(scales, problem.contacts.impulse);
      result.infeasible = is_infeasible(problem, gap_operator_, limits, host);
      if (result.infeasible || limits.tolerance < BELOW_ROUND_OFF * result.round_off) {
        judge(problem, limits, host, result);
        return;
      }
    }

    if (sums[0] > 0.0) {
      momentum = 0.0;
      momentum_time = 1.0;
    } else {
      const double next_time = 0.5 * (1.0 + std::sqrt(1.0 + 4.0 * momentum_time * momentum_time));
      momentum = (momentum_time - 1.0) / next_time;
      momentum_time = next_time;
    }
    iterations.finish(host, momentum);
  }
  iterations.impulses(scales, problem.contacts.impulse);
  judge(problem, limits, host, result);
}

SolverResult AcceleratedProjectedGradient::solve(ContactProblem &problem,
                                                 const SolverLimits &limits, Host &host)
{
  // L is let down a little between calls, so that it can follow a packing that becomes less
  // connected.
  constexpr double RELAXATION = 0.998;
  constexpr double LEAST_SCALE = 0.9, MOST_SCALE = 1.1;
  constexpr double FIRST_CURVATURE =
      2.0;    // of a few contacts; a first step far too long costs more

  ContactSet &contacts = problem.contacts;
  const std::size_t count = contacts.size();
  gap_operator_.prepare(problem);

  diagonal_.resize(count);
  for (std::size_t c = 0; c < count; ++c) {
    const double *const n = &contacts.normal[3 * c];
    diagonal_[c] = problem.timestep *
        (problem.mobility(contacts.first[c], n) + problem.mobility(contacts.second[c], n));
    contacts.impulse[c] = std::max(0.0, contacts.impulse[c]);
  }

  gap_.resize(count);
  gap_operator_.apply(problem, contacts.impulse.data(), gap_.data(), host);
  SolverResult result;
  result.residual = residual(gap_.data(), contacts.impulse.data(), count);
  double along = 0.0, along_free = 0.0, largest = 0.0, largest_diagonal = 0.0;
  const std::vector<double> &free_gap = gap_operator_.free_gap();
  for (std::size_t c = 0; c < count; ++c) {
    along += contacts.impulse[c] * gap_[c];
    along_free += contacts.impulse[c] * free_gap[c];
    largest = std::max({largest, std::abs(free_gap[c]), contacts.impulse[c] * diagonal_[c]});
    largest_diagonal = std::max(largest_diagonal, diagonal_[c]);
  }
  double sums[2] = {along, along_free};
  double maxima[4] = {result.residual.feasibility, result.residual.complementarity, largest,
                      largest_diagonal};
  host.reduce(sums, 2, maxima, 4);
  result.residual = {maxima[0], maxima[1]};
  result.converged = within(result.residual, limits);
  if (result.converged || !std::isfinite(result.residual.feasibility)) return result;

  // The guess is first made as large as the dual function likes it along its own direction, which
  // costs no product since w is affine: with b = w(0), the minimum over s of the dual at s lambda
  // is at s = -lambda.b / lambda.(w - b). Measured to save a tenth of the iterations, within these
  // bounds.
  const double curved_along = sums[0] - sums[1];
  if (curved_along > 0.0) {
    const double scale = std::clamp(-sums[1] / curved_along, LEAST_SCALE, MOST_SCALE);
    for (double &impulse : contacts.impulse) impulse *= scale;
  }
  curvature_ = curvature_ == 0.0 ? FIRST_CURVATURE : std::max(1.0, RELAXATION * curvature_);

  Scales scales;
  scales.length = std::exp2(std::ilogb(maxima[2]));
  scales.impulse = scales.length / std::exp2(std::ilogb(maxima[3]));
  if (suffices<float>(maxima[2], limits.tolerance)) {
    if (!single_) single_ = std::make_unique<Iterations<float>>();
    iterate(*single_, problem, limits, scales, host, result);
  }
  if (!result.converged && !result.infeasible && result.iterations < limits.max_iterations) {
    if (!double_) double_ = std::make_unique<Iterations<double>>();
    iterate(*double_, problem, limits, scales, host, result);
  }
  return result;
}

}    // namespace inelastic
