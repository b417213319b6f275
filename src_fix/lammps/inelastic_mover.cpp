#include "inelastic_mover.h"

#include <algorithm>

using namespace LAMMPS_NS;
using namespace Inelastic_NS;
using inelastic::ContactProblem;

void Movers::add(Mover *mover)
{
  all_.push_back(mover);
  if (mover->turns()) turning_.push_back(mover);
}

void Movers::predict()
{
  for (Mover *mover : all_) mover->predict();
}

void Movers::find_velocity_before(std::vector<double> &velocity)
{
  for (Mover *mover : all_) mover->find_velocity_before(velocity);
}

void Movers::apply(const double *contact_force)
{
  for (Mover *mover : all_) mover->apply(contact_force);
}

void Movers::begin_run()
{
  for (Mover *mover : turning_) mover->begin_run();
}

std::string Movers::find()
{
  std::string wrong;
  for (Mover *mover : turning_) {
    const std::string here = mover->find();
    if (wrong.empty()) wrong = here;
  }
  return wrong;
}

std::string Movers::measure()
{
  std::string wrong;
  for (Mover *mover : turning_) {
    const std::string here = mover->measure();
    if (wrong.empty()) wrong = here;
  }
  return wrong;
}

bool Movers::is_incomplete(int particle) const
{
  return std::any_of(turning_.begin(), turning_.end(), [particle](const Mover *mover) {
    return mover->is_incomplete(particle);
  });
}

void Movers::turn(const ContactProblem &problem, const std::vector<double> &velocity,
                  std::vector<double> &motion)
{
  if (!any_turns()) return;
  motion = velocity;
  for (Mover *mover : turning_) mover->turn(problem, velocity, motion);
}

double Movers::angle_turned(const ContactProblem &problem, int particle) const
{
  double angle = 0.0;
  for (const Mover *mover : turning_)
    angle = std::max(angle, mover->angle_turned(problem, particle));
  return angle;
}

double Movers::angle_predicted(const ContactProblem &problem, int particle) const
{
  double angle = 0.0;
  for (const Mover *mover : turning_)
    angle = std::max(angle, mover->angle_predicted(problem, particle));
  return angle;
}

double Movers::energy_of_turning(const ContactProblem &problem, int particle) const
{
  double part = 0.0;
  for (const Mover *mover : turning_)
    part = std::max(part, mover->energy_of_turning(problem, particle));
  return part;
}

void Movers::note_push(const ContactProblem &problem, const std::vector<double> &velocity)
{
  for (Mover *mover : turning_) mover->note_push(problem, velocity);
}

void Movers::note_stop(const ContactProblem &problem, const std::vector<double> &by_contacts,
                       const std::vector<double> &wanted)
{
  for (Mover *mover : turning_) mover->note_stop(problem, by_contacts, wanted);
}
