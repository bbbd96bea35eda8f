#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <variant>
#include <vector>

#include "call.hpp"
#include "error.hpp"
#include "handles.hpp"
#include "mesh.hpp"
#include "options.hpp"
#include "structures.hpp"

using namespace meshsmooth::c;
using meshsmooth::JobInput;
using meshsmooth::Mesh;
using meshsmooth::NodePair;
using meshsmooth::PositionsView;

namespace {

using Positions = decltype(Mesh::positions);

Positions copied(const PositionsView& view) {
  return std::visit([](auto array) -> Positions { return std::vector(array.begin(), array.end()); },
                    view);
}

PositionsView view_of(const Positions& positions) {
  return std::visit([](const auto& array) -> PositionsView { return std::span(array); }, positions);
}

}  // namespace

/// A session and what its mesh brings to each job.
struct meshsmooth_session {
  meshsmooth_session(std::shared_ptr<meshsmooth::client::Client> its_client, const ReadMesh& read)
      : client(std::move(its_client)),
        session(client->open(read.mesh)),
        node_count(static_cast<std::int64_t>(read.mesh.node_count())),
        float32(read.mesh.positions.index() == 0),
        reference(copied(read.input.reference)),
        pairs(read.input.node_pairs.begin(), read.input.node_pairs.end()) {}

  const std::shared_ptr<meshsmooth::client::Client> client;  // outlives the session
  meshsmooth::client::Session session;
  const std::int64_t node_count;
  const bool float32;
  const Positions reference;
  const std::vector<NodePair> pairs;
};

int meshsmooth_session_create(meshsmooth_client* client, const meshsmooth_mesh* mesh,
                              meshsmooth_session** session, meshsmooth_error** error) {
  return guarded(error, [&] {
    need(session, "session");
    *session = nullptr;
    need(client, "client");
    *session = new meshsmooth_session(client->client, read_mesh(mesh));
  });
}

int meshsmooth_session_smooth(meshsmooth_session* session, const void* positions,
                              const meshsmooth_options* options, const meshsmooth_call* call,
                              void* result, meshsmooth_report** report, meshsmooth_error** error) {
  return guarded(error, [&] {
    if (report != nullptr) *report = nullptr;
    need(session, "session");
    need(result, "result");
    Positions current =
        copied(view_like(session->float32, positions, session->node_count, "positions"));
    Job job = read_options(options, meshsmooth::Optimize{});
    const Accompaniment accompaniment(call, job.request);
    const JobInput input = {.reference = view_of(session->reference), .node_pairs = session->pairs};
    meshsmooth::client::SmoothReport done = std::visit(
        [&](auto& array) {
          return session->session.smooth(std::span(array), job.smooth, job.request, input);
        },
        current);
    hand_over(std::move(done), view_of(current), result, report);
  });
}

int meshsmooth_session_move(meshsmooth_session* session, const meshsmooth_prescribed* prescribed,
                            const meshsmooth_options* options, const meshsmooth_call* call,
                            void* result, meshsmooth_report** report, meshsmooth_error** error) {
  return guarded(error, [&] {
    if (report != nullptr) *report = nullptr;
    need(session, "session");
    need(result, "result");
    const meshsmooth_prescribed in = read_structure(prescribed, "prescribed");
    const auto nodes = array_of<meshsmooth::NodeId>(in.nodes, in.node_count, "prescribed.nodes");
    const PositionsView places =
        view_like(session->float32, in.positions, in.node_count, "prescribed.positions");
    Job job = read_options(options, meshsmooth::Move{});
    const Accompaniment accompaniment(call, job.request);
    meshsmooth::client::SmoothReport done = session->session.move(
        nodes, places, job.smooth, job.request, {.node_pairs = session->pairs});
    hand_over(std::move(done), session->session.positions(), result, report);
  });
}

void meshsmooth_session_free(meshsmooth_session* session) { delete session; }
