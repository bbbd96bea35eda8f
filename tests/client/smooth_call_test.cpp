#include <gmock/gmock.h>

#include <cstring>
#include <future>
#include <set>
#include <thread>

#include "meshsmooth/client.hpp"
#include "mock_service.hpp"
#include "support/meshes.hpp"

namespace meshsmooth::client {
namespace {

using namespace meshsmooth::testing;
using ::testing::HasSubstr;

/// Far more than any flow-control window holds.
Mesh large_mesh() {
  Mesh mesh = test::tet_ball();
  test::points(mesh).resize(1'000'000, {0.1, 0.2, 0.3});
  return mesh;
}

ServiceError smooth_error(MockServer& server, Mesh& mesh, const RequestOptions& request = {}) {
  const Mesh before = mesh;
  try {
    Client(server.address()).smooth(mesh, {}, request);
  } catch (const ServiceError& error) {
    EXPECT_EQ(mesh.positions, before.positions);
    return error;
  }
  ADD_FAILURE() << "the call succeeded";
  return {StatusCode::unknown, "", "", {}, ""};
}

/// Answers a whole upload by `answer`, then OK.
auto after_upload(std::function<void(ServerStream&, const Upload&)> answer) {
  return [answer = std::move(answer)](grpc::ServerContext&, ServerStream& stream) {
    read_spec(stream);
    accept(stream);
    answer(stream, read_upload(stream));
    return grpc::Status::OK;
  };
}

TEST(SmoothCall, SendsTheWholeMeshAndPutsTheResultIntoIt) {
  MockServer server;
  Mesh mesh = test::tet_ball();
  mesh.fixed = {1, 0, 0, 0, 0, 0, 0};
  mesh.regions = {4, 4, 4, 4, -9, -9, -9, -9};
  const Mesh before = mesh;
  v1::JobSpec spec;
  Upload upload;
  server.service.on_smooth = [&](grpc::ServerContext&, ServerStream& stream) {
    spec = read_spec(stream);
    accept(stream);
    upload = read_upload(stream);
    std::string result(upload.coordinates.size(), '\0');
    std::vector<Vec3d> moved(7, Vec3d{1, 2, 3});
    std::memcpy(result.data(), moved.data(), result.size());
    send_header(stream, 7, v1::SCALAR_TYPE_FLOAT64, 7 * 24);
    send_chunk(stream, 0, result.substr(0, 100));
    send_chunk(stream, 100, result.substr(100));
    send_summary(stream);
    return grpc::Status::OK;
  };

  const SmoothReport report = Client(server.address()).smooth(mesh, {});

  EXPECT_EQ(spec.inline_topology().node_count(), 7);
  EXPECT_EQ(spec.inline_topology().element_blocks(0).element_count(), 8);
  EXPECT_EQ(spec.coordinate_type(), v1::SCALAR_TYPE_FLOAT64);
  EXPECT_EQ(upload.elements.size(), 8 * 4 * sizeof(NodeId));
  EXPECT_EQ(std::memcmp(upload.elements.data(), before.blocks[0].nodes.data(), 128), 0);
  EXPECT_EQ(upload.fixed_mask, std::string("\1\0\0\0\0\0\0", 7));
  EXPECT_TRUE(spec.inline_topology().element_regions_present());
  ASSERT_EQ(upload.element_regions.size(), 8 * sizeof(std::int32_t));
  EXPECT_EQ(std::memcmp(upload.element_regions.data(), before.regions.data(), 32), 0);
  EXPECT_EQ(std::memcmp(upload.coordinates.data(), test::points(before).data(), 7 * 24), 0);
  EXPECT_EQ(test::points(mesh), std::vector<Vec3d>(7, Vec3d{1, 2, 3}));
  EXPECT_EQ(mesh.blocks[0].nodes, before.blocks[0].nodes);
  EXPECT_EQ(mesh.fixed, before.fixed);
  EXPECT_EQ(report.job_name, "jobs/mock");
  EXPECT_EQ(report.summary.convergence.iteration_count, 7);
  EXPECT_THAT(report.to_json(), HasSubstr("\"iteration_count\": 7"));
}

TEST(SmoothCall, KeepsFloat32) {
  MockServer server;
  Mesh mesh = test::as_float32(test::tet_ball());
  v1::JobSpec spec;
  server.service.on_smooth = [&](grpc::ServerContext&, ServerStream& stream) {
    spec = read_spec(stream);
    accept(stream);
    const Upload upload = read_upload(stream);
    send_header(stream, 7, v1::SCALAR_TYPE_FLOAT32, 7 * 12);
    send_chunk(stream, 0, std::string(upload.coordinates.size(), '\0'));
    send_summary(stream);
    return grpc::Status::OK;
  };

  Client(server.address()).smooth(mesh, {});

  EXPECT_EQ(spec.coordinate_type(), v1::SCALAR_TYPE_FLOAT32);
  EXPECT_FALSE(spec.inline_topology().element_regions_present());
  EXPECT_EQ(std::get<std::vector<Vec3f>>(mesh.positions), std::vector<Vec3f>(7, Vec3f{0, 0, 0}));
}

TEST(SmoothCall, CutsLargeArraysIntoChunksOfOneMiB) {
  MockServer server;
  Mesh mesh = large_mesh();
  std::size_t chunk_count = 0;
  server.service.on_smooth = after_upload([&](ServerStream& stream, const Upload& upload) {
    chunk_count = upload.chunk_count;
    send_header(stream, 1'000'000, v1::SCALAR_TYPE_FLOAT64, 24'000'000);
    for (std::size_t offset = 0; offset < upload.coordinates.size(); offset += 1 << 20) {
      send_chunk(stream, static_cast<std::int64_t>(offset),
                 upload.coordinates.substr(offset, 1 << 20));
    }
    send_summary(stream);
  });
  const Mesh before = mesh;

  Client(server.address()).smooth(mesh, {});

  EXPECT_EQ(mesh.positions, before.positions);
  constexpr std::size_t kFewest = 1 + (24'000'000 + (1 << 20) - 1) / (1 << 20);
  EXPECT_GE(chunk_count, kFewest);
  EXPECT_LE(chunk_count, kFewest + 1);  // one more was sent before the answer
}

TEST(SmoothCall, SendsASmallMeshWithoutWaitingToBeAccepted) {
  MockServer server;
  Mesh mesh = test::tet_ball();
  std::size_t size_bytes = 0;
  server.service.on_smooth = [&](grpc::ServerContext&, ServerStream& stream) {
    read_spec(stream);
    size_bytes = read_upload(stream).size_bytes();  // up to its half-close
    return refusal(grpc::StatusCode::RESOURCE_EXHAUSTED, "QUEUE_FULL", "100 jobs are waiting", {},
                   std::chrono::seconds(2));
  };

  EXPECT_EQ(smooth_error(server, mesh).reason(), "QUEUE_FULL");
  EXPECT_EQ(size_bytes, mesh.blocks[0].nodes.size() * 4 + mesh.node_count() * 24);
}

TEST(SmoothCall, SendsLittleUntilAccepted) {
  MockServer server;
  Mesh mesh = large_mesh();
  std::size_t size_bytes = 0;
  server.service.on_smooth = [&](grpc::ServerContext&, ServerStream& stream) {
    read_spec(stream);
    stop_sending(stream);
    size_bytes = read_upload(stream).size_bytes();
    return refusal(grpc::StatusCode::RESOURCE_EXHAUSTED, "QUEUE_FULL", "100 jobs are waiting", {},
                   std::chrono::seconds(2));
  };

  const ServiceError error = smooth_error(server, mesh);

  EXPECT_LE(size_bytes, 64U << 10);
  EXPECT_EQ(error.code(), StatusCode::resource_exhausted);
  EXPECT_EQ(error.reason(), "QUEUE_FULL");
  EXPECT_STREQ(error.what(), "100 jobs are waiting");
  EXPECT_EQ(error.hint(), "try again in 2 s");
}

TEST(SmoothCall, SendsMoreUntilAcceptedOnceAJobWasAccepted) {
  MockServer server;
  server.service.on_smooth = [&](grpc::ServerContext&, ServerStream& stream) {
    read_spec(stream);
    accept(stream);
    read_upload(stream);
    send_header(stream, 7, v1::SCALAR_TYPE_FLOAT64, 7 * 24);
    send_chunk(stream, 0, std::string(7 * 24, '\0'));
    send_summary(stream);
    return grpc::Status::OK;
  };
  Client client(server.address());
  Mesh small = test::tet_ball();
  client.smooth(small, {});
  std::vector<std::size_t> sizes_bytes;
  server.service.on_smooth = [&](grpc::ServerContext&, ServerStream& stream) {
    read_spec(stream);
    std::size_t size_bytes = 0;
    const std::size_t due = sizes_bytes.empty() ? 2 << 20 : 64 << 10;
    for (v1::SmoothRequest request; size_bytes < due && stream.Read(&request);) {
      size_bytes += request.chunk().data().size();
    }
    stop_sending(stream);
    sizes_bytes.push_back(size_bytes + read_upload(stream).size_bytes());
    return refusal(grpc::StatusCode::RESOURCE_EXHAUSTED, "QUEUE_FULL", "100 jobs are waiting", {},
                   std::chrono::milliseconds(1));
  };
  Mesh large = large_mesh();
  RequestOptions request;
  request.max_attempts = 2;

  EXPECT_THROW(client.smooth(large, {}, request), ServiceError);
  EXPECT_EQ(sizes_bytes, (std::vector<std::size_t>{2 << 20, 64 << 10}));
}

TEST(SmoothCall, StopsItsUploadWhenToldAndReadsTheStatus) {
  MockServer server;
  Mesh mesh = large_mesh();
  std::size_t dropped_bytes = 0;
  std::promise<void> told;
  RequestOptions request;
  request.on_progress = [&](const JobProgress&) { told.set_value(); };
  server.service.on_smooth = [&](grpc::ServerContext&, ServerStream& stream) {
    read_spec(stream);
    accept(stream);
    v1::SmoothRequest first;
    stream.Read(&first);
    stop_sending(stream);
    progress(stream, 1);  // once the client has it, it has been told to stop
    told.get_future().wait();
    dropped_bytes = read_upload(stream).size_bytes();
    return refusal(grpc::StatusCode::INVALID_ARGUMENT, "INDEX_OUT_OF_RANGE",
                   "element 3: node 9 >= node count 7", {{"element", "3"}, {"node", "9"}});
  };

  const ServiceError error = smooth_error(server, mesh, request);

  EXPECT_LT(dropped_bytes, 20'000'000);
  EXPECT_EQ(error.code(), StatusCode::invalid_argument);
  EXPECT_EQ(error.reason(), "INDEX_OUT_OF_RANGE");
  EXPECT_EQ(error.details(), (ErrorDetails{{"element", "3"}, {"node", "9"}}));
  EXPECT_EQ(error.hint(), "");
}

TEST(SmoothCall, ReadsAStatusThatComesInMidUpload) {
  MockServer server;
  Mesh mesh = large_mesh();
  server.service.on_smooth = [&](grpc::ServerContext&, ServerStream& stream) {
    read_spec(stream);
    accept(stream);
    v1::SmoothRequest first;
    stream.Read(&first);
    return refusal(grpc::StatusCode::UNAVAILABLE, "DRAINING", "the server is leaving", {},
                   std::chrono::seconds(0));
  };

  const ServiceError error = smooth_error(server, mesh);

  EXPECT_EQ(error.reason(), "DRAINING");
  EXPECT_EQ(error.hint(), "try again at once, or elsewhere");
}

TEST(SmoothCall, ReportsProgressOnTheCallingThread) {
  MockServer server;
  Mesh mesh = test::tet_ball();
  v1::JobSpec spec;
  server.service.on_smooth = [&](grpc::ServerContext&, ServerStream& stream) {
    spec = read_spec(stream);
    accept(stream);
    const Upload upload = read_upload(stream);
    progress(stream, 1);
    progress(stream, 2);
    send_header(stream, 7, v1::SCALAR_TYPE_FLOAT64, 7 * 24);
    send_chunk(stream, 0, upload.coordinates);
    send_summary(stream);
    return grpc::Status::OK;
  };
  std::vector<int> iterations;
  std::set<std::thread::id> threads;
  RequestOptions request;
  request.progress_interval = std::chrono::milliseconds(250);
  request.on_progress = [&](const JobProgress& progress) {
    EXPECT_EQ(progress.state, JobState::running);
    EXPECT_EQ(progress.stage, "iterate");
    iterations.push_back(progress.iteration);
    threads.insert(std::this_thread::get_id());
  };

  Client(server.address()).smooth(mesh, {}, request);

  EXPECT_EQ(iterations, (std::vector{1, 2}));
  EXPECT_EQ(threads, std::set{std::this_thread::get_id()});
  EXPECT_EQ(spec.progress_interval().nanos(), 250'000'000);
}

/// Accepts, tells of progress and then waits for the client to go.
auto working_for_ever(std::atomic<bool>* seen_cancelled = nullptr) {
  return [seen_cancelled](grpc::ServerContext& context, ServerStream& stream) {
    read_spec(stream);
    accept(stream);
    read_upload(stream);
    for (int i = 1; !context.IsCancelled(); ++i) progress(stream, i);
    if (seen_cancelled) *seen_cancelled = true;
    return grpc::Status::CANCELLED;
  };
}

TEST(SmoothCall, IsCancelledByTheStopToken) {
  MockServer server;
  Mesh mesh = test::tet_ball();
  std::atomic<bool> seen_cancelled = false;
  server.service.on_smooth = working_for_ever(&seen_cancelled);
  std::stop_source stop;
  RequestOptions request;
  request.stop = stop.get_token();
  request.on_progress = [&](const JobProgress&) { stop.request_stop(); };

  const ServiceError error = smooth_error(server, mesh, request);

  EXPECT_EQ(error.code(), StatusCode::cancelled);
  EXPECT_STREQ(error.what(), "cancelled");
  EXPECT_EQ(error.hint(), "");
  server.die();  // waits for the handler
  EXPECT_TRUE(seen_cancelled);
}

TEST(SmoothCall, IsNotEvenStartedWhenAlreadyStopped) {
  MockServer server;
  Mesh mesh = test::tet_ball();
  server.service.on_smooth = working_for_ever();
  std::stop_source stop;
  stop.request_stop();
  RequestOptions request;
  request.stop = stop.get_token();

  EXPECT_EQ(smooth_error(server, mesh, request).code(), StatusCode::cancelled);
}

TEST(SmoothCall, PassesOnWhatTheProgressCallbackThrows) {
  MockServer server;
  Mesh mesh = test::tet_ball();
  std::atomic<bool> seen_cancelled = false;
  server.service.on_smooth = working_for_ever(&seen_cancelled);
  RequestOptions request;
  request.on_progress = [](const JobProgress&) { throw std::logic_error("mine"); };

  EXPECT_THROW(Client(server.address()).smooth(mesh, {}, request), std::logic_error);

  server.die();
  EXPECT_TRUE(seen_cancelled);
}

TEST(SmoothCall, EndsAtItsDeadline) {
  MockServer server;
  Mesh mesh = test::tet_ball();
  server.service.on_smooth = working_for_ever();
  RequestOptions request;
  request.timeout = std::chrono::milliseconds(50);

  const ServiceError error = smooth_error(server, mesh, request);

  EXPECT_EQ(error.code(), StatusCode::deadline_exceeded);
  EXPECT_STREQ(error.what(), "the call did not end within its 0.05 s");
  EXPECT_THAT(error.hint(), HasSubstr("compute budget"));
}

TEST(SmoothCall, MayLastForEver) {
  MockServer server;
  Mesh mesh = test::tet_ball();
  server.service.on_smooth = after_upload([](ServerStream& stream, const Upload& upload) {
    send_header(stream, 7, v1::SCALAR_TYPE_FLOAT64, 7 * 24);
    send_chunk(stream, 0, upload.coordinates);
    send_summary(stream);
  });
  RequestOptions request;
  request.timeout = std::chrono::nanoseconds::max();

  EXPECT_NO_THROW(Client(server.address()).smooth(mesh, {}, request));
}

TEST(SmoothCall, AlwaysHasADeadline) {
  MockServer server;
  Mesh mesh = test::tet_ball();
  std::chrono::duration<double> left{};
  server.service.on_smooth = [&](grpc::ServerContext& context, ServerStream& stream) {
    left = context.deadline() - std::chrono::system_clock::now();
    read_spec(stream);
    return refusal(grpc::StatusCode::UNAVAILABLE, "DRAINING", "");
  };

  smooth_error(server, mesh);

  EXPECT_GT(left.count(), 590);
  EXPECT_LT(left.count(), 601);
}

TEST(SmoothCall, SendsTheCallersRequestIdOrANewUuid) {
  MockServer server;
  Mesh mesh = test::tet_ball();
  std::vector<std::string> ids;
  server.service.on_smooth = [&](grpc::ServerContext&, ServerStream& stream) {
    ids.push_back(read_spec(stream).request_id());
    return refusal(grpc::StatusCode::UNAVAILABLE, "DRAINING", "");
  };
  RequestOptions request;
  request.request_id = "10c5bb5e-86b9-4ddf-b183-6bc4a7a12a3b";

  smooth_error(server, mesh, request);
  smooth_error(server, mesh);
  smooth_error(server, mesh);

  const auto is_uuid = ::testing::MatchesRegex(
      "[0-9a-f]{8}-[0-9a-f]{4}-4[0-9a-f]{3}-[89ab][0-9a-f]{3}-[0-9a-f]{12}");
  ASSERT_EQ(ids.size(), 3);
  EXPECT_EQ(ids[0], request.request_id);
  EXPECT_THAT(ids[1], is_uuid);
  EXPECT_THAT(ids[2], is_uuid);
  EXPECT_NE(ids[1], ids[2]);
}

TEST(SmoothCall, SaysWhenTheServerDiesInMidJob) {
  MockServer server;
  Mesh mesh = test::tet_ball();
  server.service.on_smooth = working_for_ever();
  std::jthread killer;
  RequestOptions request;
  request.on_progress = [&](const JobProgress&) {
    if (!killer.joinable()) killer = std::jthread([&] { server.die(); });
  };

  const ServiceError error = smooth_error(server, mesh, request);

  EXPECT_EQ(error.reason(), "");
  EXPECT_THAT(error.hint(), HasSubstr("the mesh here is unchanged"));
}

TEST(SmoothCall, SaysWhenNoServerAnswers) {
  Mesh mesh = test::tet_ball();
  std::string address;
  {
    MockServer gone;
    address = gone.address();
  }
  try {
    Client(address).smooth(mesh, {});
    FAIL();
  } catch (const ServiceError& error) {
    EXPECT_EQ(error.code(), StatusCode::unavailable);
    EXPECT_EQ(error.reason(), "");
    EXPECT_THAT(error.what(), HasSubstr(address));
    EXPECT_THAT(error.hint(), HasSubstr("meshsmooth-server --listen " + address));
  }
}

TEST(SmoothCall, SaysWhenTheServerIsNoMeshsmooth) {
  grpc::ServerBuilder builder;
  int port = 0;
  builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
  v1::SmoothingService::Service nothing;  // answers every call by UNIMPLEMENTED
  builder.RegisterService(&nothing);
  const auto server = builder.BuildAndStart();
  Mesh mesh = test::tet_ball();
  try {
    Client("127.0.0.1:" + std::to_string(port)).smooth(mesh, {});
    FAIL();
  } catch (const ServiceError& error) {
    EXPECT_EQ(error.code(), StatusCode::unimplemented);
    EXPECT_THAT(error.hint(), HasSubstr("not a meshsmooth server"));
  }
}

struct BrokenAnswer {
  const char* name;
  std::function<void(ServerStream&, const Upload&)> answer;
  const char* message;
};

class SmoothCallBrokenAnswer : public ::testing::TestWithParam<BrokenAnswer> {};

TEST_P(SmoothCallBrokenAnswer, IsRefusedAndTheMeshStaysAsItWas) {
  MockServer server;
  Mesh mesh = test::tet_ball();
  server.service.on_smooth = after_upload(GetParam().answer);

  const ServiceError error = smooth_error(server, mesh);

  EXPECT_EQ(error.code(), StatusCode::data_loss);
  EXPECT_EQ(error.reason(), "");
  EXPECT_THAT(error.what(), HasSubstr(GetParam().message));
}

void good_header(ServerStream& stream) { send_header(stream, 7, v1::SCALAR_TYPE_FLOAT64, 168); }
void good_result(ServerStream& stream) {
  good_header(stream);
  send_chunk(stream, 0, std::string(168, 'x'));
}

/// A good answer, but for what `spoil` makes of its summary.
auto with_summary(void (*spoil)(v1::Summary&)) {
  return [spoil](ServerStream& stream, const Upload&) {
    good_result(stream);
    v1::SmoothResponse response;
    response.mutable_summary()->set_stop_reason(v1::STOP_REASON_CONVERGED);
    spoil(*response.mutable_summary());
    stream.Write(response);
  };
}

INSTANTIATE_TEST_SUITE_P(
    All, SmoothCallBrokenAnswer,
    ::testing::Values(
        BrokenAnswer{"Truncated",
                     [](ServerStream& stream, const Upload&) {
                       good_header(stream);
                       send_chunk(stream, 0, std::string(100, 'x'));
                       send_summary(stream);
                     },
                     "100 of 168 bytes"},
        BrokenAnswer{"NoResult", [](ServerStream& stream, const Upload&) { send_summary(stream); },
                     "incomplete"},
        BrokenAnswer{"NoDuration", with_summary([](v1::Summary& summary) {
                       summary.mutable_timings()->mutable_send()->set_seconds(INT64_MAX);
                     }),
                     "cannot decode the summary"},
        BrokenAnswer{"NoDurationInTheOptions", with_summary([](v1::Summary& summary) {
                       summary.mutable_options()->mutable_compute_budget()->set_nanos(
                           1'000'000'000);
                     }),
                     "cannot decode the summary"},
        BrokenAnswer{"NoSummary", [](ServerStream& stream, const Upload&) { good_result(stream); },
                     "without a summary"},
        BrokenAnswer{"Gap",
                     [](ServerStream& stream, const Upload&) {
                       good_header(stream);
                       send_chunk(stream, 8, std::string(160, 'x'));
                     },
                     "at 8 where those at 0 were due"},
        BrokenAnswer{"TooLong",
                     [](ServerStream& stream, const Upload&) {
                       good_header(stream);
                       send_chunk(stream, 0, std::string(169, 'x'));
                     },
                     "more result bytes than the 168"},
        BrokenAnswer{"ChunkBeforeHeader",
                     [](ServerStream& stream, const Upload&) {
                       send_chunk(stream, 0, std::string(168, 'x'));
                     },
                     "result bytes at 0"},
        BrokenAnswer{"OtherNodeCount",
                     [](ServerStream& stream, const Upload&) {
                       send_header(stream, 8, v1::SCALAR_TYPE_FLOAT64, 192);
                     },
                     "8 nodes"},
        BrokenAnswer{"OtherPrecision",
                     [](ServerStream& stream, const Upload&) {
                       send_header(stream, 7, v1::SCALAR_TYPE_FLOAT32, 84);
                     },
                     "FLOAT32"},
        BrokenAnswer{"OtherSize",
                     [](ServerStream& stream, const Upload&) {
                       send_header(stream, 7, v1::SCALAR_TYPE_FLOAT64, 1LL << 60);
                     },
                     "must have 168"},
        BrokenAnswer{"WrongChecksum",
                     [](ServerStream& stream, const Upload&) {
                       good_header(stream);
                       v1::SmoothResponse response;
                       response.mutable_chunk()->set_array_id(v1::ARRAY_ID_COORDINATES);
                       response.mutable_chunk()->set_data(std::string(168, 'x'));
                       response.mutable_chunk()->set_crc32c(1);
                       stream.Write(response);
                     },
                     "checksum"}),
    [](const auto& test) { return std::string(test.param.name); });

}  // namespace
}  // namespace meshsmooth::client
