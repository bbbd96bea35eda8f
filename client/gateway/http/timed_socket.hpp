#pragma once

#include <poll.h>

#include <boost/asio/ip/tcp.hpp>
#include <cerrno>
#include <chrono>
#include <utility>

namespace meshsmooth::gateway {

using Clock = std::chrono::steady_clock;

/// A socket whose reads and writes end by a time: Asio's synchronous operations know none. A stream
/// of Asio (SyncReadStream, SyncWriteStream), also below TLS.
class TimedSocket {
 public:
  using Error = boost::system::error_code;
  using Socket = boost::asio::ip::tcp::socket;
  using lowest_layer_type = Socket::lowest_layer_type;
  using executor_type = Socket::executor_type;

  explicit TimedSocket(Socket socket) : socket_(std::move(socket)) { socket_.non_blocking(true); }

  void expire_at(Clock::time_point time) { expiry_ = time; }
  [[nodiscard]] int descriptor() { return socket_.native_handle(); }
  lowest_layer_type& lowest_layer() { return socket_.lowest_layer(); }
  executor_type get_executor() { return socket_.get_executor(); }

  template <class Buffers>
  std::size_t read_some(const Buffers& buffers, Error& error) {
    return in_time(POLLIN, error, [&] { return socket_.read_some(buffers, error); });
  }
  template <class Buffers>
  std::size_t write_some(const Buffers& buffers, Error& error) {
    return in_time(POLLOUT, error, [&] { return socket_.write_some(buffers, error); });
  }

 private:
  template <class Function>
  std::size_t in_time(short event, Error& error, const Function& function) {
    while (true) {
      const std::size_t count = function();
      if (error != boost::asio::error::would_block) return count;
      const auto left =
          std::chrono::ceil<std::chrono::milliseconds>(expiry_ - Clock::now()).count();
      pollfd descriptor{socket_.native_handle(), event, 0};
      const int ready = left <= 0 ? 0 : ::poll(&descriptor, 1, static_cast<int>(left));
      if (ready == 0) {
        error = boost::asio::error::timed_out;
        return 0;
      }
      if (ready < 0 && errno != EINTR) {
        error.assign(errno, boost::system::system_category());
        return 0;
      }
    }
  }

  Socket socket_;
  Clock::time_point expiry_ = Clock::now();
};

}  // namespace meshsmooth::gateway
