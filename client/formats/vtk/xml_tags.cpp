#include "vtk/xml_tags.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "text.hpp"

namespace meshsmooth::formats {
namespace {

constexpr std::string_view kBlanks = " \t\r\n";

}  // namespace

std::string_view XmlTag::operator[](std::string_view attribute) const {
  const auto found = std::ranges::find(attributes, attribute, &Attribute::name);
  return found == attributes.end() ? std::string_view() : found->value;
}

std::optional<XmlTag> XmlTags::next() {
  do {
    position_ = std::min(file_.find('<', position_), file_.size());
    if (position_ == file_.size()) return std::nullopt;
  } while (skip_markup());
  ++position_;
  XmlTag tag;
  tag.closes = file_.substr(position_).starts_with('/');
  tag.opens = !tag.closes;
  if (tag.closes) ++position_;
  tag.name = read_name();
  if (tag.name.empty()) refuse("expected the name of an element after \"<\"");
  while (true) {
    skip_space();
    if (position_ >= file_.size()) truncated();
    if (file_[position_] == '>') break;
    if (file_.substr(position_).starts_with("/>")) {
      tag.closes = true;
      ++position_;
      break;
    }
    tag.attributes.push_back(read_attribute());
  }
  tag.end = ++position_;
  return tag;
}

/// Whether there was something at this place that is not a tag.
bool XmlTags::skip_markup() {
  static constexpr auto kPairs = std::to_array<std::pair<std::string_view, std::string_view>>(
      {{"<!--", "-->"}, {"<![CDATA[", "]]>"}, {"<?", "?>"}, {"<!", ">"}});
  for (const auto& [begin, end] : kPairs) {
    if (!file_.substr(position_).starts_with(begin)) continue;
    const std::size_t close = file_.find(end, position_ + begin.size());
    if (close == std::string_view::npos) truncated();
    position_ = close + end.size();
    return true;
  }
  return false;
}

void XmlTags::skip_space() {
  position_ = std::min(file_.find_first_not_of(kBlanks, position_), file_.size());
}

std::string_view XmlTags::read_name() {
  const std::size_t begin = position_;
  position_ = std::min(file_.find_first_of(" \t\r\n=/<>\"'", begin), file_.size());
  return file_.substr(begin, position_ - begin);
}

XmlTag::Attribute XmlTags::read_attribute() {
  XmlTag::Attribute attribute;
  attribute.name = read_name();
  skip_space();
  if (position_ >= file_.size()) truncated();
  if (attribute.name.empty() || file_[position_] != '=') refuse("expected an attribute in a tag");
  ++position_;
  skip_space();
  if (position_ >= file_.size()) truncated();
  const char quote = file_[position_];
  if (quote != '"' && quote != '\'') refuse("expected the value of an attribute in quotes");
  const std::size_t close = file_.find(quote, position_ + 1);
  if (close == std::string_view::npos) truncated();
  attribute.value = file_.substr(position_ + 1, close - position_ - 1);
  position_ = close + 1;
  return attribute;
}

void XmlTags::refuse(const std::string& what) const {
  fail("FORMAT_ERROR", path_, where() + ": " + what);
}

void XmlTags::truncated() const {
  fail("FILE_TRUNCATED", path_, where() + ": the file ends too early");
}

std::string XmlTags::where() const {
  const std::string_view before = file_.substr(0, position_);
  return "line " + std::to_string(std::ranges::count(before, '\n') + 1);
}

}  // namespace meshsmooth::formats
