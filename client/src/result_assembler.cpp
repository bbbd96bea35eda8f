#include "result_assembler.hpp"

#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <string>
#include <type_traits>
#include <utility>

#include "service_error.hpp"
#include "wire/codec.hpp"

namespace meshsmooth::client {
namespace {

/// Memory that is filled for the first time comes in large pages where the system gives any: small
/// ones cost a good part of a fast transfer. Only advice. Smaller blocks are malloc's to use again.
void advise_large_pages(void* data, std::size_t bytes) {
  constexpr std::size_t kLeast = 4 << 20;
  if (bytes < kLeast) return;
  const auto page = static_cast<std::uintptr_t>(sysconf(_SC_PAGESIZE));
  const auto begin = (reinterpret_cast<std::uintptr_t>(data) + page - 1) / page * page;
  const auto end = (reinterpret_cast<std::uintptr_t>(data) + bytes) / page * page;
  if (begin < end) madvise(reinterpret_cast<void*>(begin), end - begin, MADV_HUGEPAGE);
}

}  // namespace

void ResultAssembler::begin(const v1::ResultHeader& header, Positions memory) {
  if (begun_) throw broken_answer("the server announced its result twice");
  const bool float64 = std::holds_alternative<std::vector<Vec3d>>(mesh_.positions);
  const v1::ScalarType type = float64 ? v1::SCALAR_TYPE_FLOAT64 : v1::SCALAR_TYPE_FLOAT32;
  if (header.node_count() != static_cast<std::int64_t>(mesh_.node_count()) ||
      header.coordinate_type() != type) {
    throw broken_answer("the server announced a result of " + std::to_string(header.node_count()) +
                        " nodes in " + v1::ScalarType_Name(header.coordinate_type()) + " for " +
                        std::to_string(mesh_.node_count()) + " nodes in " +
                        v1::ScalarType_Name(type));
  }
  try {
    quality_.metrics = wire::decode_metrics(header.element_quality_metrics());
  } catch (const Error& error) {
    throw broken_answer("cannot decode the result's header: " + std::string(error.what()));
  }
  make_room(std::move(memory));
  begun_ = true;
  if (header.size_bytes() != static_cast<std::int64_t>(size_bytes_)) {
    throw broken_answer("the server announced a result of " + std::to_string(header.size_bytes()) +
                        " bytes, it must have " + std::to_string(size_bytes_));
  }
}

void ResultAssembler::make_room(Positions memory) {
  positions_ = std::move(memory);
  std::visit(
      [this](const auto& input) {
        using Own = std::remove_cvref_t<decltype(input)>;
        auto* positions = std::get_if<Own>(&positions_);
        if (positions == nullptr) positions = &positions_.emplace<Own>();
        const bool is_new = positions->capacity() < input.size();
        if (is_new) *positions = Own();  // {} would keep what is then copied
        positions->reserve(input.size());
        positions->resize(std::min(positions->size(), input.size()));
        coordinates_bytes_ = input.size() * sizeof(input[0]);
        if (is_new) advise_large_pages(positions->data(), coordinates_bytes_);
      },
      mesh_.positions);
  const std::size_t value_count = quality_.metrics.size() * mesh_.element_count();
  quality_.values.reserve(value_count);
  size_bytes_ = coordinates_bytes_ + value_count * sizeof(float);
}

void ResultAssembler::add(const wire::ChunkView& chunk) {
  const bool positions_due = received_bytes_ < coordinates_bytes_ || metrics().empty();
  const v1::ArrayId array_id =
      positions_due ? v1::ARRAY_ID_COORDINATES : v1::ARRAY_ID_ELEMENT_QUALITY;
  const std::size_t offset_bytes = received_bytes_ - (positions_due ? 0 : coordinates_bytes_);
  if (!begun_ || chunk.array_id != array_id ||
      chunk.offset_bytes != static_cast<std::int64_t>(offset_bytes)) {
    throw broken_answer("the server sent result bytes at " + std::to_string(chunk.offset_bytes) +
                        " where those at " + std::to_string(offset_bytes) + " were due");
  }
  if (chunk.size_bytes > (positions_due ? coordinates_bytes_ : size_bytes_) - received_bytes_) {
    throw broken_answer("the server sent more result bytes than the " +
                        std::to_string(size_bytes_) + " announced");
  }
  if (!chunk.has_right_checksum()) {
    throw broken_answer("the checksum of the result bytes at " + std::to_string(received_bytes_) +
                        " is wrong");
  }
  const auto append = [&](auto& values) {
    // Grown chunk by chunk: values zeroed all at once would leave the caches before they are
    // filled.
    constexpr std::size_t kValueBytes = sizeof(values[0]);
    const std::size_t end = offset_bytes + chunk.size_bytes;
    values.resize(std::max(values.size(), (end + kValueBytes - 1) / kValueBytes));
    chunk.copy_to(std::as_writable_bytes(std::span(values)).data() + offset_bytes);
  };
  if (positions_due) {
    std::visit(append, positions_);
  } else {
    append(quality_.values);
  }
  received_bytes_ += chunk.size_bytes;
}

void ResultAssembler::add_all(std::span<const std::byte> bytes) {
  constexpr std::size_t kPieceBytes = 256 << 10;  // see `append`
  if (!begun_ || bytes.size() < size_bytes_) throw broken_answer("the result is incomplete");
  while (received_bytes_ < size_bytes_) {
    const bool positions_due = received_bytes_ < coordinates_bytes_;
    const std::size_t end = positions_due ? coordinates_bytes_ : size_bytes_;
    wire::ChunkView chunk;
    chunk.array_id = positions_due ? v1::ARRAY_ID_COORDINATES : v1::ARRAY_ID_ELEMENT_QUALITY;
    chunk.offset_bytes =
        static_cast<std::int64_t>(received_bytes_ - (positions_due ? 0 : coordinates_bytes_));
    chunk.size_bytes = std::min(kPieceBytes, end - received_bytes_);
    chunk.pieces = {bytes.subspan(received_bytes_, chunk.size_bytes)};
    add(chunk);
  }
}

Positions ResultAssembler::take() {
  if (!begun_ || received_bytes_ != size_bytes_) {
    throw broken_answer("the result is incomplete: " + std::to_string(received_bytes_) + " of " +
                        std::to_string(size_bytes_) + " bytes arrived");
  }
  return std::move(positions_);
}

}  // namespace meshsmooth::client
