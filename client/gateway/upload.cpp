#include "upload.hpp"

#include <netdb.h>
#include <sys/socket.h>

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <optional>
#include <string_view>
#include <utility>

#include "problem.hpp"

namespace meshsmooth::gateway {
namespace {

using Clock = std::chrono::steady_clock;

/// Read of a refused form, so that a caller who sends before it reads gets the answer.
constexpr std::uint64_t kMostRefusedBytes = std::uint64_t{64} << 20;

std::optional<std::uint64_t> content_length(const httplib::Request& request) {
  const std::string text = request.get_header_value("Content-Length");
  std::uint64_t length = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), length);
  if (text.empty() || error != std::errc() || end != text.data() + text.size()) return {};
  return length;
}

/// Receives a form part by part. The first problem stays; what follows is dropped.
class FormReceiver {
 public:
  FormReceiver(const Service& service, const RequestFolder& folder, Order& order)
      : service_(service),
        folder_(folder),
        order_(order),
        deadline_(Clock::now() + service.settings().upload_timeout) {}

  bool begin_part(const httplib::MultipartFormData& part) {
    return guarded([&] {
      file_.reset();
      if (!order_.operation.parts.contains(part.name)) {
        throw Problem("UPLOAD_INVALID",
                      order_.operation.name + " has no part \"" + part.name +
                          "\"; options are parameters of the address",
                      {{"field", part.name}});
      }
      if (order_.files.contains(part.name)) {
        throw Problem("UPLOAD_INVALID", "the part \"" + part.name + "\" is given twice",
                      {{"field", part.name}});
      }
      // Of the caller's name its extension alone: it names the format.
      const std::string name = part.name + safe_extension(part.filename);
      file_.emplace(folder_ / name);
      order_.files[part.name] = name;
      if (part.name == "mesh") order_.mesh_name = part.filename;
    });
  }

  bool add(std::string_view bytes) {
    received_ += bytes.size();
    return guarded([&] {
      check_limits();
      if (file_) file_->write(bytes);
    });
  }

  void refuse(Problem problem) {
    if (!problem_) problem_ = std::move(problem);
    refused_at_ = received_;
    file_.reset();
  }

  /// Once all has been read, or no more is wanted.
  void finish(bool complete) {
    file_.reset();
    if (problem_) throw *problem_;
    if (!complete) {
      throw Problem("UPLOAD_INVALID", "the form is broken, or ends too early");
    }
    if (!order_.files.contains("mesh")) {
      throw Problem("UPLOAD_INVALID", "the form has no part \"mesh\", the file of the mesh",
                    {{"field", "mesh"}});
    }
  }

 private:
  template <class Function>
  bool guarded(const Function& function) {
    try {
      if (!problem_) function();
    } catch (const Problem& problem) {
      refuse(problem);
    }
    return !problem_ || (received_ <= refused_at_ + kMostRefusedBytes && Clock::now() < deadline_);
  }

  void check_limits() const {
    const std::uint64_t limit = service_.settings().max_upload_bytes;
    if (received_ > limit) {
      throw Problem("UPLOAD_TOO_LARGE",
                    "the form has more than " + std::to_string(limit) + " bytes",
                    {{"limit_bytes", std::to_string(limit)}});
    }
    if (Clock::now() >= deadline_) {
      throw Problem("UPLOAD_TOO_SLOW",
                    "the upload took longer than the gateway allows "
                    "(--upload-timeout)");
    }
    if (service_.stopped().requested()) throw Problem("DRAINING", "the gateway is shutting down");
  }

  const Service& service_;
  const RequestFolder& folder_;
  Order& order_;
  const Clock::time_point deadline_;
  std::optional<NewFile> file_;
  std::optional<Problem> problem_;
  std::uint64_t received_ = 0;
  std::uint64_t refused_at_ = 0;
};

}  // namespace

void read_form(const httplib::Request& request, const httplib::ContentReader& content,
               const Service& service, const RequestFolder& folder, Order& order) {
  FormReceiver receiver(service, folder, order);
  const std::uint64_t limit = service.settings().max_upload_bytes;
  if (const auto length = content_length(request); length && *length > limit) {
    receiver.refuse(Problem("UPLOAD_TOO_LARGE",
                            "the form has " + std::to_string(*length) + " bytes, of " +
                                std::to_string(limit) + " that the gateway takes",
                            {{"limit_bytes", std::to_string(limit)}}));
    // Nobody sends so much to hear that it is too much.
    if (*length > limit + kMostRefusedBytes) receiver.finish(false);
  }
  if (!request.is_multipart_form_data()) {
    receiver.refuse(Problem("UPLOAD_INVALID",
                            "the request has no form: send the file as multipart/form-data, as "
                            "curl -F mesh=@part.inp does"));
    content([&](const char* data, std::size_t size) { return receiver.add({data, size}); });
    receiver.finish(true);
    return;
  }
  const bool complete =
      content([&](const httplib::MultipartFormData& part) { return receiver.begin_part(part); },
              [&](const char* data, std::size_t size) {
                return receiver.add({data, size});
              });
  receiver.finish(complete);
}

std::string bearer_token(const httplib::Request& request) {
  const std::string value = request.get_header_value("Authorization");
  if (value.empty()) return {};
  constexpr std::string_view kBearer = "Bearer ";
  const std::string token = value.starts_with(kBearer) ? value.substr(kBearer.size()) : "";
  const auto is_visible = [](unsigned char c) { return c > 0x20 && c < 0x7f; };
  if (!token.empty() && std::ranges::all_of(token, is_visible)) return token;
  throw Problem("TOKEN_UNKNOWN", "the header Authorization is not Bearer TOKEN");
}

int find_connection(const httplib::Request& request) {
  // cpp-httplib before 0.18 does not tell, so it is looked up by its two ends.
  const auto matches = [](int socket, auto get_name, const std::string& address, int port) {
    sockaddr_storage name{};
    socklen_t size = sizeof name;
    char host[NI_MAXHOST], service[NI_MAXSERV];
    return get_name(socket, reinterpret_cast<sockaddr*>(&name), &size) == 0 &&
           getnameinfo(reinterpret_cast<sockaddr*>(&name), size, host, sizeof host, service,
                       sizeof service, NI_NUMERICHOST | NI_NUMERICSERV) == 0 &&
           host == address && std::atoi(service) == port;
  };
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd", error)) {
    const int socket = std::atoi(entry.path().filename().c_str());
    if (matches(socket, getpeername, request.remote_addr, request.remote_port) &&
        matches(socket, getsockname, request.local_addr, request.local_port)) {
      return socket;
    }
  }
  return -1;
}

}  // namespace meshsmooth::gateway
