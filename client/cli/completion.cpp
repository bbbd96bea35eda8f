#include "completion.hpp"

namespace meshsmooth::cli {

std::string joined(const std::vector<std::string>& parts, const std::string& separator) {
  std::string text;
  for (const std::string& part : parts) text += (text.empty() ? "" : separator) + part;
  return text;
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  for (std::size_t at = text.find(from); at != std::string::npos;
       at = text.find(from, at + to.size())) {
    text.replace(at, from.size(), to);
  }
  return text;
}

std::string function_prefix(const Command& program) {
  return "_" + replaced(program.name, "-", "_");
}

std::string extension_pattern(const Argument& argument) {
  std::string pattern;
  for (const std::string& extension : argument.extensions) {
    pattern += (pattern.empty() ? "" : "|") + extension.substr(1);
  }
  return pattern;
}

}  // namespace meshsmooth::cli
