#include "xdmf/data.hpp"

#include <libxml/parser.h>
#include <libxml/xpath.h>

#include <algorithm>
#include <cctype>
#include <limits>
#include <string_view>
#include <utility>

#include "self_contained.hpp"
#include "text.hpp"

namespace meshsmooth::formats {
namespace {

std::string take(xmlChar* text) {
  const std::unique_ptr<xmlChar, void (*)(void*)> owner(text, xmlFree);
  return text == nullptr ? std::string() : std::string(reinterpret_cast<const char*>(text));
}

xmlDoc* parse(const std::filesystem::path& path, const std::string& text) {
  if (text.size() > static_cast<std::size_t>(std::numeric_limits<int>::max())) {
    fail("FORMAT_ERROR", path, "the XML is larger than 2 GiB; store large arrays in HDF5");
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

std::string_view without_space(std::string_view text) {
  constexpr const char* kSpace = " \t\r\n";
  const std::size_t first = text.find_first_not_of(kSpace);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kSpace) - first + 1);
}

std::size_t find_hdf5_separator(std::string_view text) {
  if (const std::size_t end = text.rfind(":/"); end != std::string_view::npos) return end;
  for (const std::string_view extension : {".h5:", ".hdf5:", ".hdf:"}) {
    const std::size_t at = text.find(extension);
    if (at != std::string_view::npos) return at + extension.size() - 1;
  }
  return std::string_view::npos;
}

std::string XmlElement::name() const { return reinterpret_cast<const char*>(node_->name); }

std::string XmlElement::attribute(const char* name) const {
  return take(xmlGetNoNsProp(const_cast<xmlNode*>(node_), reinterpret_cast<const xmlChar*>(name)));
}

std::string XmlElement::content() const {
  return std::string(without_space(take(xmlNodeGetContent(const_cast<xmlNode*>(node_)))));
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

std::vector<XmlElement> XdmfData::find(const std::string& xpath) const {
  constexpr std::size_t kLongest = 4096;
  constexpr unsigned long kMostSteps = 1'000'000;
  std::vector<XmlElement> found;
  const std::unique_ptr<xmlXPathContext, decltype(&xmlXPathFreeContext)> context(
      xmlXPathNewContext(document_.get()), xmlXPathFreeContext);
  if (xpath.size() > kLongest || context == nullptr) return found;
  context->opLimit = kMostSteps;
  xmlSetStructuredErrorFunc(nullptr, [](void*, auto*) {});
  const std::unique_ptr<xmlXPathObject, decltype(&xmlXPathFreeObject)> result(
      xmlXPathEvalExpression(reinterpret_cast<const xmlChar*>(xpath.c_str()), context.get()),
      xmlXPathFreeObject);
  xmlSetStructuredErrorFunc(nullptr, nullptr);
  if (result == nullptr || result->type != XPATH_NODESET || result->nodesetval == nullptr) {
    return found;
  }
  for (int index = 0; index < result->nodesetval->nodeNr; ++index) {
    const xmlNode* node = result->nodesetval->nodeTab[index];
    if (node->type == XML_ELEMENT_NODE) found.emplace_back(node);
  }
  return found;
}

XmlElement XdmfData::resolved(const XmlElement& element) const {
  constexpr int kMostSteps = 16;
  XmlElement now = element;
  for (int step = 0; step < kMostSteps; ++step) {
    const std::string reference = now.attribute("Reference");
    if (reference.empty()) return now;
    const std::string xpath = reference == "XML" ? now.content() : reference;
    const std::vector<XmlElement> found = find(xpath);
    if (found.size() != 1 || found.front().name() != element.name()) {
      fail("the reference \"" + xpath + "\" does not lead to one <" + element.name() + ">");
    }
    now = found.front();
  }
  fail("the references of a <" + element.name() + "> lead from one to the next without an end");
}

void XdmfData::check_item(const XmlElement& item, const XmlElement& parent) const {
  const std::string type = item.attribute("ItemType");
  if (!type.empty() && type != "Uniform") {
    fail("the <DataItem> of <" + parent.name() + "> does not hold the numbers itself");
  }
}

std::vector<XmlElement> XdmfData::items_of(const XmlElement& parent) const {
  std::vector<XmlElement> items;
  for (const XmlElement& item : parent.children("DataItem")) {
    items.push_back(resolved(item));
    check_item(items.back(), parent);
  }
  if (items.empty()) fail("<" + parent.name() + "> has not one <DataItem>");
  return items;
}

XmlElement XdmfData::item_of(const XmlElement& parent) const {
  const std::vector<XmlElement> items = items_of(parent);
  if (items.size() != 1) fail("<" + parent.name() + "> has not one <DataItem>");
  return items.front();
}

std::size_t XdmfData::offset_of(const XmlElement& item, std::string_view text) {
  if (offsets_.empty()) find_offsets(text);
  const auto found = std::ranges::find(offsets_, item, &decltype(offsets_)::value_type::first);
  if (found == offsets_.end()) fail("a <DataItem> is not in the text as it is read");
  return found->second;
}

/// The elements stand in the text in the document's order.
void XdmfData::find_offsets(std::string_view text) {
  std::vector<XmlElement> items = find("//*[local-name()='DataItem']");
  std::ranges::reverse(items);
  const auto skip_to = [&](std::size_t from, std::string_view what) {
    const std::size_t at = text.find(what, from);
    return at == std::string_view::npos ? text.size() : at + what.size();
  };
  for (std::size_t at = text.find('<'); at < text.size(); at = text.find('<', at)) {
    const std::string_view rest = text.substr(at);
    if (rest.starts_with("<!--")) {
      at = skip_to(at, "-->");
    } else if (rest.starts_with("<![CDATA[")) {
      at = skip_to(at, "]]>");
    } else {
      const bool wanted = rest.starts_with("<DataItem") && rest.size() > 9 &&
                          std::isalnum(static_cast<unsigned char>(rest[9])) == 0;
      char quote = 0;  // '>' may stand in the value of an attribute
      for (++at; at < text.size() && (quote != 0 || text[at] != '>'); ++at) {
        if (quote == text[at]) {
          quote = 0;
        } else if (quote == 0 && (text[at] == '"' || text[at] == '\'')) {
          quote = text[at];
        }
      }
      if (!wanted || items.empty()) continue;
      offsets_.emplace_back(items.back(), std::min(at + 1, text.size()));
      items.pop_back();
    }
  }
}

void XdmfData::check_size(const XmlElement& item, std::size_t count) const {
  const std::string dimensions = item.attribute("Dimensions");
  if (dimensions.empty()) return;
  Scanner scanner(path_, dimensions);
  std::size_t expected = 1;
  while (!scanner.at_end()) {
    const std::size_t size = scanner.number<std::size_t>();
    if (size != 0 && expected > count / size + 1) expected = count + 1;
    expected *= size;
  }
  if (expected == count) return;
  fail("a <DataItem> with Dimensions=\"" + dimensions + "\" has " + std::to_string(count) +
       " numbers");
}

XdmfData::Reference XdmfData::reference(const XmlElement& item) const {
  const std::string format = item.attribute("Format");
  const auto is = [&](std::string_view name) {  // as VTK compares it
    return std::ranges::equal(format, name, {}, [](unsigned char c) { return std::toupper(c); });
  };
  if (format.empty() || is("XML")) return {};
  if (!is("HDF")) fail("a <DataItem> has the format \"" + format + "\"; HDF and XML can be read");
  const std::string content = item.content();
  const std::size_t end = find_hdf5_separator(content);
  if (end == std::string::npos || end == 0) {
    fail("\"" + content + "\" names no dataset in an HDF5 file: expected FILE:/PATH");
  }
  return {content.substr(0, end), content.substr(end + 1)};
}

XdmfData::Open& XdmfData::open(const std::string& file) {
  Open& entry = files_[file];
  if (entry.file) return entry;
  check_reference(path_, file);
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
