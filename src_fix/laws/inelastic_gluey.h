// The gluey law (Maury, ESAIM: Proceedings 18 (2007) 133; Lefebvre, M2AN 43 (2009) 53): the limit
// of the lubrication force between two surfaces in a fluid whose viscosity vanishes.
//
// While two surfaces are pressed together, the film between them stores the impulse that presses
// them, and they come apart when as much impulse has pulled. The store is g <= 0 [mass length /
// time]:
//
//   lambda >= g in a step,      g <- max(-G, min(0, g - lambda)) after it
//
// A contact begins with g = 0. G is the limit of rough surfaces, none by default. The papers hold a
// contact with g < 0 whatever it pulls, and let it go in the step after it has pulled too much.
// Here it pulls by no more than it has stored, so that it gives back just that, in a step of any
// length.

#pragma once

#include "inelastic_contact_law.h"

namespace inelastic {

class Gluey final : public ContactLaw {
 public:
  // `limit` is G [mass length / time] > 0.
  explicit Gluey(double limit) : limit_(limit) {}

  int remembers() const override { return 1; }
  Demand ask(const ContactState &contact, const double *remembered) const override;
  bool remember(const Impulse &impulse, double *remembered) const override;

 private:
  double limit_;
};

// law gluey [limit G]
std::unique_ptr<ContactLaw> make_gluey(const std::vector<std::string> &words, std::string &error);

}    // namespace inelastic
