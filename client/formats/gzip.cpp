#include "gzip.hpp"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <limits>
#include <memory>
#include <new>
#include <stdexcept>

#include "file_bytes.hpp"
#include "text.hpp"

namespace meshsmooth::formats {
namespace {

using std::filesystem::path;

constexpr int kGzipWindow = 15 + 16;  // the largest window, with gzip's header
constexpr int kMemoryLevel = 8;       // zlib's own default
constexpr std::size_t kChunk = std::size_t{1} << 18;

/// Bytes handed to zlib at once, which counts in 32 bits.
uInt next_part(std::size_t left) {
  return static_cast<uInt>(std::min<std::size_t>(left, std::numeric_limits<uInt>::max() / 2));
}

class Inflater {
 public:
  Inflater(const path& file, std::string_view bytes) : file_(file), bytes_(bytes) {
    if (inflateInit2(&stream_, kGzipWindow) != Z_OK) throw std::bad_alloc();
  }
  ~Inflater() { inflateEnd(&stream_); }
  Inflater(const Inflater&) = delete;
  Inflater& operator=(const Inflater&) = delete;

  std::string run() {
    std::string text;
    while (true) {
      inflate_member(text);
      const std::string_view rest = bytes_.substr(position_);
      if (rest.find_first_not_of('\0') == std::string_view::npos) return text;
      if (!is_gzip(rest)) {
        fail("FORMAT_ERROR", file_,
             "byte " + std::to_string(position_) + ": the compressed data end here, but " +
                 std::to_string(rest.size()) + " bytes follow that are not gzip's");
      }
      inflateReset(&stream_);
    }
  }

 private:
  void inflate_member(std::string& text) {
    int status = Z_OK;
    while (status != Z_STREAM_END) {
      const uInt given = next_part(bytes_.size() - position_);
      stream_.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes_.data() + position_));
      stream_.avail_in = given;
      stream_.next_out = reinterpret_cast<Bytef*>(buffer_.data());
      stream_.avail_out = static_cast<uInt>(buffer_.size());
      status = inflate(&stream_, Z_NO_FLUSH);
      position_ += given - stream_.avail_in;
      const std::size_t made = buffer_.size() - stream_.avail_out;
      text.append(buffer_.data(), made);
      if (status == Z_MEM_ERROR) throw std::bad_alloc();
      if (status == Z_DATA_ERROR || status == Z_NEED_DICT) {
        fail("FORMAT_ERROR", file_,
             "byte " + std::to_string(position_) + ": the compressed data are damaged (" +
                 (stream_.msg == nullptr ? "unknown dictionary" : stream_.msg) + ")");
      }
      if (status != Z_STREAM_END && made == 0 && position_ == bytes_.size()) {
        fail("FILE_TRUNCATED", file_, "the compressed data end too early");
      }
    }
  }

  const path& file_;
  std::string_view bytes_;
  std::size_t position_ = 0;
  z_stream stream_ = {};
  std::string buffer_ = std::string(kChunk, '\0');
};

}  // namespace

bool is_gzip(std::string_view bytes) { return bytes.starts_with("\x1f\x8b\x08"); }

bool is_gzip_name(const path& file) {
  const std::string extension = file.extension().string();
  return extension.size() == 3 && extension[0] == '.' && (extension[1] | 0x20) == 'g' &&
         (extension[2] | 0x20) == 'z';
}

std::string decompress_gzip(const path& file, std::string_view bytes) try {
  return Inflater(file, bytes).run();
} catch (const std::bad_alloc&) {
  fail("FILE_NOT_READABLE", file, "decompressed it does not fit into memory");
} catch (const std::length_error&) {
  fail("FILE_NOT_READABLE", file, "decompressed it does not fit into memory");
}

void compress_gzip(const path& from, const path& to) {
  const FileDescriptor source = open_to_read(from);
  FileDescriptor target = open_to_write(to);
  z_stream stream = {};
  if (deflateInit2(&stream, Z_DEFAULT_COMPRESSION, Z_DEFLATED, kGzipWindow, kMemoryLevel,
                   Z_DEFAULT_STRATEGY) != Z_OK) {
    throw std::bad_alloc();
  }
  const std::unique_ptr<z_stream, decltype(&deflateEnd)> guard(&stream, deflateEnd);
  std::string plain(kChunk, '\0'), packed(kChunk, '\0');
  for (int status = Z_OK; status != Z_STREAM_END;) {
    const std::size_t count = source.read(plain.data(), plain.size(), from);
    stream.next_in = reinterpret_cast<Bytef*>(plain.data());
    stream.avail_in = static_cast<uInt>(count);
    do {
      stream.next_out = reinterpret_cast<Bytef*>(packed.data());
      stream.avail_out = static_cast<uInt>(packed.size());
      status = deflate(&stream, count == 0 ? Z_FINISH : Z_NO_FLUSH);
      target.write(std::string_view(packed).substr(0, packed.size() - stream.avail_out), to);
    } while (stream.avail_out == 0);
  }
  target.close(to);
}

}  // namespace meshsmooth::formats
