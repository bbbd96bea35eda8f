#pragma once

#include <functional>
#include <string>
#include <string_view>

namespace meshsmooth::gateway {

/// The boundary of a body of `multipart/form-data` (RFC 7578) by its Content-Type; empty: it is no
/// such body.
[[nodiscard]] std::string form_boundary(std::string_view content_type);

/// Takes such a body apart as it comes: in pieces of any size, in memory that does not grow with
/// it.
class FormReader {
 public:
  struct Part {
    std::string name, file_name;
  };

  FormReader(const std::string& boundary, std::function<void(const Part&)> begin_part,
             std::function<void(std::string_view)> add);

  /// Throws `Problem` (UPLOAD_INVALID) and whatever the functions throw.
  void read(std::string_view bytes);
  /// Whether the last boundary has been read. What follows it has no meaning.
  [[nodiscard]] bool is_complete() const { return state_ == State::end; }

 private:
  enum class State { preamble, boundary, headers, content, end };

  [[nodiscard]] bool advance();
  [[nodiscard]] bool read_boundary();
  [[nodiscard]] bool read_headers();
  [[nodiscard]] bool read_content();

  const std::string delimiter_;  // with the line's end before it
  const std::function<void(const Part&)> begin_part_;
  const std::function<void(std::string_view)> add_;
  State state_ = State::preamble;
  std::string held_ = "\r\n";  // read, but not yet understood; a body may begin with a boundary
};

}  // namespace meshsmooth::gateway
