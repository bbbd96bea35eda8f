#pragma once

#include <grpcpp/channel.h>
#include <grpcpp/client_context.h>
#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/sync_stream.h>

#include <memory>
#include <optional>
#include <string>

namespace meshsmooth::testing {

/// A call in serialized messages, for the standard services of gRPC: Debian
/// ships neither their protos nor their headers.
class RawCall {
 public:
  RawCall(std::shared_ptr<grpc::Channel> channel, const char* method)
      : channel_(std::move(channel)),
        method_(method, grpc::internal::RpcMethod::BIDI_STREAMING),
        stream_(
            grpc::internal::ClientReaderWriterFactory<grpc::ByteBuffer, grpc::ByteBuffer>::Create(
                channel_.get(), method_, &context_)) {}
  ~RawCall() {
    context_.TryCancel();
    while (read()) {
    }
    stream_->Finish();
  }

  void send(const std::string& message) {
    const grpc::Slice slice(message);
    stream_->Write(grpc::ByteBuffer(&slice, 1));
  }
  std::optional<std::string> read() {
    grpc::ByteBuffer buffer;
    if (!stream_->Read(&buffer)) return std::nullopt;
    grpc::Slice slice;
    if (!buffer.DumpToSingleSlice(&slice).ok()) return std::nullopt;
    return std::string(reinterpret_cast<const char*>(slice.begin()), slice.size());
  }

 private:
  std::shared_ptr<grpc::Channel> channel_;
  grpc::ClientContext context_;
  const grpc::internal::RpcMethod method_;
  std::unique_ptr<grpc::ClientReaderWriter<grpc::ByteBuffer, grpc::ByteBuffer>> stream_;
};

/// A message whose only field, `number`, is the string.
inline std::string string_message(int number, const std::string& text) {
  return std::string{static_cast<char>(number << 3 | 2), static_cast<char>(text.size())} + text;
}

}  // namespace meshsmooth::testing
