#include "http/connection.hpp"

#include <sys/socket.h>

#include <algorithm>
#include <boost/asio/buffer.hpp>
#include <boost/beast/http/error.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/http/status.hpp>
#include <limits>
#include <sstream>
#include <vector>

#include "problem.hpp"

namespace meshsmooth::gateway {
namespace {

namespace asio = boost::asio;
namespace http = boost::beast::http;

constexpr std::uint32_t kMostHeadBytes = 16384;
constexpr std::chrono::seconds kHeadTime{10};
constexpr std::chrono::seconds kPatience{20};  // beyond the least rate
constexpr double kLeastBytesPerSecond = 16384;
// Who is slower gives way to others when connections run out.
constexpr double kSlowBytesPerSecond = 65536;
constexpr std::chrono::seconds kSlowAfter{1};
constexpr std::chrono::milliseconds kSlowHeadAfter{250};
constexpr std::chrono::seconds kReadOnTime{5};
constexpr std::uint64_t kMostReadOnBytes = std::uint64_t{64} << 20;
constexpr std::size_t kPieceBytes = std::size_t{1} << 18;

}  // namespace

/// For Beast, which reads from anything with these.
struct Connection::Reader {
  Connection& connection;

  template <class Buffers>
  std::size_t read_some(const Buffers& buffers) {
    Error error;
    const std::size_t count = read_some(buffers, error);
    if (error) throw boost::system::system_error(error);
    return count;
  }
  template <class Buffers>
  std::size_t read_some(const Buffers& buffers, Error& error) {
    return connection.read_some(buffers, error);
  }
};

Connection::Connection(TimedSocket::Socket socket, TlsContext* tls) : socket_(std::move(socket)) {
  if (tls != nullptr) tls_.emplace(socket_, *tls);
  Error error;
  const auto endpoint =
      static_cast<TimedSocket::Socket&>(socket_.lowest_layer()).remote_endpoint(error);
  if (!error) peer_ = endpoint.address().to_string();
  parser_.header_limit(kMostHeadBytes);
  parser_.body_limit(std::numeric_limits<std::uint64_t>::max());  // see those who read it
}

bool Connection::read_head(Request& request) {
  Error error;
  request.peer = peer_;
  socket_.expire_at(phase_begun_.load() + kHeadTime);
  if (tls_) tls_->handshake(asio::ssl::stream_base::server, error);
  if (error) return false;
  Reader reader{*this};
  http::read_header(reader, buffer_, parser_, error);
  if (error == http::error::header_limit || error == http::error::buffer_overflow) {
    throw Problem(431, "the head of the request has more than 16 KiB");
  }
  if (error.category() == http::make_error_code(http::error::bad_method).category() &&
      error != http::error::end_of_stream && error != http::error::partial_message) {
    throw Problem(400, "the request is not one of HTTP/1.1: " + error.message());
  }
  if (error) return false;
  auto& message = parser_.get();
  request.method = std::string(message.method_string());
  expects_continue_ = boost::beast::iequals(message[http::field::expect], "100-continue");
  read_target({message.target().data(), message.target().size()}, request);
  request.headers = std::move(message.base());
  begin(Phase::upload);
  return true;
}

std::optional<std::uint64_t> Connection::body_length() const {
  const auto length = parser_.content_length();
  return length ? std::optional<std::uint64_t>(*length) : std::nullopt;
}

std::size_t Connection::read_body(std::span<char> into, Clock::time_point deadline) {
  if (std::exchange(expects_continue_, false)) {
    if (!write("HTTP/1.1 100 Continue\r\n\r\n")) return 0;
  }
  if (parser_.is_done()) return 0;
  auto& body = parser_.get().body();
  body.data = into.data();
  body.size = into.size();
  socket_.expire_at(std::min(deadline, due()));
  Error error;
  Reader reader{*this};
  while (body.size == into.size() && !parser_.is_done()) {
    http::read_some(reader, buffer_, parser_, error);
    if (error == http::error::need_buffer) error = {};
    if (!error) continue;
    if (gives_way_) {
      throw Problem("QUEUE_FULL", "there are too many connections, and this upload is slow");
    }
    if (error == asio::error::timed_out) {
      throw Problem(
          "UPLOAD_TOO_SLOW",
          "the upload took longer than the gateway allows (--upload-timeout), or was slower "
          "than 16 KiB a second");
    }
    throw Problem("UPLOAD_INVALID", "the body of the request is broken, or ends too early");
  }
  const std::size_t count = into.size() - body.size;
  transferred_ += count;
  return count;
}

bool Connection::write(std::string_view bytes) {
  Error error;
  while (!bytes.empty()) {
    socket_.expire_at(due());
    const asio::const_buffer buffer(bytes.data(), bytes.size());
    const std::size_t count =
        tls_ ? tls_->write_some(buffer, error) : socket_.write_some(buffer, error);
    if (error) return false;
    transferred_ += count;
    bytes.remove_prefix(count);
  }
  return true;
}

void Connection::send(const Answer& answer) {
  std::ostringstream head;
  head << "HTTP/1.1 " << answer.status << ' '
       << http::obsolete_reason(http::int_to_status(answer.status)) << "\r\nConnection: close\r\n";
  for (const auto& [name, value] : answer.headers) head << name << ": " << value << "\r\n";
  if (!answer.type.empty()) head << "Content-Type: " << answer.type << "\r\n";
  if (answer.next_piece) {
    head << "Transfer-Encoding: chunked\r\n";
  } else if (answer.status != 204) {
    head << "Content-Length: " << (answer.file ? answer.file->size() : answer.body.size())
         << "\r\n";
  }
  head << "\r\n";
  if (!answer.next_piece && !answer.file) head << answer.body;
  begin(answer.next_piece ? Phase::events : Phase::answer);
  bool good = write(head.str());
  if (good && answer.next_piece) good = send_pieces(answer);
  if (good && answer.file) good = send_file(*answer.file);
  begin(Phase::ending);
  if (good) read_on();
}

bool Connection::send_pieces(const Answer& answer) {
  std::string piece;
  for (bool more = true; more;) {
    piece.clear();
    more = answer.next_piece(piece);
    std::ostringstream chunk;
    if (!piece.empty()) chunk << std::hex << piece.size() << "\r\n" << piece << "\r\n";
    if (!more) chunk << "0\r\n\r\n";
    begin(Phase::events);  // each has its time
    if (!write(chunk.str())) return false;
  }
  return true;
}

bool Connection::send_file(const OpenFile& file) {
  std::string bytes(std::min<std::uint64_t>(kPieceBytes, file.size()), '\0');
  for (std::uint64_t at = 0; at < file.size();) {
    const std::size_t count =
        file.read(bytes.data(), std::min<std::uint64_t>(bytes.size(), file.size() - at), at);
    if (count == 0 || !write({bytes.data(), count})) return false;
    at += count;
  }
  return true;
}

void Connection::read_on() {
  // Closed with bytes unread, a connection is reset, and the answer may be lost with it.
  Error error;
  socket_.expire_at(Clock::now() + kReadOnTime);
  if (tls_) tls_->shutdown(error);
  ::shutdown(socket_.descriptor(), SHUT_WR);
  std::vector<char> dropped(kPieceBytes);
  std::uint64_t left = kMostReadOnBytes;
  error = {};
  while (!error && left > 0) {
    left -= std::min<std::uint64_t>(left, socket_.read_some(asio::buffer(dropped), error));
  }
}

void Connection::close() {
  Error error;
  socket_.lowest_layer().close(error);
}

void Connection::begin(Phase phase) {
  phase_begun_ = Clock::now();
  transferred_ = 0;
  phase_ = phase;
}

Clock::time_point Connection::due() const {
  const std::chrono::duration<double> time(static_cast<double>(transferred_) /
                                           kLeastBytesPerSecond);
  return phase_begun_.load() + kPatience + std::chrono::duration_cast<Clock::duration>(time);
}

bool Connection::can_give_way() const {
  if (gives_way_ || phase_ == Phase::work) return false;
  const std::chrono::duration<double> time = Clock::now() - phase_begun_.load();
  if (phase_ == Phase::head) return time > kSlowHeadAfter;
  if (phase_ != Phase::answer && phase_ != Phase::upload) return true;
  return time > kSlowAfter &&
         static_cast<double>(transferred_) < kSlowBytesPerSecond * time.count();
}

void Connection::give_way() {
  gives_way_ = true;
  // Whose upload it ends is told so.
  ::shutdown(socket_.descriptor(), phase_ == Phase::upload ? SHUT_RD : SHUT_RDWR);
}

}  // namespace meshsmooth::gateway
