// This search makes conjugate gradients on the active set, in double precision: modified
// proportioning with reduced gradient projections (MPRGP: Dostal and Schoeberl, Comput. Optim.
// Appl. 30 (2005) 23) on the dual problem of inelastic_contact_problem.h, in impulses scaled by the
// root of the diagonal of A.
//
// The impulses above their least ones are free: conjugate gradients minimise the dual function over
// them until one would fall below its least impulse. That one is then held there, by a projected
// gradient step. A held one is let go by a step along its own gradient where such gradients
// outweigh those of the free ones.
//
// Sweeps and accelerated gradients need as many iterations as the root of the condition number of
// A, and a heavy grain on light ones makes that as large as the ratio of masses. Conjugate
// gradients need as many as A has different eigenvalues, and the heavy grains are few. So it is
// with a few grains wedged between nearly parallel walls. Where the search is not for a few slow
// modes, sweeps are faster: it therefore comes when these get nowhere.

#pragma once

#include "inelastic_contact_problem.h"
#include "inelastic_gap_operator.h"
#include "inelastic_host.h"

#include <functional>
#include <vector>

namespace inelastic {

class ConjugateGradients {
 public:
  // Judges problem.contacts.impulse: sets `gap` to the gaps at the end of the step, and returns the
  // largest residual as a part of its target, over all ranks. Collective.
  using Judge = std::function<double()>;

  // Searches from problem.contacts.impulse, which was judged last: its gaps are `gap`. Leaves the
  // best impulses that it came to there, judged. `diagonal` is that of A, and `gap_operator` is
  // prepared for the problem. Makes no more than so many iterations, products with A, and returns
  // their number. Collective.
  long search(ContactProblem &problem, GapOperator &gap_operator,
              const std::vector<double> &diagonal, const std::vector<double> &gap, long most,
              const Judge &judge, Host &host);

 private:
  // What a step looks at, over all ranks.
  struct Sums {
    double held;    // |gradient of the held impulses that push to be let go|^2
    double free;    // reduced free gradient . free gradient
  };

  void multiply(const ContactProblem &problem, const std::vector<double> &by, Host &host);
  void begin(const ContactProblem &problem, const std::vector<double> &diagonal);
  void take_gaps(const std::vector<double> &gap);
  void give_impulses(ContactProblem &problem) const;
  bool is_free(std::size_t c) const { return x_[c] > least_[c]; }
  double free_gradient(std::size_t c) const { return is_free(c) ? g_[c] : 0.0; }
  Sums look(Host &host) const;
  bool step(const ContactProblem &problem, Host &host);
  bool let_go(const ContactProblem &problem, Host &host);
  void expand(double longest);
  void begin_direction();

  GapOperator *gap_operator_ = nullptr;
  std::vector<double> root_;           // of the diagonal of A
  std::vector<double> x_, least_;      // impulses, and the least ones, times the root
  std::vector<double> g_;              // the gradient: gaps over the root
  std::vector<double> p_, product_;    // the direction, and A times it
  std::vector<double> unscaled_;
  double curvature_ = 1.0;    // the largest |A p| / |p| so far, from below the largest eigenvalue
  bool expanded_ =
      false;    // the last step came to a least impulse: gradients are to be taken anew
};

}    // namespace inelastic
