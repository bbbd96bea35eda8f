// Chunks that are found in the bytes of a message, without protobuf: what is found is what
// protobuf reads. First: how many pieces the message comes in.
#include <grpcpp/impl/grpc_library.h>
#include <grpcpp/support/byte_buffer.h>

#include <string>
#include <vector>

#include "fuzz/choices.hpp"
#include "meshsmooth/v1/smoothing.pb.h"
#include "wire/raw_message.hpp"

// Slices need gRPC's own interface, which a program that opens no channel has to set up.
static const grpc::internal::GrpcLibraryInitializer library;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace meshsmooth;
  using testing::require;
  testing::Choices choices({data, size});
  std::vector<std::size_t> cuts(choices.below(4));
  for (std::size_t& cut : cuts) cut = choices.byte();
  const std::string bytes = choices.rest();
  std::vector<grpc::Slice> slices;
  std::string_view rest = bytes;
  for (const std::size_t cut : cuts) {
    const std::string_view piece = rest.substr(0, cut);
    slices.emplace_back(piece.data(), piece.size());
    rest.remove_prefix(piece.size());
  }
  slices.emplace_back(rest.data(), rest.size());
  grpc::ByteBuffer message(slices.data(), slices.size());

  const auto found = wire::find_chunk(message, v1::SmoothRequest::kChunkFieldNumber);
  if (!found) return 0;
  v1::SmoothRequest request;
  require(request.ParseFromString(bytes), "what has a chunk is a message");
  require(request.has_chunk(), "protobuf sees a chunk too");
  const v1::Chunk& chunk = request.chunk();
  require(found->array_id == chunk.array_id() && found->offset_bytes == chunk.offset_bytes(),
          "the same place");
  require(found->crc32c.has_value() == chunk.has_crc32c() &&
              found->crc32c.value_or(0) == chunk.crc32c(),
          "the same checksum");
  std::vector<std::byte> copy(found->size_bytes);
  if (!copy.empty()) found->copy_to(copy.data());
  require(std::ranges::equal(copy, std::as_bytes(std::span(chunk.data()))), "the same data");
  (void)found->has_right_checksum();
  return 0;
}
