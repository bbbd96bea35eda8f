#pragma once

#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <iosfwd>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace meshsmooth::bench {

/// A JSON value, for writing.
class Json {
 public:
  using Array = std::vector<Json>;
  using Object = std::vector<std::pair<std::string, Json>>;

  Json() = default;  // null
  Json(bool value) : value_(value) {}
  Json(double value) : value_(value) {}
  Json(std::int64_t value) : value_(value) {}
  Json(std::size_t value) : value_(static_cast<std::int64_t>(value)) {}
  Json(int value) : value_(std::int64_t{value}) {}
  Json(std::string value) : value_(std::move(value)) {}
  Json(const char* value) : value_(std::string(value)) {}
  Json(Array value) : value_(std::move(value)) {}
  Json(Object value) : value_(std::move(value)) {}

  /// Appends to an object; null becomes one.
  Json& set(std::string key, Json value);
  /// Appends to an array; null becomes one.
  Json& push(Json value);
  void write(std::ostream& out, int indent = 0) const;

 private:
  std::variant<std::monostate, bool, double, std::int64_t, std::string, Array, Object> value_;
};

/// Writes the file whole or throws; does nothing for an empty path.
void write_json(const std::filesystem::path& file, const Json& json);

/// A table of text; all columns but the first are aligned to the right.
class Table {
 public:
  explicit Table(std::vector<std::string> header) : rows_{std::move(header)} {}
  void add(std::vector<std::string> row) { rows_.push_back(std::move(row)); }
  void print(std::ostream& out) const;

 private:
  std::vector<std::vector<std::string>> rows_;
};

/// Four significant digits, no exponent for what is usual: "0.3981", "1259".
[[nodiscard]] std::string number(double value);
/// "33.1x"
[[nodiscard]] std::string ratio(double value);

/// The middle value; of an even number the upper one. `values` is not empty.
[[nodiscard]] double median(std::vector<double> values);

}  // namespace meshsmooth::bench
