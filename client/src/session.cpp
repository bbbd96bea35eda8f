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
        topology_name(wire::topology_name(MeshTopology(mesh).view())),
        route(topology_name.substr(topology_name.rfind('-') + 1)) {}

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
  std::string topology_name;
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

Session Client::open(const Mesh& mesh) {
  return Session(std::make_unique<Session::Impl>(*impl_, mesh));
}

}  // namespace meshsmooth::client
