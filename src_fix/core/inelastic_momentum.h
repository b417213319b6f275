// The momentum of accelerated iterations (Nesterov): how far an iteration is extrapolated along the
// last change. With t_0 = 1 and t_k+1 = (1 + sqrt(1 + 4 t_k^2)) / 2
//
//   along_k  = (t_k - 1) / t_k+1
//   beyond_k = t_k / t_k+1
//   back_k   = (t_k - 1) / (t_k+1 g_k),   g_0 = 1,   g_k+1 = (2 t_k + t_k+1 - 1) / t_k+1
//
// It begins anew, t = 1, where the dual function rises along the last change (O'Donoghue and
// Candes, Found. Comput. Math. 15 (2015) 715).

#pragma once

#include <cmath>

namespace inelastic {

struct Weights {
  double along, beyond, back;
};

class Momentum {
 public:
  // Returns the weights of the next iteration, whose step is 1 / L; along does not depend on L.
  Weights next(double curvature = 1.0)
  {
    const double next_time = 0.5 * (1.0 + std::sqrt(1.0 + 4.0 * time_ * time_));
    const Weights weights = {(time_ - 1.0) / next_time, time_ / next_time,
                             (time_ - 1.0) / (next_time * curvature * length_)};
    length_ = (2.0 * time_ + next_time - 1.0) / (next_time * curvature);
    time_ = next_time;
    return weights;
  }

  // Takes how the dual function changes along the last change: above 0 it rises.
  void see(double uphill)
  {
    if (uphill > 0.0) time_ = 1.0;
  }

 private:
  double time_ = 1.0;      // t
  double length_ = 1.0;    // g / L, of no meaning where t is 1
};

}    // namespace inelastic
