#pragma once

#include <libxml/tree.h>

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "hdf5_file.hpp"

namespace meshsmooth::formats {

/// An XML element; it lives as long as its `XdmfData`.
class XmlElement {
 public:
  explicit XmlElement(const xmlNode* node) : node_(node) {}
  [[nodiscard]] std::string name() const;
  /// Empty where there is no such attribute.
  [[nodiscard]] std::string attribute(const char* name) const;
  /// Without white space around it.
  [[nodiscard]] std::string content() const;
  [[nodiscard]] std::vector<XmlElement> children() const;
  [[nodiscard]] std::vector<XmlElement> children(const std::string& name) const;
  /// Whether both are the same place in the text.
  [[nodiscard]] bool operator==(const XmlElement& other) const = default;

 private:
  const xmlNode* node_;
};

/// Without white space before and behind, line ends among it.
[[nodiscard]] std::string_view without_space(std::string_view text);

/// Where the ':' of "FILE:/PATH" or "FILE.h5:PATH" stands; npos: there is none.
[[nodiscard]] std::size_t find_hdf5_separator(std::string_view text);

/// The text of an XDMF file and the HDF5 files with its numbers. Every call throws `Error` that
/// names the file: FORMAT_ERROR, FILE_TRUNCATED, FILE_NOT_FOUND.
class XdmfData {
 public:
  XdmfData(std::filesystem::path path, const std::string& text);

  [[nodiscard]] XmlElement root() const;
  /// The element's one <DataItem>, or the one to which it refers.
  [[nodiscard]] XmlElement item_of(const XmlElement& parent) const;
  /// All of them, at least one.
  [[nodiscard]] std::vector<XmlElement> items_of(const XmlElement& parent) const;
  /// What the XPath of a Reference or an <xi:include> leads to, in this file.
  [[nodiscard]] std::vector<XmlElement> find(const std::string& xpath) const;
  /// The element itself, or the one to which its attribute Reference leads.
  [[nodiscard]] XmlElement resolved(const XmlElement& element) const;
  /// Where the numbers of a <DataItem> begin in the text that was given.
  [[nodiscard]] std::size_t offset_of(const XmlElement& item, std::string_view text);
  /// Throws unless there are as many numbers as the <DataItem> says.
  void check_size(const XmlElement& item, std::size_t count) const;

  /// "mesh.h5:/path" in two; the file is empty where the numbers stand in the text.
  struct Reference {
    std::string file;
    std::string dataset;
  };
  [[nodiscard]] Reference reference(const XmlElement& item) const;
  [[nodiscard]] std::vector<double> reals(const XmlElement& item);
  [[nodiscard]] std::vector<std::int64_t> integers(const XmlElement& item);
  [[nodiscard]] bool is_whole(const XmlElement& item);
  [[nodiscard]] const Hdf5File& hdf5(const std::string& file);
  [[nodiscard]] const std::string& bytes(const std::string& file);

  [[noreturn]] void fail(const std::string& what) const;

 private:
  void find_offsets(std::string_view text);
  void check_item(const XmlElement& item, const XmlElement& parent) const;

  struct Open {
    std::string bytes;
    std::unique_ptr<Hdf5File> file;
  };
  Open& open(const std::string& file);
  template <class T>
  std::vector<T> numbers_in_text(const XmlElement& item) const;

  std::filesystem::path path_;
  std::unique_ptr<xmlDoc, decltype(&xmlFreeDoc)> document_;
  std::map<std::string, Open> files_;
  std::vector<std::pair<XmlElement, std::size_t>> offsets_;  // of all <DataItem>, once asked for
};

}  // namespace meshsmooth::formats
