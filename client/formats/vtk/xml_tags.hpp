#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "vtk/layout.hpp"

namespace meshsmooth::formats {

/// A tag of an XML file: "<Piece NumberOfPoints='8'>", "</Piece>".
struct XmlTag {
  struct Attribute {
    std::string_view name;
    std::string_view value;
  };

  std::string_view name;
  bool opens = false;  // both for "<Points/>"
  bool closes = false;
  std::vector<Attribute> attributes;
  std::size_t end = 0;  // in the file, behind it

  /// Empty: it has none of the name.
  [[nodiscard]] std::string_view operator[](std::string_view attribute) const;
};

/// Walks from tag to tag, over comments, processing instructions and CDATA.
class XmlTags {
 public:
  XmlTags(const std::filesystem::path& path, std::string_view file) : path_(path), file_(file) {}

  /// None at the end of the file. Throws FILE_TRUNCATED, FORMAT_ERROR.
  [[nodiscard]] std::optional<XmlTag> next();
  /// Throws FORMAT_ERROR with the line at which the walk is.
  [[noreturn]] void refuse(const std::string& what) const;

 private:
  [[nodiscard]] bool skip_markup();
  void skip_space();
  [[nodiscard]] std::string_view read_name();
  [[nodiscard]] XmlTag::Attribute read_attribute();
  [[noreturn]] void truncated() const;
  [[nodiscard]] std::string where() const;

  const std::filesystem::path& path_;
  std::string_view file_;
  std::size_t position_ = 0;
};

}  // namespace meshsmooth::formats
