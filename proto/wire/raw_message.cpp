#include "wire/raw_message.hpp"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/wire_format_lite.h>
#include <grpcpp/support/proto_buffer_reader.h>

#include <algorithm>
#include <cstring>

#include "wire/crc32c.hpp"

namespace meshsmooth::wire {
namespace {

using google::protobuf::internal::WireFormatLite;
using google::protobuf::io::CodedInputStream;
using google::protobuf::io::CodedOutputStream;

constexpr std::uint32_t tag(int field, WireFormatLite::WireType type) {
  return WireFormatLite::MakeTag(field, type);
}
constexpr std::uint32_t kArrayId =
    tag(v1::Chunk::kArrayIdFieldNumber, WireFormatLite::WIRETYPE_VARINT);
constexpr std::uint32_t kOffset =
    tag(v1::Chunk::kOffsetBytesFieldNumber, WireFormatLite::WIRETYPE_VARINT);
constexpr std::uint32_t kData =
    tag(v1::Chunk::kDataFieldNumber, WireFormatLite::WIRETYPE_LENGTH_DELIMITED);
constexpr std::uint32_t kCrc = tag(v1::Chunk::kCrc32CFieldNumber, WireFormatLite::WIRETYPE_FIXED32);

// Whether what was read from `begin` on took no more bytes than it needs. Tags and lengths that do
// are left to protobuf: of long ones CodedInputStream drops the bits above the 32nd where
// protobuf's parser, which goes without it, refuses the message.
bool is_shortest(const CodedInputStream& input, int begin, std::uint32_t value) {
  const auto taken = static_cast<std::size_t>(input.CurrentPosition() - begin);
  return taken == CodedOutputStream::VarintSize32(value);
}

// 0 at the end.
std::uint32_t read_tag(CodedInputStream& input) {
  constexpr std::uint32_t kNone = UINT32_MAX;
  const int begin = input.CurrentPosition();
  const std::uint32_t tag = input.ReadTag();
  return tag == 0 || is_shortest(input, begin, tag) ? tag : kNone;
}

bool read_length(CodedInputStream& input, std::uint32_t& length) {
  const int begin = input.CurrentPosition();
  return input.ReadVarint32(&length) && length <= INT32_MAX && is_shortest(input, begin, length);
}

// The next `size` bytes, in place; false when there are fewer.
bool take_pieces(CodedInputStream& input, std::uint32_t size, ChunkView& chunk) {
  chunk.size_bytes = size;
  while (size > 0) {
    const void* data = nullptr;
    int available = 0;
    if (!input.GetDirectBufferPointer(&data, &available)) return false;
    const std::uint32_t length = std::min(size, static_cast<std::uint32_t>(available));
    chunk.pieces.emplace_back(static_cast<const std::byte*>(data), length);
    if (!input.Skip(static_cast<int>(length))) return false;
    size -= length;
  }
  return true;
}

// The fields of a chunk up to the limit of `input`; data at most once.
bool read_fields(CodedInputStream& input, ChunkView& chunk) {
  for (bool has_data = false;;) {
    std::uint32_t small = 0;
    std::uint64_t large = 0;
    switch (read_tag(input)) {
      case 0:
        return input.ConsumedEntireMessage();
      case kArrayId:
        if (!input.ReadVarint64(&large)) return false;
        chunk.array_id = static_cast<v1::ArrayId>(static_cast<std::int32_t>(large));
        break;
      case kOffset:
        if (!input.ReadVarint64(&large)) return false;
        chunk.offset_bytes = static_cast<std::int64_t>(large);
        break;
      case kData:
        if (has_data || !read_length(input, small)) return false;
        if (!take_pieces(input, small, chunk)) return false;
        has_data = true;
        break;
      case kCrc:
        if (!input.ReadLittleEndian32(&small)) return false;
        chunk.crc32c = small;
        break;
      default:
        return false;
    }
  }
}

}  // namespace

ChunkView::ChunkView(const v1::Chunk& chunk)
    : array_id(chunk.array_id()),
      offset_bytes(chunk.offset_bytes()),
      pieces{std::as_bytes(std::span(chunk.data().data(), chunk.data().size()))},
      size_bytes(chunk.data().size()) {
  if (chunk.has_crc32c()) crc32c = chunk.crc32c();
}

bool ChunkView::has_right_checksum() const {
  if (!crc32c) return true;
  std::uint32_t crc = 0;
  for (const auto& piece : pieces) crc = wire::crc32c(piece, crc);
  return crc == *crc32c;
}

void ChunkView::copy_to(std::byte* to) const {
  for (const auto& piece : pieces) {
    if (piece.empty()) continue;
    std::memcpy(to, piece.data(), piece.size());
    to += piece.size();
  }
}

std::optional<ChunkView> find_chunk(grpc::ByteBuffer& message, int field_number) {
  grpc::ProtoBufferReader reader(&message);
  if (!reader.status().ok()) return std::nullopt;
  CodedInputStream input(&reader);
  std::uint32_t size = 0;
  if (read_tag(input) != tag(field_number, WireFormatLite::WIRETYPE_LENGTH_DELIMITED) ||
      !read_length(input, size)) {
    return std::nullopt;
  }
  ChunkView chunk;
  const int begin = input.CurrentPosition();
  const auto outside = input.PushLimit(static_cast<int>(size));
  // It may also end before the limit, with the message.
  if (!read_fields(input, chunk) || input.CurrentPosition() - begin != static_cast<int>(size)) {
    return std::nullopt;
  }
  input.PopLimit(outside);
  if (input.ReadTag() != 0 || !input.ConsumedEntireMessage()) return std::nullopt;
  return chunk;
}

grpc::ByteBuffer encode_chunk(int field_number, v1::ArrayId array_id, std::int64_t offset_bytes,
                              std::span<const std::byte> data) {
  const auto outer = tag(field_number, WireFormatLite::WIRETYPE_LENGTH_DELIMITED);
  const auto id = static_cast<std::uint64_t>(array_id);
  const auto offset = static_cast<std::uint64_t>(offset_bytes);
  const auto length = static_cast<std::uint32_t>(data.size());
  const auto varint = [](std::uint64_t value) { return CodedOutputStream::VarintSize64(value); };
  // As protobuf does, without the fields that are 0 or empty.
  const std::size_t inner = (id == 0 ? 0 : 1 + varint(id)) +
                            (offset == 0 ? 0 : 1 + varint(offset)) +
                            (data.empty() ? 0 : 1 + varint(length) + data.size());
  const grpc::Slice slice(varint(outer) + varint(inner) + inner);
  auto* to = const_cast<std::uint8_t*>(slice.begin());  // nobody else has it yet
  to = CodedOutputStream::WriteVarint32ToArray(outer, to);
  to = CodedOutputStream::WriteVarint32ToArray(static_cast<std::uint32_t>(inner), to);
  if (id != 0) {
    to = CodedOutputStream::WriteVarint32ToArray(kArrayId, to);
    to = CodedOutputStream::WriteVarint64ToArray(id, to);
  }
  if (offset != 0) {
    to = CodedOutputStream::WriteVarint32ToArray(kOffset, to);
    to = CodedOutputStream::WriteVarint64ToArray(offset, to);
  }
  if (!data.empty()) {
    to = CodedOutputStream::WriteVarint32ToArray(kData, to);
    to = CodedOutputStream::WriteVarint32ToArray(length, to);
    std::memcpy(to, data.data(), data.size());
  }
  return grpc::ByteBuffer(&slice, 1);
}

bool parse(grpc::ByteBuffer& bytes, google::protobuf::Message& message) {
  grpc::ProtoBufferReader reader(&bytes);
  const bool parsed = reader.status().ok() && message.ParseFromZeroCopyStream(&reader);
  bytes.Clear();
  return parsed;
}

grpc::ByteBuffer encode(const google::protobuf::Message& message) {
  const grpc::Slice slice(message.ByteSizeLong());
  static_cast<void>(
      message.SerializeWithCachedSizesToArray(const_cast<std::uint8_t*>(slice.begin())));
  return grpc::ByteBuffer(&slice, 1);
}

}  // namespace meshsmooth::wire
