#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "job.hpp"
#include "meshsmooth/v1/smoothing.pb.h"
#include "region/region_service.hpp"
#include "wire/mesh_assembler.hpp"

namespace meshsmooth::server {

/// Where the arrays of a job lie in a region: all within it, as of the job's layout.
class RegionUse {
 public:
  /// Throws Error (REGION_NOT_FOUND, REGION_OUT_OF_RANGE), InvalidOption (OPTION_OUT_OF_RANGE: not
  /// the arrays of the job in their order). `service`: null where there are no regions.
  RegionUse(const v1::RegionUse& message, const RegionService* service, const JobRequest& job);

  /// The coordinates, where a device reads and writes them by itself.
  [[nodiscard]] std::optional<wire::SharedCoordinates> shared_coordinates() const;

  /// That `take_inputs` copies.
  [[nodiscard]] std::int64_t input_bytes(const wire::MeshAssembler& mesh) const;
  [[nodiscard]] std::int64_t result_bytes() const {
    return static_cast<std::int64_t>(result_.size());
  }

  /// Copies the inputs into the arrays of the job, but for those that it shares; afterwards the
  /// server reads nothing else of the region. Ends early, leaving the mesh incomplete, when a stop
  /// is requested. Throws what MeshAssembler::add throws.
  void take_inputs(wire::MeshAssembler& mesh, const std::stop_token& stop) const;
  /// That `write_result` copies.
  [[nodiscard]] std::int64_t result_bytes_to_copy(const JobResult& result) const;
  /// Copies what the job has not written there itself.
  void write_result(const JobResult& result) const;

 private:
  struct Input {
    v1::ArrayId array_id;
    std::span<const std::byte> bytes;
  };

  std::shared_ptr<Region> region_;
  [[nodiscard]] static bool is_copied(const Input& input, const wire::MeshAssembler& mesh) {
    return input.array_id != v1::ARRAY_ID_COORDINATES || !mesh.shares_coordinates();
  }

  std::vector<Input> inputs_;
  std::span<std::byte> result_;
  std::size_t coordinates_bytes_;  // of the result
};

}  // namespace meshsmooth::server
