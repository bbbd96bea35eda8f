#include "operation.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <nlohmann/json.hpp>

#include "problem.hpp"

namespace meshsmooth::gateway {
namespace {

using nlohmann::json;

bool is_letter_or_digit(char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0; }

/// The gateway's own, and what says the form of its answer.
constexpr std::array<std::string_view, 2> kOwn = {"to", "partial"};

std::string_view without_folders(std::string_view name) {
  return name.substr(name.find_last_of("/\\") + 1);  // npos + 1 is 0
}

/// The extension and what is before it; "" and the name where there is none.
std::pair<std::string_view, std::string_view> split(std::string_view name) {
  const std::size_t dot = name.rfind('.');
  if (dot == std::string_view::npos) return {name, {}};
  const std::string_view extension = name.substr(dot + 1);
  constexpr std::size_t kLongest = 8;
  const bool safe = !extension.empty() && extension.size() <= kLongest &&
                    std::ranges::all_of(extension, is_letter_or_digit);
  if (!safe) return {name, {}};
  return {name.substr(0, dot), name.substr(dot)};
}

std::string in_lower_case(std::string_view text) {
  std::string lower(text);
  std::ranges::transform(lower, lower.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return lower;
}

}  // namespace

std::map<std::string, Operation> read_operations() {
  std::map<std::string, Operation> operations;
  const json document = json::parse(openapi_document);
  for (const auto& [path, methods] : document.at("paths").items()) {
    if (!methods.contains("post")) continue;
    const json& post = methods.at("post");
    Operation operation;
    operation.name = post.at("operationId");
    for (const json& parameter : post.at("parameters")) {
      if (parameter.at("in") == "query") operation.parameters.insert(parameter.at("name"));
      if (parameter.at("name") == "Prefer") operation.can_be_job = true;
    }
    const json& form = post.at("requestBody").at("content").at("multipart/form-data");
    for (const auto& [part, schema] : form.at("schema").at("properties").items()) {
      operation.parts.insert(part);
    }
    operations.emplace(path, std::move(operation));
  }
  return operations;
}

std::map<std::string, std::set<std::string>> read_paths() {
  std::map<std::string, std::set<std::string>> paths;
  const json document = json::parse(openapi_document);
  for (const auto& [path, methods] : document.at("paths").items()) {
    for (const auto& [method, operation] : methods.items()) {
      std::string name = method;
      std::ranges::transform(name, name.begin(),
                             [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
      paths[path].insert(name);
      if (name == "GET") paths[path].insert("HEAD");
    }
  }
  return paths;
}

std::string value_of(const Parameters& parameters, const std::string& name) {
  const auto [first, last] = parameters.equal_range(name);
  if (first == last) return {};
  if (std::next(first) != last) {
    throw Problem("OPTION_MISPLACED", name + " is given twice", {{"field", name}});
  }
  return first->second;
}

std::vector<std::string> to_flags(const Operation& operation, const Parameters& parameters) {
  std::vector<std::string> flags;
  bool second = false;  // of a pair
  for (const auto& [name, value] : parameters) {
    if (!operation.parameters.contains(name)) {
      throw Problem("OPTION_MISPLACED",
                    "there is no parameter " + name + " of " + operation.name +
                        "; /openapi.json lists those that there are",
                    {{"field", name}});
    }
    if (std::ranges::find(kOwn, name) != kOwn.end()) continue;
    if (value.find('\0') != std::string::npos) {
      throw Problem("OPTION_OUT_OF_RANGE", name + " contains a NUL", {{"field", name}});
    }
    // Two values of one flag are two arguments, the second without a name before it.
    if (name == "periodic" && second && value.starts_with('-')) {
      throw Problem("OPTION_OUT_OF_RANGE", "periodic: the second name begins with a dash",
                    {{"field", name}});
    }
    flags.push_back(name == "periodic" && second ? value : "--" + name + "=" + value);
    second = name == "periodic" && !second;
  }
  if (parameters.count("periodic") % 2 != 0) {
    throw Problem("OPTION_MISPLACED", "periodic needs the names of two sides",
                  {{"field", "periodic"}});
  }
  return flags;
}

std::string safe_extension(std::string_view name) {
  auto [stem, extension] = split(without_folders(name));
  if (in_lower_case(extension) != ".gz") return in_lower_case(extension);
  return in_lower_case(split(stem).second) + ".gz";
}

std::string result_name(std::string_view name, const std::string& operation,
                        const std::string& extension) {
  std::string_view stem = split(without_folders(name)).first;
  if (in_lower_case(split(without_folders(name)).second) == ".gz") stem = split(stem).first;
  std::string safe;
  for (const char c : stem.substr(0, 80)) {
    safe += is_letter_or_digit(c) || c == '-' || c == '_' || c == '.' ? c : '_';
  }
  return (safe.empty() ? "mesh" : safe) + "-" + operation + extension;
}

}  // namespace meshsmooth::gateway
