#include "inelastic_packed_constraints.h"

namespace inelastic {

template <typename Real> void PackedConstraints<Real>::resize(std::size_t count)
{
  source.resize(count);
  ends.resize(count);
  normal.resize(count);
  diagonal.resize(count);
  compliance.resize(count);
  set.resize(count);
  least_target.resize(count);
  part.resize(count);
  inverse_target.resize(count);
}

template <typename Real>
void PackedConstraints<Real>::copy(const PackedConstraints &other, std::size_t k, std::size_t to)
{
  source[to] = other.source[k];
  ends[to] = other.ends[k];
  normal[to] = other.normal[k];
  diagonal[to] = other.diagonal[k];
  compliance[to] = other.compliance[k];
  set[to] = other.set[k];
  least_target[to] = other.least_target[k];
  part[to] = other.part[k];
  inverse_target[to] = other.inverse_target[k];
}

template <typename Real>
void PackedConstraints<Real>::pack(const Start &start, const std::vector<std::size_t> &places)
{
  const ContactSet &contacts = start.problem.contacts;
  const Scales &scales = start.scales;
  resize(places.size());
  source = places;
  const double per_length = 1.0 / scales.length;
  const double diagonal_unit = scales.impulse / scales.length;
  for (std::size_t k = 0; k < places.size(); ++k) {
    const std::size_t c = places[k];
    const double *const n = &contacts.normal[3 * c];
    ends[k] = {packed::place<Real>(contacts.first[c]), packed::place<Real>(contacts.second[c])};
    packed::set_lanes(normal[k], n[0], n[1], n[2], start.gap[c] * per_length);
    diagonal[k] = static_cast<Real>(start.diagonal[c] * diagonal_unit);
    compliance[k] = static_cast<Real>(contacts.compliance[c] * diagonal_unit);
    set[k] =
        contacts.set[c].changes_of(contacts.impulse[c]).template in_units<Real>(scales.impulse);
    least_target[k] = static_cast<Real>(start.targets.least()[c] * per_length);
    part[k] = static_cast<Real>(start.targets.part()[c]);
  }
}

template <typename Real> void PackedConstraints<Real>::add_inverse_diagonals(double &sum) const
{
  for (const Real d : diagonal) sum += 1.0 / d;
}

template <typename Real>
void PackedConstraints<Real>::set_targets(const PackedTargets<Real> &targets)
{
  for (std::size_t k = 0; k < size(); ++k)
    inverse_target[k] = 1 / targets.target(first(k), second(k), least_target[k], part[k]);
}

template struct PackedConstraints<float>;
template struct PackedConstraints<double>;

}    // namespace inelastic
