// Writes arrays as NumPy's .npz: a zip archive of .npy members, uncompressed, little-endian.

#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace inelastic {

class NpzWriter {
 public:
  // `columns` = 0 gives shape (n,), otherwise (n / columns, columns). Below 4 GB in all.
  void add(const std::string &name, const std::vector<double> &values, std::size_t columns = 0);
  void add(const std::string &name, const std::vector<std::int64_t> &values);
  void add(const std::string &name, double value);    // shape ()

  // Writes under a temporary name and renames, so that a file that exists is whole. False when the
  // file cannot be written (errno tells why).
  bool write(const std::string &path) const;

 private:
  struct Member {
    std::string name;
    std::string bytes;
  };
  void add_member(const std::string &name, const std::string &type, const std::string &shape,
                  const void *data, std::size_t bytes);
  std::vector<Member> members_;
};

}    // namespace inelastic
