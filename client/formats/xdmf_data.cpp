#include "xdmf_data.hpp"

#include <libxml/parser.h>

#include <algorithm>
#include <cctype>
#include <limits>
#include <string_view>
#include <utility>

#include "text.hpp"

namespace meshsmooth::formats {
namespace {

std::string take(xmlChar* text) {
  const std::unique_ptr<xmlChar, void (*)(void*)> owner(text, xmlFree);
  return text == nullptr ? std::string() : std::string(reinterpret_cast<const char*>(text));
}

std::string trimmed(const std::string& text) {
  constexpr const char* kBlank = " \t\r\n";
  const std::size_t first = text.find_first_not_of(kBlank);
  if (first == std::string::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlank) - first + 1);
}

xmlDoc* parse(const std::filesystem::path& path, const std::string& text) {
  if (text.size() > static_cast<std::size_t>(std::numeric_limits<int>::max())) {
    fail("FORMAT_ERROR", path, "the XML is larger than 2 GiB; numbers belong into an HDF5 file");
  }
  // Entities are not needed, and would let a small file become a large one.
  if (text.find("<!ENTITY") != std::string::npos) {
    fail("FORMAT_ERROR", path, "XML entities are not supported");
  }
  xmlDoc* document =
      xmlReadMemory(text.data(), static_cast<int>(text.size()), "", nullptr,
                    XML_PARSE_NONET | XML_PARSE_NOERROR | XML_PARSE_NOWARNING | XML_PARSE_HUGE);
  if (document != nullptr) return document;
  const auto* error = xmlGetLastError();
  std::string what = error == nullptr || error->message == nullptr ? "unknown" : error->message;
  what.erase(what.find_last_not_of("\r\n") + 1);
  const bool truncated = error != nullptr && (error->code == XML_ERR_DOCUMENT_END ||
                                              error->code == XML_ERR_TAG_NOT_FINISHED ||
                                              error->code == XML_ERR_DOCUMENT_EMPTY);
  fail(truncated ? "FILE_TRUNCATED" : "FORMAT_ERROR", path,
       "line " + std::to_string(error == nullptr ? 0 : error->line) + ": XML: " + what);
}

}  // namespace

std::string XmlElement::name() const { return reinterpret_cast<const char*>(node_->name); }

std::string XmlElement::attribute(const char* name) const {
  return take(xmlGetNoNsProp(const_cast<xmlNode*>(node_), reinterpret_cast<const xmlChar*>(name)));
}

std::string XmlElement::content() const {
  return trimmed(take(xmlNodeGetContent(const_cast<xmlNode*>(node_))));
}

std::vector<XmlElement> XmlElement::children() const {
  std::vector<XmlElement> found;
  for (const xmlNode* child = node_->children; child != nullptr; child = child->next) {
    if (child->type == XML_ELEMENT_NODE) found.emplace_back(child);
  }
  return found;
}

std::vector<XmlElement> XmlElement::children(const std::string& name) const {
  std::vector<XmlElement> found = children();
  std::erase_if(found, [&](const XmlElement& child) { return child.name() != name; });
  return found;
}

XdmfData::XdmfData(std::filesystem::path path, const std::string& text)
    : path_(std::move(path)), document_(parse(path_, text), xmlFreeDoc) {}

void XdmfData::fail(const std::string& what) const { formats::fail("FORMAT_ERROR", path_, what); }

XmlElement XdmfData::root() const {
  const xmlNode* root = xmlDocGetRootElement(document_.get());
  if (root == nullptr || XmlElement(root).name() != "Xdmf") fail("there is no <Xdmf> in it");
  return XmlElement(root);
}

XmlElement XdmfData::item_of(const XmlElement& parent) const {
  const std::vector<XmlElement> items = parent.children("DataItem");
  if (items.size() != 1) fail("<" + parent.name() + "> has not one <DataItem>");
  const std::string type = items.front().attribute("ItemType");
  if ((!type.empty() && type != "Uniform") || !items.front().attribute("Reference").empty()) {
    fail("the <DataItem> of <" + parent.name() + "> does not hold the numbers itself");
  }
  return items.front();
}

XdmfData::Reference XdmfData::reference(const XmlElement& item) const {
  const std::string format = item.attribute("Format");
  const auto is = [&](std::string_view name) {  // as VTK compares it
    return std::ranges::equal(format, name, {}, [](unsigned char c) { return std::toupper(c); });
  };
  if (format.empty() || is("XML")) return {};
  if (!is("HDF")) fail("a <DataItem> has the format \"" + format + "\"; HDF and XML can be read");
  const std::string content = item.content();
  const std::size_t end = content.rfind(":/");
  if (end == std::string::npos || end == 0) {
    fail("\"" + content + "\" names no dataset in an HDF5 file: expected FILE:/PATH");
  }
  return {content.substr(0, end), content.substr(end + 1)};
}

XdmfData::Open& XdmfData::open(const std::string& file) {
  Open& entry = files_[file];
  if (entry.file) return entry;
  const std::filesystem::path path = path_.parent_path() / file;
  std::error_code error;
  if (!std::filesystem::exists(path, error)) {
    formats::fail("FILE_NOT_FOUND", path_, "its HDF5 file \"" + file + "\" is not there");
  }
  entry.bytes = read_bytes(path);
  entry.file = std::make_unique<Hdf5File>(path, entry.bytes);
  return entry;
}

const Hdf5File& XdmfData::hdf5(const std::string& file) { return *open(file).file; }
const std::string& XdmfData::bytes(const std::string& file) { return open(file).bytes; }

template <class T>
std::vector<T> XdmfData::numbers_in_text(const XmlElement& item) const {
  const std::string text = item.content();
  Scanner scanner(path_, text);
  std::vector<T> numbers;
  while (!scanner.at_end()) numbers.push_back(scanner.number<T>());
  return numbers;
}

std::vector<double> XdmfData::reals(const XmlElement& item) {
  const Reference where = reference(item);
  return where.file.empty() ? numbers_in_text<double>(item) : hdf5(where.file).reals(where.dataset);
}

std::vector<std::int64_t> XdmfData::integers(const XmlElement& item) {
  const Reference where = reference(item);
  return where.file.empty() ? numbers_in_text<std::int64_t>(item)
                            : hdf5(where.file).integers(where.dataset);
}

bool XdmfData::is_whole(const XmlElement& item) {
  const Reference where = reference(item);
  if (!where.file.empty()) return hdf5(where.file).is_whole(where.dataset);
  const std::string type = item.attribute("NumberType") + item.attribute("DataType");
  return type == "Int" || type == "UInt" || type == "Char" || type == "UChar";
}

}  // namespace meshsmooth::formats
