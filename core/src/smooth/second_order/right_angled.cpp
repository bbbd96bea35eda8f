#include "smooth/second_order/right_angled.hpp"

#include "mesh/curved_jacobian.hpp"
#include "smooth/base/topology.hpp"
#include "smooth/second_order/repaired_part.hpp"
#include "smooth/second_order/shares.hpp"

namespace meshsmooth::detail {

template <class Real>
std::vector<std::uint8_t> find_right_angled(const TopologyView& topology,
                                            const SurfaceOrientation& orientation,
                                            std::span<const Vec3<Real>> positions) {
  constexpr double kRightAngled = 0.99;  // the measure is a bound, up to 0.003 lower
  std::vector<std::uint8_t> curved(topology.node_count), other(topology.node_count);
  for_each_element(
      topology, [&](ElementType type, std::span<const NodeId> nodes, std::size_t element) {
        const auto at = positions_of(nodes, positions);
        const bool right =
            !is_simplex(element_shape(linear_type(type))) &&
            least_scaled_jacobian(type, at.data(), orientation.reference(element)) >= kRightAngled;
        if (!right) {
          mark_nodes(nodes, other);
        } else if (!is_straight(type, at.data())) {
          mark_nodes(nodes, curved);
        }
      });
  for (std::size_t n = 0; n < curved.size(); ++n) curved[n] = curved[n] != 0 && other[n] == 0;
  return curved;
}

template std::vector<std::uint8_t> find_right_angled(const TopologyView&, const SurfaceOrientation&,
                                                     std::span<const Vec3f>);
template std::vector<std::uint8_t> find_right_angled(const TopologyView&, const SurfaceOrientation&,
                                                     std::span<const Vec3d>);

}  // namespace meshsmooth::detail
