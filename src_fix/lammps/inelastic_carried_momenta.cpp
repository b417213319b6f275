#include "inelastic_carried_momenta.h"

#include <algorithm>

using namespace LAMMPS_NS;
using namespace Inelastic_NS;

int CarriedMomenta::pack(int i, double *buffer) const
{
  const Carried &of_body = carried_[i];
  double *out = std::copy_n(of_body.angular_momentum.begin(), 3, buffer);
  for (const Push *push : {&of_body.next, &of_body.included}) {
    out = std::copy_n(push->velocity.begin(), 3, out);
    out = std::copy_n(push->angular_momentum.begin(), 3, out);
  }
  out = std::copy_n(of_body.left_over.begin(), 3, out);
  *out++ = of_body.angle;
  *out++ = of_body.continues ? 1.0 : 0.0;
  return static_cast<int>(out - buffer);
}

int CarriedMomenta::unpack(int i, const double *buffer)
{
  Carried &of_body = carried_[i];
  const double *in = buffer;
  auto take = [&in](std::array<double, 3> &values) {
    std::copy_n(in, 3, values.begin());
    in += 3;
  };
  take(of_body.angular_momentum);
  for (Push *push : {&of_body.next, &of_body.included}) {
    take(push->velocity);
    take(push->angular_momentum);
  }
  take(of_body.left_over);
  of_body.angle = *in++;
  of_body.continues = *in++ != 0.0;
  return static_cast<int>(in - buffer);
}

bool CarriedMomenta::has_included(int i) const
{
  double included[INCLUDED_SIZE];
  pack_included(i, included);
  return std::any_of(included, included + INCLUDED_SIZE, [](double value) {
    return value != 0.0;
  });
}

void CarriedMomenta::pack_included(int i, double *buffer) const
{
  const Push &included = carried_[i].included;
  double *out = std::copy_n(included.velocity.begin(), 3, buffer);
  std::copy_n(included.angular_momentum.begin(), 3, out);
}

void CarriedMomenta::unpack_included(int i, const double *buffer)
{
  Push &included = carried_[i].included;
  std::copy_n(buffer, 3, included.velocity.begin());
  std::copy_n(buffer + 3, 3, included.angular_momentum.begin());
}
