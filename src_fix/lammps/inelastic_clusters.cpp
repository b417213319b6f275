#include "inelastic_clusters.h"

#include "inelastic_ghost_exchange.h"

#include "atom.h"
#include "comm.h"

#include <algorithm>
#include <numeric>
#include <unordered_map>

using namespace LAMMPS_NS;
using namespace Inelastic_NS;

Clusters::Clusters(LAMMPS *lmp, const Step &step, GhostExchange &ranks) :
    Pointers(lmp), step_(step), ranks_(ranks)
{
}

int Clusters::root(int i)
{
  while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
  return i;
}

void Clusters::join(int i, int j)
{
  const int a = root(i), b = root(j);
  parent_[std::max(a, b)] = std::min(a, b);
}

// Connects the particles whose contacts this rank sees.
void Clusters::join_local()
{
  const inelastic::ContactProblem &problem = step_.problem;
  parent_.resize(problem.particles);
  std::iota(parent_.begin(), parent_.end(), 0);
  const inelastic::RigidBodies &bodies = problem.bodies;
  for (std::size_t b = 0; b < bodies.size(); ++b)
    for (int k = bodies.start[b] + 1; k < bodies.start[b + 1]; ++k)
      join(bodies.member[bodies.start[b]], bodies.member[k]);
  for (std::size_t c = 0; c < problem.contacts.size(); ++c) {
    const int i = problem.contacts.first[c], j = problem.contacts.second[c];
    if (problem.contacts.impulse[c] != 0.0 && is_mobile(i) && is_mobile(j)) join(i, j);
  }
}

// Two numbers per particle: the label, then minus one where another rank, or an image, has a part
// of the cluster. Both fall to the least value that any of the cluster's particles has, round by
// round, in which a ghost and its owned atom agree, and then what is connected on a rank.
void Clusters::agree_on_labels(std::vector<double> &labels)
{
  const int count = step_.problem.particles;
  const auto least_of_roots = [&] {
    bool changed = false;
    for (int pass = 0; pass < 2; ++pass)
      for (int i = 0; i < count; ++i) {
        double *const own = &labels[2 * static_cast<std::size_t>(i)];
        double *const of_root = &labels[2 * static_cast<std::size_t>(root(i))];
        for (int k = 0; k < 2; ++k) {
          double &from = pass == 0 ? own[k] : of_root[k], &to = pass == 0 ? of_root[k] : own[k];
          if (!(from < to)) continue;
          to = from;
          changed = true;
        }
      }
    return changed;
  };
  least_of_roots();
  if (!ranks_.has_ghosts()) return;
  double changed = 1.0;
  while (changed > 0.0) {
    ranks_.least_over_ghosts(labels.data(), 2);
    changed = least_of_roots() ? 1.0 : 0.0;
    ranks_.reduce(nullptr, 0, &changed, 1);
  }
}

void Clusters::find()
{
  const int count = step_.problem.particles;
  join_local();
  std::vector<double> labels(2 * static_cast<std::size_t>(count), 0.0);
  for (int i = 0; i < count; ++i) {
    labels[2 * static_cast<std::size_t>(i)] = static_cast<double>(atom->tag[i]);
    const bool connected = parent_[i] != i;
    if (connected && (i >= atom->nlocal || root(i) >= atom->nlocal))
      labels[2 * static_cast<std::size_t>(i) + 1] = -1.0;
  }
  // What holds a particle from outside, a frozen one, may be on another rank than its own.
  const inelastic::ContactSet &contacts = step_.problem.contacts;
  for (std::size_t c = 0; c < contacts.size(); ++c)
    for (const int i : {contacts.first[c], contacts.second[c]})
      if (contacts.impulse[c] != 0.0 && is_mobile(i) && i >= atom->nlocal)
        labels[2 * static_cast<std::size_t>(i) + 1] = -1.0;
  agree_on_labels(labels);

  label_.clear();
  shared_.clear();
  cluster_.assign(step_.problem.slots(), NONE);
  std::unordered_map<double, int> known;
  for (int i = 0; i < count; ++i) {
    if (!is_mobile(i)) continue;
    const double label = labels[2 * static_cast<std::size_t>(i)];
    const auto [found, is_new] = known.emplace(label, static_cast<int>(label_.size()));
    if (is_new) {
      label_.push_back(label);
      shared_.push_back(0);
    }
    cluster_[i] = found->second;
    if (labels[2 * static_cast<std::size_t>(i) + 1] < 0.0) shared_[found->second] = 1;
  }
}

void Clusters::over_ranks(int number_of_sums, std::vector<double> &sums, int number_of_maxima,
                          std::vector<double> &maxima) const
{
  if (comm->nprocs == 1) return;
  const auto of_sums = static_cast<std::size_t>(number_of_sums);
  const auto of_maxima = static_cast<std::size_t>(number_of_maxima);
  std::vector<double> mine;
  for (std::size_t k = 0; k < label_.size(); ++k) {
    if (!shared_[k]) continue;
    mine.push_back(label_[k]);
    const double *const s = sums.data() + of_sums * k, *const m = maxima.data() + of_maxima * k;
    mine.insert(mine.end(), s, s + of_sums);
    mine.insert(mine.end(), m, m + of_maxima);
  }
  const std::vector<double> all = ranks_.gather_on_all(mine);
  std::unordered_map<double, std::size_t> place;
  for (std::size_t k = 0; k < label_.size(); ++k)
    if (shared_[k]) {
      place.emplace(label_[k], k);
      std::fill_n(sums.data() + of_sums * k, of_sums, 0.0);
    }
  const std::size_t row = 1 + of_sums + of_maxima;
  for (std::size_t at = 0; at < all.size(); at += row) {
    const auto found = place.find(all[at]);
    if (found == place.end()) continue;
    const double *const more = all.data() + at + 1;
    for (std::size_t s = 0; s < of_sums; ++s) sums[of_sums * found->second + s] += more[s];
    for (std::size_t m = 0; m < of_maxima; ++m) {
      double &most = maxima[of_maxima * found->second + m];
      most = std::max(most, more[of_sums + m]);
    }
  }
}
