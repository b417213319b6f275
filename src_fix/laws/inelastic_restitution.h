// Newton's law of restitution: surfaces that collide with the speed a part with E a.
//
// It holds where the surfaces would overlap at the end of the step, D + h n.u* < 0, and approach
// with more than the forces of the step have given them: a = min(-n.u_before, -n.u*) > |n.u* -
// n.u_before|. All other contacts are inelastic, so that a bed comes to rest: a sphere that bounces
// on a floor stays there when its speed has fallen below g h.
//
// Energy never rises where steps have one length. The projection changes the kinetic energy by 1/2
// the sum of lambda (n.u + n.u*) over all contacts. Where one has collided, n.u = E a, and n.u* <=
// -a. Where another contact pushes apart surfaces that were parting with n.u* > 0, their gap has
// grown by h n.u* in the last step, and n.u = -D / h <= -n.u*.

#pragma once

#include "inelastic_contact_law.h"

namespace inelastic {

class Restitution final : public ContactLaw {
 public:
  // 0 <= `coefficient` <= 1 is E.
  explicit Restitution(double coefficient) : coefficient_(coefficient) {}

  Demand ask(const ContactState &contact, const double *remembered) const override;

 private:
  double coefficient_;
};

// law restitution E
std::unique_ptr<ContactLaw> make_restitution(const std::vector<std::string> &words,
                                             std::string &error);

}    // namespace inelastic
