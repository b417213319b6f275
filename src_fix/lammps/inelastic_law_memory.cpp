#include "inelastic_law_memory.h"

#include "inelastic_vector3.h"

#include <algorithm>

using namespace LAMMPS_NS;
using namespace Inelastic_NS;

double LawEntry::along(const double *other_normal) const
{ return inelastic::dot(normal.data(), other_normal); }

double *LawEntry::pack(double *out) const
{
  *out++ = static_cast<double>(partner);
  out = std::copy(normal.begin(), normal.end(), out);
  *out++ = demand.parts ? 1.0 : 0.0;
  *out++ = demand.parting_speed;
  *out++ = demand.set.idle();
  *out++ = impulse;
  *out++ = speed;
  return std::copy(remembered.begin(), remembered.end(), out);
}

const double *LawEntry::unpack(const double *in)
{
  partner = static_cast<tagint>(*in++);
  for (double &component : normal) component = *in++;
  demand.parts = *in++ != 0.0;
  demand.parting_speed = *in++;
  demand.set = inelastic::AdmissibleSet<double>::above(*in++);
  impulse = *in++;
  speed = *in++;
  for (double &value : remembered) value = *in++;
  return in;
}

void LawMemory::resize(int atoms)
{
  ContactMemory::resize(atoms);
  owner_.resize(atoms, 0);
  sent_.resize(atoms, 0);
}

void LawMemory::forget(int atom)
{
  ContactMemory::forget(atom);
  sent_[atom] = 0;
}

void LawMemory::copy(int from, int to)
{
  ContactMemory::copy(from, to);
  owner_[to] = owner_[from];
}

bool LawMemory::remembers_wall(int atom) const
{
  return std::any_of(entries_[atom].begin(), entries_[atom].end(), [](const LawEntry &entry) {
    return entry.partner < 0;
  });
}

void LawMemory::rename_partners(int atom, const std::unordered_map<tagint, tagint> &id_now)
{
  std::vector<LawEntry> known;
  for (LawEntry entry : entries_[atom]) {
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
  buffer[0] = static_cast<double>(owner_[atom]);
  return 1 + ContactMemory::pack(atom, begin, end, buffer + 1);
}

int LawMemory::unpack(int atom, const double *buffer)
{
  owner_[atom] = static_cast<tagint>(buffer[0]);
  return 1 + ContactMemory::unpack(atom, buffer + 1);
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
