#pragma once

#include <libxml/tree.h>

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
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

 private:
  const xmlNode* node_;
};

/// The text of an XDMF file and the HDF5 files with its numbers. Every call throws `Error` that
/// names the file: FORMAT_ERROR, FILE_TRUNCATED, FILE_NOT_FOUND.
class XdmfData {
 public:
  XdmfData(std::filesystem::path path, const std::string& text);

  [[nodiscard]] XmlElement root() const;
  /// The element's one <DataItem>.
  [[nodiscard]] XmlElement item_of(const XmlElement& parent) const;

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
};

}  // namespace meshsmooth::formats
