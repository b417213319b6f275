// This room makes what LAMMPS's output shows of the fix: the global vector, contacts and forces per
// atom, the local list of contacts, the forces on walls and the virial. Movers and the check of the
// motion take the contact forces from here.

#ifndef INELASTIC_CONTACT_OUTPUT_H
#define INELASTIC_CONTACT_OUTPUT_H

#include "inelastic_projection.h"
#include "inelastic_step.h"
#include "inelastic_wall_forces.h"

#include "pointers.h"

#include <vector>

namespace LAMMPS_NS::Inelastic_NS {

class GhostExchange;

class ContactOutput : protected Pointers {
 public:
  ContactOutput(class LAMMPS *lmp, const Step &step, GhostExchange &ranks);
  ~ContactOutput() override;
  ContactOutput(const ContactOutput &) = delete;
  ContactOutput &operator=(const ContactOutput &) = delete;

  // The columns of the arrays, in the order in which the page of the fix lists them.
  static constexpr int PER_ATOM_COLUMNS = 5;
  // One more follows for each value that the contact law remembers.
  static constexpr int LOCAL_COLUMNS = 10;
  int local_columns() const { return LOCAL_COLUMNS + remembered(); }
  enum Vector {
    ITERATIONS,
    FEASIBILITY,
    COMPLEMENTARITY,
    OVERLAP,
    PARTICLE_CONTACTS,
    WALL_CONTACTS,
    CONSTRAINTS,
    ROUNDS,
    TOTAL_ITERATIONS,
    SHORTENED_STEPS,
    EXCESS,
    PUSHED_STEPS,
    AT_REST,
    PRESSED_CONTACTS,
    HELD_CONTACTS,
    // These two are known to the room inelastic_unrest alone.
    REST_SPEED,
    NET_FORCE,
    VECTOR_SIZE
  };

  // Call it once, when the fix is defined.
  void set_walls(int number_of_walls) { wall_forces_.set_walls(number_of_walls); }

  // LAMMPS says which virial it wants in this step, and where it is to be added.
  struct VirialTarget {
    bool global;
    bool per_atom;
    double *total;     // 6 numbers
    double **atoms;    // 6 per atom
  };

  // Takes the contacts of a step that is solved. Collective.
  void take(const inelastic::ProjectionResult &result, long shortened_steps,
            const VirialTarget &virial);

  // 3 per particle: the force of all contacts, on ghosts that of their owned atom.
  const double *contact_force() const { return contact_force_.data(); }
  // The largest change of a velocity that one of the contacts made, on any rank.
  double largest_change() const { return largest_change_; }

  double vector(int n) const { return vector_[n]; }
  // One component of the force on a wall (0 = the first one), on all ranks. Collective.
  double wall_force(int wall, int direction) { return wall_forces_.total(wall, direction, world); }
  double **per_atom() { return per_atom_; }
  double **local() { return local_; }
  int local_rows() const { return local_rows_; }

  // LAMMPS's callbacks for what is per atom.
  void grow(int atoms);
  void copy(int from, int to);
  void clear(int i);

  // [numbers] of one constraint.
  static constexpr double PER_CONTACT = 20.0 + LOCAL_COLUMNS;

 private:
  // Contacts between spheres, and with walls; of these: pressed ones, and those of which the law
  // remembers something.
  struct Counts {
    double pairs = 0.0, walls = 0.0, pressed = 0.0, kept = 0.0;
  };

  enum { POINT = 2, NORMAL = 5, FORCE = 9 };    // columns of the local list
  static constexpr int NONE = -1;

  int remembered() const;
  bool is_contact(std::size_t c) const;
  void clear_sums(bool virial_per_atom);
  int listed_before(std::size_t c) const;
  void join(double *row, double strength, const double *normal, int i, double to_point) const;
  void add_contact(std::size_t c, double strength, const VirialTarget &virial);
  void count_contact(std::size_t c);
  void list_contact(std::size_t c, double strength, double to_point);
  void add_virial(std::size_t c, double weight, const VirialTarget &virial);
  void share(const VirialTarget &virial);

  const Step &step_;
  GhostExchange &ranks_;
  double vector_[VECTOR_SIZE] = {};
  double **per_atom_ = nullptr;
  double **local_ = nullptr;
  int local_rows_ = 0;
  int local_room_ = 0;
  // Rows of the local list: the last one of each contact (of Step::contacts), and by row the one
  // of the same contact before it
  std::vector<int> last_row_, row_before_;
  Counts counts_;
  // 3 per slot (inelastic_unknowns.h), and 2: contacts with particles, and with walls
  std::vector<double> contact_force_, contact_count_;
  std::vector<double> virial_;    // 6 per slot
  WallForces wall_forces_;
  double largest_change_ = 0.0;
};

}    // namespace LAMMPS_NS::Inelastic_NS

#endif
