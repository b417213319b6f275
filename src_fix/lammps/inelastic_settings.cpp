#include "inelastic_settings.h"

#include "inelastic_make_law.h"
#include "inelastic_make_solver.h"

#include "group.h"
#include "lammps.h"
#include "utils.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <set>

using namespace LAMMPS_NS;
using namespace Inelastic_NS;

namespace {

constexpr const char *KEYWORDS[] = {"region", "rigid",  "law",     "accuracy", "solver", "maxiter",
                                    "frozen", "record", "shorten", "rest",     "unlock"};

bool is_keyword(const char *word)
{
  return std::any_of(std::begin(KEYWORDS), std::end(KEYWORDS), [word](const char *keyword) {
    return strcmp(word, keyword) == 0;
  });
}

// Reads the arguments one after the other. `at_` is the index of the next one.
class Reader {
 public:
  Reader(LAMMPS *lmp, int narg, char **arg, Settings &settings) :
      lmp_(lmp), error_(lmp->error), narg_(narg), arg_(arg), settings_(settings)
  {
  }

  void read_keywords();

 private:
  void refuse_twice(const std::string &keyword);
  void read_regions(const char *first);
  void read_rigid(const char *fix_id);
  void read_law(const std::string &name);
  void read_solver(const char *name);
  void choose_solver();
  void read_max_iterations(const char *value);
  void read_frozen(const char *group_id);
  void read_record(const char *file);

  LAMMPS *lmp_;
  Error *error_;
  int narg_;
  char **arg_;
  int at_ = 4, at_law_ = 4;
  std::set<std::string> given_;    // keywords
  Settings &settings_;
};

void Reader::read_keywords()
{
  while (at_ < narg_) {
    const std::string keyword = arg_[at_];
    if (!is_keyword(arg_[at_]))
      error_at(error_, FLERR, at_,
               "Unknown fix inelastic keyword {}: use region, rigid, law, accuracy, solver, "
               "maxiter, frozen, record, shorten, rest or unlock",
               keyword);
    if (at_ + 2 > narg_) utils::missing_cmd_args(FLERR, "fix inelastic " + keyword, error_);
    refuse_twice(keyword);
    const char *const value = arg_[at_ + 1];
    at_ += 2;
    if (keyword == "region")
      read_regions(value);
    else if (keyword == "rigid")
      read_rigid(value);
    else if (keyword == "law")
      read_law(value);
    else if (keyword == "accuracy")
      settings_.accuracy = read_accuracy(lmp_, value, at_ - 1);
    else if (keyword == "solver")
      read_solver(value);
    else if (keyword == "maxiter")
      read_max_iterations(value);
    else if (keyword == "frozen")
      read_frozen(value);
    else if (keyword == "record")
      read_record(value);
    else if (keyword == "unlock")
      settings_.unlock = utils::logical(FLERR, value, false, lmp_) == 1;
    else if (keyword == "rest")
      settings_.rest = utils::logical(FLERR, value, false, lmp_) == 1;
    else
      settings_.shorten = utils::logical(FLERR, value, false, lmp_) == 1;
  }
  if (settings_.law) choose_solver();
}

// Regions add up, and read_law() knows better what to say of two laws.
void Reader::refuse_twice(const std::string &keyword)
{
  if (keyword == "region" || keyword == "law") return;
  if (!given_.insert(keyword).second)
    error_at(error_, FLERR, at_, "Fix inelastic: keyword {} is given twice", keyword);
}

void Reader::read_regions(const char *first)
{
  settings_.regions.emplace_back(first);
  while (at_ < narg_ && !is_keyword(arg_[at_])) settings_.regions.emplace_back(arg_[at_++]);
}

void Reader::read_rigid(const char *fix_id)
{
  const std::string inertia = at_ < narg_ ? arg_[at_] : "nothing";
  if (inertia != "point" && inertia != "solid")
    error_at(error_, FLERR, at_ - 1,
             "Fix inelastic needs rigid FIX-ID point or rigid FIX-ID solid (the mass of each "
             "sphere in its centre, or a solid ball), not {}",
             inertia);
  ++at_;
  settings_.rigid_fix = fix_id;
  settings_.inertia = inertia == "point" ? Inertia::POINT : Inertia::SOLID;
}

void Reader::read_law(const std::string &name)
{
  const int at_name = at_law_ = at_ - 1;
  if (!settings_.law_words.empty())
    error_at(error_, FLERR, at_name,
             "Fix inelastic: two laws, {} and {}: all contacts have one law", settings_.law_words,
             name);
  const inelastic::NamedLaw *const law = inelastic::find_law(name);
  if (!law)
    error_at(error_, FLERR, at_name, "Fix inelastic law must be {}, not {}",
             inelastic::names_of_laws(), name);
  settings_.law_words = name;
  std::vector<std::string> words;
  while (at_ < narg_ && !is_keyword(arg_[at_])) words.emplace_back(arg_[at_++]);
  for (const std::string &word : words) settings_.law_words += " " + word;
  std::string allowed;
  settings_.law = law->make(words, allowed);
  if (!allowed.empty())
    error_at(error_, FLERR, at_name, "Fix inelastic needs law {}, not law {}", allowed,
             settings_.law_words);
  const int most = inelastic::ContactLaw::MOST_REMEMBERED;
  const int remembered = settings_.law ? settings_.law->remembers() : 0;
  if (remembered < 0 || remembered > most)
    error_at(error_, FLERR, at_name,
             "Fix inelastic: law {} remembers {} values of a contact: 0 to {} are allowed", name,
             remembered, most);
}

void Reader::read_solver(const char *name)
{
  if (!inelastic::make_solver(name))
    error_at(error_, FLERR, at_ - 1, "Fix inelastic solver must be sweeps, apgd or uzawa, not {}",
             name);
  settings_.solver = name;
}

// A law may rule solvers out.
void Reader::choose_solver()
{
  const std::vector<std::string> serve = settings_.law->solvers();
  std::string names;
  for (const std::string &name : serve) {
    if (!inelastic::make_solver(name))
      error_at(error_, FLERR, at_law_,
               "Fix inelastic: law {} asks for the solver {}, which is none", settings_.law_words,
               name);
    names += (names.empty() ? "" : " or ") + name;
  }
  if (serve.empty())
    error_at(error_, FLERR, at_law_, "Fix inelastic: law {} names no solver that serves it",
             settings_.law_words);
  if (given_.count("solver") == 0) settings_.solver = serve.front();
  if (std::find(serve.begin(), serve.end(), settings_.solver) == serve.end())
    error_at(error_, FLERR, at_law_, "Fix inelastic: law {} needs solver {}, not {}",
             settings_.law_words, names, settings_.solver);
}

void Reader::read_max_iterations(const char *value)
{
  settings_.max_iterations = utils::bnumeric(FLERR, value, false, lmp_);
  if (settings_.max_iterations < 1)
    error_at(error_, FLERR, at_ - 1, "Fix inelastic maxiter must be at least 1, not {}", value);
  if (at_ < narg_ && strcmp(arg_[at_], "warn") == 0) {
    settings_.warn_only = true;
    ++at_;
  }
}

void Reader::read_frozen(const char *group_id)
{
  const int frozen_group = lmp_->group->find(group_id);
  if (frozen_group < 0)
    error_at(error_, FLERR, at_ - 1, "Fix inelastic frozen group {} does not exist", group_id);
  settings_.frozen_group = group_id;
  settings_.frozen_bit = lmp_->group->bitmask[frozen_group];
}

void Reader::read_record(const char *file)
{
  if (at_ + 2 > narg_ || strcmp(arg_[at_], "every") != 0)
    error_at(error_, FLERR, at_ - 1, "Fix inelastic record needs: record FILE every N");
  settings_.record_file = file;
  settings_.record_every = utils::inumeric(FLERR, arg_[at_ + 1], false, lmp_);
  if (settings_.record_every < 1)
    error_at(error_, FLERR, at_ + 1, "Fix inelastic record every must be at least 1, not {}",
             settings_.record_every);
  if (settings_.record_file.find('*') == std::string::npos)
    error_at(error_, FLERR, at_ - 1,
             "Fix inelastic record file {} must contain a *, which becomes the step",
             settings_.record_file);
  at_ += 2;
}

}    // namespace

double Inelastic_NS::read_tolerance(LAMMPS *lmp, const char *text, int argument)
{
  const double tolerance = utils::numeric(FLERR, text, false, lmp);
  if (!(tolerance > 0.0) || std::isinf(tolerance))
    error_at(lmp->error, FLERR, argument,
             "Fix inelastic tolerance must be a length greater than 0, not {}", text);
  return tolerance;
}

double Inelastic_NS::read_accuracy(LAMMPS *lmp, const char *text, int argument)
{
  const double accuracy = utils::numeric(FLERR, text, false, lmp);
  if (!(accuracy > 0.0 && accuracy <= 1.0))
    error_at(lmp->error, FLERR, argument,
             "Fix inelastic accuracy must be greater than 0 and at most 1, not {}", text);
  return accuracy;
}

Settings Inelastic_NS::read_settings(LAMMPS *lmp, int narg, char **arg, int group_bit)
{
  if (narg < 4) utils::missing_cmd_args(FLERR, "fix inelastic", lmp->error);
  Settings settings;
  settings.group_bit = group_bit;
  settings.tolerance = read_tolerance(lmp, arg[3], 3);
  Reader(lmp, narg, arg, settings).read_keywords();
  return settings;
}
