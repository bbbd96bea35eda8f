#include "stl_facets.hpp"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <string>

#include "text.hpp"
#include "vtk/number_text.hpp"

namespace meshsmooth::formats {
namespace {

constexpr std::size_t kFacetBytes = 50;

bool is_word(std::string_view word, std::string_view keyword) {
  return std::ranges::equal(word, keyword, [](char a, char b) {
    return (a >= 'A' && a <= 'Z' ? static_cast<char>(a - 'A' + 'a') : a) == b;
  });
}

void expect(Scanner& scanner, std::string_view keyword) {
  if (const auto word = scanner.token(); !is_word(word, keyword)) scanner.refuse(keyword, word);
}

void read_vector(Scanner& scanner, StlFacet& facet, std::size_t vector) {
  for (std::size_t number = 3 * vector; number < 3 * vector + 3; ++number) {
    const std::string_view word = scanner.token();
    const auto value = parse_number(word, true);
    if (!value) scanner.refuse("a number", word);
    facet.set(number, word, static_cast<float>(*value));
  }
}

StlFacet read_text_facet(Scanner& scanner) {
  StlFacet facet;
  expect(scanner, "normal");
  read_vector(scanner, facet, 0);
  expect(scanner, "outer");
  expect(scanner, "loop");
  for (std::size_t vertex = 1; vertex <= 3; ++vertex) {
    expect(scanner, "vertex");
    read_vector(scanner, facet, vertex);
  }
  expect(scanner, "endloop");
  expect(scanner, "endfacet");
  return facet;
}

/// Visits the facets of all solids.
void for_each_text_facet(const std::filesystem::path& path, std::string_view text,
                         const StlFacetVisitor& visit) {
  Scanner scanner(path, text);
  bool in_solid = false;
  while (!scanner.at_end()) {
    const std::string_view word = scanner.token();
    if (is_word(word, "solid") || is_word(word, "endsolid")) {
      in_solid = is_word(word, "solid");
      scanner.line();  // with its name
    } else if (is_word(word, "color")) {
      scanner.line();
    } else if (is_word(word, "facet")) {
      visit(read_text_facet(scanner));
    } else {
      scanner.refuse("facet or endsolid", word);
    }
  }
  if (in_solid) fail("FILE_TRUNCATED", path, "there is no endsolid");
}

std::uint32_t facet_count(std::string_view bytes) {
  std::uint32_t count = 0;
  std::memcpy(&count, bytes.data() + kStlHeaderBytes, sizeof count);
  return count;
}

void check_binary(const std::filesystem::path& path, std::string_view bytes) {
  const std::size_t start = kStlHeaderBytes + sizeof(std::uint32_t);
  if (bytes.size() < start) fail("FORMAT_ERROR", path, "this is no STL file");
  const std::size_t count = facet_count(bytes);
  const std::size_t expected = start + kFacetBytes * count;
  if (bytes.size() < expected) {
    fail("FILE_TRUNCATED", path,
         "it should hold " + std::to_string(count) + " triangles, " + std::to_string(expected) +
             " bytes, but has " + std::to_string(bytes.size()));
  }
  constexpr std::size_t kMostBehind = 4096;
  const std::size_t behind = bytes.size() - expected;
  if (behind > kMostBehind) fail("FORMAT_ERROR", path, "this is no STL file");
  if (behind == 0 || behind % kFacetBytes != 0) return;
  fail("FORMAT_ERROR", path,
       "it announces " + std::to_string(count) + " triangles, but has room for " +
           std::to_string(count + behind / kFacetBytes));
}

}  // namespace

bool is_stl_text(std::string_view bytes) {
  const std::size_t first = std::min(bytes.find_first_not_of(" \t\r\n"), bytes.size());
  const std::string_view start = bytes.substr(first, 5);
  if (!is_word(start, "solid")) return false;
  // The header of a binary file may begin so, too.
  constexpr std::size_t kStart = kStlHeaderBytes + sizeof(std::uint32_t);
  if (bytes.size() >= kStart && bytes.size() == kStart + kFacetBytes * facet_count(bytes)) {
    return false;
  }
  return bytes.find("facet") != std::string_view::npos ||
         bytes.find("FACET") != std::string_view::npos;
}

void for_each_stl_facet(const std::filesystem::path& path, std::string_view bytes,
                        const StlFacetVisitor& visit) {
  if (is_stl_text(bytes)) return for_each_text_facet(path, bytes, visit);
  check_binary(path, bytes);
  for (std::size_t row = 0; row < facet_count(bytes); ++row) {
    const std::size_t begin = kStlHeaderBytes + sizeof(std::uint32_t) + row * kFacetBytes;
    StlFacet facet;
    for (std::size_t number = 0; number < facet.words.size(); ++number) {
      const std::string_view word = bytes.substr(begin + number * sizeof(float), sizeof(float));
      float value = 0;
      std::memcpy(&value, word.data(), sizeof value);
      facet.set(number, word, value);
    }
    visit(facet);
  }
}

}  // namespace meshsmooth::formats
