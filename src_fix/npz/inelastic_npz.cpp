#include "inelastic_npz.h"

#include <array>
#include <cerrno>
#include <cstdio>
#include <utility>

namespace inelastic {

namespace {

  // Returns the checksum of zip archives (ISO 3309): polynomial 0x04C11DB7 with reflected bits.
  std::uint32_t crc32(const std::string &bytes)
  {
    static const std::array<std::uint32_t, 256> table = [] {
      std::array<std::uint32_t, 256> built{};
      for (std::uint32_t n = 0; n < 256; ++n) {
        std::uint32_t value = n;
        for (int bit = 0; bit < 8; ++bit)
          value = value & 1 ? 0xEDB88320U ^ (value >> 1) : value >> 1;
        built[n] = value;
      }
      return built;
    }();
    std::uint32_t crc = 0xFFFFFFFFU;
    for (const char byte : bytes)
      crc = table[(crc ^ static_cast<unsigned char>(byte)) & 0xFF] ^ (crc >> 8);
    return crc ^ 0xFFFFFFFFU;
  }

  // Appends so many bytes of a number, the least first.
  void append(std::string &out, std::uint32_t value, int bytes)
  {
    for (int k = 0; k < bytes; ++k) out.push_back(static_cast<char>(value >> (8 * k) & 0xFF));
  }

}    // namespace

void NpzWriter::add_member(const std::string &name, const std::string &type,
                           const std::string &shape, const void *data, std::size_t bytes)
{
  std::string header =
      "{'descr': '" + type + "', 'fortran_order': False, 'shape': " + shape + ", }";
  // Magic, version, length of the header, and the header fill a multiple of 64 bytes.
  constexpr std::size_t PREFIX = 10;
  header.append(63 - (PREFIX + header.size()) % 64, ' ');
  header.push_back('\n');
  std::string member("\x93NUMPY\x01\x00", 8);
  append(member, static_cast<std::uint32_t>(header.size()), 2);
  member += header;
  member.append(static_cast<const char *>(data), bytes);
  members_.push_back({name + ".npy", std::move(member)});
}

void NpzWriter::add(const std::string &name, const std::vector<double> &values, std::size_t columns)
{
  const std::string shape = columns == 0
      ? "(" + std::to_string(values.size()) + ",)"
      : "(" + std::to_string(values.size() / columns) + ", " + std::to_string(columns) + ")";
  add_member(name, "<f8", shape, values.data(), values.size() * sizeof(double));
}

void NpzWriter::add(const std::string &name, const std::vector<std::int64_t> &values)
{
  add_member(name, "<i8", "(" + std::to_string(values.size()) + ",)", values.data(),
             values.size() * sizeof(std::int64_t));
}

void NpzWriter::add(const std::string &name, double value)
{ add_member(name, "<f8", "()", &value, sizeof(double)); }

// Returns the zip archive of all members: each with its local header, then the directory.
std::string NpzWriter::archive() const
{
  std::string bytes, directory;
  for (const Member &member : members_) {
    const auto size = static_cast<std::uint32_t>(member.bytes.size());
    const auto offset = static_cast<std::uint32_t>(bytes.size());
    std::string common;         // the fields that the local and the central header share
    append(common, 20, 2);      // version of the format: 2.0
    append(common, 0, 2);       // flags
    append(common, 0, 2);       // method: stored
    append(common, 0, 2);       // time
    append(common, 0x21, 2);    // date: 1 January 1980, so that equal arrays give equal files
    append(common, crc32(member.bytes), 4);
    append(common, size, 4);    // compressed
    append(common, size, 4);    // uncompressed
    append(common, static_cast<std::uint32_t>(member.name.size()), 2);
    append(common, 0, 2);    // no extra field

    append(bytes, 0x04034b50, 4);
    bytes += common + member.name + member.bytes;

    append(directory, 0x02014b50, 4);
    append(directory, 20, 2);    // version that wrote it: 2.0
    directory += common;
    append(directory, 0, 2);    // no comment
    append(directory, 0, 2);    // first disk
    append(directory, 0, 2);    // binary
    append(directory, 0, 4);    // external attributes
    append(directory, offset, 4);
    directory += member.name;
  }
  const auto directory_offset = static_cast<std::uint32_t>(bytes.size());
  bytes += directory;
  append(bytes, 0x06054b50, 4);
  append(bytes, 0, 4);    // this disk, and that of the directory
  append(bytes, static_cast<std::uint32_t>(members_.size()), 2);    // on this disk
  append(bytes, static_cast<std::uint32_t>(members_.size()), 2);    // in all
  append(bytes, static_cast<std::uint32_t>(directory.size()), 4);
  append(bytes, directory_offset, 4);
  append(bytes, 0, 2);    // no comment
  return bytes;
}

bool NpzWriter::write(const std::string &path) const
{
  const std::string bytes = archive();
  const std::string temporary = path + ".part";
  FILE *file = std::fopen(temporary.c_str(), "wb");
  if (!file) return false;
  const bool written = std::fwrite(bytes.data(), 1, bytes.size(), file) == bytes.size();
  const bool closed = std::fclose(file) == 0;
  if (written && closed && std::rename(temporary.c_str(), path.c_str()) == 0) return true;
  const int cause = errno;
  std::remove(temporary.c_str());
  errno = cause;
  return false;
}

}    // namespace inelastic
