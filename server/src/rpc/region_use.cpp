#include "rpc/region_use.hpp"

#include <algorithm>
#include <cstring>

#include "meshsmooth/error.hpp"

namespace meshsmooth::server {
namespace {

// A part of what the first cache keeps, so that the hash of a topology reads it from there.
constexpr std::size_t kPieceBytes = 256 << 10;

std::span<std::byte> part_of(const Region& region, const std::string& array,
                             std::int64_t offset_bytes, std::int64_t size_bytes) {
  const std::int64_t size = region.size_bytes();
  if (offset_bytes < 0 || offset_bytes > size || size_bytes > size - offset_bytes) {
    throw Error("REGION_OUT_OF_RANGE",
                array + ": " + std::to_string(size_bytes) + " bytes at " +
                    std::to_string(offset_bytes) + " end behind the region, which has " +
                    std::to_string(size),
                {{"array", array},
                 {"offset_bytes", std::to_string(offset_bytes)},
                 {"size_bytes", std::to_string(size)}});
  }
  return region.bytes().subspan(static_cast<std::size_t>(offset_bytes),
                                static_cast<std::size_t>(size_bytes));
}

std::string name_of(v1::ArrayId id) { return v1::ArrayId_Name(id); }

}  // namespace

RegionUse::RegionUse(const v1::RegionUse& message, const RegionService* service,
                     const JobRequest& job) {
  if (service == nullptr) {
    throw NotSupported("OPTION_NOT_SUPPORTED", "region: this server shares no memory",
                       {{"field", "region"}});
  }
  region_ = service->find(job.caller, message.region_name());
  const std::vector<wire::MeshLayout::Array> arrays = job.layout.arrays();
  const bool right = std::ranges::equal(arrays, message.inputs(), {}, &wire::MeshLayout::Array::id,
                                        &v1::RegionArray::array_id);
  if (!right) {
    std::string expected;
    for (const auto& array : arrays) expected += (expected.empty() ? "" : ", ") + name_of(array.id);
    throw InvalidOption("OPTION_OUT_OF_RANGE", "region.inputs: expected " + expected,
                        {{"field", "region.inputs"}});
  }
  for (int i = 0; i < message.inputs_size(); ++i) {
    const auto& [id, size_bytes] = arrays[static_cast<std::size_t>(i)];
    inputs_.push_back(
        {id, part_of(*region_, name_of(id), message.inputs(i).offset_bytes(), size_bytes)});
  }
  result_ = part_of(*region_, "result", message.result_offset_bytes(), job.result_bytes());
  coordinates_bytes_ = static_cast<std::size_t>(job.layout.coordinates_bytes);
}

std::optional<wire::SharedCoordinates> RegionUse::shared_coordinates() const {
  wire::SharedCoordinates shared{region_, {}, result_.first(coordinates_bytes_)};
  const auto given = std::ranges::find(inputs_, v1::ARRAY_ID_COORDINATES, &Input::array_id);
  if (given != inputs_.end()) shared.given = given->bytes;
  const auto is_aligned = [](const std::byte* data) {
    return reinterpret_cast<std::uintptr_t>(data) % alignof(double) == 0;
  };
  const bool possible = region_->open_to_devices() && is_aligned(shared.given.data()) &&
                        is_aligned(shared.result.data());
  return possible ? std::optional(shared) : std::nullopt;
}

std::int64_t RegionUse::input_bytes(const wire::MeshAssembler& mesh) const {
  std::size_t bytes = 0;
  for (const Input& input : inputs_) {
    if (is_copied(input, mesh)) bytes += input.bytes.size();
  }
  return static_cast<std::int64_t>(bytes);
}

void RegionUse::take_inputs(wire::MeshAssembler& mesh, const std::stop_token& stop) const {
  for (const Input& input : inputs_) {
    if (!is_copied(input, mesh)) continue;
    for (std::size_t at = 0; at < input.bytes.size() && !stop.stop_requested();) {
      const auto piece = input.bytes.subspan(at, std::min(kPieceBytes, input.bytes.size() - at));
      wire::ChunkView chunk;
      chunk.array_id = input.array_id;
      chunk.offset_bytes = static_cast<std::int64_t>(at);
      chunk.pieces = {piece};
      chunk.size_bytes = piece.size();
      mesh.add(chunk);
      at += piece.size();
    }
  }
}

std::int64_t RegionUse::result_bytes_to_copy(const JobResult& result) const {
  const bool there = result.coordinates.data() == result_.data();
  return result_bytes() - (there ? static_cast<std::int64_t>(coordinates_bytes_) : 0);
}

void RegionUse::write_result(const JobResult& result) const {
  for (std::size_t at = 0; at < result_.size();) {
    const auto bytes = result.part_at(static_cast<std::int64_t>(at)).bytes;
    if (bytes.data() != result_.data() + at) {
      std::memcpy(result_.data() + at, bytes.data(), bytes.size());
    }
    at += bytes.size();
  }
}

}  // namespace meshsmooth::server
