#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "client_impl.hpp"
#include "wire/topology_name.hpp"

namespace meshsmooth::client {

/// The current positions are in one of three places: in the mesh until the first job, then in
/// memory, or in a region once there is one, where results alternate between two places so that
/// they need not be copied.
struct Session::Impl {
  Impl(Client::Impl& its_client, const Mesh& its_mesh)
      : client(its_client),
        mesh(its_mesh),
        topology_name(wire::topology_name(MeshTopology(mesh).view())),
        route(topology_name.substr(topology_name.rfind('-') + 1)) {}
  ~Impl() { now.region.keep(); }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  [[nodiscard]] PositionsSpan positions() {
    if (!begun) {
      own = mesh.positions;
      begun = true;
    }
    if (now.in_region.empty()) {
      return std::visit([](auto& array) -> PositionsSpan { return std::span(array); }, own);
    }
    const auto typed = [&]<class Real>() {
      auto* first = reinterpret_cast<Vec3<Real>*>(now.in_region.data());
      return std::span(first, mesh.node_count());
    };
    if (float64_in_region) return typed.operator()<double>();
    return typed.operator()<float>();
  }

  SmoothReport smooth(const SmoothOptions& options, const RequestOptions& request,
                      const JobInput& input) {
    leave_lost_region();
    return run({mesh, as_view(positions()), input}, options, request, topology_name);
  }

  template <class Real>
  SmoothReport smooth(std::span<Vec3<Real>> positions, const SmoothOptions& options,
                      const RequestOptions& request, const JobInput& input) {
    if (positions.size() != mesh.node_count()) {
      throw ServiceError(StatusCode::invalid_argument, "ARRAY_SIZE_MISMATCH",
                         std::to_string(positions.size()) + " positions for a mesh of " +
                             std::to_string(mesh.node_count()) + " nodes",
                         {}, {});
    }
    leave_lost_region();
    SmoothReport report =
        run({mesh, std::span<const Vec3<Real>>(positions), input}, options, request, topology_name);
    std::ranges::copy(std::get<std::span<Vec3<Real>>>(this->positions()), positions.begin());
    return report;
  }

  SmoothReport move(const JobInput& input, const SmoothOptions& options,
                    const RequestOptions& request) {
    // It is another topology: its reference belongs to it.
    if (moving_name.empty()) {
      moving_name = wire::topology_name(MeshTopology(mesh).view(), mesh.positions_view());
    }
    leave_lost_region();
    return run({mesh, mesh.positions_view(), input}, options, request, moving_name);
  }

  SmoothReport run(const JobMesh& job, const SmoothOptions& options, const RequestOptions& request,
                   const std::string& topology) {
    try {
      now.more_bytes = bytes_of(job.positions).size();
      SmoothReport report = client.smooth(job, options, request, {topology, false, route}, now);
      begun = true;
      float64_in_region = std::holds_alternative<std::span<const Vec3d>>(job.positions);
      if (now.in_region.empty()) {
        std::swap(own, now.memory);
        now.region = {};
      } else {
        own = now.memory = Positions();
      }
      return report;
    } catch (...) {
      leave_region();  // the server may still write to it
      throw;
    }
  }

  void leave_lost_region() {
    if (now.region.get() != nullptr && now.region.get()->ended()) leave_region();
  }

  void leave_region() {
    if (now.in_region.empty()) return;
    now.copy_to_memory(as_view(positions()));
    std::swap(own, now.memory);
    now.region.give_up();
  }

  Client::Impl& client;
  const Mesh mesh;  // as it was opened: the reference of motions
  bool begun = false;
  Positions own;  // of the last job, unless they lie in the region
  Delivery now;
  bool float64_in_region = false;
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
                             const RequestOptions& request, const JobInput& input) {
  return impl_->smooth(positions, options, request, input);
}

SmoothReport Session::smooth(std::span<Vec3f> positions, const SmoothOptions& options,
                             const RequestOptions& request, const JobInput& input) {
  return impl_->smooth(positions, options, request, input);
}

SmoothReport Session::move(std::span<const NodeId> nodes, PositionsView positions,
                           const SmoothOptions& options, const RequestOptions& request,
                           JobInput input) {
  input.prescribed = {nodes, positions};
  validate(options, input);
  return impl_->move(input, options, request);
}

SmoothReport Session::smooth(const SmoothOptions& options, const RequestOptions& request,
                             const JobInput& input) {
  return impl_->smooth(options, request, input);
}

PositionsView Session::positions() const {
  return impl_->begun ? as_view(impl_->positions()) : impl_->mesh.positions_view();
}

PositionsSpan Session::positions_span() { return impl_->positions(); }

Session Client::open(const Mesh& mesh) {
  return Session(std::make_unique<Session::Impl>(*impl_, mesh));
}

}  // namespace meshsmooth::client
