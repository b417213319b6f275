// A writer of NumPy's .npz files: zip archives (PKWARE's APPNOTE.TXT) of uncompressed,
// little-endian .npy members (numpy.lib.format, version 1.0). An archive must stay below 4 GB.

#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace inelastic {

class NpzWriter {
 public:
  // Adds an array of shape (n,) if `columns` is 0, and of shape (n / columns, columns) otherwise.
  void add(const std::string &name, const std::vector<double> &values, std::size_t columns = 0);
  void add(const std::string &name, const std::vector<std::int64_t> &values);
  // Adds an array of shape ().
  void add(const std::string &name, double value);

  // Writes the archive under a temporary name and renames it, so that a file that exists is whole.
  // Returns false if the file cannot be written; errno then tells the cause.
  bool write(const std::string &path) const;

 private:
  struct Member {
    std::string name;
    std::string bytes;
  };

  void add_member(const std::string &name, const std::string &type, const std::string &shape,
                  const void *data, std::size_t bytes);
  std::string archive() const;

  std::vector<Member> members_;
};

}    // namespace inelastic
