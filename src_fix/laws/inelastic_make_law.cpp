#include "inelastic_make_law.h"

#include "inelastic_gluey.h"
#include "inelastic_restitution.h"

namespace inelastic {

namespace {

  std::unique_ptr<ContactLaw> make_inelastic(const std::vector<std::string> &words,
                                             std::string &error)
  {
    if (!words.empty()) error = "inelastic, without any other word";
    return nullptr;
  }

  // The laws of this folder, one line each, then those that plugins have added.
  std::vector<NamedLaw> &laws()
  {
    static std::vector<NamedLaw> all = {
        {"inelastic", &make_inelastic},
        {"gluey", &make_gluey},
        {"restitution", &make_restitution},
    };
    return all;
  }

}    // namespace

std::string add_law(const std::string &name, MakeLaw make)
{
  static const std::size_t own = laws().size();
  for (std::size_t k = 0; k < laws().size(); ++k) {
    if (laws()[k].name != name) continue;
    if (k < own) return "a contact law of fix inelastic has the name " + name + " already";
    laws()[k].make = make;    // its file was loaded again
    return "";
  }
  laws().push_back({name, make});
  return "";
}

const NamedLaw *find_law(const std::string &name)
{
  for (const NamedLaw &law : laws())
    if (law.name == name) return &law;
  return nullptr;
}

std::string names_of_laws()
{
  std::string names;
  const std::vector<NamedLaw> &all = laws();
  for (std::size_t k = 0; k < all.size(); ++k)
    names += (k == 0 ? "" : k + 1 == all.size() ? " or " : ", ") + all[k].name;
  return names;
}

}    // namespace inelastic
