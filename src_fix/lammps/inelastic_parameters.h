/* -*- c++ -*- ----------------------------------------------------------
   The parameters of a deck as one table: names, defaults, what each may
   be, and what it means. The command makes a variable of each that is not
   set yet, checks all values before anything runs, and lists them.
------------------------------------------------------------------------- */

#ifdef COMMAND_CLASS
// clang-format off
CommandStyle(parameters,Parameters);
// clang-format on
#else

#ifndef LMP_INELASTIC_PARAMETERS_H
#define LMP_INELASTIC_PARAMETERS_H

#include "command.h"

#include <string>
#include <vector>

namespace LAMMPS_NS {

class Parameters : public Command {
 public:
  explicit Parameters(class LAMMPS *lmp) : Command(lmp) {}
  void command(int, char **) override;

 private:
  struct Bound {
    std::string text;    // as it stands in the table; empty: no bound
    double value = 0.0;
    bool included = true;
  };

  struct Rule {
    enum { INTEGER, NUMBER, WORDS, FOLDER } kind = WORDS;
    Bound low, high;                   // of numbers
    std::vector<std::string> words;    // WORDS: those that are allowed
    bool file = false;                 // WORDS: a file's name is allowed, too

    std::string allowed() const;    // in words, for messages
  };

  struct Parameter {
    std::string name, value, usual;    // usual: the default
    bool alone = true;                 // no further values follow, as in `variable a index 1 2`
    Rule rule;
  };

  std::vector<Parameter> read_table(const std::string &) const;
  Rule read_rule(const std::vector<std::string> &, const std::string &) const;

  bool is_index_variable(int) const;
  std::vector<std::string> find_unknown(const std::vector<Parameter> &) const;
  std::string value_of(const Parameter &) const;
  bool is_alone(const Parameter &) const;
  std::string mistake_in(const Parameter &) const;
  std::string mistake_in_folder(const std::string &) const;
  std::string make_folder(const Parameter &) const;
  std::string listed(const std::vector<Parameter> &) const;
  bool is_there_a_list() const;
  void write_to_log() const;

  bool is_file(const std::string &) const;
  bool said_by_first_rank(bool) const;
  [[noreturn]] void stop(const std::vector<std::string> &) const;
};

}    // namespace LAMMPS_NS

#endif
#endif
