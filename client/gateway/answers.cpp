#include "answers.hpp"

#include <nlohmann/json.hpp>
#include <utility>

namespace meshsmooth::gateway {

using nlohmann::json;

std::string to_text(const json& object) {
  return object.dump(-1, ' ', false, json::error_handler_t::replace);
}

Answer problem_answer(const Problem& problem) {
  Answer answer = json_answer(problem.to_json());
  answer.type = "application/problem+json";
  answer.status = problem.status();
  if (problem.retry_after() > 0) {
    answer.headers.emplace_back("Retry-After", std::to_string(problem.retry_after()));
  }
  if (problem.status() == 401) answer.headers.emplace_back("WWW-Authenticate", "Bearer");
  return answer;
}

Answer text_answer(std::string_view text, const char* type) {
  Answer answer;
  answer.type = type;
  answer.body = text;
  return answer;
}

Answer json_answer(const json& object) { return text_answer(to_text(object) + "\n", kJson); }

Answer file_answer(const std::filesystem::path& path, const char* type,
                   std::shared_ptr<void> kept) {
  Answer answer;
  answer.type = type;
  answer.file = std::make_shared<const OpenFile>(path);
  answer.kept = std::move(kept);
  return answer;
}

Answer mesh_answer(const RequestFolder& folder, const Outcome& outcome,
                   std::shared_ptr<void> kept) {
  Answer answer = file_answer(folder / outcome.mesh, "application/octet-stream", std::move(kept));
  answer.headers.emplace_back("Content-Disposition",
                              "attachment; filename=\"" + outcome.download_name + "\"");
  return answer;
}

Answer report_answer(const RequestFolder& folder, const Outcome& outcome,
                     std::shared_ptr<void> kept) {
  Answer answer = file_answer(folder / outcome.report, kHtml, std::move(kept));
  answer.headers.emplace_back("Content-Security-Policy", "sandbox allow-scripts");
  return answer;
}

}  // namespace meshsmooth::gateway
