#include "inelastic_cluster_pieces.h"

#include "atom.h"

#include <algorithm>
#include <array>

using namespace LAMMPS_NS;
using namespace Inelastic_NS;

ClusterPieces::ClusterPieces(LAMMPS *lmp, const Step &step, GhostExchange &ranks) :
    step_(step), clusters_(lmp, step, ranks)
{
}

void ClusterPieces::find()
{
  clusters_.find();
  const inelastic::ContactSet &contacts = step_.problem.contacts;
  std::vector<double> normals(Directions::SUMS * clusters_.size(), 0.0), none;
  for (std::size_t c = 0; c < contacts.size(); ++c) {
    const bool one = clusters_.is_mobile(contacts.first[c]);
    const bool other = clusters_.is_mobile(contacts.second[c]);
    if (contacts.impulse[c] == 0.0 || one == other) continue;
    const auto k =
        static_cast<std::size_t>(clusters_.of(one ? contacts.first[c] : contacts.second[c]));
    Directions::add(&contacts.normal[3 * c], &normals[Directions::SUMS * k]);
  }
  clusters_.over_ranks(Directions::SUMS, normals, 0, none);
  held_.assign(clusters_.size(), Directions{});
  for (std::size_t k = 0; k < held_.size(); ++k)
    held_[k].span_range(&normals[Directions::SUMS * k]);
}

std::vector<double> Inelastic_NS::common_velocities(const Atom *atom, const Clusters &clusters,
                                                    const std::vector<Directions> &held,
                                                    const std::vector<double> &velocity,
                                                    const std::vector<char> &marked)
{
  enum { MASS, MOMENTUM, SUMS = MOMENTUM + 3 };
  std::vector<double> sums(SUMS * clusters.size(), 0.0), none(clusters.size(), 0.0);
  for (int i = 0; i < atom->nlocal; ++i) {
    if (!marked[i]) continue;
    double *const s = &sums[SUMS * static_cast<std::size_t>(clusters.of(i))];
    const double mass = mass_of(atom, i);
    s[MASS] += mass;
    for (int d = 0; d < 3; ++d)
      s[MOMENTUM + d] += mass * velocity[3 * static_cast<std::size_t>(i) + d];
  }
  clusters.over_ranks(SUMS, sums, 1, none);
  std::vector<double> common(3 * marked.size(), 0.0);
  for (std::size_t i = 0; i < marked.size(); ++i) {
    if (!marked[i]) continue;
    const auto k = static_cast<std::size_t>(clusters.of(static_cast<int>(i)));
    const double *const s = &sums[SUMS * k];
    const std::array<double, 3> mean = {s[MOMENTUM] / s[MASS], s[MOMENTUM + 1] / s[MASS],
                                        s[MOMENTUM + 2] / s[MASS]};
    const std::array<double, 3> of_cluster = held[k].without(mean);
    std::copy_n(of_cluster.begin(), 3, &common[3 * i]);
  }
  return common;
}
