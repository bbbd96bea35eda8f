#include <algorithm>
#include <cstddef>
#include <cstring>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include "meshsmooth/error.hpp"
#include "rpc/transfer.hpp"
#include "transport/copy_threads.hpp"
#include "transport/shared_segment.hpp"

namespace meshsmooth::server {
namespace {

// A part of what the first cache keeps, so that the hash of a topology reads it from there.
constexpr std::size_t kPieceBytes = 256 << 10;

std::span<std::byte> part_of(const SharedSegment& segment, const std::string& array,
                             std::int64_t offset_bytes, std::int64_t size_bytes) {
  const std::int64_t size = segment.size_bytes();
  if (offset_bytes < 0 || offset_bytes > size || size_bytes > size - offset_bytes) {
    throw Error("SHARED_MEMORY_OUT_OF_RANGE",
                array + ": " + std::to_string(size_bytes) + " bytes at " +
                    std::to_string(offset_bytes) + " end behind the segment, which has " +
                    std::to_string(size),
                {{"array", array},
                 {"offset_bytes", std::to_string(offset_bytes)},
                 {"size_bytes", std::to_string(size)}});
  }
  return segment.bytes().subspan(static_cast<std::size_t>(offset_bytes),
                                 static_cast<std::size_t>(size_bytes));
}

std::string name_of(v1::ArrayId id) { return v1::ArrayId_Name(id); }

/// Through a segment that the caller leased: all arrays lie within it, as of the job's layout.
class SharedMemoryTransfer final : public Transfer {
 public:
  /// See `decode_transfer`.
  SharedMemoryTransfer(const v1::SharedMemoryUse& message, const Transport& transport,
                       const JobRequest& job);

  [[nodiscard]] bool in_place() const override { return true; }
  [[nodiscard]] bool copies_inputs() const override { return !coordinates_stay_; }

  bool upload(Job& job, Uploaded done) const override;
  void download(std::shared_ptr<const JobResult> result, Downloaded done) const override;

  /// The coordinates, from now on not copied; nothing where a device cannot read and write them by
  /// itself.
  [[nodiscard]] std::optional<CoordinatesInPlace> leave_coordinates();

 private:
  struct Input {
    v1::ArrayId array_id;
    std::span<const std::byte> bytes;
  };

  [[nodiscard]] bool is_copied(const Input& input) const {
    return input.array_id != v1::ARRAY_ID_COORDINATES || !coordinates_stay_;
  }
  void copy_inputs(Job& job, const Uploaded& done) const;
  /// Afterwards the server reads nothing else of the segment.
  void copy_inputs(wire::MeshAssembler& mesh, const std::stop_token& stop) const;
  [[nodiscard]] std::int64_t bytes_to_write(const JobResult& result) const;
  /// Copies what the job has not written there itself.
  void write(const JobResult& result) const;

  CopyThreads* copies_;
  std::shared_ptr<SharedSegment> segment_;
  std::vector<Input> inputs_;
  std::span<std::byte> result_;
  std::size_t coordinates_bytes_;  // of the result
  bool coordinates_stay_ = false;
};

SharedMemoryTransfer::SharedMemoryTransfer(const v1::SharedMemoryUse& message,
                                           const Transport& transport, const JobRequest& job)
    : segment_(transport.find(job.caller, message.segment_name())) {
  copies_ = &transport.copies();
  const std::vector<wire::MeshLayout::Array> arrays = job.layout.arrays();
  const bool right = std::ranges::equal(arrays, message.inputs(), {}, &wire::MeshLayout::Array::id,
                                        &v1::SharedMemoryArray::array_id);
  if (!right) {
    std::string expected;
    for (const auto& array : arrays) expected += (expected.empty() ? "" : ", ") + name_of(array.id);
    throw InvalidOption("OPTION_OUT_OF_RANGE", "shared_memory.inputs: expected " + expected,
                        {{"field", "shared_memory.inputs"}});
  }
  for (int i = 0; i < message.inputs_size(); ++i) {
    const auto& [id, size_bytes] = arrays[static_cast<std::size_t>(i)];
    inputs_.push_back(
        {id, part_of(*segment_, name_of(id), message.inputs(i).offset_bytes(), size_bytes)});
  }
  result_ = part_of(*segment_, "result", message.result_offset_bytes(), job.result_bytes());
  coordinates_bytes_ = static_cast<std::size_t>(job.layout.coordinates_bytes);
}

std::optional<CoordinatesInPlace> SharedMemoryTransfer::leave_coordinates() {
  CoordinatesInPlace place{segment_, {}, result_.first(coordinates_bytes_)};
  const auto given = std::ranges::find(inputs_, v1::ARRAY_ID_COORDINATES, &Input::array_id);
  if (given != inputs_.end()) place.given = given->bytes;
  const auto is_aligned = [](const std::byte* data) {
    return reinterpret_cast<std::uintptr_t>(data) % alignof(double) == 0;
  };
  coordinates_stay_ = segment_->open_to_devices() && is_aligned(place.given.data()) &&
                      is_aligned(place.result.data());
  return coordinates_stay_ ? std::optional(place) : std::nullopt;
}

bool SharedMemoryTransfer::upload(Job& job, Uploaded done) const {
  std::size_t bytes = 0;
  for (const Input& input : inputs_) {
    if (is_copied(input)) bytes += input.bytes.size();
  }
  if (static_cast<std::int64_t>(bytes) <= CopyThreads::kAtOnceBytes) {
    copy_inputs(job, done);
    return false;
  }
  copies_->post([this, &job, done = std::move(done)] { copy_inputs(job, done); });
  return true;
}

void SharedMemoryTransfer::copy_inputs(Job& job, const Uploaded& done) const {
  std::exception_ptr error;
  try {
    copy_inputs(job.mesh(), job.stop_token());
  } catch (...) {
    error = std::current_exception();
  }
  std::int64_t bytes = job.mesh().received_bytes();
  for (const Input& input : inputs_) {
    if (!is_copied(input)) bytes += static_cast<std::int64_t>(input.bytes.size());
  }
  done(bytes, error);
}

void SharedMemoryTransfer::copy_inputs(wire::MeshAssembler& mesh,
                                       const std::stop_token& stop) const {
  for (const Input& input : inputs_) {
    if (!is_copied(input)) continue;
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

void SharedMemoryTransfer::download(std::shared_ptr<const JobResult> result,
                                    Downloaded done) const {
  if (bytes_to_write(*result) <= CopyThreads::kAtOnceBytes) {
    write(*result);
    return done();
  }
  copies_->post([this, result = std::move(result), done = std::move(done)] {
    write(*result);
    done();
  });
}

std::int64_t SharedMemoryTransfer::bytes_to_write(const JobResult& result) const {
  const bool there = result.coordinates.data() == result_.data();
  return static_cast<std::int64_t>(result_.size() - (there ? coordinates_bytes_ : 0));
}

void SharedMemoryTransfer::write(const JobResult& result) const {
  for (std::size_t at = 0; at < result_.size();) {
    const auto bytes = result.part_at(static_cast<std::int64_t>(at)).bytes;
    if (bytes.data() != result_.data() + at) {
      std::memcpy(result_.data() + at, bytes.data(), bytes.size());
    }
    at += bytes.size();
  }
}

}  // namespace

std::shared_ptr<const Transfer> decode_transfer(const v1::JobSpec& spec, Engine& engine,
                                                JobRequest& job) {
  static const auto chunks = std::make_shared<const ChunkTransfer>();
  if (!spec.has_shared_memory()) return chunks;
  const auto transfer =
      std::make_shared<SharedMemoryTransfer>(spec.shared_memory(), engine.transport(), job);
  // A kept result would hold the segment as long.
  if (!job.kept() && engine.reads_positions_once(job.layout.size())) {
    job.coordinates_in_place = transfer->leave_coordinates();
  }
  return transfer;
}

void clear_transfer(v1::JobSpec& spec) { spec.clear_shared_memory(); }

void encode_transport(const Transport& transport, v1::GetServerInfoResponse& info) {
  if (transport.max_bytes() == 0) return;
  info.add_features("shared_memory");
  info.mutable_limits()->set_max_shared_memory_bytes(transport.max_bytes());
}

}  // namespace meshsmooth::server
