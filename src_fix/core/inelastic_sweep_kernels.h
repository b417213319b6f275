// The passes of coloured sweeps (inelastic_coloured_sweeps.h) over packed constraints, in single
// precision.
//
// A batch holds eight constraints of which no two share anything that impulses move, so that one
// instruction works on all of them. In impulses scaled by the root of the diagonal, x = lambda
// sqrt(D), A has a unit diagonal; rows and gaps are divided by that root, and a visit to constraint
// c makes
//
//   x_c <- max(l_c, x_c - w_c),   w_c = gap_c + C_c x_c + row_c . u
//
// and adds the change to u, the states of what moves: of a scene of particles their velocities, of
// one with bodies velocities and spins in scaled units, in which A = rows . rows^T.

#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <new>
#include <utility>
#include <vector>

namespace inelastic::swept {

// Numbers of which new ones have no value yet: that of a batch would be written twice.
template <typename T> struct WithoutValue : std::allocator<T> {
  template <typename U> struct rebind {
    using other = WithoutValue<U>;
  };
  template <typename U> void construct(U *place) { ::new (static_cast<void *>(place)) U; }
  template <typename U, typename Value> void construct(U *place, Value &&value)
  { ::new (static_cast<void *>(place)) U(std::forward<Value>(value)); }
};
template <typename T> using Array = std::vector<T, WithoutValue<T>>;

// Halves of a vector are read as vectors, too.
typedef float Four __attribute__((vector_size(16), may_alias));
typedef float Eight __attribute__((vector_size(32), may_alias));

constexpr int WIDTH = 8;    // constraints in a batch

// What the constraints of a batch have in common, whatever moves: one lane a constraint. All
// impulses are changes since the start of the search.
struct alignas(32) Lanes {
  std::uint32_t first[WIDTH], second[WIDTH];    // places of the two states, in bytes
  Eight gap;       // at the end of the step with the impulses at the start
  Eight idle;      // of the set of admissible changes of the impulse (inelastic_admissible_set.h)
  Eight now;       // x, the change of the impulse
  Eight before;    // x before the last sweep
  Eight inverse_target;
};

// Constraints of particles that turn with nothing. A state is a velocity, and the inverse mass.
// Sweeps of large scenes read their batches from memory: what belongs to a grain is in its state.
struct ParticleBatch : Lanes {
  struct alignas(16) State {
    Four lanes;
  };
  Eight row[4];    // constraint k is in row[k % 4], the lower half for k < 4: x y z and 0
};

// Constraints of bodies and particles. A state is sqrt(M) v, 0, the spin in units of the root of
// the inverse inertia, and 0.
struct BodyBatch : Lanes {
  struct alignas(32) State {
    Eight lanes;
  };
  Eight first_row[WIDTH], second_row[WIDTH];    // by the constraint
};

// What a sweep does not read of the constraints of a batch.
struct alignas(32) Details {
  Eight root;                                   // of D
  Eight compliance;                             // the compliance over D
  Eight least_target, part;                     // of PackedTargets::target
  std::size_t source[WIDTH];                    // the place in the problem; NONE in an empty lane
  std::uint32_t first[WIDTH], second[WIDTH];    // slots
};
constexpr std::size_t NONE = static_cast<std::size_t>(-1);

// A sweep returns these over its constraints.
struct Swept {
  double uphill = 0.0;    // > 0 where the dual function rises along the last change
  double change = 0.0;    // the largest change of an impulse that a visit made, in scaled units
  // The same, beyond what may be round-off, as a part of the target: a hint at the residual.
  double of_target = 0.0;
  double since_start = 0.0;    // the largest change of an impulse since the start of the search
};

// Visits the constraints of `count` batches, each from its impulse extrapolated by `along` times
// its last change, and adds to `swept`. The states must have been extrapolated alike. Changes below
// `blur`, in scaled units, may be round-off. Here and below `springs` are the batches' Details if
// some constraints have a compliance, and nullptr if none has.
void sweep(ParticleBatch *batches, const Details *springs, std::size_t count,
           ParticleBatch::State *states, float along, float blur, Swept &swept);
void sweep(BodyBatch *batches, const Details *springs, std::size_t count, BodyBatch::State *states,
           float along, float blur, Swept &swept);

// Returns, between two sweeps, the largest residual, beyond the blur, as a part of its target.
double find_unsolved(const Array<ParticleBatch> &batches, const Details *springs,
                     const ParticleBatch::State *states, float blur);
double find_unsolved(const Array<BodyBatch> &batches, const Details *springs,
                     const BodyBatch::State *states, float blur);

// What a look at a batch finds.
struct alignas(32) Looked {
  Eight gap;                // w, as a length in packed units
  std::uint8_t unloaded;    // a bit for each constraint whose impulse is and was the least and 0
};

// Looks at all batches; returns their largest residual, as a length in packed units.
float look(const Array<ParticleBatch> &batches, const Details *details, const Details *springs,
           const ParticleBatch::State *states, Looked *looked);
float look(const Array<BodyBatch> &batches, const Details *details, const Details *springs,
           const BodyBatch::State *states, Looked *looked);

// Sets the targets of `count` batches as PackedTargets::target has them, from its `changed` and
// `most`.
void set_targets(ParticleBatch *batches, const Details *details, std::size_t count,
                 const float *changed, float most);
void set_targets(BodyBatch *batches, const Details *details, std::size_t count,
                 const float *changed, float most);

// Adds to the states what all impulses make of them, those now or before the last sweep.
enum class When { NOW, BEFORE };
void add_impulses(const Array<ParticleBatch> &batches, When when, ParticleBatch::State *states);
void add_impulses(const Array<BodyBatch> &batches, When when, BodyBatch::State *states);

// Extrapolates the states by `along` times their last change, and keeps them as they were in
// `before`.
void extrapolate(std::vector<ParticleBatch::State> &states,
                 std::vector<ParticleBatch::State> &before, float along);
void extrapolate(std::vector<BodyBatch::State> &states, std::vector<BodyBatch::State> &before,
                 float along);

}    // namespace inelastic::swept
