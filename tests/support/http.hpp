#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdint>
#include <map>
#include <sstream>
#include <string>

namespace meshsmooth::testing {

struct HttpResponse {
  int status = 0;  // 0: nobody answered
  std::string text;
};

/// GET from the loopback device.
inline HttpResponse http_get(int port, const std::string& path, const std::string& method = "GET") {
  const int file = ::socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  HttpResponse response;
  if (::connect(file, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) {
    const std::string request = method + " " + path + " HTTP/1.1\r\nHost: test\r\n\r\n";
    ::send(file, request.data(), request.size(), MSG_NOSIGNAL);
    std::string all;
    char buffer[4096];
    for (ssize_t n; (n = ::recv(file, buffer, sizeof buffer, 0)) > 0;) {
      all.append(buffer, static_cast<std::size_t>(n));
    }
    std::string version;
    std::istringstream(all) >> version >> response.status;
    const std::size_t body = all.find("\r\n\r\n");
    if (body != std::string::npos) response.text = all.substr(body + 4);
  }
  ::close(file);
  return response;
}

/// The values of Prometheus' text format by name and labels, as they stand there.
inline std::map<std::string, double> parse_metrics(const std::string& text) {
  std::map<std::string, double> values;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (line.empty() || line.front() == '#') continue;
    const std::size_t space = line.rfind(' ');
    values[line.substr(0, space)] = std::stod(line.substr(space + 1));
  }
  return values;
}

}  // namespace meshsmooth::testing
