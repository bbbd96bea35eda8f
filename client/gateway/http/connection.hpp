#pragma once

#include <atomic>
#include <boost/asio/ssl.hpp>
#include <boost/beast/core/flat_static_buffer.hpp>
#include <boost/beast/http/buffer_body.hpp>
#include <boost/beast/http/parser.hpp>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "http/request.hpp"
#include "http/timed_socket.hpp"

namespace meshsmooth::gateway {

/// One connection, which has one request. Whatever its peer does, it costs bounded memory and each
/// step ends: a head has 16 KiB and 10 s, forms and answers go on at 16 KiB a second at least.
class Connection {
 public:
  /// What it is at, in the order in which connections give way when there are too many.
  enum class Phase { head, ending, events, answer, upload, work };

  using TlsContext = boost::asio::ssl::context;

  /// `tls` null: in clear.
  Connection(TimedSocket::Socket socket, TlsContext* tls);

  /// Throws `Problem` (400, 431) where it is none of HTTP; returns false where there is nobody
  /// to hear that.
  [[nodiscard]] bool read_head(Request& request);
  /// The next bytes of the body; 0: it has ended. Throws `Problem` (UPLOAD_INVALID where it is
  /// broken, UPLOAD_TOO_SLOW, QUEUE_FULL where it gives way).
  [[nodiscard]] std::size_t read_body(std::span<char> into, Clock::time_point deadline);
  /// The announced length of the body; unset: unknown.
  [[nodiscard]] std::optional<std::uint64_t> body_length() const;

  /// The request is complete, or no more of it is wanted: it works for its caller, until `send`.
  void begin_work() { begin(Phase::work); }
  /// Sends the answer, then reads what the caller still sends, so that it gets to reading.
  void send(const Answer& answer);

  void close();
  /// To be asked whether the caller is still there.
  [[nodiscard]] int descriptor() { return socket_.descriptor(); }

  // For other threads.
  [[nodiscard]] Phase phase() const { return phase_; }
  /// Whether it does nothing that another may not end: a transfer that is slow, no work.
  [[nodiscard]] bool can_give_way() const;
  /// Ends what it is at.
  void give_way();

 private:
  using Error = TimedSocket::Error;

  void begin(Phase phase);
  /// When a transfer that goes on at the least rate has got so far.
  [[nodiscard]] Clock::time_point due() const;
  template <class Buffers>
  std::size_t read_some(const Buffers& buffers, Error& error) {
    return tls_ ? tls_->read_some(buffers, error) : socket_.read_some(buffers, error);
  }
  /// All of it; false: the peer is gone or too slow.
  [[nodiscard]] bool write(std::string_view bytes);
  [[nodiscard]] bool send_pieces(const Answer& answer);
  [[nodiscard]] bool send_file(const OpenFile& file);
  void read_on();

  struct Reader;

  TimedSocket socket_;
  std::optional<boost::asio::ssl::stream<TimedSocket&>> tls_;
  boost::beast::flat_static_buffer<std::size_t{1} << 16> buffer_;
  boost::beast::http::request_parser<boost::beast::http::buffer_body> parser_;
  bool expects_continue_ = false;  // the caller waits to be told before it sends the body
  std::string peer_;

  std::atomic<Phase> phase_ = Phase::head;
  std::atomic<Clock::time_point> phase_begun_ = Clock::now();
  std::atomic<std::uint64_t> transferred_ = 0;  // in this phase
  std::atomic<bool> gives_way_ = false;
};

}  // namespace meshsmooth::gateway
