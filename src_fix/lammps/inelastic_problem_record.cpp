#include "inelastic_problem_record.h"

#include "inelastic_ghost_exchange.h"
#include "inelastic_npz.h"
#include "inelastic_step.h"

#include "atom.h"
#include "comm.h"
#include "update.h"
#include "utils.h"

#include "fmt/format.h"

#include <algorithm>
#include <cstdint>
#include <numeric>

using namespace LAMMPS_NS;
using namespace Inelastic_NS;

ProblemRecord::ProblemRecord(LAMMPS *lmp, const Step &step, GhostExchange &ranks) :
    Pointers(lmp), step_(step), ranks_(ranks)
{
}

// Arrays with a row for each owned atom of the group, in the order of atom IDs.
ProblemRecord::Table ProblemRecord::atoms() const
{
  auto vector = [](const double *values) {
    return [values](int i, double *out) {
      std::copy_n(values + 3 * i, 3, out);
    };
  };
  const inelastic::ContactProblem &problem = step_.problem;
  return {
      {"id", 1, Column::INTEGER,
       [this](int i, double *out) {
         *out = atom->tag[i];
       }},
      {"inverse_mass", 1, Column::REAL,
       [&problem](int i, double *out) {
         *out = problem.inverse_mass[i];
       }},
      {"radius", 1, Column::REAL,
       [this](int i, double *out) {
         *out = atom->radius[i];
       }},
      {"position", 3, Column::REAL,
       [this](int i, double *out) {
         std::copy_n(atom->x[i], 3, out);
       }},
      {"predicted_velocity", 3, Column::REAL, vector(problem.predicted_velocity.data())},
      {"velocity", 3, Column::REAL, vector(step_.velocity.data())},
      {"mass", 1, Column::REAL,
       [this](int i, double *out) {
         *out = mass_of(atom, i);
       }},
  };
}

// More arrays of the same rows in a scene with bodies; zeros for free spheres.
ProblemRecord::Table ProblemRecord::members() const
{
  return {
      {"molecule", 1, Column::INTEGER,
       [this](int i, double *out) {
         *out = step_.is_member(i) ? static_cast<double>(atom->molecule[i]) : 0.0;
       }},
      {"arm", 3, Column::REAL,
       [this](int i, double *out) {
         std::copy_n(step_.arm(i), 3, out);
       }},
  };
}

// Arrays with a row for each body, which its first particle stands for.
ProblemRecord::Table ProblemRecord::bodies() const
{
  const inelastic::RigidBodies &all = step_.problem.bodies;
  return {
      {"body_molecule", 1, Column::INTEGER,
       [this](int i, double *out) {
         *out = static_cast<double>(atom->molecule[i]);
       }},
      {"body_inverse_mass", 1, Column::REAL,
       [&all](int i, double *out) {
         *out = all.inverse_mass[all.body[i]];
       }},
      {"body_inverse_inertia", 6, Column::REAL,
       [&all](int i, double *out) {
         std::copy_n(&all.inverse_inertia[6 * all.body[i]], 6, out);
       }},
  };
}

// Arrays with a row for each constraint.
ProblemRecord::Table ProblemRecord::contacts() const
{
  const inelastic::ContactSet &set = step_.problem.contacts;
  return {
      {"id1", 1, Column::INTEGER,
       [this, &set](int c, double *out) {
         *out = static_cast<double>(atom->tag[set.first[c]]);
       }},
      {"id2", 1, Column::INTEGER,
       [this](int c, double *out) {
         *out = static_cast<double>(step_.contact_of(c).partner);
       }},
      {"normal", 3, Column::REAL,
       [&set](int c, double *out) {
         std::copy_n(&set.normal[3 * c], 3, out);
       }},
      {"gap", 1, Column::REAL,
       [&set](int c, double *out) {
         *out = set.gap[c];
       }},
      {"gap_now", 1, Column::REAL,
       [this](int c, double *out) {
         *out = step_.contact_of(c).gap_now;
       }},
      {"wall_motion", 1, Column::REAL,
       [this](int c, double *out) {
         *out = step_.rows[c].wall_motion;
       }},
      {"impulse", 1, Column::REAL,
       [&set](int c, double *out) {
         *out = set.impulse[c];
       }},
      {"impulse_guess", 1, Column::REAL,
       [this](int c, double *out) {
         *out = step_.impulse_per_force * step_.contact_of(c).force;
       }},
  };
}

int ProblemRecord::width(const Table &table)
{
  return std::accumulate(table.begin(), table.end(), 0, [](int sum, const Column &column) {
    return sum + column.width;
  });
}

// Collective: the rows of all ranks, on rank 0.
std::vector<double> ProblemRecord::rows(const Table &table, const std::vector<int> &indices) const
{
  std::vector<double> mine(width(table) * indices.size());
  double *out = mine.data();
  for (const int index : indices)
    for (const Column &column : table) {
      column.get(index, out);
      out += column.width;
    }
  return ranks_.gather(std::move(mine));
}

std::vector<double> ProblemRecord::sorted_by_first(const std::vector<double> &rows, int width)
{
  std::vector<std::size_t> order(rows.size() / width);
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return rows[width * a] < rows[width * b];
  });
  std::vector<double> sorted;
  sorted.reserve(rows.size());
  for (const std::size_t k : order)
    sorted.insert(sorted.end(), &rows[width * k], &rows[width * k] + width);
  return sorted;
}

void ProblemRecord::add(inelastic::NpzWriter &file, const Table &table,
                        const std::vector<double> &rows)
{
  const std::size_t all = width(table);
  std::size_t from = 0;
  for (const Column &column : table) {
    std::vector<double> values;
    for (std::size_t row = 0; row < rows.size(); row += all)
      values.insert(values.end(), rows.begin() + row + from,
                    rows.begin() + row + from + column.width);
    from += column.width;
    if (column.type == Column::INTEGER)
      file.add(column.name, std::vector<std::int64_t>(values.begin(), values.end()));
    else
      file.add(column.name, values, column.width > 1 ? column.width : 0);
  }
}

void ProblemRecord::write(const inelastic::ProjectionResult &result) const
{
  std::vector<int> owned, first_of_bodies, constraints(step_.problem.contacts.size());
  std::iota(constraints.begin(), constraints.end(), 0);
  const inelastic::RigidBodies &all = step_.problem.bodies;
  for (int i = 0; i < atom->nlocal; ++i) {
    if (!step_.in_group(atom, i)) continue;
    owned.push_back(i);
    if (step_.is_member(i) && all.place[i] == all.start[all.body[i]]) first_of_bodies.push_back(i);
  }
  Table of_atoms = atoms();
  Table of_contacts = contacts();
  if (step_.settings.law)
    of_contacts.push_back({"least_impulse", 1, Column::REAL, [this](int c, double *out) {
                             *out = step_.problem.contacts.set[c].idle();
                           }});
  const bool has_bodies = step_.has_bodies;
  if (has_bodies)
    for (const Column &column : members()) of_atoms.push_back(column);
  const std::vector<double> atom_rows = rows(of_atoms, owned);
  const std::vector<double> contact_rows = rows(of_contacts, constraints);
  const std::vector<double> body_rows = rows(bodies(), first_of_bodies);
  std::string message;
  if (comm->me == 0) {
    inelastic::NpzWriter file;
    file.add("step", static_cast<double>(update->ntimestep));
    file.add("timestep", step_.problem.timestep);
    file.add("tolerance", step_.settings.tolerance);
    file.add("iterations", static_cast<double>(result.iterations));
    add(file, of_atoms, sorted_by_first(atom_rows, width(of_atoms)));
    if (has_bodies) add(file, bodies(), body_rows);
    add(file, of_contacts, contact_rows);
    const std::string path = utils::star_subst(step_.settings.record_file, update->ntimestep, 0);
    if (!file.write(path))
      message = fmt::format("cannot write the record {}: {}", path, utils::getsyserror());
  }
  ranks_.fail_together(message);
}
