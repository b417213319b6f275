// Uzawa's algorithm, the solver of the paper (Faure, Lefebvre-Lepot and Semin, ESAIM: Proceedings
// 28 (2009) 13): projected gradient on the dual problem of inelastic_contact_problem.h with a fixed
// step,
//
//   lambda <- max(l, lambda - w(lambda) / L),   l the least impulses
//
// from lambda = 0. L is the largest eigenvalue of A, from a power iteration whose products with A
// are not counted among the iterations. The solver stops on feasibility alone.

#pragma once

#include "inelastic_solver.h"

namespace inelastic {

class Uzawa final : public Solver {
 public:
  SolverResult solve(ContactProblem &problem, const SolverLimits &limits, Host &host) override;
};

}    // namespace inelastic
