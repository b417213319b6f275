// The constraints between pairs of spheres: which pairs of the neighbour list are in the problem,
// from the start or because a solution would let them overlap, and how turning bodies change their
// gaps.

#ifndef INELASTIC_PAIR_CONSTRAINTS_H
#define INELASTIC_PAIR_CONSTRAINTS_H

#include "inelastic_step.h"

#include "pointers.h"

#include <vector>

namespace LAMMPS_NS {
class NeighList;
}

namespace LAMMPS_NS::Inelastic_NS {

class ContactRows;
class EntangledBodies;
class GapRules;
class Movers;

class PairConstraints : protected Pointers {
 public:
  PairConstraints(class LAMMPS *lmp, Step &step, GapRules &rules, ContactRows &rows,
                  const EntangledBodies &entangled, const Movers &movers);

  void use(NeighList *list) { list_ = list; }

  // Takes the pairs that come nearer than `margin` [length] with the predicted velocities.
  void collect(double margin);

  // Takes more pairs, those that overlap by more than the tolerance at the end of the step. Returns
  // how many.
  long add_violated();

  // Makes the gaps of bodies, and of contacts that pull, exact for the present solution. The
  // distance between turning bodies is not convex: at the end of the step it may be less than the
  // linearised gap. The gap of the constraint is then lowered by the difference over the cosine of
  // the angle between the normal and the line of the centres at the end, since the spheres make it
  // up along the normal; where the distance is more, nothing changes. The normal stays that of the
  // positions from which the force acts: along any other, two opposite forces would be a couple,
  // and angular momentum would not be kept. Returns how many constraints changed.
  long relinearise();

 private:
  // A pair of the list that the step may bring into contact.
  struct Candidate {
    std::size_t slot;    // in taken_
    int first, second;
  };
  struct Range {
    float centre[3], range;
  };

  void note_motion(const std::vector<double> &velocity);
  void search_list();
  void take(std::size_t slot, int i, int j);
  double gap_at_end(int i, int j, double *away) const;
  bool is_remembered(int i, int j) const;

  Step &step_;
  GapRules &rules_;
  ContactRows &rows_;
  const EntangledBodies &entangled_;
  const Movers &movers_;
  NeighList *list_ = nullptr;
  std::vector<char> taken_;    // per pair of the neighbour list: whether it is in the problem
  // The list reaches as far as the fastest particles go, so that most of its pairs are far apart.
  // One search of a step finds those that may meet; later rounds look at these alone, as long as no
  // particle goes much farther.
  std::vector<Candidate> candidates_;    // in the order of the list
  double widest_ = 0.0;    // [length] the widest gap of a candidate at the end of the step
  // [length] Per particle: how far it moves in this step at most, by the velocities so far; and how
  // far it may move as long as candidates_ holds all pairs that may meet.
  std::vector<double> motion_, allowed_;
  std::vector<Range> ranges_;
  std::vector<int> row_;    // the places in a row of the list that were found
};

}    // namespace LAMMPS_NS::Inelastic_NS

#endif
