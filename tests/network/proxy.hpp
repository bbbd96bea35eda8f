#pragma once

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "support/process.hpp"
#include "support/scratch_folder.hpp"

namespace meshsmooth::testing {

enum class ProxyKind { haproxy, nginx };

inline std::string name_of(ProxyKind kind) {
  return kind == ProxyKind::haproxy ? "haproxy" : "nginx";
}

/// HAProxy or nginx on a free port of loopback, before servers there, with the configuration
/// in deploy/; only the addresses are the test's.
class Proxy {
 public:
  struct Backend {
    int port = 0;
    int admin_port = 0;  // 0: not asked whether it is ready
  };
  /// A text of the configuration, and what stands there instead.
  using Change = std::pair<std::string, std::string>;

  Proxy(ProxyKind kind, const std::vector<Backend>& backends,
        const std::vector<Change>& changes = {})
      : kind_(kind) {
    const int listener = listen_on_loopback();
    std::string text =
        text_of(std::string(MESHSMOOTH_DEPLOY) +
                (kind == ProxyKind::haproxy ? "/haproxy/haproxy.cfg" : "/nginx/meshsmooth.conf"));
    for (const auto& [from, to] : changes) replace(text, from, to);
    if (kind == ProxyKind::haproxy) {
      start_haproxy(std::move(text), backends, listener);
      close(listener);  // from now on only the proxy listens
    } else {
      close(listener);  // nginx 1.22 dies of a socket that it inherits
      start_nginx(std::move(text), backends);
    }
  }
  ~Proxy() {
    if (process_->ended() || ::testing::Test::HasFailure()) {
      ADD_FAILURE() << name_of(kind_) << " says:\n" << log();
    }
  }
  Proxy(const Proxy&) = delete;
  Proxy& operator=(const Proxy&) = delete;

  [[nodiscard]] int port() const { return port_; }
  [[nodiscard]] std::string log() const { return text_of(folder_.path("log")); }
  [[nodiscard]] std::string target() const { return "127.0.0.1:" + std::to_string(port_); }

 private:
  static sockaddr_in loopback() {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    return address;
  }
  int listen_on_loopback() {
    const int file = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in address = loopback();
    socklen_t size = sizeof address;
    if (bind(file, reinterpret_cast<sockaddr*>(&address), size) != 0 || listen(file, 128) != 0 ||
        getsockname(file, reinterpret_cast<sockaddr*>(&address), &size) != 0) {
      throw std::runtime_error("cannot listen on loopback");
    }
    port_ = ntohs(address.sin_port);
    return file;
  }

  void start_haproxy(std::string text, const std::vector<Backend>& backends, int listener) {
    std::string servers;
    for (const Backend& backend : backends) {
      servers +=
          "    server s" + std::to_string(backend.port) +
          " 127.0.0.1:" + std::to_string(backend.port) +
          (backend.admin_port == 0 ? " no-check" : " port " + std::to_string(backend.admin_port)) +
          "\n";
    }
    replace_line(text, "server-template ", servers);
    process_ = std::make_unique<Process>(
        std::vector<std::string>{find_program("haproxy"), "-db", "-f",
                                 folder_.write("haproxy.cfg", text)},
        folder_.path("log"),
        Surroundings{{"MESHSMOOTH_BIND=fd@" + std::to_string(listener)}, listener});
  }

  void start_nginx(std::string text, const std::vector<Backend>& backends) {
    std::string servers;
    for (const Backend& backend : backends) {
      servers +=
          "server 127.0.0.1:" + std::to_string(backend.port) + " max_fails=1 fail_timeout=5s;\n";
    }
    replace_line(text, "server meshsmooth-1:", servers);
    replace_line(text, "server meshsmooth-2:", "");
    replace(text, "listen 50051", "listen 127.0.0.1:" + std::to_string(port_));
    const std::string main = "daemon off; master_process off; pid " + folder_.path("pid").string() +
                             "; error_log stderr; events {}\nhttp {\naccess_log off;\n" +
                             temporary_folders() + text + "}\n";
    process_ = std::make_unique<Process>(
        std::vector<std::string>{find_program("nginx"), "-e", "stderr", "-p",
                                 folder_.path().string(), "-c", folder_.write("nginx.conf", main)},
        folder_.path("log"));
    eventually([&] { return answers() || process_->ended(); });
  }

  [[nodiscard]] bool answers() const {
    const int file = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in address = loopback();
    address.sin_port = htons(static_cast<std::uint16_t>(port_));
    const bool connected =
        connect(file, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
    close(file);
    return connected;
  }

  [[nodiscard]] std::string temporary_folders() const {
    std::string text;
    for (const char* const what : {"client_body", "proxy", "fastcgi", "uwsgi", "scgi"}) {
      text += std::string(what) + "_temp_path " + folder_.path(what).string() + ";\n";
    }
    return text;
  }

  static void replace(std::string& text, const std::string& from, const std::string& to) {
    const std::size_t place = text.find(from);
    if (place == std::string::npos) throw std::runtime_error("no " + from + " in:\n" + text);
    text.replace(place, from.size(), to);
  }
  static void replace_line(std::string& text, const std::string& begin, const std::string& to) {
    const std::size_t place = text.find(begin);
    if (place == std::string::npos) throw std::runtime_error("no " + begin + " in:\n" + text);
    const std::size_t start = text.rfind('\n', place) + 1;
    text.replace(start, text.find('\n', place) + 1 - start, to);
  }

  const ProxyKind kind_;
  const ScratchFolder folder_;
  int port_ = 0;
  std::unique_ptr<Process> process_;
};

}  // namespace meshsmooth::testing
