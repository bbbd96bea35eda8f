#include <array>
#include <bit>
#include <cstring>
#include <string>

#include "medit/model.hpp"
#include "text.hpp"

namespace meshsmooth::formats::medit {
namespace {

constexpr std::size_t kHeadBytes = 8;

/// Walks over the sections, each of which says where the next one starts.
class BinaryReader {
 public:
  BinaryReader(const std::filesystem::path& file, std::string_view bytes, Model& model)
      : file_(file), bytes_(bytes), model_(model) {
    swapped_ = bytes.front() == 0;  // the number 1, big-endian
    position_ = 4;
    model_.has_end = true;  // else it is an error
    const auto version = static_cast<int>(integer(4));
    if (version < 1 || version > 4) {
      fail("FORMAT_ERROR", file_,
           "expected a version from 1 to 4, found " + std::to_string(version));
    }
    model_.single_precision = version == 1;
    real_bytes_ = version == 1 ? 4 : 8;
    position_bytes_ = version >= 3 ? 8 : 4;
    integer_bytes_ = version == 4 ? 8 : 4;
    model_.fields.style = swapped_ ? NumberStyle::binary_swapped : NumberStyle::binary;
  }

  void read() {
    while (position_ < bytes_.size()) {
      const auto code = static_cast<int>(integer(4));
      if (code == kEndCode) {
        return;
      }
      const std::size_t start = position_;
      const auto next = static_cast<std::uint64_t>(integer(position_bytes_));
      if (next > bytes_.size()) truncated();
      if (next != 0 && next <= start) {
        fail("FORMAT_ERROR", file_,
             "byte " + std::to_string(start) + ": the section after number " +
                 std::to_string(code) + " does not start behind it");
      }
      end_ = next == 0 ? bytes_.size() : static_cast<std::size_t>(next);
      read_section(code);
      position_ = end_;
      if (next == 0) return;  // the last one
    }
    truncated();
  }

 private:
  [[noreturn]] void truncated() const {
    fail("FILE_TRUNCATED", file_,
         "byte " + std::to_string(position_) + ": the file is too short for what it announces");
  }

  std::string_view take(std::size_t count) {
    if (position_ > bytes_.size() || count > bytes_.size() - position_) truncated();
    position_ += count;
    return bytes_.substr(position_ - count, count);
  }

  /// Of four or eight bytes.
  std::int64_t integer(std::size_t size) {
    const std::string_view taken = take(size);
    std::uint64_t value = 0;
    for (std::size_t byte = 0; byte < size; ++byte) {
      const auto digit = static_cast<unsigned char>(taken[swapped_ ? byte : size - 1 - byte]);
      value = value << 8 | digit;
    }
    if (size == 4) return static_cast<std::int32_t>(static_cast<std::uint32_t>(value));
    return static_cast<std::int64_t>(value);
  }

  double real(std::size_t size) {
    const auto bits = static_cast<std::uint64_t>(integer(size));
    if (size == 4) return std::bit_cast<float>(static_cast<std::uint32_t>(bits));
    return std::bit_cast<double>(bits);
  }

  /// Of the rows of `row_bytes` that end with this section.
  std::size_t count_rows(std::string_view name, std::size_t row_bytes) {
    const std::int64_t count = integer(integer_bytes_);
    if (count < 0 || position_ > end_ ||
        static_cast<std::uint64_t>(count) > (end_ - position_) / row_bytes) {
      fail("FORMAT_ERROR", file_,
           std::string(name) + ": " + std::to_string(count) + " rows do not fit into the section");
    }
    return static_cast<std::size_t>(count);
  }

  void read_section(int code) {
    if (code == kDimensionCode) {
      const std::int64_t dimension = integer(4);
      if (dimension != 2 && dimension != 3) {
        fail("FORMAT_ERROR", file_,
             "expected dimension 2 or 3, found " + std::to_string(dimension));
      }
      model_.dimension = static_cast<int>(dimension);
      return;
    }
    if (code == kPrecisionCode) {
      model_.single_precision = integer(4) == 32;
      real_bytes_ = model_.single_precision ? 4 : 8;
      return;
    }
    const Keyword* keyword = find_keyword(code);
    if (keyword == nullptr || keyword->role == Role::skipped) return;
    if (keyword->role == Role::vertices) {
      read_vertices();
    } else if (keyword->role == Role::refused) {
      check_supported(file_, *keyword, count_rows(keyword->name, 1));
    } else {
      read_rows(*keyword);
    }
  }

  void read_vertices() {
    if (model_.dimension == 0) fail("FORMAT_ERROR", file_, "expected Dimension before Vertices");
    if (model_.has_vertices) fail("FORMAT_ERROR", file_, "expected Vertices once");
    model_.has_vertices = true;
    const auto axes = static_cast<std::size_t>(model_.dimension);
    const std::size_t count = count_rows("Vertices", axes * real_bytes_ + integer_bytes_);
    for (std::size_t vertex = 0; vertex < count; ++vertex) {
      std::array<CoordinateFields::Field, 3> found{};
      std::array<double, 3> values{};
      for (std::size_t axis = 0; axis < axes; ++axis) {
        found[axis] = {position_, real_bytes_};
        values[axis] = real(real_bytes_);
      }
      model_.add_vertex(found, values);
      model_.vertex_references.push_back(static_cast<double>(integer(integer_bytes_)));
    }
  }

  void read_rows(const Keyword& keyword) {
    const bool cells = keyword.role == Role::cells;
    const auto width = cells ? static_cast<std::size_t>(keyword.node_count) : 1;
    const std::size_t count = count_rows(keyword.name, (width + (cells ? 1 : 0)) * integer_bytes_);
    Section section{&keyword, {}, {}};
    for (std::size_t row = 0; row < count; ++row) {
      for (std::size_t number = 0; number < width; ++number) {
        section.numbers.push_back(integer(integer_bytes_));
      }
      if (cells) section.references.push_back(static_cast<double>(integer(integer_bytes_)));
    }
    model_.sections.push_back(std::move(section));
  }

  const std::filesystem::path& file_;
  std::string_view bytes_;
  Model& model_;
  bool swapped_ = false;
  std::size_t real_bytes_ = 8;
  std::size_t position_bytes_ = 4;
  std::size_t integer_bytes_ = 4;
  std::size_t position_ = 0;
  std::size_t end_ = 0;  // of this section
};

}  // namespace

bool is_binary(std::string_view bytes) {
  using namespace std::string_view_literals;
  return bytes.size() >= kHeadBytes &&
         (bytes.starts_with("\1\0\0\0"sv) || bytes.starts_with("\0\0\0\1"sv));
}

void read_binary(const std::filesystem::path& file, std::string_view bytes, Model& model) {
  BinaryReader(file, bytes, model).read();
}

}  // namespace meshsmooth::formats::medit
