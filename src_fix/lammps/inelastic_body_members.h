// This room knows which spheres belong to which body of a fix rigid/small, ghosts included, and
// checks that every rank sees its bodies whole.

#ifndef INELASTIC_BODY_MEMBERS_H
#define INELASTIC_BODY_MEMBERS_H

#include "inelastic_contact_problem.h"
#include "inelastic_host.h"
#include "inelastic_molecule_sizes.h"
#include "inelastic_step.h"

#include "pointers.h"

#include <string>
#include <vector>

namespace LAMMPS_NS {
class Fix;
}

namespace LAMMPS_NS::Inelastic_NS {

class BodyMembers : protected Pointers {
 public:
  BodyMembers(class LAMMPS *lmp, Step &step, inelastic::Host &host);

  // Errors: there is no such fix, or it has another style than rigid/small.
  void find_fix();
  // At the start of a run: the next call of find() counts the bodies afresh.
  void begin_run() { first_of_run_ = true; }
  Fix *fix() const { return fix_; }

  // Puts the bodies into the step's problem, all particles of the group. Call it when atoms or
  // ghosts have changed. Collective. Returns a message if this rank sees only a part of a body;
  // otherwise an empty text. Errors: a body that is not all in the group, or holds frozen spheres.
  std::string find();

  // Checks, once a run, when the bodies are measured, how far this rank sees. Errors: ghosts that
  // do not reach far enough. Collective.
  void check_reach() const;

  bool is_first_of_run() const { return first_of_run_; }
  void begin_steps() { first_of_run_ = false; }

  bool is_incomplete(int i) const { return incomplete_[i]; }
  const std::vector<int> &original_of() const { return original_of_; }

 private:
  void count_spheres();
  void check_hidden_pairs() const;
  std::vector<int> first_spheres(std::vector<int> &next, std::string &message);
  std::string add_body(int first_sphere, const std::vector<int> &next);
  std::string explained(const std::string &message) const;

  Step &step_;
  inelastic::Host &host_;
  Fix *fix_ = nullptr;
  bool first_of_run_ = false;
  static constexpr int NONE = -1;
  MoleculeSizes molecules_;
  std::vector<int> last_sphere_;    // per molecule: room for find, NONE between its calls
  std::vector<int> original_of_;    // per member: which of the body's originals it is
  std::vector<char> incomplete_;    // per particle: of a body of which this rank has only a part
  // 3 per particle, of which the first tells whether it is in a body
  std::vector<double> in_body_;
};

}    // namespace LAMMPS_NS::Inelastic_NS

#endif
