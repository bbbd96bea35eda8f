#pragma once

#include <grpcpp/support/byte_buffer.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "meshsmooth/v1/mesh.pb.h"

/// Messages as gRPC moves them, for calls that parse and write them themselves: chunks, nearly all
/// that the service moves, go around the generated classes and are copied once at either end. On
/// the wire nothing is different.
namespace meshsmooth::wire {

/// A chunk whose data lie in pieces wherever they came to.
struct ChunkView {
  v1::ArrayId array_id{};
  std::int64_t offset_bytes = 0;
  std::vector<std::span<const std::byte>> pieces;  // in order
  std::size_t size_bytes = 0;                      // of all
  std::optional<std::uint32_t> crc32c;

  ChunkView() = default;
  /// Of a message, which must outlive it.
  explicit ChunkView(const v1::Chunk& chunk);

  [[nodiscard]] bool has_right_checksum() const;
  /// Copies the data to `to`, which has room for them.
  void copy_to(std::byte* to) const;
};

/// What a protobuf message is when its field `field_number` is a chunk and it has nothing else;
/// nothing when it is not, or the chunk is written in an unusual way: parse it then. The pieces
/// lie in `message`.
[[nodiscard]] std::optional<ChunkView> find_chunk(grpc::ByteBuffer& message, int field_number);

/// That message, with a copy of `data`; at most 1 GiB.
[[nodiscard]] grpc::ByteBuffer encode_chunk(int field_number, v1::ArrayId array_id,
                                            std::int64_t offset_bytes,
                                            std::span<const std::byte> data);

/// False when the bytes are no such message. Clears `bytes`.
[[nodiscard]] bool parse(grpc::ByteBuffer& bytes, google::protobuf::Message& message);
[[nodiscard]] grpc::ByteBuffer encode(const google::protobuf::Message& message);

}  // namespace meshsmooth::wire
