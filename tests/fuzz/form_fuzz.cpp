// A body of multipart/form-data: read in any pieces it has the same parts, and they are what lies
// between its boundaries.
#include <string>
#include <vector>

#include "fuzz/choices.hpp"
#include "http/form.hpp"
#include "problem.hpp"

namespace {

using namespace meshsmooth::gateway;

struct Parts {
  std::vector<std::string> names, contents;
  bool is_complete = false, is_refused = false;

  bool operator==(const Parts&) const = default;
};

Parts read(const std::string& body, std::size_t piece) {
  Parts parts;
  FormReader form(
      "b",
      [&](const FormReader::Part& part) {
        parts.names.push_back(part.name + "\n" + part.file_name);
        parts.contents.emplace_back();
      },
      [&](std::string_view bytes) { parts.contents.back() += bytes; });
  try {
    for (std::size_t at = 0; at < body.size(); at += piece)
      form.read(std::string_view(body).substr(at, piece));
  } catch (const Problem&) {
    parts.is_refused = true;
  }
  parts.is_complete = form.is_complete();
  return parts;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::string body(reinterpret_cast<const char*>(data) + 1, size - 1);
  const Parts whole = read(body, body.size() + 1);
  const Parts pieces = read(body, data[0] % 16 + 1);
  meshsmooth::testing::require(whole == pieces, body);
  for (const std::string& content : whole.contents) {
    meshsmooth::testing::require(content.find("\r\n--b") == std::string::npos &&
                                     ("\r\n\r\n" + body).find(content) != std::string::npos,
                                 body);
  }
  return 0;
}
