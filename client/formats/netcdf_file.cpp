#include "netcdf_file.hpp"

#include <netcdf.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <string_view>
#include <utility>

#include "text.hpp"

namespace meshsmooth::formats {
namespace {

/// Deflate makes 1032 bytes of one at most.
constexpr std::uintmax_t kHighestCompression = 1100;

/// The k of "NAMEk"; none: it is not so called.
std::optional<std::size_t> number_behind(std::string_view name, std::string_view found) {
  if (!found.starts_with(name)) return std::nullopt;
  found.remove_prefix(name.size());
  std::size_t value = 0;
  const auto [end, error] = std::from_chars(found.begin(), found.end(), value);
  if (error != std::errc() || end != found.end() || found.starts_with('0')) return std::nullopt;
  return value;
}

}  // namespace

NetcdfFile::NetcdfFile(std::filesystem::path path, Access access)
    : path_(std::move(path)), size_(std::filesystem::file_size(path_)) {
  const int mode = access == Access::read ? NC_NOWRITE : NC_WRITE;
  // Absolute, for netCDF takes what looks like a URL for one.
  const std::string name = std::filesystem::absolute(path_).string();
  if (const int status = nc_open(name.c_str(), mode, &file_); status != NC_NOERR) {
    file_ = -1;
    formats::fail(status == NC_ETRUNC ? "FILE_TRUNCATED" : "FORMAT_ERROR", path_,
                  std::string("netCDF cannot open it: ") + nc_strerror(status));
  }
}

NetcdfFile::~NetcdfFile() {
  if (file_ >= 0) nc_close(file_);
}

void NetcdfFile::close() {
  if (const int status = nc_close(std::exchange(file_, -1)); status != NC_NOERR) {
    formats::fail("FILE_NOT_WRITABLE", path_, nc_strerror(status));
  }
}

void NetcdfFile::fail(const std::string& what) const { formats::fail("FORMAT_ERROR", path_, what); }

void NetcdfFile::check(int status, const std::string& what) const {
  if (status != NC_NOERR) fail(what + ": " + nc_strerror(status));
}

std::optional<std::size_t> NetcdfFile::dimension(const std::string& name) const {
  int id = 0;
  std::size_t length = 0;
  if (nc_inq_dimid(file_, name.c_str(), &id) != NC_NOERR) return std::nullopt;
  check(nc_inq_dimlen(file_, id, &length), "the dimension \"" + name + "\"");
  return length;
}

bool NetcdfFile::has(const std::string& variable) const {
  int id = 0;
  return nc_inq_varid(file_, variable.c_str(), &id) == NC_NOERR;
}

std::vector<std::size_t> NetcdfFile::numbers_behind(const std::string& name) const {
  int variables = 0;
  check(nc_inq_nvars(file_, &variables), "its variables");
  std::vector<std::size_t> numbers;
  for (int id = 0; id < variables; ++id) {
    std::array<char, NC_MAX_NAME + 1> found{};
    check(nc_inq_varname(file_, id, found.data()), "its variables");
    if (const auto number = number_behind(name, found.data())) numbers.push_back(*number);
  }
  std::ranges::sort(numbers);
  return numbers;
}

std::vector<std::size_t> NetcdfFile::dimension_numbers(const std::string& name) const {
  int count = 0;
  check(nc_inq_ndims(file_, &count), "its dimensions");
  std::vector<int> ids(static_cast<std::size_t>(count));
  check(nc_inq_dimids(file_, &count, ids.data(), 0), "its dimensions");
  std::vector<std::size_t> numbers;
  for (const int id : ids) {
    std::array<char, NC_MAX_NAME + 1> found{};
    check(nc_inq_dimname(file_, id, found.data()), "its dimensions");
    if (const auto number = number_behind(name, found.data())) numbers.push_back(*number);
  }
  std::ranges::sort(numbers);
  return numbers;
}

int NetcdfFile::find(const std::string& variable) const {
  int id = 0;
  if (nc_inq_varid(file_, variable.c_str(), &id) != NC_NOERR) {
    fail("there is no variable \"" + variable + "\"");
  }
  return id;
}

std::vector<std::size_t> NetcdfFile::shape(int id, const std::string& variable) const {
  const std::string what = "the variable \"" + variable + "\" has no shape";
  int dimension_count = 0;
  check(nc_inq_varndims(file_, id, &dimension_count), what);
  std::vector<int> dimensions(static_cast<std::size_t>(dimension_count));
  check(nc_inq_vardimid(file_, id, dimensions.data()), what);
  std::vector<std::size_t> lengths;
  for (const int dimension : dimensions) {
    check(nc_inq_dimlen(file_, dimension, &lengths.emplace_back()), what);
  }
  return lengths;
}

std::size_t NetcdfFile::count(int id, const std::string& variable) const {
  std::size_t product = 1;
  for (const std::size_t length : shape(id, variable)) {
    if (length != 0 && product > size_ * kHighestCompression / length) {
      fail("the variable \"" + variable + "\" has more values than the file can hold");
    }
    product *= length;
  }
  return product;
}

std::vector<double> NetcdfFile::reals(const std::string& variable) const {
  const int id = find(variable);
  std::vector<double> values(count(id, variable));
  check(nc_get_var_double(file_, id, values.data()), "cannot read \"" + variable + "\"");
  return values;
}

std::vector<std::int64_t> NetcdfFile::integers(const std::string& variable) const {
  const int id = find(variable);
  nc_type type = NC_NAT;
  check(nc_inq_vartype(file_, id, &type), "the variable \"" + variable + "\" has no type");
  if (type == NC_FLOAT || type == NC_DOUBLE) {
    fail("the variable \"" + variable + "\" does not hold whole numbers");
  }
  std::vector<long long> values(count(id, variable));
  check(nc_get_var_longlong(file_, id, values.data()), "cannot read \"" + variable + "\"");
  return {values.begin(), values.end()};
}

std::vector<std::string> NetcdfFile::rows(const std::string& variable) const {
  std::vector<std::string> rows;
  if (!has(variable)) return rows;
  const int id = find(variable);
  nc_type type = NC_NAT;
  check(nc_inq_vartype(file_, id, &type), "the variable \"" + variable + "\" has no type");
  const std::vector<std::size_t> lengths = shape(id, variable);
  if (type != NC_CHAR || lengths.size() != 2) {
    fail("the variable \"" + variable + "\" holds no rows of text");
  }
  std::string all(count(id, variable), '\0');
  check(nc_get_var_text(file_, id, all.data()), "cannot read \"" + variable + "\"");
  for (std::size_t first = 0; first < all.size(); first += lengths[1]) {
    std::string& row = rows.emplace_back(all.substr(first, lengths[1]).c_str());  // up to its NUL
    row.erase(row.find_last_not_of(' ') + 1);
  }
  return rows;
}

std::string NetcdfFile::text_attribute(const std::string& variable, const std::string& name) const {
  constexpr std::size_t kLongest = 65536;
  const int id = find(variable);
  nc_type type = NC_NAT;
  std::size_t length = 0;
  if (nc_inq_att(file_, id, name.c_str(), &type, &length) != NC_NOERR || type != NC_CHAR ||
      length > kLongest) {
    return {};
  }
  std::string text(length, '\0');
  check(nc_get_att_text(file_, id, name.c_str(), text.data()),
        "cannot read the attribute \"" + name + "\" of \"" + variable + "\"");
  return text.c_str();
}

bool NetcdfFile::is_single_precision(const std::string& variable) const {
  nc_type type = NC_NAT;
  check(nc_inq_vartype(file_, find(variable), &type), "\"" + variable + "\" has no type");
  return type == NC_FLOAT;
}

void NetcdfFile::overwrite(const std::string& variable, std::span<const double> values) {
  const int id = find(variable);
  nc_type type = NC_NAT;
  check(nc_inq_vartype(file_, id, &type), "\"" + variable + "\" has no type");
  if (type != NC_FLOAT && type != NC_DOUBLE) {
    fail("the coordinates in \"" + variable + "\" are whole numbers");
  }
  if (count(id, variable) != values.size()) {
    fail("the variable \"" + variable + "\" is not of the size that was read");
  }
  check(nc_put_var_double(file_, id, values.data()), "cannot write \"" + variable + "\"");
}

}  // namespace meshsmooth::formats
