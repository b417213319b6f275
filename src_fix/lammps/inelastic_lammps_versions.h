// What differs between the releases of LAMMPS for which these sources compile: errors that point to
// a word of the input and the arguments of `minimum_image` are of 2025, a description of a variable
// is of 2024. Beside it stand things that every release shows to its own classes alone.

#ifndef INELASTIC_LAMMPS_VERSIONS_H
#define INELASTIC_LAMMPS_VERSIONS_H

#include "domain.h"
#include "error.h"
#include "info.h"
#include "modify.h"

#include <cstdlib>
#include <string>
#include <type_traits>
#include <utility>

namespace LAMMPS_NS::Inelastic_NS {

// The places in the input to which an error may point beside the index of an argument: none, and
// not even the last line that was read. `points` tells whether this release takes them.
template <typename E, typename = void> struct PlaceOfError {
  static constexpr bool points = false;
  static constexpr int nowhere = 0, no_line = 0;
};
template <typename E>
struct PlaceOfError<E, std::void_t<decltype(E::NOPOINTER), decltype(E::NOLASTLINE)>> {
  static constexpr bool points = true;
  static constexpr int nowhere = E::NOPOINTER, no_line = E::NOLASTLINE;
};
constexpr int NO_WORD = PlaceOfError<Error>::nowhere;
constexpr int NO_LINE = PlaceOfError<Error>::no_line;

// Ends all ranks with an error that points to the place, where this release can. Call it with
// FLERR.
template <typename E, typename... Values>
[[noreturn]] void error_at(E *error, const char *file, int line, int place,
                           const std::string &format, Values &&...values)
{
  if constexpr (PlaceOfError<E>::points)
    error->all(file, line, place, format, std::forward<Values>(values)...);
  else
    error->all(file, line, format, std::forward<Values>(values)...);
  // Earlier headers do not say that the function never returns.
  std::abort();
}

template <typename D, typename = void> struct NearestImage {
  static void of(D *domain, double *vector) { domain->minimum_image(vector); }
};
template <typename D>
struct NearestImage<D,
                    std::void_t<decltype(std::declval<D>().minimum_image(
                        std::string(), 0, std::declval<double *>()))>> {
  static void of(D *domain, double *vector) { domain->minimum_image(__FILE__, __LINE__, vector); }
};

template <typename I, typename = void> struct Description {
  static std::string of_variable(I &, int) { return ""; }
};
template <typename I>
struct Description<I, std::void_t<decltype(std::declval<I>().get_variable_info(0))>> {
  static std::string of_variable(I &info, int variable) { return info.get_variable_info(variable); }
};

// Returns the text about a variable that `info variables` prints: its name, "style = ...," and
// behind "def =" its values. It is empty in releases that cannot tell.
inline std::string description_of_variable(LAMMPS *lmp, int variable)
{
  Info info(lmp);
  return Description<Info>::of_variable(info, variable);
}

// The ID and the style of the k-th fix that is not yet defined and for which a restart file holds
// numbers per atom. LAMMPS hides them in its class.
struct HiddenInModify : Modify {
  static const char *id(const Modify *modify, int k)
  { return (modify->*(&HiddenInModify::id_restart_peratom))[k]; }
  static const char *style(const Modify *modify, int k)
  { return (modify->*(&HiddenInModify::style_restart_peratom))[k]; }
};
inline const char *id_in_restart_file(const Modify *modify, int k)
{ return HiddenInModify::id(modify, k); }
inline const char *style_in_restart_file(const Modify *modify, int k)
{ return HiddenInModify::style(modify, k); }

}    // namespace LAMMPS_NS::Inelastic_NS

#endif
