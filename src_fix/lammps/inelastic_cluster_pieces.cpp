#include "inelastic_cluster_pieces.h"

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
