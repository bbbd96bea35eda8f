#include "fixed_nodes.hpp"

#include <fmt/format.h>

#include <charconv>
#include <sstream>
#include <string_view>

#include "meshsmooth/error.hpp"
#include "text.hpp"

namespace meshsmooth::cli {
namespace {

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kBlank = " \t\r";
  const std::size_t first = text.find_first_not_of(kBlank);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlank) - first + 1);
}

[[noreturn]] void fail(const std::string& name, std::size_t line, const std::string& what) {
  throw InvalidOption("FIXED_NODES_INVALID", fmt::format("{}:{}: {}", name, line, what),
                      {{"path", name}, {"line", std::to_string(line)}});
}

}  // namespace

std::vector<NodeId> read_fixed_nodes(std::istream& stream, const std::string& name,
                                     std::size_t node_count) {
  std::vector<NodeId> nodes;
  std::string line;
  for (std::size_t number = 1; std::getline(stream, line); ++number) {
    const std::string_view text = trimmed(std::string_view(line).substr(0, line.find('#')));
    if (text.empty()) continue;
    std::int64_t node = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), node);
    if (error != std::errc{} || end != text.data() + text.size()) {
      fail(name, number, fmt::format("\"{}\" is not a node id; write one a line", text));
    }
    if (node < 0 || node >= static_cast<std::int64_t>(node_count)) {
      fail(name, number,
           fmt::format("node {} is not in the mesh; its nodes count from 0 to {}", node,
                       static_cast<std::int64_t>(node_count) - 1));
    }
    nodes.push_back(static_cast<NodeId>(node));
  }
  return nodes;
}

std::vector<NodeId> read_fixed_nodes(const std::filesystem::path& path, std::size_t node_count) {
  std::istringstream stream(formats::read_bytes(path));
  return read_fixed_nodes(stream, path.string(), node_count);
}

void mark_fixed(std::vector<std::uint8_t>& mask, const std::vector<NodeId>& nodes,
                std::size_t node_count) {
  if (nodes.empty()) return;
  mask.resize(node_count, 0);
  for (const NodeId node : nodes) mask[static_cast<std::size_t>(node)] = 1;
}

}  // namespace meshsmooth::cli
