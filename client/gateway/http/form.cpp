#include "http/form.hpp"

#include <algorithm>
#include <boost/beast/core/string.hpp>
#include <boost/beast/http/rfc7230.hpp>
#include <optional>
#include <utility>

#include "problem.hpp"

namespace meshsmooth::gateway {
namespace {

using boost::beast::iequals;

constexpr std::size_t kMostBoundaryBytes = 70;  // RFC 2046
constexpr std::size_t kMostHeaderBytes = 16384;

/// The value of `; name=value` in a header; unset: there is none.
std::optional<std::string> parameter_of(std::string_view header, std::string_view name) {
  const std::size_t begin = header.find(';');
  if (begin == std::string_view::npos) return std::nullopt;
  const std::string_view list = header.substr(begin);
  for (const auto& [key, value] : boost::beast::http::param_list({list.data(), list.size()})) {
    if (!iequals(key, {name.data(), name.size()})) continue;
    std::string text(value);
    // With its quotes where nothing in them was escaped.
    if (text.size() >= 2 && text.front() == '"') text = text.substr(1, text.size() - 2);
    return text;
  }
  return std::nullopt;
}

bool starts_with(std::string_view text, std::string_view begin) {
  return text.size() >= begin.size() &&
         iequals({text.data(), begin.size()}, {begin.data(), begin.size()});
}

[[noreturn]] void fail(const std::string& why) {
  throw Problem("UPLOAD_INVALID", "the form is broken: " + why);
}

/// By the headers of a part.
FormReader::Part part_of(std::string_view headers) {
  constexpr std::string_view kDisposition = "content-disposition:";
  while (!headers.empty()) {
    const std::size_t end = headers.find("\r\n");
    const std::string_view line = headers.substr(0, end);
    if (starts_with(line, kDisposition)) {
      const std::optional<std::string> name = parameter_of(line, "name");
      if (!name) break;
      return {*name, parameter_of(line, "filename").value_or("")};
    }
    headers = end == std::string_view::npos ? "" : headers.substr(end + 2);
  }
  fail("a part has no name");
}

}  // namespace

std::string form_boundary(std::string_view content_type) {
  if (!starts_with(content_type, "multipart/form-data")) return {};
  const std::string boundary = parameter_of(content_type, "boundary").value_or("");
  return boundary.size() <= kMostBoundaryBytes ? boundary : std::string();
}

FormReader::FormReader(const std::string& boundary, std::function<void(const Part&)> begin_part,
                       std::function<void(std::string_view)> add)
    : delimiter_("\r\n--" + boundary), begin_part_(std::move(begin_part)), add_(std::move(add)) {}

void FormReader::read(std::string_view bytes) {
  if (is_complete()) return;
  held_ += bytes;
  while (advance()) {
  }
}

bool FormReader::advance() {
  switch (state_) {
    case State::preamble:
    case State::content:
      return read_content();
    case State::boundary:
      return read_boundary();
    case State::headers:
      return read_headers();
    case State::end:
      break;
  }
  return false;
}

bool FormReader::read_content() {
  const std::size_t at = held_.find(delimiter_);
  const bool found = at != std::string::npos;
  // The last bytes may be the beginning of a boundary.
  const std::size_t sure =
      found ? at : held_.size() - std::min(held_.size(), delimiter_.size() - 1);
  if (state_ == State::content && sure > 0) add_(std::string_view(held_).substr(0, sure));
  held_.erase(0, found ? at + delimiter_.size() : sure);
  if (found) state_ = State::boundary;
  return found;
}

bool FormReader::read_boundary() {
  const std::size_t begin = held_.find_first_not_of(" \t");
  if (begin == std::string::npos || held_.size() < begin + 2) {
    if (held_.size() > kMostHeaderBytes) fail("a boundary is followed by too many blanks");
    return false;
  }
  const std::string_view next = std::string_view(held_).substr(begin, 2);
  if (next == "--") {
    state_ = State::end;
  } else if (next == "\r\n") {
    state_ = State::headers;
    held_.erase(0, begin);  // so that a part without headers has their end, too
  } else {
    fail("a boundary is followed by something else");
  }
  return state_ != State::end;
}

bool FormReader::read_headers() {
  const std::size_t end = held_.find("\r\n\r\n");
  if (end == std::string::npos || end > kMostHeaderBytes) {
    if (held_.size() > kMostHeaderBytes) fail("the headers of a part have more than 16 KiB");
    return false;
  }
  begin_part_(part_of(std::string_view(held_).substr(2, end < 2 ? 0 : end - 2)));
  held_.erase(0, end + 4);
  state_ = State::content;
  return true;
}

}  // namespace meshsmooth::gateway
