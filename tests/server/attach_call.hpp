#pragma once

#include <optional>
#include <string>

#include "server/smooth_call.hpp"

namespace meshsmooth::testing {

/// One AttachJob call, read message by message.
class AttachCall {
 public:
  AttachCall(Stub& stub, const std::string& name, std::int64_t offset = 0) : offset_(offset) {
    v1::AttachJobRequest request;
    request.set_name(name);
    request.set_result_offset_bytes(offset);
    stream_ = stub.AttachJob(&context_, request);
  }
  ~AttachCall() {
    if (finished_) return;
    context_.TryCancel();
    finish();
  }

  void cancel() { context_.TryCancel(); }

  /// Nothing at the end of the stream.
  std::optional<v1::AttachJobResponse> read() {
    v1::AttachJobResponse response;
    if (!stream_->Read(&response)) return std::nullopt;
    return response;
  }

  /// Reads to the end and takes the status.
  const grpc::Status& finish() {
    while (!finished_) {
      const auto response = read();
      if (!response) {
        status_ = stream_->Finish();
        finished_ = true;
      } else if (response->has_chunk()) {
        EXPECT_EQ(response->chunk().offset_bytes(),
                  offset_ + static_cast<std::int64_t>(result_.size()));
        result_ += response->chunk().data();
      } else if (response->has_summary()) {
        summary_ = response->summary();
      }
    }
    return status_;
  }

  // After `finish`.
  [[nodiscard]] const std::string& result() const { return result_; }
  [[nodiscard]] const std::optional<v1::Summary>& summary() const { return summary_; }

 private:
  const std::int64_t offset_;
  grpc::ClientContext context_;
  std::unique_ptr<grpc::ClientReader<v1::AttachJobResponse>> stream_;
  bool finished_ = false;
  grpc::Status status_;
  std::string result_;
  std::optional<v1::Summary> summary_;
};

}  // namespace meshsmooth::testing
