// The laws by their names.

#pragma once

#include "inelastic_contact_law.h"

namespace inelastic {

struct NamedLaw {
  std::string name;
  MakeLaw make;
};

// Adds a law, or replaces one that was added before. Returns what is wrong where the name is that
// of a law of this folder; otherwise an empty text.
std::string add_law(const std::string &name, MakeLaw make);

// Returns the law with this name, or nullptr.
const NamedLaw *find_law(const std::string &name);

// Returns the names of all laws, as a sentence lists them.
std::string names_of_laws();

}    // namespace inelastic
