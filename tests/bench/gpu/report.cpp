#include "gpu/report.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <ostream>
#include <stdexcept>

namespace meshsmooth::bench {
namespace {

void write_string(std::ostream& out, const std::string& text) {
  out << '"';
  for (const char c : text) {
    if (c == '"' || c == '\\') {
      out << '\\' << c;
    } else if (static_cast<unsigned char>(c) < 0x20) {
      std::array<char, 8> code{};
      std::snprintf(code.data(), code.size(), "\\u%04x", static_cast<unsigned>(c));
      out << code.data();
    } else {
      out << c;
    }
  }
  out << '"';
}

void new_line(std::ostream& out, int indent) {
  out << '\n' << std::string(static_cast<std::size_t>(indent), ' ');
}

struct Writer {
  std::ostream& out;
  int indent;

  void operator()(std::monostate) const { out << "null"; }
  void operator()(bool value) const { out << (value ? "true" : "false"); }
  void operator()(std::int64_t value) const { out << value; }
  void operator()(double value) const {
    std::array<char, 32> text{};
    std::snprintf(text.data(), text.size(), "%.9g", value);
    out << (std::isfinite(value) ? text.data() : "null");
  }
  void operator()(const std::string& value) const { write_string(out, value); }
  void operator()(const Json::Array& values) const {
    out << '[';
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (i > 0) out << ',';
      new_line(out, indent + 1);
      values[i].write(out, indent + 1);
    }
    if (!values.empty()) new_line(out, indent);
    out << ']';
  }
  void operator()(const Json::Object& members) const {
    out << '{';
    for (std::size_t i = 0; i < members.size(); ++i) {
      if (i > 0) out << ',';
      new_line(out, indent + 1);
      write_string(out, members[i].first);
      out << ": ";
      members[i].second.write(out, indent + 1);
    }
    if (!members.empty()) new_line(out, indent);
    out << '}';
  }
};

}  // namespace

Json& Json::set(std::string key, Json value) {
  if (std::holds_alternative<std::monostate>(value_)) value_ = Object{};
  std::get<Object>(value_).emplace_back(std::move(key), std::move(value));
  return *this;
}

Json& Json::push(Json value) {
  if (std::holds_alternative<std::monostate>(value_)) value_ = Array{};
  std::get<Array>(value_).push_back(std::move(value));
  return *this;
}

void Json::write(std::ostream& out, int indent) const { std::visit(Writer{out, indent}, value_); }

void write_json(const std::filesystem::path& file, const Json& json) {
  if (file.empty()) return;
  std::ofstream out(file);
  json.write(out);
  out << '\n';
  if (!out.flush()) throw std::runtime_error(file.string() + ": cannot be written");
}

void Table::print(std::ostream& out) const {
  std::vector<std::size_t> widths;
  for (const auto& row : rows_) {
    widths.resize(std::max(widths.size(), row.size()));
    for (std::size_t c = 0; c < row.size(); ++c) widths[c] = std::max(widths[c], row[c].size());
  }
  for (std::size_t r = 0; r < rows_.size(); ++r) {
    std::string line;
    for (std::size_t c = 0; c < rows_[r].size(); ++c) {
      const std::string pad(widths[c] - rows_[r][c].size(), ' ');
      line += (c > 0 ? "  " : "") + (c == 0 ? rows_[r][c] + pad : pad + rows_[r][c]);
    }
    out << line << '\n';
    if (r > 0) continue;
    for (std::size_t c = 0; c < widths.size(); ++c) {
      out << (c > 0 ? "  " : "") << std::string(widths[c], '-');
    }
    out << '\n';
  }
  out << std::flush;
}

std::string number(double value) {
  if (!std::isfinite(value)) return "-";
  const double size = std::fabs(value);
  std::array<char, 40> text{};
  if (size != 0 && size < 1e-3) {
    std::snprintf(text.data(), text.size(), "%.3g", value);
  } else {
    const int before = size < 1 ? 0 : static_cast<int>(std::floor(std::log10(size))) + 1;
    std::snprintf(text.data(), text.size(), "%.*f", std::max(0, 4 - before), value);
  }
  return text.data();
}

std::string ratio(double value) {
  return std::isfinite(value) ? number(value) + "x" : std::string("-");
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace meshsmooth::bench
