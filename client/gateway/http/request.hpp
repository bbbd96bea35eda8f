#pragma once

#include <boost/beast/http/fields.hpp>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "work_folder.hpp"

namespace meshsmooth::gateway {

using Parameters = std::multimap<std::string, std::string>;

/// The head of a request.
struct Request {
  std::string method, path;
  Parameters parameters;  // of the address, decoded
  boost::beast::http::fields headers;
  std::string peer;  // its address

  /// Empty: there is none.
  [[nodiscard]] std::string header(const char* name) const { return std::string(headers[name]); }
};

/// The parts of the target of a request, "/v1/smooth?goal=worst". Throws `Problem` (400) where it
/// is none.
void read_target(std::string_view target, Request& request);

/// What a request is answered with: a text, a file as it is read, or events as they come.
struct Answer {
  int status = 200;
  std::string type, body;
  std::vector<std::pair<std::string, std::string>> headers;
  std::shared_ptr<const OpenFile> file;
  /// The next piece of an answer of unknown length; true: more may follow.
  std::function<bool(std::string&)> next_piece;
  std::shared_ptr<void> kept;  // lives until it is sent
};

}  // namespace meshsmooth::gateway
