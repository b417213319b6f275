#include "inelastic_parameters.h"

#include "inelastic_lammps_versions.h"

#include "comm.h"
#include "input.h"
#include "platform.h"
#include "utils.h"
#include "variable.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <climits>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <sys/stat.h>
#include <unistd.h>
#include <utility>

using namespace LAMMPS_NS;
using namespace Inelastic_NS;

namespace {

// The variable that holds the list of parameters as text. It is there from the first table on.
constexpr char LIST[] = "parameters";
// This variable says whether a value is a word or a file.
constexpr char IS_FILE[] = "_is_file";
constexpr std::size_t LONGEST_SHOWN = 100;

// Dumps and restart files give * and % a meaning, the functions of variables the comma, input
// scripts and the shell the others.
constexpr char NOT_IN_FILES[] = "\"'`$&#";
constexpr char NOT_IN_FOLDERS[] = "\"'`$&#*?%{}()[]~;<>|\\!,";

bool is_name(const std::string &word)
{
  return !word.empty() && std::all_of(word.begin(), word.end(), [](unsigned char letter) {
    return letter < 128 && (std::isalnum(letter) || letter == '_');
  });
}

bool are_digits(const char *&at)
{
  const char *const start = at;
  while (*at >= '0' && *at <= '9') ++at;
  return at > start;
}

bool is_integer(const std::string &text)
{
  const char *at = text.c_str();
  if (*at == '-') ++at;
  return are_digits(at) && !*at;
}

// A number is what LAMMPS understands everywhere as one: `if` knows neither a leading + nor
// hexadecimals.
bool is_number(const std::string &text)
{
  const char *at = text.c_str();
  if (*at == '-') ++at;
  const bool before = are_digits(at);
  if (*at == '.') ++at;
  const bool after = are_digits(at);
  if (!before && !after) return false;
  if (*at == 'e' || *at == 'E') {
    ++at;
    if (*at == '-' || *at == '+') ++at;
    if (!are_digits(at)) return false;
  }
  return !*at;
}

bool read_number(const std::string &text, double &value)
{
  if (!is_number(text)) return false;
  errno = 0;
  value = std::strtod(text.c_str(), nullptr);
  return errno != ERANGE;
}

bool has_any_of(const std::string &text, const char *letters)
{
  return std::any_of(text.begin(), text.end(), [letters](unsigned char letter) {
    return letter <= ' ' || letter == 127 || std::strchr(letters, letter);
  });
}

// A value on one line of a message, whatever it is.
std::string shown(const std::string &value)
{
  if (value.empty()) return "an empty text";
  std::size_t end = std::min(value.size(), LONGEST_SHOWN);
  // Not in the middle of a letter beyond ASCII.
  while (end < value.size() && (value[end] & 0xc0) == 0x80) --end;
  std::string text = value.substr(0, end);
  for (char &letter : text)
    if (static_cast<unsigned char>(letter) < ' ' || letter == 127) letter = '?';
  return value.size() > end ? text + "..." : text;
}

std::string joined(const std::vector<std::string> &words, const char *last)
{
  std::string text;
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (i > 0) text += i + 1 < words.size() ? ", " : last;
    text += words[i];
  }
  return text;
}

// The least number of letters to add, drop, change, or swap with the next, that makes one word of
// the other.
std::size_t distance_of(const std::string &a, const std::string &b)
{
  std::array<std::vector<std::size_t>, 3> rows;    // of a's first i-2, i-1 and i letters
  for (auto &row : rows) row.resize(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) rows[2][j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::swap(rows[0], rows[1]);
    std::swap(rows[1], rows[2]);
    rows[2][0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t change = rows[1][j - 1] + (a[i - 1] != b[j - 1]);
      rows[2][j] = std::min({rows[1][j] + 1, rows[2][j - 1] + 1, change});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        rows[2][j] = std::min(rows[2][j], rows[0][j - 2] + 1);
    }
  }
  return rows[2][b.size()];
}

}    // namespace

/* ---------------------------------------------------------------------- */

std::string Parameters::Rule::allowed() const
{
  if (kind == FOLDER) return "a folder for output";
  if (kind == WORDS) {
    std::vector<std::string> choices = words;
    if (file) choices.emplace_back("a file that is there");
    return joined(choices, " or ");
  }
  std::string text = kind == INTEGER ? "a whole number" : "a number";
  const bool both = !low.text.empty() && !high.text.empty();
  if (!low.text.empty()) {
    const char *const word = !low.included ? " above " : both ? " from " : " of at least ";
    text += word + low.text;
  }
  if (!high.text.empty()) {
    const char *word = high.included ? " of at most " : " below ";
    if (both) {
      word = " and below ";
      if (high.included)
        word = low.included ? " to " : " and up to ";
      else if (low.included)
        word = " to below ";
    }
    text += word + high.text;
  }
  return text;
}

/* ---------------------------------------------------------------------- */

void Parameters::command(int narg, char **arg)
{
  if (narg != 1)
    error_at(error, FLERR, NO_LINE,
             "Command parameters takes one argument, a table in triple quotes or log, not {}",
             narg);
  if (strcmp(arg[0], "log") == 0) {
    write_to_log();
    return;
  }
  std::vector<Parameter> table = read_table(arg[0]);

  std::vector<std::string> mistakes = find_unknown(table);
  for (Parameter &parameter : table) {
    if (input->variable->find(parameter.name.c_str()) < 0)
      input->variable->set(fmt::format("{} index {}", parameter.name, parameter.usual));
    parameter.value = value_of(parameter);
    parameter.alone = is_alone(parameter);
    const std::string mistake = mistake_in(parameter);
    if (!mistake.empty()) mistakes.push_back(mistake);
  }
  if (!mistakes.empty()) stop(mistakes);

  for (const Parameter &parameter : table) {
    if (parameter.rule.kind == Rule::FOLDER) {
      const std::string mistake = make_folder(parameter);
      if (!mistake.empty()) stop({mistake});
    }
    if (parameter.rule.file) {
      const auto &words = parameter.rule.words;
      const bool word = std::find(words.begin(), words.end(), parameter.value) != words.end();
      input->variable->set(fmt::format("{}{} equal {}", parameter.name, IS_FILE, word ? 0 : 1));
    }
  }

  const std::string list = listed(table);
  if (comm->me == 0) utils::logmesg(lmp, "{}\n", list);
  input->variable->set(fmt::format("{} string none", LIST));
  input->variable->set_string(LIST, list.c_str());
}

/* ----------------------------------------------------------------------
   the table: a line each: name, default, rule, # comment
------------------------------------------------------------------------- */

std::vector<Parameters::Parameter> Parameters::read_table(const std::string &text) const
{
  std::vector<Parameter> table;
  std::size_t start = 0;
  while (start < text.size()) {
    const std::size_t end = std::min(text.find('\n', start), text.size());
    const std::string line = utils::trim(utils::trim_comment(text.substr(start, end - start)));
    start = end + 1;
    const std::vector<std::string> words = utils::split_words(line);
    if (words.empty()) continue;
    if (words.size() < 3)
      error_at(error, FLERR, NO_LINE,
               "A line of parameters must be: name, default, what is allowed; not: {}",
               shown(line));
    Parameter parameter;
    parameter.name = words[0];
    parameter.usual = words[1];
    if (!is_name(parameter.name) || parameter.name == LIST)
      error_at(error, FLERR, NO_LINE,
               "A parameter's name must be of letters, digits and underscores, and not "
               "\"{}\": {}",
               LIST, shown(line));
    for (const Parameter &other : table)
      if (other.name == parameter.name)
        error_at(error, FLERR, NO_LINE, "Parameter {} is in the table twice", parameter.name);
    parameter.rule = read_rule({words.begin() + 2, words.end()}, line);
    table.push_back(parameter);
  }
  if (table.empty()) error_at(error, FLERR, NO_LINE, "The table of parameters is empty");
  return table;
}

Parameters::Rule Parameters::read_rule(const std::vector<std::string> &words,
                                       const std::string &line) const
{
  Rule rule;
  if (words[0] == "folder" && words.size() == 1) {
    rule.kind = Rule::FOLDER;
    return rule;
  }
  if (words[0] == "integer" || words[0] == "number") {
    rule.kind = words[0] == "integer" ? Rule::INTEGER : Rule::NUMBER;
    if (rule.kind == Rule::INTEGER) {
      // An integer of LAMMPS holds this.
      rule.low = {std::to_string(INT_MIN), INT_MIN, true};
      rule.high = {std::to_string(INT_MAX), INT_MAX, true};
    }
    bool low = false, high = false;
    for (std::size_t i = 1; i < words.size(); i += 2) {
      bool &given = words[i][0] == '>' ? low : high;
      const bool is_bound = words[i] == ">" || words[i] == ">=" || words[i] == "<" ||
          words[i] == "<=";
      Bound bound{i + 1 < words.size() ? words[i + 1] : "", 0.0, words[i].size() == 2};
      if (!is_bound || given || !read_number(bound.text, bound.value))
        error_at(error, FLERR, NO_LINE,
                 "The bounds of a parameter must be > or >= and a number, < or <= and a "
                 "number: {}",
                 shown(line));
      (words[i][0] == '>' ? rule.low : rule.high) = bound;
      given = true;
    }
    return rule;
  }
  for (std::size_t i = 0; i < words.size(); ++i) {
    const bool is_choice = i % 2 == 0;
    if (is_choice ? words[i] == "or" : words[i] != "or")
      error_at(error, FLERR, NO_LINE,
               "What a parameter may be must be integer or number with bounds, words with "
               "\"or\" between them, or folder: {}",
               shown(line));
    if (is_choice && words[i] == "file")
      rule.file = true;
    else if (is_choice)
      rule.words.push_back(words[i]);
  }
  if (words.size() % 2 == 0)
    error_at(error, FLERR, NO_LINE, "A word is missing after the last \"or\": {}", shown(line));
  return rule;
}

/* ----------------------------------------------------------------------
   variables that are set, but in no line of the table. The command line's
   are of style index, and all there before the first table; later, after
   a clear, variables of that style may also be a script's own
------------------------------------------------------------------------- */

std::vector<std::string> Parameters::find_unknown(const std::vector<Parameter> &table) const
{
  std::vector<std::string> unknown;
  if (is_there_a_list()) return unknown;
  std::vector<std::string> names;
  for (const Parameter &parameter : table) names.push_back(parameter.name);
  for (int i = 0; i < input->variable->nvar; ++i) {
    const std::string name = input->variable->names[i];
    if (!is_index_variable(i) || std::find(names.begin(), names.end(), name) != names.end())
      continue;
    std::string nearest;
    std::size_t least = std::max<std::size_t>(2, name.size() / 3) + 1;
    for (const std::string &other : names) {
      const std::size_t distance = distance_of(name, other);
      if (distance < least) {
        least = distance;
        nearest = other;
      }
    }
    const std::string meant = nearest.empty() ? "." : ": did you mean " + nearest + "?";
    unknown.push_back(fmt::format("There is no parameter {}{} All are {}", shown(name), meant,
                                  joined(names, " and ")));
  }
  return unknown;
}

bool Parameters::is_index_variable(int variable) const
{
  // The styles are private, but this text has that of the variable behind its name.
  const std::string text = description_of_variable(lmp, variable);
  const std::string before = "style = ";
  const std::size_t at = text.find(before);
  return at != std::string::npos && text.compare(at + before.size(), 6, "index,") == 0;
}

/* ---------------------------------------------------------------------- */

std::string Parameters::value_of(const Parameter &parameter) const
{
  const char *const value = input->variable->retrieve(parameter.name.c_str());
  return value ? value : "";
}

// Says whether a variable has one value, and not several for the command next.
bool Parameters::is_alone(const Parameter &parameter) const
{
  const int variable = input->variable->find(parameter.name.c_str());
  if (!is_index_variable(variable)) return true;
  // Ends with all values.
  const std::string text = description_of_variable(lmp, variable);
  return text.substr(text.find(" def =") + 6) == " " + parameter.value + "\n";
}

// Returns what is wrong with a parameter's value, or nothing.
std::string Parameters::mistake_in(const Parameter &parameter) const
{
  const Rule &rule = parameter.rule;
  const std::string &value = parameter.value;
  std::string why;
  bool right = false;
  if (rule.kind == Rule::FOLDER) {
    why = mistake_in_folder(value);
    right = why.empty();
  } else if (rule.kind == Rule::WORDS) {
    right = std::find(rule.words.begin(), rule.words.end(), value) != rule.words.end();
    if (!right && rule.file) {
      right = is_file(value);
      if (right && has_any_of(value, NOT_IN_FILES)) {
        right = false;
        why = ": a file's name must be without white space, quotes, $, & and #";
      }
    }
  } else {
    double number = 0.0;
    right = (rule.kind == Rule::NUMBER || is_integer(value)) && read_number(value, number);
    if (!rule.low.text.empty())
      right = right && (rule.low.included ? number >= rule.low.value : number > rule.low.value);
    if (!rule.high.text.empty())
      right = right && (rule.high.included ? number <= rule.high.value : number < rule.high.value);
  }
  if (right) return "";
  return fmt::format("Parameter {} must be {}, not {}{}", parameter.name, rule.allowed(),
                     shown(value), why);
}

std::string Parameters::mistake_in_folder(const std::string &name) const
{
  if (name.empty()) return ": it needs a name";
  if (has_any_of(name, NOT_IN_FOLDERS))
    return ": its name must be without white space, quotes and $ & # * ? % { } ( ) [ ] ~ ; < > | "
           "\\ ! ,";
  struct stat status;
  const bool other = stat(name.c_str(), &status) == 0 && !S_ISDIR(status.st_mode);
  return said_by_first_rank(other) ? ", which is there and is no folder" : "";
}

// Makes a folder unless it is there; returns what went wrong, or nothing.
std::string Parameters::make_folder(const Parameter &parameter) const
{
  int failed = 0;
  if (comm->me == 0) {
    errno = 0;
    if (platform::mkdir(parameter.value) != 0 || access(parameter.value.c_str(), W_OK) != 0)
      failed = errno;
  }
  MPI_Bcast(&failed, 1, MPI_INT, 0, world);
  if (!failed) return "";
  return fmt::format("Parameter {} must be {}, not {}, where nothing can be written: {}",
                     parameter.name, parameter.rule.allowed(), shown(parameter.value),
                     std::strerror(failed));
}

// A log file may have been opened after the table was read.
void Parameters::write_to_log() const
{
  if (!is_there_a_list())
    error_at(error, FLERR, NO_LINE, "Command parameters log must follow a table of parameters");
  if (comm->me == 0 && logfile) fprintf(logfile, "%s\n", input->variable->retrieve(LIST));
}

bool Parameters::is_there_a_list() const
{
  const int list = input->variable->find(LIST);
  return list >= 0 && !is_index_variable(list);
}

std::string Parameters::listed(const std::vector<Parameter> &table) const
{
  std::size_t names = 0, values = 0;
  for (const Parameter &parameter : table) {
    names = std::max(names, parameter.name.size());
    values = std::max(values, parameter.value.size());
  }
  std::string text = "Parameters (* is not the default):";
  for (const Parameter &parameter : table) {
    const bool usual = parameter.value == parameter.usual;
    text +=
        fmt::format("\n  {} {:{}} {}", usual ? ' ' : '*', parameter.name, names, parameter.value);
    if (usual && parameter.alone) continue;
    text += std::string(values - parameter.value.size(), ' ');
    if (!usual) text += " default " + parameter.usual;
    if (!parameter.alone) text += " (one of several values)";
  }
  return text;
}

/* ----------------------------------------------------------------------
   other ranks may see other files, or the same ones later
------------------------------------------------------------------------- */

bool Parameters::is_file(const std::string &name) const
{
  struct stat status;
  // Not a pipe, which would be waited for.
  const bool there = stat(name.c_str(), &status) == 0 && S_ISREG(status.st_mode);
  return said_by_first_rank(there && platform::file_is_readable(name));
}

bool Parameters::said_by_first_rank(bool what) const
{
  int said = what ? 1 : 0;
  MPI_Bcast(&said, 1, MPI_INT, 0, world);
  return said == 1;
}

void Parameters::stop(const std::vector<std::string> &mistakes) const
{
  // Each has a line of its own, the first one as LAMMPS writes it.
  std::string text = mistakes[0];
  for (std::size_t i = 1; i < mistakes.size(); ++i) text += "\nERROR: " + mistakes[i];
  // Without the last input line, which would be the whole table.
  error_at(error, FLERR, NO_LINE, "{}", text);
}
