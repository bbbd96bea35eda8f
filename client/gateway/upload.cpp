#include "upload.hpp"

#include <algorithm>
#include <optional>
#include <string_view>
#include <utility>

#include "http/form.hpp"
#include "problem.hpp"

namespace meshsmooth::gateway {
namespace {

constexpr std::size_t kPieceBytes = std::size_t{1} << 18;

/// Puts the parts of a form into files.
class FormFiles {
 public:
  FormFiles(const RequestFolder& folder, Order& order) : folder_(folder), order_(order) {}

  void begin(const FormReader::Part& part) {
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
    const std::string name = part.name + safe_extension(part.file_name);
    file_.emplace(folder_ / name);
    order_.files[part.name] = name;
    if (part.name == "mesh") order_.mesh_name = part.file_name;
  }

  void add(std::string_view bytes) const {
    if (file_) file_->write(bytes);
  }

 private:
  const RequestFolder& folder_;
  Order& order_;
  std::optional<NewFile> file_;
};

Problem too_large(const std::string& length, const Settings& settings) {
  const std::string limit = std::to_string(settings.max_upload_bytes);
  return {"UPLOAD_TOO_LARGE",
          "the form has " + length + " bytes, of " + limit + " that the gateway takes",
          {{"limit_bytes", limit}}};
}

}  // namespace

void check_length(const Connection& connection, const Settings& settings) {
  const auto length = connection.body_length();
  if (length && *length > settings.max_upload_bytes)
    throw too_large(std::to_string(*length), settings);
}

void read_form(Connection& connection, const Request& request, const Service& service,
               const RequestFolder& folder, Order& order) {
  const std::string boundary = form_boundary(request.header("Content-Type"));
  if (boundary.empty()) {
    throw Problem("UPLOAD_INVALID",
                  "the request has no form: send the file as multipart/form-data, as "
                  "curl -F mesh=@part.inp does");
  }
  FormFiles files(folder, order);
  FormReader form(
      boundary, [&](const FormReader::Part& part) { files.begin(part); },
      [&](std::string_view bytes) { files.add(bytes); });
  const Settings& settings = service.settings();
  const auto deadline = Clock::now() + settings.upload_timeout;
  std::uint64_t received = 0;
  std::string bytes(kPieceBytes, '\0');
  while (const std::size_t count = connection.read_body(bytes, deadline)) {
    received += count;
    if (received > settings.max_upload_bytes) throw too_large("more", settings);
    if (service.stopped().requested()) throw Problem("DRAINING", "the gateway is shutting down");
    form.read(std::string_view(bytes).substr(0, count));
  }
  if (!form.is_complete()) throw Problem("UPLOAD_INVALID", "the form is broken, or ends too early");
  if (!order.files.contains("mesh")) {
    throw Problem("UPLOAD_INVALID", "the form has no part \"mesh\", the file of the mesh",
                  {{"field", "mesh"}});
  }
}

std::string bearer_token(const Request& request) {
  const std::string value = request.header("Authorization");
  if (value.empty()) return {};
  constexpr std::string_view kBearer = "Bearer ";
  const std::string token = value.starts_with(kBearer) ? value.substr(kBearer.size()) : "";
  const auto is_visible = [](unsigned char c) { return c > 0x20 && c < 0x7f; };
  if (!token.empty() && std::ranges::all_of(token, is_visible)) return token;
  throw Problem("TOKEN_UNKNOWN", "the header Authorization is not Bearer TOKEN");
}

}  // namespace meshsmooth::gateway
