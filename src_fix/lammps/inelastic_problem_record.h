// The keyword record: the contact problem of a step, as it was solved, in a file of NumPy's. The
// page docs/reference/record.md lists the arrays.

#ifndef INELASTIC_PROBLEM_RECORD_H
#define INELASTIC_PROBLEM_RECORD_H

#include "inelastic_projection.h"

#include "pointers.h"

#include <functional>
#include <string>
#include <vector>

namespace inelastic {
class NpzWriter;
}

namespace LAMMPS_NS::Inelastic_NS {

class GhostExchange;
struct Step;

class ProblemRecord : protected Pointers {
 public:
  ProblemRecord(class LAMMPS *lmp, const Step &step, GhostExchange &ranks);

  // Collective. Errors: the file cannot be written.
  void write(const inelastic::ProjectionResult &result) const;

 private:
  // One array of the file: `width` numbers of each row (1 gives shape (rows,), otherwise
  // (rows, width)), which `get` writes for a particle or a constraint.
  struct Column {
    const char *name;
    int width;
    enum Type { REAL, INTEGER } type;
    std::function<void(int index, double *values)> get;
  };
  using Table = std::vector<Column>;

  Table atoms() const;
  Table members() const;
  Table bodies() const;
  Table contacts() const;

  static int width(const Table &table);
  std::vector<double> rows(const Table &table, const std::vector<int> &indices) const;
  static void add(inelastic::NpzWriter &file, const Table &table, const std::vector<double> &rows);
  static std::vector<double> sorted_by_first(const std::vector<double> &rows, int width);

  const Step &step_;
  GhostExchange &ranks_;
};

}    // namespace LAMMPS_NS::Inelastic_NS

#endif
