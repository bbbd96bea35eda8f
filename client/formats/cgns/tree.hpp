#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace meshsmooth::formats {

/// The tree of nodes of a CGNS file, in either of its containers, HDF5 and ADF. A node is named by
/// its path, "/Base/Zone"; it has a label, its type ("Zone_t"), and may have data. Links within the
/// file are followed. Every call throws `Error` that names the file and the node: FORMAT_ERROR,
/// FILE_TRUNCATED.
class CgnsTree {
 public:
  virtual ~CgnsTree() = default;

  /// Paths of the children of one label, in the file's order. Throws FORMAT_ERROR where one that
  /// may be of that label is in another file.
  [[nodiscard]] std::vector<std::string> children(const std::string& parent,
                                                  const std::string& label) const;
  /// Up to its NUL, without the blanks that pad it.
  [[nodiscard]] std::string text(const std::string& node) const;
  /// The first and the last.
  [[nodiscard]] std::pair<std::int64_t, std::int64_t> range(const std::string& node) const;

  [[nodiscard]] virtual bool exists(const std::string& node) const = 0;
  /// Whether it exists and has data.
  [[nodiscard]] virtual bool has_data(const std::string& node) const = 0;
  [[nodiscard]] virtual std::vector<std::int64_t> integers(const std::string& node) const = 0;
  [[nodiscard]] virtual std::vector<double> reals(const std::string& node) const = 0;
  [[nodiscard]] virtual bool is_single_precision(const std::string& node) const = 0;
  /// What `write_cgns` calls its data.
  [[nodiscard]] virtual std::string data_name(const std::string& node) const = 0;

  [[noreturn]] void fail(const std::string& what) const;

 protected:
  explicit CgnsTree(std::filesystem::path path) : path_(std::move(path)) {}

  struct Child {
    std::string path;
    std::string label;
    std::string other_file;  // that a link leads to; empty: it is in this one
  };
  [[nodiscard]] virtual std::vector<Child> list(const std::string& parent) const = 0;
  [[nodiscard]] virtual std::string characters(const std::string& node) const = 0;

 private:
  std::filesystem::path path_;
};

/// The last name of a path.
[[nodiscard]] std::string cgns_name(const std::string& node);

/// The tree of an HDF5 or ADF file with these bytes.
[[nodiscard]] std::unique_ptr<CgnsTree> open_cgns(const std::filesystem::path& path,
                                                  const std::string& bytes);

}  // namespace meshsmooth::formats
