#include "cgns/adf_file.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cstring>
#include <set>
#include <utility>

#include "text.hpp"

namespace meshsmooth::formats {
namespace {

// A file is blocks of 4096 bytes; a pointer is the number of a block, in 8 bytes, and an offset in
// it, in 4. In version A all numbers but the data are hexadecimal text; in version B pointers and
// dimensions are binary, of the data's byte order. A node has a header of 246 bytes, a table of its
// children, and its data in one chunk or in several with a table of them.

constexpr std::uint64_t kBlockSize = 4096;
constexpr std::uint64_t kTagSize = 4;
constexpr std::uint64_t kPointerSize = 12;
constexpr std::uint64_t kNameSize = 32;
constexpr std::string_view kName = "ADF Database Version ";  // after four bytes
constexpr std::uint64_t kMostDimensions = 12;
constexpr std::size_t kLongestPath = 4096;
constexpr std::uint64_t kChunkHead = kTagSize + kPointerSize;

std::string without_padding(std::string_view text) {
  text = text.substr(0, text.find('\0'));
  const std::size_t last = text.find_last_not_of(' ');
  return std::string(text.substr(0, last == std::string_view::npos ? 0 : last + 1));
}

template <class T>
std::array<char, sizeof(T)> in_order(T value, bool swapped) {
  auto bytes = std::bit_cast<std::array<char, sizeof(T)>>(value);
  if (swapped) std::ranges::reverse(bytes);
  return bytes;
}

}  // namespace

bool is_adf(std::string_view bytes) {
  return bytes.size() >= kNameSize && bytes.substr(kTagSize, kNameSize).starts_with(kName);
}

AdfFile::AdfFile(std::filesystem::path path, std::string bytes)
    : path_(std::move(path)), bytes_(std::move(bytes)) {
  read_header();
  read_tree();
}

void AdfFile::fail(const std::string& what) const { formats::fail("FORMAT_ERROR", path_, what); }

std::string_view AdfFile::at(std::uint64_t begin, std::uint64_t count) const {
  if (begin > bytes_.size() || count > bytes_.size() - begin) {
    formats::fail("FILE_TRUNCATED", path_,
                  "the ADF file refers to byte " + std::to_string(begin) + ", it has only " +
                      std::to_string(bytes_.size()));
  }
  return std::string_view(bytes_).substr(begin, count);
}

std::uint64_t AdfFile::hexadecimal(std::uint64_t begin, std::uint64_t digits) const {
  const std::string_view text = at(begin, digits);
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, 16);
  if (error != std::errc() || end != text.data() + text.size()) {
    fail("byte " + std::to_string(begin) + " of the ADF file: expected a hexadecimal number");
  }
  return value;
}

std::uint64_t AdfFile::number(std::uint64_t begin, std::uint64_t width) const {
  if (!binary_) return hexadecimal(begin, width);
  std::string digits(at(begin, width));
  if (!swapped_) std::ranges::reverse(digits);
  std::uint64_t value = 0;
  for (const char digit : digits) value = value << 8U | static_cast<unsigned char>(digit);
  return value;
}

std::uint64_t AdfFile::pointer(std::uint64_t begin) const {
  const std::uint64_t block = number(begin, 8);
  const std::uint64_t most = bytes_.size() / kBlockSize;
  return std::min(block, most + 1) * kBlockSize + number(begin + 8, 4);
}

void AdfFile::check_tag(std::uint64_t begin, std::string_view tag) const {
  if (at(begin, tag.size()) == tag) return;
  fail("byte " + std::to_string(begin) + " of the ADF file: expected the tag \"" +
       std::string(tag) + "\"");
}

void AdfFile::read_header() {
  constexpr std::uint64_t kFormat = 100;
  constexpr std::uint64_t kRoot = 134;
  check_tag(32, "AdF0");
  const char version = at(kTagSize + kName.size(), 1).front();
  if (version != 'A' && version != 'B') {
    fail("the ADF file is of the version " + std::string(1, version) +
         "; A and B can be read: convert it with cgnsconvert or adf2hdf");
  }
  binary_ = version == 'B';
  const char format = at(kFormat, 1).front();
  if (format != 'B' && format != 'L') {
    fail("the ADF file has numbers in the format \"" + std::string(1, format) +
         "\"; only IEEE's can be read: convert it with cgnsconvert or adf2hdf");
  }
  swapped_ = format == 'B';
  check_tag(kRoot - kTagSize, "AdF4");
  root_ = pointer(kRoot);
  (void)at(pointer(kRoot + kPointerSize), 1);  // its last byte
}

void AdfFile::read_tree() {
  std::set<std::uint64_t> seen;
  std::vector<std::pair<std::string, std::uint64_t>> left = {{"", root_}};
  while (!left.empty()) {
    const auto [path, begin] = std::move(left.back());
    left.pop_back();
    if (path.size() > kLongestPath) fail("the ADF nodes are nested too deep");
    if (!seen.insert(begin).second) fail("the node \"" + path + "\" has two parents");
    Node& node = nodes_[path];
    for (auto& [name, child] : read_node(begin, node)) left.emplace_back(path + "/" + name, child);
  }
}

std::map<std::string, std::uint64_t> AdfFile::read_node(std::uint64_t begin, Node& node) {
  check_tag(begin, "NoDe");
  std::uint64_t field = begin + kTagSize + kNameSize;
  const auto take = [&](std::uint64_t size) { return std::exchange(field, field + size); };
  node.label = without_padding(at(take(kNameSize), kNameSize));
  const std::uint64_t child_count = hexadecimal(take(8), 8);
  (void)take(8);  // entries in the table, used or not
  const std::uint64_t table = take(kPointerSize);
  node.type = without_padding(at(take(kNameSize), kNameSize));
  const std::uint64_t dimensions = hexadecimal(take(2), 2);
  if (dimensions > kMostDimensions) fail("an ADF node has more than 12 dimensions");
  for (std::uint64_t index = 0; index < kMostDimensions; ++index) {
    const std::uint64_t size = take(8);
    if (index < dimensions) node.shape.push_back(number(size, 8));
  }
  node.chunk_count = hexadecimal(take(4), 4);
  const std::uint64_t chunks = take(kPointerSize);
  if (node.chunk_count != 0) node.chunks = pointer(chunks);
  check_tag(take(kTagSize), "TaiL");

  std::map<std::string, std::uint64_t> children;
  if (child_count == 0) return children;
  std::uint64_t entry = pointer(table);
  check_tag(entry, "SNTb");
  entry += kChunkHead;
  for (std::uint64_t index = 0; index < child_count; ++index) {
    std::string name = without_padding(at(entry, kNameSize));
    if (!children.emplace(name, pointer(entry + kNameSize)).second) {
      fail("two ADF nodes are called \"" + name + "\"");
    }
    node.children.push_back(std::move(name));
    entry += kNameSize + kPointerSize;
  }
  return children;
}

const AdfFile::Node* AdfFile::find(const std::string& path) const {
  const auto found = nodes_.find(path == "/" ? "" : path);
  return found == nodes_.end() ? nullptr : &found->second;
}

const AdfFile::Node& AdfFile::existing(const std::string& path) const {
  const Node* node = find(path);
  if (node == nullptr) fail("there is no node \"" + path + "\"");
  return *node;
}

AdfFile::Range AdfFile::chunk_at(std::uint64_t begin) const {
  check_tag(begin, "DaTa");
  const std::uint64_t end = pointer(begin + kTagSize);
  if (end < begin + kChunkHead) fail("an ADF chunk ends before it begins");
  (void)at(begin, end - begin);
  return {begin + kChunkHead, end};
}

std::vector<std::uint64_t> AdfFile::places(const Node& node, const std::string& path,
                                           std::size_t width) const {
  std::uint64_t count = node.shape.empty() || node.chunk_count == 0 ? 0 : 1;
  for (const std::uint64_t size : node.shape) {
    if (size != 0 && count > bytes_.size() / size) count = bytes_.size() + 1;
    count *= size;
  }
  if (count > bytes_.size() / width) {
    fail("the node \"" + path + "\" has more values than the file can hold");
  }
  std::vector<std::uint64_t> places;
  places.reserve(count);
  const auto add = [&](const Range& chunk) {
    for (std::uint64_t place = chunk.begin; places.size() < count && place + width <= chunk.end;
         place += width) {
      places.push_back(place);
    }
  };
  if (node.chunk_count == 1) add(chunk_at(node.chunks));
  if (node.chunk_count > 1) {
    check_tag(node.chunks, "DCtb");
    for (std::uint64_t chunk = 0; chunk < node.chunk_count; ++chunk) {
      add(chunk_at(pointer(node.chunks + kChunkHead + 2 * chunk * kPointerSize)));
    }
  }
  if (places.size() != count) {
    fail("the node \"" + path + "\" has " + std::to_string(places.size()) + " values instead of " +
         std::to_string(count));
  }
  return places;
}

template <class T>
T AdfFile::value(std::uint64_t begin) const {
  std::array<char, sizeof(T)> bytes{};
  std::memcpy(bytes.data(), bytes_.data() + begin, sizeof(T));
  if (swapped_) std::ranges::reverse(bytes);
  return std::bit_cast<T>(bytes);
}

std::vector<double> AdfFile::reals(const std::string& path) const {
  const Node& node = existing(path);
  std::vector<double> values;
  if (node.type == "R4") {
    for (const auto place : places(node, path, 4)) values.push_back(value<float>(place));
  } else if (node.type == "R8") {
    for (const auto place : places(node, path, 8)) values.push_back(value<double>(place));
  } else {
    fail("the node \"" + path + "\" holds the type \"" + node.type + "\", not numbers (R4, R8)");
  }
  return values;
}

std::vector<std::int64_t> AdfFile::integers(const std::string& path) const {
  const Node& node = existing(path);
  std::vector<std::int64_t> values;
  if (node.type == "I4" || node.type == "U4") {
    for (const auto place : places(node, path, 4)) values.push_back(value<std::int32_t>(place));
  } else if (node.type == "I8" || node.type == "U8") {
    for (const auto place : places(node, path, 8)) values.push_back(value<std::int64_t>(place));
  } else {
    fail("the node \"" + path + "\" holds the type \"" + node.type +
         "\", not whole numbers (I4, I8)");
  }
  return values;
}

std::string AdfFile::text(const std::string& path) const {
  const Node& node = existing(path);
  if (node.type != "C1" && node.type != "B1" && node.type != "LK") {
    fail("the node \"" + path + "\" holds the type \"" + node.type + "\", not text (C1)");
  }
  std::string text;
  for (const auto place : places(node, path, 1)) text += bytes_[place];
  return text;
}

void AdfFile::overwrite(const std::string& path, std::span<const double> values) {
  const Node& node = existing(path);
  const bool single = node.type == "R4";
  const std::vector<double> before = reals(path);
  const auto where = places(node, path, single ? 4 : 8);
  if (where.size() != values.size()) {
    fail("the node \"" + path + "\" is not of the size that was read");
  }
  for (std::size_t index = 0; index < values.size(); ++index) {
    if (before[index] == values[index]) continue;
    if (single) {
      const auto bytes = in_order(static_cast<float>(values[index]), swapped_);
      std::ranges::copy(bytes, bytes_.begin() + static_cast<std::ptrdiff_t>(where[index]));
    } else {
      const auto bytes = in_order(values[index], swapped_);
      std::ranges::copy(bytes, bytes_.begin() + static_cast<std::ptrdiff_t>(where[index]));
    }
  }
}

}  // namespace meshsmooth::formats
