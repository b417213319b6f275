// Tests the .npz writer: npz_test FOLDER. The program checks the bytes of members and what happens
// when a file cannot be written, and leaves files in FOLDER for test_npz.py to read with NumPy.
// Returns 1 when a check failed.

#include "inelastic_npz.h"

#include <cerrno>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <iostream>
#include <iterator>
#include <limits>
#include <string>
#include <vector>

#include <sys/resource.h>
#include <sys/stat.h>

using inelastic::NpzWriter;

namespace {

int failures = 0;

#define CHECK(condition)                                                               \
  do {                                                                                 \
    if (!(condition)) {                                                                \
      ++failures;                                                                      \
      std::cerr << "npz_test.cpp:" << __LINE__ << ": " << #condition << " is false\n"; \
    }                                                                                  \
  } while (false)

std::string contents(const std::string &path)
{
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

bool exists(const std::string &path)
{ return std::ifstream(path).good(); }

// Returns whether the archive has this member, with this type and shape and these bytes of data.
bool has_member(const std::string &archive, const std::string &name, const std::string &type,
                const std::string &shape, const std::string &data)
{
  const std::size_t start = archive.find(name + ".npy\x93NUMPY");    // local header, then data
  if (start == std::string::npos) return false;
  const std::size_t member = start + name.size() + 4;
  const std::size_t header_size = static_cast<unsigned char>(archive[member + 8]) +
      256 * static_cast<std::size_t>(static_cast<unsigned char>(archive[member + 9]));
  const std::string header = archive.substr(member + 10, header_size);
  return (10 + header_size) % 64 == 0 && header.back() == '\n' &&
      header.find("'descr': '" + type + "'") != std::string::npos &&
      header.find("'fortran_order': False") != std::string::npos &&
      header.find("'shape': " + shape) != std::string::npos &&
      archive.compare(member + 10 + header_size, data.size(), data) == 0;
}

template <typename Value> std::string bytes_of(const std::vector<Value> &values)
{
  std::string bytes(values.size() * sizeof(Value), '\0');
  if (!values.empty()) std::memcpy(&bytes[0], values.data(), bytes.size());
  return bytes;
}

void test_members(const std::string &folder)
{
  const std::string path = folder + "/members.npz";
  const std::vector<double> values = {1.0, -0.0, 1.0e300, 4.0, 5.0, 6.0};
  const std::vector<std::int64_t> indices = {-1, std::int64_t{1} << 40};
  NpzWriter writer;
  writer.add("values", values);
  writer.add("rows", values, 3);
  writer.add("indices", indices);
  writer.add("timestep", 0.005);
  writer.add("none", std::vector<double>());
  writer.add("no_rows", std::vector<double>(), 3);
  writer.add("no_indices", std::vector<std::int64_t>());
  CHECK(writer.write(path));
  const std::string archive = contents(path);
  CHECK(archive.rfind("PK\x03\x04", 0) == 0);
  CHECK(has_member(archive, "values", "<f8", "(6,)", bytes_of(values)));
  CHECK(has_member(archive, "rows", "<f8", "(2, 3)", bytes_of(values)));
  CHECK(has_member(archive, "indices", "<i8", "(2,)", bytes_of(indices)));
  CHECK(has_member(archive, "timestep", "<f8", "()", bytes_of(std::vector<double>{0.005})));
  CHECK(has_member(archive, "none", "<f8", "(0,)", ""));
  CHECK(has_member(archive, "no_rows", "<f8", "(0, 3)", ""));
  CHECK(has_member(archive, "no_indices", "<i8", "(0,)", ""));

  CHECK(writer.write(path));    // over itself
  CHECK(contents(path) == archive);
  CHECK(!exists(path + ".part"));
}

void test_no_members(const std::string &folder)
{
  const std::string path = folder + "/none.npz";
  CHECK(NpzWriter().write(path));
  CHECK(contents(path).size() == 22);    // the end record of an empty archive
}

// The arrays that test_npz.py expects.
NpzWriter writer_of_arrays()
{
  using Limits = std::numeric_limits<double>;
  std::vector<double> many;
  for (int k = 0; k < 3000; ++k) many.push_back((k - 1500) / 7.0);
  NpzWriter writer;
  writer.add("empty", std::vector<double>(), 3);
  writer.add("one", {1.0, 2.0, 3.0}, 3);
  writer.add("special",
             {Limits::quiet_NaN(), Limits::infinity(), -Limits::infinity(), -0.0,
              Limits::denorm_min(), Limits::max()},
             3);
  writer.add("many", many, 3);
  writer.add("a name of " + std::string(60, 'x'), std::vector<double>(6, 1.0), 3);
  return writer;
}

void test_equal_arrays_give_equal_files(const std::string &folder)
{
  for (const std::string name : {"/arrays.npz", "/again.npz"})
    CHECK(writer_of_arrays().write(folder + name));
  CHECK(contents(folder + "/arrays.npz") == contents(folder + "/again.npz"));
}

NpzWriter writer_of(const std::string &name, std::size_t rows)
{
  NpzWriter writer;
  writer.add(name, std::vector<double>(3 * rows, 1.0), 3);
  return writer;
}

// Whoever reads the old file goes on reading the old file.
void test_replaces_a_file_at_once(const std::string &folder)
{
  const std::string path = folder + "/replaced.npz";
  CHECK(writer_of("old", 5).write(path));
  const std::string before = contents(path);
  std::ifstream open_before(path, std::ios::binary);
  CHECK(writer_of("new", 5).write(path));
  CHECK(std::string(std::istreambuf_iterator<char>(open_before), {}) == before);
  CHECK(contents(path).find("new.npy") != std::string::npos);
  CHECK(contents(path).find("old.npy") == std::string::npos);
  CHECK(!exists(path + ".part"));
}

void test_places_that_are_no_files(const std::string &folder)
{
  errno = 0;
  CHECK(!writer_of("any", 1).write(folder + "/missing/some.npz"));
  CHECK(errno == ENOENT);

  const std::string path = folder + "/a folder";
  mkdir(path.c_str(), 0755);
  errno = 0;
  CHECK(!writer_of("any", 1).write(path));
  CHECK(errno == EISDIR);
  CHECK(!exists(path + ".part"));
}

// So few rows fail when the file is closed, and so many while it is written.
void test_no_space_left(const std::string &folder)
{
  for (const std::size_t rows : {10, 10000}) {
    const std::string path = folder + "/full.npz";
    CHECK(writer_of("old", 1).write(path));
    const std::string before = contents(path);
    std::signal(SIGXFSZ, SIG_IGN);
    rlimit limits;
    getrlimit(RLIMIT_FSIZE, &limits);
    const rlimit small = {100, limits.rlim_max};    // bytes, for every file
    setrlimit(RLIMIT_FSIZE, &small);
    errno = 0;
    const bool written = writer_of("new", rows).write(path);
    const int cause = errno;
    setrlimit(RLIMIT_FSIZE, &limits);
    CHECK(!written);
    CHECK(cause == EFBIG);
    CHECK(contents(path) == before);
    CHECK(!exists(path + ".part"));
  }
}

}    // namespace

int main(int count, char **arguments)
{
  if (count != 2) return 2;
  const std::string folder = arguments[1];
  test_members(folder);
  test_no_members(folder);
  test_equal_arrays_give_equal_files(folder);
  test_replaces_a_file_at_once(folder);
  test_places_that_are_no_files(folder);
  test_no_space_left(folder);
  if (failures > 0) std::cerr << failures << " checks failed\n";
  return failures > 0 ? 1 : 0;
}
