#include "wire/raw_message.hpp"

#include <grpcpp/impl/grpc_library.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "meshsmooth/v1/smoothing.pb.h"
#include "wire/crc32c.hpp"

namespace meshsmooth::wire {
namespace {

/// gRPC's buffers need it.
const grpc::internal::GrpcLibraryInitializer kGrpc;

std::span<const std::byte> bytes_of(const std::string& text) {
  return std::as_bytes(std::span(text.data(), text.size()));
}

/// A message in slices of so many bytes, as they come from a socket.
grpc::ByteBuffer in_sell(const std::string& bytes, std::size_t slice_bytes) {
  std::vector<grpc::Slice> slices;
  for (std::size_t at = 0; at < bytes.size(); at += slice_bytes) {
    slices.emplace_back(bytes.data() + at, std::min(slice_bytes, bytes.size() - at));
  }
  return slices.empty() ? encode(v1::SmoothRequest())
                        : grpc::ByteBuffer(slices.data(), slices.size());
}

std::string flat(const grpc::ByteBuffer& buffer) {
  std::vector<grpc::Slice> slices;
  EXPECT_TRUE(buffer.Dump(&slices).ok());
  std::string bytes;
  for (const grpc::Slice& slice : slices) bytes.append(slice.begin(), slice.end());
  return bytes;
}

std::string data_of(const ChunkView& chunk) {
  std::string data(chunk.size_bytes, '?');
  chunk.copy_to(reinterpret_cast<std::byte*>(data.data()));
  return data;
}

v1::SmoothRequest request_of(v1::ArrayId id, std::int64_t offset, const std::string& data) {
  v1::SmoothRequest request;
  request.mutable_chunk()->set_array_id(id);
  request.mutable_chunk()->set_offset_bytes(offset);
  request.mutable_chunk()->set_data(data);
  return request;
}

std::string random_text(std::mt19937& random, std::size_t size) {
  std::string text(size, '\0');
  for (char& c : text) c = static_cast<char>(random());
  return text;
}

constexpr int kField = v1::SmoothRequest::kChunkFieldNumber;

TEST(RawMessage, WritesChunksAsProtobufDoes) {
  std::mt19937 random(1);
  for (const std::size_t size : {0U, 1U, 127U, 128U, 16383U, 16384U, 1U << 20}) {
    for (const std::int64_t offset : {0LL, 1LL, 127LL, 128LL, 1LL << 31, 1LL << 40}) {
      for (const v1::ArrayId id : {v1::ARRAY_ID_UNSPECIFIED, v1::ARRAY_ID_COORDINATES}) {
        const std::string data = random_text(random, size);
        EXPECT_EQ(flat(encode_chunk(kField, id, offset, bytes_of(data))),
                  request_of(id, offset, data).SerializeAsString());
      }
    }
  }
}

TEST(RawMessage, FindsChunksHoweverTheyAreCut) {
  std::mt19937 random(2);
  for (const std::size_t size : {0U, 1U, 300U, 70'000U}) {
    v1::SmoothRequest request =
        request_of(v1::ARRAY_ID_FIXED_MASK, 1LL << 40, random_text(random, size));
    for (const bool checked : {false, true}) {
      if (checked) request.mutable_chunk()->set_crc32c(crc32c(bytes_of(request.chunk().data())));
      for (const std::size_t slice_bytes : {1U, 7U, 8192U, 1U << 20}) {
        grpc::ByteBuffer buffer = in_sell(request.SerializeAsString(), slice_bytes);
        const auto chunk = find_chunk(buffer, kField);
        ASSERT_TRUE(chunk);
        EXPECT_EQ(chunk->array_id, v1::ARRAY_ID_FIXED_MASK);
        EXPECT_EQ(chunk->offset_bytes, 1LL << 40);
        EXPECT_EQ(data_of(*chunk), request.chunk().data());
        EXPECT_EQ(chunk->crc32c.has_value(), checked);
        EXPECT_TRUE(chunk->has_right_checksum());
      }
    }
  }
}

TEST(RawMessage, SeesAWrongChecksumOverAllPieces) {
  v1::SmoothRequest request = request_of(v1::ARRAY_ID_ELEMENTS, 0, std::string(1000, 'x'));
  request.mutable_chunk()->set_crc32c(crc32c(bytes_of(request.chunk().data())) + 1);
  grpc::ByteBuffer buffer = in_sell(request.SerializeAsString(), 100);
  const auto chunk = find_chunk(buffer, kField);
  ASSERT_TRUE(chunk);
  EXPECT_FALSE(chunk->has_right_checksum());
}

TEST(RawMessage, LeavesWhatIsNoPlainChunkToProtobuf) {
  const std::string chunk = request_of(v1::ARRAY_ID_ELEMENTS, 5, "abc").SerializeAsString();
  v1::SmoothRequest spec;
  spec.mutable_spec()->set_request_id("x");
  for (const std::string& bytes : {std::string(), spec.SerializeAsString(), chunk + chunk,
                                   chunk + spec.SerializeAsString(), chunk.substr(0, 4)}) {
    grpc::ByteBuffer buffer = in_sell(bytes, 1 << 20);
    EXPECT_FALSE(find_chunk(buffer, kField)) << bytes.size();
    v1::SmoothRequest parsed, expected;
    EXPECT_EQ(parse(buffer, parsed), expected.ParseFromString(bytes));
    EXPECT_EQ(parsed.SerializeAsString(), expected.SerializeAsString());
  }
}

// Those of more than five bytes protobuf refuses.
TEST(RawMessage, LeavesLongTagsAndLengthsToProtobuf) {
  const std::string zero(1, '\0');
  for (const std::string& bytes :
       {std::string("\x12\x07\x1a\x80\x80\x80\x80\x80\x08"),        // length of the data: 2^38
        std::string("\x12\x82\x80\x80\x80\x80\x10\x08\x05"),        // of the chunk: 2^39 + 2
        std::string("\x12\x07\x88\x80\x80\x80\x80\x10\x05"),        // tag of the array
        std::string("\x92\x80\x80\x80\x80\x10\x02\x08\x05"),        // of the chunk
        "\x12\x03\x1a\x80" + zero, "\x12\x82" + zero + "\x08\x05",  // allowed, but unusual
        "\x12\x03\x88" + zero + "\x05", "\x92" + zero + "\x02\x08\x05"}) {
    grpc::ByteBuffer buffer = in_sell(bytes, 1 << 20);
    EXPECT_FALSE(find_chunk(buffer, kField)) << bytes.size();
  }
}

// Of broken messages nothing may be taken that protobuf does not see.
TEST(RawMessage, FindsOnlyWhatProtobufFinds) {
  std::mt19937 random(3);
  int found = 0;
  for (int i = 0; i < 100'000; ++i) {
    v1::SmoothRequest request =
        request_of(static_cast<v1::ArrayId>(random() % 5),
                   static_cast<std::int64_t>(random() % 1000), random_text(random, random() % 40));
    if (random() % 2 == 0)
      request.mutable_chunk()->set_crc32c(static_cast<std::uint32_t>(random()));
    std::string bytes = request.SerializeAsString();
    for (std::size_t change = random() % 4; change > 0 && !bytes.empty(); --change) {
      const std::size_t at = random() % bytes.size();
      switch (random() % 3) {
        case 0:
          bytes[at] = static_cast<char>(random());
          break;
        case 1:
          bytes.resize(at);
          break;
        default:
          bytes.insert(at, 1, static_cast<char>(random() % 40));
      }
    }
    grpc::ByteBuffer buffer = in_sell(bytes, 1 + random() % 20);
    const auto chunk = find_chunk(buffer, kField);
    if (!chunk) continue;
    ++found;
    v1::SmoothRequest parsed;
    ASSERT_TRUE(parsed.ParseFromString(bytes)) << i;
    ASSERT_TRUE(parsed.has_chunk()) << i;
    EXPECT_EQ(chunk->array_id, parsed.chunk().array_id());
    EXPECT_EQ(chunk->offset_bytes, parsed.chunk().offset_bytes());
    EXPECT_EQ(data_of(*chunk), parsed.chunk().data());
    EXPECT_EQ(chunk->crc32c.has_value(), parsed.chunk().has_crc32c());
  }
  EXPECT_GT(found, 25'000);  // those left whole, and some that were not
}

}  // namespace
}  // namespace meshsmooth::wire
