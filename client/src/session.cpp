#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "client_impl.hpp"
#include "wire/topology_name.hpp"

namespace meshsmooth::client {

struct Session::Impl {
  Impl(Client::Impl& its_client, const Mesh& its_mesh)
      : client(its_client),
        mesh(its_mesh),
        node_count(mesh.node_count()),
        reference(mesh.positions),
        topology_name(wire::topology_name(MeshTopology(mesh).view())),
        route(topology_name.substr(topology_name.rfind('-') + 1)) {}

  SmoothReport move(const SmoothOptions& options, const RequestOptions& request) {
    // It is another topology: its reference belongs to it.
    if (moving_name.empty()) {
      const PositionsView own = std::visit(
          [](const auto& array) -> PositionsView { return std::span(array); }, reference);
      moving_name = wire::topology_name(MeshTopology(mesh).view(), own);
    }
    mesh.positions = reference;
    return client.smooth(mesh, options, request, {moving_name, false, route});
  }

  template <class Real>
  SmoothReport smooth(std::span<Vec3<Real>> positions, const SmoothOptions& options,
                      const RequestOptions& request) {
    if (positions.size() != node_count) {
      throw ServiceError(StatusCode::invalid_argument, "ARRAY_SIZE_MISMATCH",
                         std::to_string(positions.size()) + " positions for a mesh of " +
                             std::to_string(node_count) + " nodes",
                         {}, {});
    }
    using Own = std::vector<Vec3<Real>>;
    if (!std::holds_alternative<Own>(mesh.positions)) mesh.positions.emplace<Own>();
    auto& own = std::get<Own>(mesh.positions);
    own.assign(positions.begin(), positions.end());
    SmoothReport report = client.smooth(mesh, options, request, {topology_name, false, route});
    std::copy(own.begin(), own.end(), positions.begin());
    return report;
  }

  Client::Impl& client;
  Mesh mesh;  // its positions are those of the last job
  const std::size_t node_count;
  const Positions reference;  // the mesh's positions when it was opened
  std::string topology_name;
  std::string moving_name;  // of the topology with its reference; empty: not needed yet
  std::string route;
};

Session::Session(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Session::~Session() = default;
Session::Session(Session&&) noexcept = default;
Session& Session::operator=(Session&&) noexcept = default;

const std::string& Session::topology_name() const { return impl_->topology_name; }

SmoothReport Session::smooth(std::span<Vec3d> positions, const SmoothOptions& options,
                             const RequestOptions& request) {
  return impl_->smooth(positions, options, request);
}

SmoothReport Session::smooth(std::span<Vec3f> positions, const SmoothOptions& options,
                             const RequestOptions& request) {
  return impl_->smooth(positions, options, request);
}

SmoothReport Session::move(std::span<const NodeId> nodes, PositionsView positions,
                           SmoothOptions options, const RequestOptions& request) {
  options.prescribed = {nodes, positions};
  validate(options);
  return impl_->move(options, request);
}

PositionsView Session::positions() const { return impl_->mesh.positions_view(); }

Session Client::open(const Mesh& mesh) {
  return Session(std::make_unique<Session::Impl>(*impl_, mesh));
}

}  // namespace meshsmooth::client
