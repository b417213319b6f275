// A contact law of one's own, in a file of its own that is built as a LAMMPS plugin
// (docs/reference/laws.md).
//
//   INELASTIC_CONTACT_LAW("name", &make)
//
// makes `law name ...` known to fix inelastic when a deck loads the file with `plugin load`. `make`
// is a MakeLaw (inelastic_contact_law.h).

#pragma once

#include "inelastic_contact_law.h"

extern "C" {
// The plugin of fix inelastic has this function. `version` must be that of its own header;
// otherwise, and for a name that another law has, it ends LAMMPS with an error.
void inelastic_add_contact_law(void *lammps, int version, const char *name,
                               inelastic::MakeLaw make);
}

#define INELASTIC_CONTACT_LAW(NAME, MAKE)                                                        \
  extern "C" __attribute__((visibility("default"))) void lammpsplugin_init(void *lammps, void *, \
                                                                           void *)               \
  { inelastic_add_contact_law(lammps, inelastic::CONTACT_LAW_VERSION, NAME, MAKE); }
