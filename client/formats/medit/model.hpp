#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "content.hpp"
#include "medit/keywords.hpp"

namespace meshsmooth::formats::medit {

/// The rows of a section of cells or of numbers of entities, which count from 1.
struct Section {
  const Keyword* keyword;
  std::vector<std::int64_t> numbers;  // of all rows, without references
  std::vector<double> references;     // of cells, by row
};

/// A Medit file as it was read, of text or binary.
struct Model {
  int dimension = 0;
  bool single_precision = false;
  bool has_vertices = false;
  bool has_end = false;
  CoordinateFields fields;
  std::vector<double> vertex_references;
  std::vector<Section> sections;  // in the file's order

  /// A vertex of which `found` says where its coordinates stand.
  void add_vertex(const std::array<CoordinateFields::Field, 3>& found,
                  const std::array<double, 3>& values);
};

/// Fills the data set, the ids, the sets and the fixed nodes. Throws FORMAT_ERROR where numbers
/// name what is not in the file, FILE_TRUNCATED where it has no end and vertices of no element.
void store(const std::filesystem::path& file, Model& model, FileContent& content);

/// Throws ELEMENT_NOT_SUPPORTED for a section that has `count` rows of a kind that is refused.
void check_supported(const std::filesystem::path& file, const Keyword& keyword, std::size_t count);

void read_text(const std::filesystem::path& file, std::string_view text, Model& model);
/// Whether the first bytes are those of a binary file.
[[nodiscard]] bool is_binary(std::string_view bytes);
void read_binary(const std::filesystem::path& file, std::string_view bytes, Model& model);

/// Throws FORMAT_ERROR that names the program whose mesh format this is, where it is known.
void refuse_foreign(const std::filesystem::path& file, std::string_view text);

/// A mesh of another format as a Medit file. `file_name` is for messages. Throws
/// ELEMENT_NOT_SUPPORTED.
[[nodiscard]] std::string make_text(const std::filesystem::path& file_name, const MeshFile& file);
[[nodiscard]] std::string make_binary(const std::filesystem::path& file_name, const MeshFile& file);

}  // namespace meshsmooth::formats::medit
