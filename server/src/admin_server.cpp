#include "admin_server.hpp"

#include <civetweb.h>
#include <fmt/format.h>

#include <array>
#include <exception>
#include <string_view>
#include <utility>

#include "meshsmooth/error.hpp"

namespace meshsmooth::server {
namespace {

const char* phrase(int status) {
  switch (status) {
    case 200:
      return "OK";
    case 404:
      return "Not Found";
    case 405:
      return "Method Not Allowed";
    default:
      return "Service Unavailable";
  }
}

}  // namespace

AdminServer::AdminServer(const std::string& address, Pages pages) : pages_(std::move(pages)) {
  mg_init_library(0);
  // Without keep-alive, with a short timeout and many threads, slow clients delay no probe for
  // long: 200 of them take 4 s, and probes are patient for 5.
  std::array options = {"listening_ports",
                        address.c_str(),
                        "num_threads",
                        "48",
                        "request_timeout_ms",
                        "1000",
                        "enable_keep_alive",
                        "no",
                        "max_request_size",
                        "8192",
                        static_cast<const char*>(nullptr)};
  const mg_callbacks callbacks{};
  context_ = mg_start(&callbacks, nullptr, options.data());
  if (context_ == nullptr) {
    mg_exit_library();
    throw InvalidOption(
        "OPTION_OUT_OF_RANGE",
        "admin-listen: cannot serve on " + address + "; is the address right and the port free?",
        {{"field", "admin-listen"}});
  }
  mg_set_request_handler(context_, "/", &AdminServer::handle, this);
}

AdminServer::~AdminServer() {
  mg_stop(context_);
  mg_exit_library();
}

int AdminServer::port() const {
  mg_server_port port{};
  return mg_get_server_ports(context_, 1, &port) == 1 ? port.port : 0;
}

int AdminServer::handle(mg_connection* connection, void* self) {
  const mg_request_info& request = *mg_get_request_info(connection);
  const std::string_view method = request.request_method;
  const HttpAnswer answer =
      static_cast<AdminServer*>(self)->answer(request.request_method, request.local_uri);
  const std::string head = fmt::format(
      "HTTP/1.1 {} {}\r\nContent-Type: text/plain; version=0.0.4; charset=utf-8\r\n"
      "Content-Length: {}\r\nCache-Control: no-store\r\nConnection: close\r\n\r\n",
      answer.status, phrase(answer.status), answer.text.size());
  mg_write(connection, head.data(), head.size());
  if (method != "HEAD") mg_write(connection, answer.text.data(), answer.text.size());
  return answer.status;
}

HttpAnswer AdminServer::answer(const std::string& method, const std::string& path) const {
  const auto page = pages_.find(path);
  if (page == pages_.end()) return {404, "not found\n"};
  if (method != "GET" && method != "HEAD") return {405, "only GET and HEAD\n"};
  try {
    return page->second();
  } catch (const std::exception& error) {  // the callers are C
    return {503, std::string(error.what()) + '\n'};
  }
}

}  // namespace meshsmooth::server
