#include "contact_set.h"

namespace inelastic {

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
                     double least_impulse, double refinement_value)
{
  first.push_back(first_particle);
  second.push_back(second_slot);
  for (int d = 0; d < 3; ++d) normal.push_back(unit_normal[d]);
  gap.push_back(gap_value);
  impulse.push_back(impulse_guess);
  compliance.push_back(compliance_value);
  set.push_back({least_impulse});
  refinement.push_back(refinement_value);
}

}    // namespace inelastic
