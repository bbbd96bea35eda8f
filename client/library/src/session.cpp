#include <algorithm>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <variant>

#include "client_impl.hpp"
#include "meshsmooth/error.hpp"
#include "wire/topology_name.hpp"

namespace meshsmooth::client {
struct Session::Impl {
  /// Where the current positions lie. In the mesh, until the first job.
  struct InMesh {};
  struct InMemory {
    Positions positions;
  };
  /// Where the server writes them: results alternate between two parts of it, so that they need not
  /// be copied.
  struct InPlace {
    std::unique_ptr<Transfer> transfer;
    bool float64;

    [[nodiscard]] PositionsSpan positions() const {
      const std::span<std::byte> bytes = transfer->positions();
      const auto typed = [&]<class Real>() -> PositionsSpan {
        return std::span(reinterpret_cast<Vec3<Real>*>(bytes.data()),
                         bytes.size() / sizeof(Vec3<Real>));
      };
      return float64 ? typed.operator()<double>() : typed.operator()<float>();
    }
  };

  Impl(Client::Impl& its_client, const Mesh& its_mesh)
      : client(its_client),
        mesh(its_mesh),
        topology_name(wire::topology_name(MeshTopology(mesh).view())),
        route(topology_name.substr(topology_name.rfind('-') + 1)) {}
  ~Impl() {
    if (const auto* const place = std::get_if<InPlace>(&current)) place->transfer->keep();
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  [[nodiscard]] PositionsSpan positions() {
    if (std::holds_alternative<InMesh>(current)) current = InMemory{mesh.positions};
    if (const auto* const place = std::get_if<InPlace>(&current)) return place->positions();
    return std::visit([](auto& array) -> PositionsSpan { return std::span(array); },
                      std::get<InMemory>(current).positions);
  }

  SmoothReport smooth(const SmoothOptions& options, const RequestOptions& request,
                      const JobInput& input) {
    leave_lost_place();
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
    leave_lost_place();
    SmoothReport report =
        run({mesh, std::span<const Vec3<Real>>(positions), input}, options, request, topology_name);
    std::ranges::copy(std::get<std::span<Vec3<Real>>>(this->positions()), positions.begin());
    return report;
  }

  SmoothReport move(const JobInput& input, const SmoothOptions& options,
                    const RequestOptions& request) {
    leave_lost_place();
    return run({mesh, mesh.positions_view(), input}, options, request, name_moving());
  }

  MotionDerivative differentiate(const JobInput& input, const SmoothOptions& options,
                                 const RequestOptions& request) {
    MotionDerivative result;
    result.report = client.smooth({mesh, mesh.positions_view(), input}, options, request,
                                  {name_moving(), false, route}, result.vectors);
    return result;
  }

  /// It is another topology: its reference belongs to it.
  const std::string& name_moving() {
    if (moving_name.empty()) {
      moving_name = wire::topology_name(MeshTopology(mesh).view(), mesh.positions_view());
    }
    return moving_name;
  }

  SmoothReport run(const JobMesh& job, const SmoothOptions& options, const RequestOptions& request,
                   const std::string& topology) {
    auto* const place = std::get_if<InPlace>(&current);
    Delivery delivery{.memory = std::move(spare),
                      .transfer = place != nullptr ? std::move(place->transfer) : nullptr,
                      .more_bytes = bytes_of(job.positions).size()};
    try {
      SmoothReport report =
          client.smooth(job, options, request, {topology, false, route}, delivery);
      take(delivery, std::holds_alternative<std::span<const Vec3d>>(job.positions));
      return report;
    } catch (...) {
      spare = std::move(delivery.memory);
      if (place != nullptr) place->transfer = std::move(delivery.transfer);
      leave_place();  // the server may still write to it
      throw;
    }
  }

  void take(Delivery& delivery, bool float64) {
    if (delivery.in_place) {
      current = InPlace{std::move(delivery.transfer), float64};
      return;
    }
    auto* const memory = std::get_if<InMemory>(&current);
    spare = memory != nullptr ? std::move(memory->positions) : Positions();
    current = InMemory{std::move(delivery.memory)};
  }

  void leave_lost_place() {
    const auto* const place = std::get_if<InPlace>(&current);
    if (place != nullptr && place->transfer->ended()) leave_place();
  }

  void leave_place() {
    const auto* const place = std::get_if<InPlace>(&current);
    if (place == nullptr) return;
    current = InMemory{
        copied(place->transfer->positions(), as_view(place->positions()), std::move(spare))};
  }

  Client::Impl& client;
  const Mesh mesh;  // as it was opened: the reference of motions
  std::variant<InMesh, InMemory, InPlace> current;
  Positions spare = {};  // of the result before that in memory, for the next one
  std::string topology_name;
  std::string moving_name;  // of the topology with its reference; empty: not needed yet
  std::string route;
};

namespace {

/// The method of a derivative.
Move& differentiating(SmoothOptions& options) {
  if (auto* const move = std::get_if<Move>(&options.method)) return *move;
  throw NotSupported(
      "OPTION_NOT_SUPPORTED",
      "only move has derivatives, the method is " + std::string(method_name(options.method)),
      {{"field", "method"}});
}

/// Those of a call, in place of none.
void set_prescribed(JobInput& input, const PrescribedNodes& prescribed) {
  if (!input.prescribed.nodes.empty() || position_count(input.prescribed.positions) > 0) {
    throw InvalidOption("OPTION_MISPLACED",
                        "the input has prescribed nodes, but those of this call are its arguments",
                        {{"field", "prescribed"}});
  }
  input.prescribed = prescribed;
}

}  // namespace

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
  set_prescribed(input, {nodes, positions});
  validate(options, input);
  return impl_->move(input, options, request);
}

MotionDerivative Session::move_tangent(std::span<const NodeId> nodes, PositionsView tangents,
                                       SmoothOptions options, const RequestOptions& request,
                                       JobInput input) {
  differentiating(options).derivative = Derivative::tangent;
  set_prescribed(input, {nodes, tangents});
  validate(options, input);
  return impl_->differentiate(input, options, request);
}

MotionDerivative Session::move_transpose(std::span<const NodeId> nodes, PositionsView cotangents,
                                         SmoothOptions options, const RequestOptions& request,
                                         JobInput input) {
  differentiating(options).derivative = Derivative::cotangent;
  set_prescribed(input, {nodes, {}});
  input.cotangent = cotangents;
  validate(options, input);
  MotionDerivative result = impl_->differentiate(input, options, request);
  std::visit(
      [&]<class Real>(std::vector<Vec3<Real>>& all) {
        std::vector<Vec3<Real>> prescribed;
        prescribed.reserve(nodes.size());
        for (const NodeId node : nodes) prescribed.push_back(all[static_cast<std::size_t>(node)]);
        all = std::move(prescribed);
      },
      result.vectors);
  return result;
}

SmoothReport Session::smooth(const SmoothOptions& options, const RequestOptions& request,
                             const JobInput& input) {
  return impl_->smooth(options, request, input);
}

PositionsView Session::positions() const {
  if (std::holds_alternative<Impl::InMesh>(impl_->current)) return impl_->mesh.positions_view();
  return as_view(impl_->positions());
}

PositionsSpan Session::positions_span() { return impl_->positions(); }

Session Client::open(const Mesh& mesh) {
  return Session(std::make_unique<Session::Impl>(*impl_, mesh));
}

}  // namespace meshsmooth::client
