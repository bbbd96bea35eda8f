#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "server/smooth_call.hpp"

namespace meshsmooth::testing {

/// A row of tetrahedra for the real smoother, float64: a job of any length.
class Row {
 public:
  explicit Row(std::int32_t elements) {
    for (std::int32_t e = 0; e < elements; ++e) {
      for (const std::int32_t n : {0, 1, 2, 3}) elements_.push_back(e + n);
      // Every second one would lie the other way round.
      if (e % 2 == 1) std::swap(elements_[elements_.size() - 1], elements_[elements_.size() - 2]);
    }
    for (std::int32_t n = 0; n < elements + 3; ++n) {
      const double a = 2.0 * n;
      for (const double x : {std::cos(a), std::sin(a), 0.2 * n}) places_.push_back(x);
    }
  }

  /// So many sweeps; but after 1,300 it stagnates, which takes 25 us an element on two cores. (Its
  /// ends creep inwards, as t^-1/4. Small steps would stagnate after 50: none is much smaller than
  /// the one before.)
  [[nodiscard]] v1::JobSpec spec(int sweeps, const std::string& request_id = "") const {
    v1::JobSpec spec;
    spec.set_request_id(request_id);
    v1::TopologySpec* topology = spec.mutable_inline_topology();
    topology->set_node_count(static_cast<std::int64_t>(places_.size() / 3));
    topology->add_element_blocks()->set_element_type(v1::ELEMENT_TYPE_TETRAHEDRON);
    topology->mutable_element_blocks(0)->set_element_count(
        static_cast<std::int64_t>(elements_.size() / 4));
    spec.set_coordinate_type(v1::SCALAR_TYPE_FLOAT64);
    v1::SmoothingOptions* options = spec.mutable_options();
    options->mutable_laplacian()->set_relaxation_factor(0.5);
    options->set_guard(false);
    options->set_boundary_policy(v1::BOUNDARY_POLICY_FREE);
    options->set_max_iteration_count(sweeps);
    options->set_absolute_tolerance(1e-300);
    return spec;
  }

  /// All its data, as far as the server wants it.
  void send(SmoothCall& call) const {
    send_array(call, v1::ARRAY_ID_ELEMENTS, bytes_of(elements_));
    send_array(call, v1::ARRAY_ID_COORDINATES, bytes_of(places_));
    call.half_close();
  }

  [[nodiscard]] std::size_t result_bytes() const { return places_.size() * sizeof(double); }

 private:
  static void send_array(SmoothCall& call, v1::ArrayId id, const std::string& bytes) {
    constexpr std::size_t kChunk = 1 << 20;
    for (std::size_t at = 0; at < bytes.size(); at += kChunk) {
      if (!call.send(chunk(id, static_cast<std::int64_t>(at), bytes.substr(at, kChunk)))) return;
    }
  }

  std::vector<std::int32_t> elements_;
  std::vector<double> places_;
};

}  // namespace meshsmooth::testing
