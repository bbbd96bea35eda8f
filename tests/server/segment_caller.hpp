#pragma once

#include <fcntl.h>
#include <grpcpp/client_context.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/mman.h>
#include <sys/socket.h>

#include <cstring>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "meshsmooth/server_config.hpp"
#include "server/smooth_call.hpp"
#include "wire/lease_socket.hpp"
#include "wire/local_address.hpp"

namespace meshsmooth::testing {

/// A server that shares memory, on a free port.
inline server::ServerConfig sharing_config(server::ServerConfig config) {
  config.listen = "127.0.0.1:0";
  return config;
}

inline grpc::Status lease_shared_memory(Stub& stub, std::int64_t size_bytes,
                                        v1::LeaseSharedMemoryResponse& response) {
  grpc::ClientContext context;
  v1::LeaseSharedMemoryRequest request;
  request.set_size_bytes(size_bytes);
  return stub.LeaseSharedMemory(&context, request, &response);
}

/// A connection to the socket, for a segment or something else.
inline wire::Descriptor connect_to(const std::string& path) {
  const auto address = wire::socket_address(path);
  wire::Descriptor socket(::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0));
  if (!address || connect(socket.number(), reinterpret_cast<const sockaddr*>(&*address),
                          sizeof *address) != 0) {
    socket.close();
  }
  return socket;
}

/// The next message; the test's timeout ends a wait in vain.
inline wire::ReceivedMessage next_message(const wire::Descriptor& socket) {
  pollfd event{socket.number(), POLLIN, 0};
  poll(&event, 1, -1);
  return wire::receive_message(socket.number());
}

/// A caller's side of one segment, step by step.
class SegmentCaller {
 public:
  SegmentCaller(Stub& stub, std::int64_t size_bytes) {
    const grpc::Status status = lease_shared_memory(stub, size_bytes, lease_);
    EXPECT_TRUE(status.ok()) << status.error_message();
  }
  /// All steps.
  static SegmentCaller ready(Stub& stub, std::int64_t size_bytes) {
    SegmentCaller caller(stub, size_bytes);
    caller.fetch();
    caller.map();
    caller.say_mapped();
    return caller;
  }
  SegmentCaller(SegmentCaller&& other) noexcept
      : lease_(std::move(other.lease_)),
        socket_(std::move(other.socket_)),
        file_(std::move(other.file_)),
        bytes_(std::exchange(other.bytes_, {})) {}
  SegmentCaller& operator=(SegmentCaller&&) = delete;
  ~SegmentCaller() { unmap(); }

  /// Shows the ticket and takes the descriptor; false when there is none.
  bool fetch() {
    socket_ = connect_to(lease_.socket_path());
    send(socket_.number(), lease_.ticket().data(), lease_.ticket().size(), MSG_NOSIGNAL);
    wire::ReceivedMessage received = next_message(socket_);
    file_ = std::move(received.descriptor);
    return received.message == wire::LeaseMessage::descriptor && static_cast<bool>(file_);
  }
  void map() {
    const auto size = static_cast<std::size_t>(lease_.size_bytes());
    void* const data = mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_SHARED, file_.number(), 0);
    ASSERT_NE(data, MAP_FAILED);
    bytes_ = {static_cast<std::byte*>(data), size};
  }
  void say_mapped() {
    EXPECT_TRUE(wire::send_message(socket_.number(), wire::LeaseMessage::mapped));
    EXPECT_EQ(next_message(socket_).message, wire::LeaseMessage::ready);
  }
  void unmap() {
    if (!bytes_.empty()) munmap(bytes_.data(), bytes_.size());
    bytes_ = {};
  }
  void close_file() { file_.close(); }
  void close_socket() { socket_.close(); }
  /// Returns the segment, however far it came.
  void end() {
    unmap();
    close_file();
    close_socket();
  }

  [[nodiscard]] const v1::LeaseSharedMemoryResponse& lease() const { return lease_; }
  [[nodiscard]] const wire::Descriptor& socket() const { return socket_; }
  [[nodiscard]] const wire::Descriptor& file() const { return file_; }
  [[nodiscard]] std::span<std::byte> bytes() const { return bytes_; }

  void write(std::size_t offset, const std::string& text) const {
    std::memcpy(bytes_.data() + offset, text.data(), text.size());
  }
  [[nodiscard]] std::string read(std::size_t offset, std::size_t size) const {
    return {reinterpret_cast<const char*>(bytes_.data()) + offset, size};
  }

 private:
  v1::LeaseSharedMemoryResponse lease_;
  wire::Descriptor socket_, file_;
  std::span<std::byte> bytes_;
};

/// Two tetrahedra in a segment: where their arrays lie, and the spec that says so.
struct TwoTetrahedraInSegment {
  static constexpr std::int64_t kElements = 0, kFixed = 64, kCoordinates = 128, kResult = 256;
  static constexpr std::int64_t kBytes = 4096;
  TwoTetrahedra mesh;

  void write(const SegmentCaller& segment) const {
    segment.write(kElements, mesh.elements);
    segment.write(kFixed, mesh.fixed);
    segment.write(kCoordinates, bytes_of(mesh.coordinates));
  }
  [[nodiscard]] std::string result(const SegmentCaller& segment) const {
    return segment.read(kResult, mesh.coordinates.size() * sizeof(double));
  }
  [[nodiscard]] static v1::JobSpec spec(const std::string& segment_name) {
    v1::JobSpec spec = TwoTetrahedra::spec();
    v1::SharedMemoryUse* use = spec.mutable_shared_memory();
    use->set_segment_name(segment_name);
    const auto add = [&](v1::ArrayId id, std::int64_t offset) {
      use->add_inputs()->set_array_id(id);
      use->mutable_inputs(use->inputs_size() - 1)->set_offset_bytes(offset);
    };
    add(v1::ARRAY_ID_ELEMENTS, kElements);
    add(v1::ARRAY_ID_FIXED_MASK, kFixed);
    add(v1::ARRAY_ID_COORDINATES, kCoordinates);
    use->set_result_offset_bytes(kResult);
    return spec;
  }
};

}  // namespace meshsmooth::testing
