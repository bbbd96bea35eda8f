// What a server may answer to Smooth and AttachJob, in any order, and how it may end the call.
#include <grpcpp/grpcpp.h>

#include <memory>
#include <utility>
#include <vector>

#include "attach_call.hpp"
#include "fuzz/choices.hpp"
#include "fuzz/fill_message.hpp"
#include "meshsmooth/v1/smoothing_mock.grpc.pb.h"
#include "smooth_call.hpp"
#include "wire/crc32c.hpp"
#include "wire/status_details.hpp"

namespace {

using namespace meshsmooth;
using meshsmooth::testing::Choices;
using meshsmooth::testing::require;

template <class Response>
struct Script {
  std::vector<Response> responses;
  grpc::Status end;
};

/// A call that answers by a script, whatever it hears.
template <class Response>
class ScriptedReader final : public grpc::ClientReaderInterface<Response> {
 public:
  explicit ScriptedReader(Script<Response> script) : script_(std::move(script)) {}
  bool NextMessageSize(std::uint32_t*) override { return false; }
  bool Read(Response* response) override {
    if (next_ == script_.responses.size()) return false;
    *response = script_.responses[next_++];
    return true;
  }
  void WaitForInitialMetadata() override {}
  grpc::Status Finish() override { return script_.end; }

 private:
  const Script<Response> script_;
  std::size_t next_ = 0;
};

class ScriptedStream final
    : public grpc::ClientReaderWriterInterface<v1::SmoothRequest, v1::SmoothResponse> {
 public:
  explicit ScriptedStream(Script<v1::SmoothResponse> script) : reader_(std::move(script)) {}
  bool NextMessageSize(std::uint32_t*) override { return false; }
  bool Read(v1::SmoothResponse* response) override { return reader_.Read(response); }
  bool Write(const v1::SmoothRequest&, grpc::WriteOptions) override { return true; }
  bool WritesDone() override { return true; }
  void WaitForInitialMetadata() override {}
  grpc::Status Finish() override { return reader_.Finish(); }

 private:
  ScriptedReader<v1::SmoothResponse> reader_;
};

Mesh make_mesh(Choices& choices) {
  Mesh mesh;
  const std::size_t node_count = choices.below(9);
  if (choices.flag()) {
    mesh.positions = std::vector<Vec3f>(node_count);
  } else {
    mesh.positions = std::vector<Vec3d>(node_count);
  }
  mesh.blocks = {{ElementType::tetrahedron, {0, 1, 2, 3}}};
  return mesh;
}

/// The part of the result that is due, or about it.
void fill_chunk(v1::Chunk& chunk, std::int64_t& sent, std::int64_t result_bytes, Choices& choices) {
  const std::uint8_t kind = choices.byte();
  std::string data = choices.text(100);
  if ((kind & 7) != 3) {
    data.resize(std::min(data.size(), static_cast<std::size_t>(result_bytes - sent)));
  }
  chunk.set_array_id((kind & 7) == 1 ? static_cast<v1::ArrayId>(choices.number())
                                     : v1::ARRAY_ID_COORDINATES);
  chunk.set_offset_bytes((kind & 7) == 2 ? choices.number() : sent);
  if ((kind & 8) != 0) {
    chunk.set_crc32c((kind & 16) != 0 ? static_cast<std::uint32_t>(choices.number())
                                      : wire::crc32c(std::as_bytes(std::span(data))));
  }
  sent = std::min(result_bytes, sent + static_cast<std::int64_t>(data.size()));
  chunk.set_data(std::move(data));
}

template <class Response>
void add_response(Script<Response>& script, const Mesh& mesh, std::int64_t& sent,
                  Choices& choices) {
  const bool float64 = std::holds_alternative<std::vector<Vec3d>>(mesh.positions);
  const std::int64_t result_bytes =
      static_cast<std::int64_t>(mesh.node_count() * (float64 ? sizeof(Vec3d) : sizeof(Vec3f)));
  Response& response = script.responses.emplace_back();
  switch (choices.below(5)) {
    case 0:
      fill_message(response, choices);
      return;
    case 1: {
      v1::ResultHeader& header = *response.mutable_result();
      header.set_node_count(static_cast<std::int64_t>(mesh.node_count()));
      header.set_coordinate_type(float64 ? v1::SCALAR_TYPE_FLOAT64 : v1::SCALAR_TYPE_FLOAT32);
      header.set_size_bytes(result_bytes);
      return;
    }
    case 2:
      return fill_chunk(*response.mutable_chunk(), sent, result_bytes, choices);
    case 3:
      response.mutable_summary()->set_stop_reason(v1::STOP_REASON_CONVERGED);
      fill_message(*response.mutable_summary(), choices);
      return;
    default:
      if constexpr (std::is_same_v<Response, v1::SmoothResponse>) {
        if (choices.flag()) return void(response.mutable_stop_sending());
        response.mutable_accepted()->mutable_job()->set_name("jobs/1");
      } else {
        fill_message(*response.mutable_progress(), choices);
      }
  }
}

/// Details of the status: those of a server, or any bytes.
grpc::Status make_end(Choices& choices) {
  const int code = static_cast<int>(choices.below(18));
  if (code == 0) return grpc::Status::OK;
  const auto grpc_code = static_cast<grpc::StatusCode>(code);
  if (choices.flag()) return {grpc_code, choices.text(60), choices.rest()};
  const wire::StatusDetails details{.code = code,
                                    .message = meshsmooth::testing::printable(choices.text(60)),
                                    .reason = meshsmooth::testing::printable(choices.text(20)),
                                    .metadata = {{"element", choices.text(20)}},
                                    .retry_delay = std::nullopt};
  return {grpc_code, details.message, wire::encode_status_details(details)};
}

template <class Response>
Script<Response> make_script(const Mesh& mesh, Choices& choices) {
  Script<Response> script;
  std::int64_t sent = 0;
  for (std::size_t left = choices.below(12); left > 0 && !choices.empty(); --left) {
    add_response(script, mesh, sent, choices);
  }
  script.end = make_end(choices);
  return script;
}

/// A result of the mesh's own size, or the mesh as it was.
template <class Call>
void run(Call& call, const Mesh& mesh, const Mesh& before) {
  try {
    const client::SmoothReport report = call.run();
    require(mesh.node_count() == before.node_count() &&
                mesh.positions.index() == before.positions.index(),
            "a result has the nodes and the precision of its mesh");
    require(!report.json.empty(), "a report has its JSON");
  } catch (const client::ServiceError& error) {
    require(static_cast<int>(error.code()) != 0, "an error has a code");
    const auto bytes = [](const Mesh& of) {
      return std::visit([](const auto& p) { return std::as_bytes(std::span(p)); }, of.positions);
    };
    require(std::ranges::equal(bytes(mesh), bytes(before)), "a mesh without result is as it was");
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Choices choices({data, size});
  Mesh mesh = make_mesh(choices);
  const Mesh before = mesh;
  client::RequestOptions request;
  request.max_attempts = 1;
  request.request_id = "12345678-1234-1234-1234-123456789abc";
  if (choices.flag()) request.on_progress = [](const client::JobProgress&) {};
  ::testing::NiceMock<v1::MockSmoothingServiceStub> stub;
  const SmoothOptions options;
  if (choices.flag()) {
    EXPECT_CALL(stub, SmoothRaw)
        .WillRepeatedly([script = make_script<v1::SmoothResponse>(mesh, choices)](auto*) {
          return new ScriptedStream(script);
        });
    client::SmoothCall call(stub, "the server", mesh, options, request);
    run(call, mesh, before);
  } else {
    EXPECT_CALL(stub, AttachJobRaw)
        .WillRepeatedly([script = make_script<v1::AttachJobResponse>(mesh, choices)](auto*, auto&) {
          return new ScriptedReader<v1::AttachJobResponse>(script);
        });
    client::AttachCall call(stub, "the server", "jobs/1", mesh, request);
    run(call, mesh, before);
  }
  return 0;
}
