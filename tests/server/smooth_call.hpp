#pragma once

#include <grpcpp/client_context.h>
#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "meshsmooth/v1/smoothing.grpc.pb.h"
#include "wire/status_details.hpp"

namespace meshsmooth::testing {

using Stub = v1::SmoothingService::Stub;

template <class T>
std::string bytes_of(const std::vector<T>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

/// Two tetrahedra on five nodes, node 1 fixed, float64.
struct TwoTetrahedra {
  std::string elements = bytes_of<std::int32_t>({0, 1, 2, 3, 1, 2, 3, 4});
  std::string fixed = {0, 1, 0, 0, 0};
  std::vector<double> coordinates = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 1, 1};

  /// What the fake smoother makes of them: x + 1 unless fixed.
  [[nodiscard]] std::string moved() const {
    std::vector<double> moved = coordinates;
    for (std::size_t node : {0U, 2U, 3U, 4U}) moved[3 * node] += 1;
    return bytes_of(moved);
  }

  [[nodiscard]] static v1::JobSpec spec() {
    v1::JobSpec spec;
    v1::TopologySpec* topology = spec.mutable_inline_topology();
    topology->set_node_count(5);
    topology->set_fixed_mask_present(true);
    topology->add_element_blocks()->set_element_type(v1::ELEMENT_TYPE_TETRAHEDRON);
    topology->mutable_element_blocks(0)->set_element_count(2);
    spec.set_coordinate_type(v1::SCALAR_TYPE_FLOAT64);
    return spec;
  }
};

inline v1::Chunk chunk(v1::ArrayId id, std::int64_t offset, std::string data) {
  v1::Chunk message;
  message.set_array_id(id);
  message.set_offset_bytes(offset);
  message.set_data(std::move(data));
  return message;
}

/// What a call carries beside its messages.
using Metadata = std::vector<std::pair<std::string, std::string>>;

/// One Smooth call, spoken message by message.
class SmoothCall {
 public:
  explicit SmoothCall(Stub& stub,
                      std::optional<std::chrono::system_clock::time_point> deadline = {},
                      const Metadata& metadata = {}) {
    if (deadline) context_.set_deadline(*deadline);
    for (const auto& [key, value] : metadata) context_.AddMetadata(key, value);
    stream_ = stub.Smooth(&context_);
  }
  ~SmoothCall() {
    if (finished_) return;
    context_.TryCancel();
    finish();
  }

  bool send(const v1::JobSpec& spec) {
    v1::SmoothRequest request;
    *request.mutable_spec() = spec;
    return stream_->Write(request);
  }
  bool send(v1::Chunk chunk) {
    v1::SmoothRequest request;
    *request.mutable_chunk() = std::move(chunk);
    return stream_->Write(request);
  }
  void send_data(const TwoTetrahedra& mesh) {
    send(chunk(v1::ARRAY_ID_ELEMENTS, 0, mesh.elements));
    send(chunk(v1::ARRAY_ID_FIXED_MASK, 0, mesh.fixed));
    send(chunk(v1::ARRAY_ID_COORDINATES, 0, bytes_of(mesh.coordinates)));
  }
  void send_all(const TwoTetrahedra& mesh, const v1::JobSpec& spec = TwoTetrahedra::spec()) {
    send(spec);
    send_data(mesh);
    half_close();
  }
  void half_close() {
    if (!std::exchange(half_closed_, true)) stream_->WritesDone();
  }
  void cancel() { context_.TryCancel(); }

  /// Nothing at the end of the stream.
  std::optional<v1::SmoothResponse> read() {
    v1::SmoothResponse response;
    if (!stream_->Read(&response)) return std::nullopt;
    return response;
  }

  /// The job's name from Accepted, which must come next.
  std::string read_accepted() {
    const auto response = read();
    EXPECT_TRUE(response && response->has_accepted());
    return response ? response->accepted().job().name() : "";
  }

  /// The same where the deadline may come first: nothing then.
  std::optional<std::string> try_read_accepted() {
    const auto response = read();
    if (!response || !response->has_accepted()) return std::nullopt;
    return response->accepted().job().name();
  }

  /// Reads to the end and takes the status; half-closes when told to stop.
  const grpc::Status& finish() {
    while (!finished_) {
      const auto response = read();
      if (!response) {
        status_ = stream_->Finish();
        finished_ = true;
      } else if (response->has_chunk()) {
        ++chunk_count_;
        EXPECT_EQ(response->chunk().offset_bytes(), static_cast<std::int64_t>(result_.size()));
        result_ += response->chunk().data();
      } else if (response->has_summary()) {
        summary_ = response->summary();
      } else if (response->has_progress()) {
        progress_.push_back(response->progress());
      } else if (response->has_stop_sending()) {
        stop_sending_ = true;
        half_close();
      }
    }
    return status_;
  }

  // After `finish`.
  [[nodiscard]] const std::string& result() const { return result_; }
  [[nodiscard]] int chunk_count() const { return chunk_count_; }
  [[nodiscard]] const std::optional<v1::Summary>& summary() const { return summary_; }
  [[nodiscard]] const std::vector<v1::Progress>& progress() const { return progress_; }
  [[nodiscard]] bool was_told_to_stop() const { return stop_sending_; }
  [[nodiscard]] wire::StatusDetails details() const {
    return wire::decode_status_details(status_.error_details()).value_or(wire::StatusDetails{});
  }
  [[nodiscard]] std::string initial_metadata(const std::string& key) const {
    const auto& all = context_.GetServerInitialMetadata();
    const auto found = all.find(key);
    return found == all.end() ? "" : std::string(found->second.data(), found->second.size());
  }
  [[nodiscard]] std::string detail(const std::string& key) const {
    for (const auto& [name, value] : details().metadata) {
      if (name == key) return value;
    }
    return "";
  }

 private:
  grpc::ClientContext context_;
  std::unique_ptr<grpc::ClientReaderWriter<v1::SmoothRequest, v1::SmoothResponse>> stream_;
  bool half_closed_ = false;
  bool finished_ = false;
  grpc::Status status_;
  std::string result_;
  int chunk_count_ = 0;
  std::optional<v1::Summary> summary_;
  std::vector<v1::Progress> progress_;
  bool stop_sending_ = false;
};

inline v1::Job get_job(Stub& stub, const std::string& name) {
  grpc::ClientContext context;
  v1::GetJobRequest request;
  request.set_name(name);
  v1::GetJobResponse response;
  EXPECT_TRUE(stub.GetJob(&context, request, &response).ok());
  return response.job();
}

/// Asks until the job has the state; the test's timeout ends a wait in vain.
inline v1::Job wait_for_state(Stub& stub, const std::string& name, v1::State state) {
  for (;;) {
    v1::Job job = get_job(stub, name);
    if (job.state() == state) return job;
    std::this_thread::yield();
  }
}

/// The same of a job that may end before: then as it ended.
inline v1::Job wait_for_state_or_end(Stub& stub, const std::string& name, v1::State state) {
  for (;;) {
    v1::Job job = get_job(stub, name);
    if (job.state() == state || job.state() >= v1::STATE_SUCCEEDED) return job;
    std::this_thread::yield();
  }
}

inline v1::ListJobsResponse list_jobs(Stub& stub, const v1::ListJobsRequest& request = {}) {
  grpc::ClientContext context;
  v1::ListJobsResponse response;
  EXPECT_TRUE(stub.ListJobs(&context, request, &response).ok());
  return response;
}

inline v1::GetServerInfoResponse server_info(Stub& stub) {
  grpc::ClientContext context;
  v1::GetServerInfoResponse response;
  EXPECT_TRUE(stub.GetServerInfo(&context, {}, &response).ok());
  return response;
}

/// Every promise of memory comes back, at the latest when those calls are over
/// that were just cancelled; the test's timeout ends a wait in vain.
inline void expect_nothing_reserved(Stub& stub) {
  const auto reserved = [&] {
    std::int64_t sum = 0;
    const v1::GetServerInfoResponse info = server_info(stub);
    for (const v1::Backend& backend : info.backends()) sum += backend.reserved_bytes();
    return sum;
  };
  while (reserved() != 0) std::this_thread::yield();
}

/// A job after all that happened is answered as ever.
inline void expect_healthy_service(Stub& stub) {
  const TwoTetrahedra mesh;
  SmoothCall call(stub);
  call.send_all(mesh);
  EXPECT_TRUE(call.finish().ok()) << call.finish().error_message();
  EXPECT_EQ(call.result(), mesh.moved());
  expect_nothing_reserved(stub);
}

}  // namespace meshsmooth::testing
