#include "npz_file.hpp"

#include <array>
#include <bit>
#include <utility>

namespace meshsmooth::cli {
namespace {

static_assert(std::endian::native == std::endian::little, "arrays are copied as they are");

constexpr std::uint16_t kVersion = 45;   // the first with 64-bit sizes
constexpr std::uint16_t kDate = 0x0021;  // 1980-01-01: the same bytes for the same values
constexpr std::uint32_t kInExtra = 0xffffffff;

template <class Number>
void append(std::string& bytes, Number number) {
  bytes.append(reinterpret_cast<const char*>(&number), sizeof number);
}

/// CRC-32 of zip (IEEE 802.3), by tables for eight bytes at a time.
class Checksum {
 public:
  Checksum() {
    for (std::uint32_t byte = 0; byte < 256; ++byte) {
      std::uint32_t value = byte;
      for (int bit = 0; bit < 8; ++bit) value = (value >> 1) ^ ((value & 1U) * 0xedb88320U);
      tables_[0][byte] = value;
    }
    for (std::size_t byte = 0; byte < 256; ++byte) {
      for (std::size_t t = 1; t < tables_.size(); ++t) {
        const std::uint32_t before = tables_[t - 1][byte];
        tables_[t][byte] = (before >> 8) ^ tables_[0][before & 0xffU];
      }
    }
  }

  [[nodiscard]] std::uint32_t operator()(std::string_view bytes) const {
    const auto at = [&](std::size_t i) { return static_cast<unsigned char>(bytes[i]); };
    std::uint32_t value = 0xffffffffU;
    std::size_t i = 0;
    for (; i + 8 <= bytes.size(); i += 8) {
      std::uint32_t next = 0;
      for (std::size_t n = 0; n < 8; ++n) {
        const std::uint32_t mixed = n < 4 ? (value >> (8 * n)) & 0xffU : 0;
        next ^= tables_[7 - n][at(i + n) ^ mixed];
      }
      value = next;
    }
    for (; i < bytes.size(); ++i) value = (value >> 8) ^ tables_[0][(value & 0xffU) ^ at(i)];
    return ~value;
  }

 private:
  std::array<std::array<std::uint32_t, 256>, 8> tables_{};
};

std::string npy_header(std::string_view type, const std::vector<std::size_t>& shape) {
  std::string text = "{'descr': '" + std::string(type) + "', 'fortran_order': False, 'shape': (";
  for (const std::size_t size : shape) text += std::to_string(size) + ", ";
  text += "), }";
  constexpr std::size_t kStart = 10;  // magic, version, length
  while ((kStart + text.size() + 1) % 64 != 0) text += ' ';
  text += '\n';
  std::string bytes = "\x93NUMPY";
  append(bytes, std::uint8_t{1});
  append(bytes, std::uint8_t{0});
  append(bytes, static_cast<std::uint16_t>(text.size()));
  return bytes + text;
}

/// The fields that the header of an entry and its row in the directory share.
void append_common(std::string& bytes, std::uint32_t checksum, std::size_t name_size,
                   std::uint16_t extra_size) {
  append(bytes, kVersion);
  append(bytes, std::uint16_t{0});  // flags
  append(bytes, std::uint16_t{0});  // stored
  append(bytes, std::uint16_t{0});  // midnight
  append(bytes, kDate);
  append(bytes, checksum);
  append(bytes, kInExtra);
  append(bytes, kInExtra);
  append(bytes, static_cast<std::uint16_t>(name_size));
  append(bytes, extra_size);
}

}  // namespace

void NpzFile::add(std::string_view name, std::span<const double> values, std::size_t columns) {
  std::vector<std::size_t> shape = {values.size() / columns};
  if (columns > 1) shape.push_back(columns);
  add(name, "<f8", shape, values.data(), values.size_bytes());
}

void NpzFile::add(std::string_view name, std::string_view type,
                  const std::vector<std::size_t>& shape, const void* data, std::size_t size) {
  static const Checksum checksum_of;
  std::string content = npy_header(type, shape);
  content.append(static_cast<const char*>(data), size);
  const Entry entry{std::string(name) + ".npy", checksum_of(content), content.size(),
                    bytes_.size()};
  append(bytes_, std::uint32_t{0x04034b50});
  append_common(bytes_, entry.checksum, entry.name.size(), 20);
  bytes_ += entry.name;
  append(bytes_, std::uint16_t{1});
  append(bytes_, std::uint16_t{16});
  append(bytes_, entry.size);
  append(bytes_, entry.size);
  bytes_ += content;
  entries_.push_back(entry);
}

std::string NpzFile::bytes() && {
  const std::uint64_t directory = bytes_.size();
  for (const Entry& entry : entries_) {
    append(bytes_, std::uint32_t{0x02014b50});
    append(bytes_, kVersion);
    append_common(bytes_, entry.checksum, entry.name.size(), 28);
    append(bytes_, std::uint16_t{0});  // comment
    append(bytes_, std::uint16_t{0});  // disk
    append(bytes_, std::uint16_t{0});  // attributes
    append(bytes_, std::uint32_t{0});
    append(bytes_, kInExtra);
    bytes_ += entry.name;
    append(bytes_, std::uint16_t{1});
    append(bytes_, std::uint16_t{24});
    append(bytes_, entry.size);
    append(bytes_, entry.size);
    append(bytes_, entry.offset);
  }
  const std::uint64_t end = bytes_.size();
  append(bytes_, std::uint32_t{0x06064b50});
  append(bytes_, std::uint64_t{44});
  append(bytes_, kVersion);
  append(bytes_, kVersion);
  append(bytes_, std::uint64_t{0});  // disks
  append(bytes_, static_cast<std::uint64_t>(entries_.size()));
  append(bytes_, static_cast<std::uint64_t>(entries_.size()));
  append(bytes_, end - directory);
  append(bytes_, directory);
  append(bytes_, std::uint32_t{0x07064b50});
  append(bytes_, std::uint32_t{0});
  append(bytes_, end);
  append(bytes_, std::uint32_t{1});
  append(bytes_, std::uint32_t{0x06054b50});
  append(bytes_, std::uint32_t{0});  // disks
  append(bytes_, static_cast<std::uint16_t>(entries_.size()));
  append(bytes_, static_cast<std::uint16_t>(entries_.size()));
  append(bytes_, kInExtra);
  append(bytes_, kInExtra);
  append(bytes_, std::uint16_t{0});  // comment
  return std::move(bytes_);
}

}  // namespace meshsmooth::cli
