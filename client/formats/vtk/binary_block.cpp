#include "vtk/binary_block.hpp"

#include <vtkDataCompressor.h>
#include <vtkLZ4DataCompressor.h>
#include <vtkLZMADataCompressor.h>
#include <vtkSmartPointer.h>
#include <vtkZLibDataCompressor.h>

#include <cstdint>

#include "vtk/base64.hpp"

namespace meshsmooth::formats {
namespace {

using Encoding = NumberBlock::Encoding;
using Compressor = NumberBlock::Compressor;

vtkSmartPointer<vtkDataCompressor> make_compressor(Compressor compressor) {
  switch (compressor) {
    case Compressor::zlib:
      return vtkSmartPointer<vtkZLibDataCompressor>::New();
    case Compressor::lz4:
      return vtkSmartPointer<vtkLZ4DataCompressor>::New();
    case Compressor::lzma:
      return vtkSmartPointer<vtkLZMADataCompressor>::New();
    case Compressor::none:
      break;
  }
  return nullptr;
}

const unsigned char* unsigned_bytes(std::string_view bytes) {
  return reinterpret_cast<const unsigned char*>(bytes.data());
}

unsigned char* unsigned_bytes(std::string& bytes) {
  return reinterpret_cast<unsigned char*>(bytes.data());
}

/// A walk over the streams of a block. VTK encodes in base64 stream by stream: the header of
/// compressed data by itself, that of other data together with them.
class Streams {
 public:
  Streams(std::string_view file, const NumberBlock& block)
      : block_(block), rest_(file.substr(block.begin, block.limit - block.begin)) {}

  std::optional<BinaryBlock> read() {
    BinaryBlock result;
    const bool read =
        block_.compressor == Compressor::none ? read_plain(result) : read_compressed(result);
    if (!read) return std::nullopt;
    result.length = taken_;
    return result;
  }

 private:
  /// The first bytes of the stream that begins here.
  std::optional<std::string> peek(std::size_t count) const {
    if (block_.encoding == Encoding::base64) return decode_base64(rest_, count);
    if (count > rest_.size()) return std::nullopt;
    return std::string(rest_.substr(0, count));
  }
  /// The whole stream, which has as many bytes.
  std::optional<std::string> take(std::size_t count) {
    auto bytes = peek(count);
    const std::size_t length = block_.encoding == Encoding::base64 ? base64_length(count) : count;
    if (!bytes || length > rest_.size()) return std::nullopt;
    rest_.remove_prefix(length);
    taken_ += length;
    return bytes;
  }
  std::size_t word(const std::string& header, std::size_t place) const {
    const char* bytes = header.data() + place * block_.header_bytes;
    return block_.header_bytes == 4 ? load<std::uint32_t>(bytes, block_.big_endian)
                                    : load<std::uint64_t>(bytes, block_.big_endian);
  }
  bool is_expected(std::size_t size) const {
    return block_.count == NumberBlock::kAll || size == block_.count * block_.type.bytes;
  }

  bool read_plain(BinaryBlock& result) {
    std::size_t size = block_.count * block_.type.bytes;
    if (block_.header_bytes != 0) {
      const auto header = peek(block_.header_bytes);
      if (!header) return false;
      size = word(*header, 0);
    }
    if (!is_expected(size) || size > rest_.size()) return false;
    auto all = take(block_.header_bytes + size);
    if (!all) return false;
    result.bytes = all->substr(block_.header_bytes);
    return true;
  }

  bool read_compressed(BinaryBlock& result) {
    // Damaged sizes must not ask for memory that no such file needs.
    const std::size_t most = 4096 * rest_.size();
    const auto start = peek(3 * block_.header_bytes);
    if (!start) return false;
    const std::size_t block_count = word(*start, 0);
    const std::size_t last_size = word(*start, 2);
    result.block_size = word(*start, 1);
    if (block_count > rest_.size() || last_size > most) return false;
    if (block_count != 0 && result.block_size > most / block_count) return false;
    const bool has_partial = block_count != 0 && last_size != 0;
    if (!is_expected((block_count - (has_partial ? 1 : 0)) * result.block_size +
                     (has_partial ? last_size : 0))) {
      return false;
    }
    const auto header = take((3 + block_count) * block_.header_bytes);
    if (!header) return false;
    std::size_t total = 0;
    for (std::size_t block = 0; block < block_count; ++block) {
      const std::size_t size = word(*header, 3 + block);
      if (size > rest_.size()) return false;
      total += size;
    }
    const auto all = take(total);
    if (!all) return false;
    std::size_t from = 0;
    for (std::size_t block = 0; block < block_count; ++block) {
      result.compressed.push_back(all->substr(from, word(*header, 3 + block)));
      from += result.compressed.back().size();
      const bool partial = has_partial && block + 1 == block_count;
      if (!decompress(result, partial ? last_size : result.block_size)) return false;
    }
    return true;
  }

  bool decompress(BinaryBlock& result, std::size_t size) const {
    const std::string& given = result.compressed.back();
    std::string bytes(size, '\0');
    const auto compressor = make_compressor(block_.compressor);
    if (compressor->Uncompress(unsigned_bytes(std::string_view(given)), given.size(),
                               unsigned_bytes(bytes), size) != size) {
      return false;
    }
    result.bytes += bytes;
    return true;
  }

  const NumberBlock& block_;
  std::string_view rest_;
  std::size_t taken_ = 0;
};

void append_word(std::string& header, std::size_t value, const NumberBlock& block) {
  std::array<char, 8> bytes{};
  if (block.header_bytes == 4) {
    store(bytes.data(), static_cast<std::uint32_t>(value), block.big_endian);
  } else {
    store(bytes.data(), static_cast<std::uint64_t>(value), block.big_endian);
  }
  header.append(bytes.data(), block.header_bytes);
}

std::string as_stream(const std::string& bytes, const NumberBlock& block) {
  return block.encoding == Encoding::base64 ? encode_base64(bytes) : bytes;
}

std::string compress(const NumberBlock& block, std::string_view bytes) {
  const auto compressor = make_compressor(block.compressor);
  std::string result(compressor->GetMaximumCompressionSpace(bytes.size()), '\0');
  result.resize(compressor->Compress(unsigned_bytes(bytes), bytes.size(), unsigned_bytes(result),
                                     result.size()));
  return result;
}

}  // namespace

std::optional<BinaryBlock> read_binary(std::string_view file, const NumberBlock& block) {
  return Streams(file, block).read();
}

std::string write_binary(const NumberBlock& block, const BinaryBlock& before,
                         const std::string& bytes) {
  std::string header;
  if (block.compressor == Compressor::none) {
    if (block.header_bytes != 0) append_word(header, bytes.size(), block);
    return as_stream(header + bytes, block);
  }
  const std::size_t size = before.block_size == 0 ? bytes.size() : before.block_size;
  const std::size_t block_count = size == 0 ? 0 : (bytes.size() + size - 1) / size;
  append_word(header, block_count, block);
  append_word(header, size, block);
  append_word(header, size == 0 ? 0 : bytes.size() % size, block);
  std::string all;
  for (std::size_t place = 0; place < block_count; ++place) {
    const auto part = std::string_view(bytes).substr(place * size, size);
    const bool same = before.bytes.size() == bytes.size() && place < before.compressed.size() &&
                      part == std::string_view(before.bytes).substr(place * size, size);
    const std::string packed = same ? before.compressed[place] : compress(block, part);
    append_word(header, packed.size(), block);
    all += packed;
  }
  return as_stream(header, block) + as_stream(all, block);
}

}  // namespace meshsmooth::formats
