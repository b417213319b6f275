#include "inelastic_contact_set.h"

#include "inelastic_unknowns.h"
#include "inelastic_vector3.h"
#include "inelastic_vectorise.h"

#include <algorithm>

namespace inelastic {

namespace {

  // Returns n . (v_first - v_second) for 3 numbers per slot.
  inline double opening_speed(const double *n, const double *v_first, const double *v_second)
  {
    const double relative[3] = {v_first[0] - v_second[0], v_first[1] - v_second[1],
                                v_first[2] - v_second[2]};
    return dot(n, relative);
  }

}    // namespace

void ContactSet::clear()
{
  first.clear();
  second.clear();
  normal.clear();
  gap.clear();
  impulse.clear();
  compliance.clear();
  set.clear();
  refinement.clear();
}

void ContactSet::add(int first_particle, int second_slot, const double *unit_normal,
                     double gap_value, double impulse_guess, double compliance_value,
                     const AdmissibleSet<double> &admissible, double refinement_value)
{
  first.push_back(first_particle);
  second.push_back(second_slot);
  for (int d = 0; d < 3; ++d) normal.push_back(unit_normal[d]);
  gap.push_back(gap_value);
  impulse.push_back(impulse_guess);
  compliance.push_back(compliance_value);
  set.push_back(admissible);
  refinement.push_back(refinement_value);
}

void ContactSet::add_of(const ContactSet &other, std::size_t c)
{
  add(other.first[c], other.second[c], &other.normal[3 * c], other.gap[c], 0.0, other.compliance[c],
      other.set[c], other.refinement[c]);
}

bool ContactSet::has_springs() const
{
  return std::any_of(compliance.begin(), compliance.end(), [](double c) {
    return c > 0.0;
  });
}

void ContactSet::forget_impulses(std::size_t from)
{ std::fill(impulse.begin() + static_cast<std::ptrdiff_t>(from), impulse.end(), 0.0); }

void ContactSet::make_admissible()
{
  for (std::size_t c = 0; c < size(); ++c) impulse[c] = set[c].project(impulse[c]);
}

std::vector<double> ContactSet::pushing() const
{
  std::vector<double> pushes = impulse;
  for (double &value : pushes) value = std::max(0.0, value);
  return pushes;
}

double ContactSet::lacking(const double *impulses, const double *free_gap, double tolerance,
                           double &longest) const
{
  double sum = 0.0;
  for (std::size_t c = 0; c < size(); ++c) {
    const double give = compliance[c] * impulses[c];
    sum -= impulses[c] * (free_gap[c] + give + tolerance);
    longest = std::max(longest, -free_gap[c]);
  }
  return sum;
}

double ContactSet::diagonal(std::size_t c, const Unknowns &unknowns, double timestep) const
{
  const double *const n = &normal[3 * c];
  return timestep * (unknowns.mobility(first[c], n) + unknowns.mobility(second[c], n)) +
      compliance[c];
}

double ContactSet::free_gap(std::size_t c, double timestep, const double *velocity) const
{
  return gap[c] +
      timestep *
      opening_speed(&normal[3 * c], velocity + 3 * static_cast<std::size_t>(first[c]),
                    velocity + 3 * static_cast<std::size_t>(second[c]));
}

void ContactSet::free_gaps(double timestep, const double *velocity, double *gap_at_end) const
{
  for (std::size_t c = 0; c < size(); ++c) gap_at_end[c] = free_gap(c, timestep, velocity);
}

INELASTIC_CLONES void ContactSet::gaps_at_end(const double *free_gap, double timestep,
                                              const double *change, const double *impulses,
                                              double *gap_at_end) const
{
  const std::size_t count = size();
  const int *const firsts = first.data();
  const int *const seconds = second.data();
  const double *const compliances = compliance.data();
  const double *n = normal.data();
  for (std::size_t c = 0; c < count; ++c, n += 3)
    gap_at_end[c] = free_gap[c] + compliances[c] * impulses[c] +
        timestep *
            opening_speed(n, change + 3 * static_cast<std::size_t>(firsts[c]),
                          change + 3 * static_cast<std::size_t>(seconds[c]));
}

// Constraints come in runs with the same first particle,
// in the order of the neighbour list. The sum of that particle is kept in registers over a run:
// through memory each addition would wait for the one before.
INELASTIC_CLONES void ContactSet::add_impulses(const double *impulses, double *sum) const
{
  const std::size_t count = size();
  const int *const firsts = first.data();
  const int *const seconds = second.data();
  const double *n = normal.data();
  std::size_t c = 0;
  while (c < count) {
    const int i = firsts[c];
    double ix = 0.0, iy = 0.0, iz = 0.0;
    for (; c < count && firsts[c] == i; ++c, n += 3) {
      const double lambda = impulses[c];
      double *const j = sum + 3 * static_cast<std::size_t>(seconds[c]);
      const double x = lambda * n[0], y = lambda * n[1], z = lambda * n[2];
      ix += x;
      iy += y;
      iz += z;
      j[0] -= x;
      j[1] -= y;
      j[2] -= z;
    }
    double *const own = sum + 3 * static_cast<std::size_t>(i);
    own[0] += ix;
    own[1] += iy;
    own[2] += iz;
  }
}

}    // namespace inelastic
