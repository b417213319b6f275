#include "law_memory.h"

#include "vector3.h"

#include <algorithm>

using namespace LAMMPS_NS;

namespace {

constexpr double SAME_SIDE =
    0.1;    // the least cosine of the angle between two normals of one contact

}    // namespace

void LawMemory::resize(int atoms)
{
  entries_.resize(atoms);
  owner_.resize(atoms, 0);
  sent_.resize(atoms, 0);
}

void LawMemory::forget(int atom)
{
  entries_[atom].clear();
  sent_[atom] = 0;
}

const LawMemory::Entry *LawMemory::find(int atom, tagint partner, const double *normal) const
{
  const Entry *found = nullptr;
  double nearest = SAME_SIDE;
  for (const Entry &entry : entries_[atom]) {
    if (entry.partner != partner) continue;
    const double cosine = inelastic::dot(entry.normal.data(), normal);
    if (cosine <= nearest) continue;
    nearest = cosine;
    found = &entry;
  }
  return found;
}

bool LawMemory::remembers_wall(int atom) const
{
  return std::any_of(entries_[atom].begin(), entries_[atom].end(), [](const Entry &entry) {
    return entry.partner < 0;
  });
}

void LawMemory::rename_partners(int atom, const std::unordered_map<tagint, tagint> &id_now)
{
  std::vector<Entry> known;
  for (Entry entry : entries_[atom]) {
    if (entry.partner > 0) {
      const auto now = id_now.find(entry.partner);
      if (now == id_now.end()) continue;
      entry.partner = now->second;
    }
    known.push_back(entry);
  }
  entries_[atom] = std::move(known);
}

int LawMemory::pack(int atom, int begin, int end, double *buffer) const
{
  double *out = buffer;
  *out++ = static_cast<double>(owner_[atom]);
  *out++ = end - begin;
  for (int k = begin; k < end; ++k) {
    const Entry &entry = entries_[atom][k];
    *out++ = static_cast<double>(entry.partner);
    out = std::copy(entry.normal.begin(), entry.normal.end(), out);
    *out++ = entry.demand.parts ? 1.0 : 0.0;
    *out++ = entry.demand.parting_speed;
    *out++ = entry.demand.least_impulse;
    *out++ = entry.impulse;
    *out++ = entry.speed;
    out = std::copy(entry.remembered.begin(), entry.remembered.end(), out);
  }
  return static_cast<int>(out - buffer);
}

int LawMemory::pack(int atom, double *buffer) const
{ return pack(atom, 0, number_of_entries(atom), buffer); }

int LawMemory::unpack(int atom, const double *buffer)
{
  const double *in = buffer;
  owner_[atom] = static_cast<tagint>(*in++);
  const int count = static_cast<int>(*in++);
  for (int k = 0; k < count; ++k) {
    Entry entry;
    entry.partner = static_cast<tagint>(*in++);
    for (double &component : entry.normal) component = *in++;
    entry.demand.parts = *in++ != 0.0;
    entry.demand.parting_speed = *in++;
    entry.demand.least_impulse = *in++;
    entry.impulse = *in++;
    entry.speed = *in++;
    for (double &value : entry.remembered) value = *in++;
    remember(atom, entry);
  }
  return static_cast<int>(in - buffer);
}

int LawMemory::pack_unsent(int atom, double *buffer)
{
  const int begin = sent_[atom];
  sent_[atom] = std::min(begin + ENTRIES_PER_MESSAGE, number_of_entries(atom));
  return pack(atom, begin, sent_[atom], buffer);
}

long LawMemory::number_unsent(int begin, int end) const
{
  long unsent = 0;
  for (int i = begin; i < end; ++i) unsent += number_of_entries(i) - sent_[i];
  return unsent;
}
