#include "answers.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

namespace meshsmooth::gateway {

using nlohmann::json;

std::string to_text(const json& object) {
  return object.dump(-1, ' ', false, json::error_handler_t::replace);
}

void set_problem(httplib::Response& response, const Problem& problem) {
  response.status = problem.status();
  if (problem.retry_after() > 0) {
    response.set_header("Retry-After", std::to_string(problem.retry_after()));
  }
  if (problem.status() == 401) response.set_header("WWW-Authenticate", "Bearer");
  response.set_content(to_text(problem.to_json()) + "\n", "application/problem+json");
}

void set_file(httplib::Response& response, const std::filesystem::path& path, const char* type,
              std::shared_ptr<void> kept) {
  auto file = std::make_shared<OpenFile>(path);
  if (file->size() == 0) {  // which the library takes for a file of unknown size
    response.set_content("", type);
    return;
  }
  response.set_content_provider(
      file->size(), type,
      [file, kept = std::move(kept)](std::size_t offset, std::size_t length,
                                     httplib::DataSink& sink) {
        std::string bytes(std::min<std::size_t>(length, std::size_t{1} << 18), '\0');
        const std::size_t count = file->read(bytes.data(), bytes.size(), offset);
        return count > 0 && sink.write(bytes.data(), count);
      });
}

void set_mesh(httplib::Response& response, const RequestFolder& folder, const Outcome& outcome,
              std::shared_ptr<void> kept) {
  response.set_header("Content-Disposition",
                      "attachment; filename=\"" + outcome.download_name + "\"");
  set_file(response, folder / outcome.mesh, "application/octet-stream", std::move(kept));
}

void set_report(httplib::Response& response, const RequestFolder& folder, const Outcome& outcome,
                std::shared_ptr<void> kept) {
  response.set_header("Content-Security-Policy", "sandbox allow-scripts");
  set_file(response, folder / outcome.report, kHtml, std::move(kept));
}

}  // namespace meshsmooth::gateway
