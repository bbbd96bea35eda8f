#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace meshsmooth::formats {

/// Whether the bytes are of a file in ADF, "Advanced Data Format", the container of CGNS before
/// HDF5.
[[nodiscard]] bool is_adf(std::string_view bytes);

/// The tree of nodes of an ADF file, read from its bytes, as "ADF File Format" of the CGNS
/// documentation describes it. Every call throws `Error` that names the file and the node:
/// FILE_TRUNCATED, FORMAT_ERROR.
class AdfFile {
 public:
  /// `path` is for messages only. O(nodes).
  AdfFile(std::filesystem::path path, std::string bytes);

  struct Node {
    std::string label;
    std::string type;                   // "R8", "LK" of a link
    std::vector<std::size_t> shape;     // empty: it has no data
    std::vector<std::string> children;  // names, in the file's order
    std::uint64_t chunks = 0;           // where its data or their table are
    std::uint64_t chunk_count = 0;
  };
  /// By its path, "/Base/Zone"; null: there is no such node.
  [[nodiscard]] const Node* find(const std::string& path) const;

  [[nodiscard]] std::vector<double> reals(const std::string& node) const;
  [[nodiscard]] std::vector<std::int64_t> integers(const std::string& node) const;
  [[nodiscard]] std::string text(const std::string& node) const;
  /// Replaces the numbers of a node in its own type; those that stay the same keep their bytes.
  void overwrite(const std::string& node, std::span<const double> values);
  [[nodiscard]] const std::string& bytes() const { return bytes_; }

  [[noreturn]] void fail(const std::string& what) const;

 private:
  /// A part of the bytes.
  struct Range {
    std::uint64_t begin;
    std::uint64_t end;
  };

  [[nodiscard]] std::string_view at(std::uint64_t begin, std::uint64_t count) const;
  [[nodiscard]] std::uint64_t hexadecimal(std::uint64_t begin, std::uint64_t digits) const;
  [[nodiscard]] std::uint64_t number(std::uint64_t begin, std::uint64_t width) const;
  [[nodiscard]] std::uint64_t pointer(std::uint64_t begin) const;
  void check_tag(std::uint64_t begin, std::string_view tag) const;
  void read_header();
  void read_tree();
  [[nodiscard]] std::map<std::string, std::uint64_t> read_node(std::uint64_t begin, Node& node);
  [[nodiscard]] const Node& existing(const std::string& path) const;
  [[nodiscard]] Range chunk_at(std::uint64_t begin) const;
  /// Where each value of a node begins.
  [[nodiscard]] std::vector<std::uint64_t> places(const Node& node, const std::string& path,
                                                  std::size_t width) const;
  template <class T>
  [[nodiscard]] T value(std::uint64_t begin) const;

  std::filesystem::path path_;
  std::string bytes_;
  bool swapped_ = false;  // big-endian
  bool binary_ = false;   // pointers and dimensions
  std::uint64_t root_ = 0;
  std::map<std::string, Node> nodes_;
};

}  // namespace meshsmooth::formats
