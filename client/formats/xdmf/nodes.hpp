#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "content.hpp"
#include "xdmf/cells.hpp"
#include "xdmf/data.hpp"

namespace meshsmooth::formats {

/// The nodes of all geometries of a file, and where their coordinates stand.
class XdmfNodeReader {
 public:
  XdmfNodeReader(XdmfData& data, const std::filesystem::path& path, FileContent& content)
      : data_(data), path_(path), content_(content) {}

  /// Those that were read already from the same numbers; none: there are none.
  [[nodiscard]] std::optional<XdmfNodes> find(const XmlElement& geometry);
  /// The coordinates, as they stand in the file.
  [[nodiscard]] std::vector<std::vector<double>> numbers(const XmlElement& geometry);
  [[nodiscard]] bool have(const XdmfNodes& nodes,
                          const std::vector<std::vector<double>>& numbers) const;
  /// New nodes, behind those so far.
  XdmfNodes add(const XmlElement& geometry, const std::vector<std::vector<double>>& numbers);
  /// The same nodes, which stand in the file once more.
  void add_copy(const XmlElement& geometry, const XdmfNodes& nodes,
                const std::vector<std::vector<double>>& numbers);
  /// Into the data set; to be called once.
  void store(PlainDataset& dataset);

 private:
  /// A geometry that was read.
  struct Known {
    std::vector<std::string> places;  // of its arrays
    XdmfNodes nodes;
    std::vector<std::vector<double>> numbers;  // empty of a copy
  };

  [[nodiscard]] std::vector<std::string> places_of(const XmlElement& geometry);
  Positions keep(const XmlElement& geometry, const XdmfNodes& nodes,
                 const std::vector<std::vector<double>>& numbers);
  void keep_fields(const XmlElement& item, const XdmfNodes& nodes, std::size_t dimension);
  void keep_companion(const std::string& file);

  XdmfData& data_;
  const std::filesystem::path& path_;
  FileContent& content_;
  std::vector<Known> known_;
  Positions positions_;
  std::int64_t count_ = 0;
  bool in_text_ = false;
};

/// The text with the positions of the mesh in place of those that stood in it.
[[nodiscard]] std::string replace_xdmf_coordinates(const std::filesystem::path& path,
                                                   const FileContent& content, const Mesh& mesh);

}  // namespace meshsmooth::formats
