// The formula of a target (inelastic_contact_targets.h), in one place for single numbers and for
// vectors of them.

#pragma once

namespace inelastic {

// Writes max(least, part of what the velocities of both sides change).
template <typename Number>
inline __attribute__((always_inline)) void find_free_target(const Number &by_velocity,
                                                            const Number &least, Number &target)
{ target = by_velocity > least ? by_velocity : least; }

// Writes the target within the tolerance.
template <typename Number>
inline __attribute__((always_inline)) void bound_target(const Number &free, const Number &tolerance,
                                                        Number &target)
{ target = free < tolerance ? free : tolerance; }

}    // namespace inelastic
