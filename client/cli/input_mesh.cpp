#include "input_mesh.hpp"

#include <charconv>

namespace meshsmooth::cli {
namespace {

/// The value as an id below `count`, else -1.
std::int64_t to_id(const std::string& value, std::size_t count) {
  std::int64_t id = -1;
  const auto [end, error] = std::from_chars(value.data(), value.data() + value.size(), id);
  const bool whole = error == std::errc{} && end == value.data() + value.size();
  return whole && id >= 0 && id < static_cast<std::int64_t>(count) ? id : -1;
}

}  // namespace

std::string place_in_file(const ErrorDetails& details, const formats::MeshFile& file) {
  std::string place;
  for (const auto& [key, value] : details) {
    const bool element = key == "element";
    if (!element && key != "node") continue;
    const std::int64_t id =
        to_id(value, element ? file.mesh.element_count() : file.mesh.node_count());
    if (id < 0) continue;
    const std::int64_t file_id = element ? file.file_element_id(id) : file.file_node_id(id);
    if (file_id == id) continue;
    place += (place.empty() ? "" : ", ") + key + " " + std::to_string(file_id);
  }
  return place.empty() ? place : " (in the file: " + place + ")";
}

}  // namespace meshsmooth::cli
