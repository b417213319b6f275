#include "inelastic_make_solver.h"

#include "inelastic_accelerated_gradient.h"
#include "inelastic_coloured_sweeps.h"
#include "inelastic_uzawa.h"

namespace inelastic {

std::unique_ptr<Solver> make_solver(const std::string &name)
{
  if (name == "apgd") return std::make_unique<AcceleratedProjectedGradient>();
  if (name == "sweeps") return std::make_unique<ColouredSweeps>();
  if (name == "uzawa") return std::make_unique<Uzawa>();
  return nullptr;
}

}    // namespace inelastic
