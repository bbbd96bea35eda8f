#pragma once

#include <httplib.h>

#include <exception>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "problem.hpp"
#include "service.hpp"

namespace meshsmooth::gateway {

inline constexpr const char* kJson = "application/json";
inline constexpr const char* kHtml = "text/html; charset=utf-8";

/// In one line; bytes that are no UTF-8 are replaced.
[[nodiscard]] std::string to_text(const nlohmann::json& object);

void set_problem(httplib::Response& response, const Problem& problem);

/// What `function` throws becomes the answer.
template <class Function>
void answer(httplib::Response& response, const Function& function) {
  try {
    function();
  } catch (const Problem& problem) {
    set_problem(response, problem);
  } catch (const std::exception& failure) {
    set_problem(response, Problem("INTERNAL", failure.what()));
  }
}

/// A handler that calls a function so.
template <class Function>
auto answering(Function function) {
  return [function](const httplib::Request& request, httplib::Response& response) {
    answer(response, [&] { function(request, response); });
  };
}

/// Sends a file as it is read. `kept` lives as long.
void set_file(httplib::Response& response, const std::filesystem::path& path, const char* type,
              std::shared_ptr<void> kept);
void set_mesh(httplib::Response& response, const RequestFolder& folder, const Outcome& outcome,
              std::shared_ptr<void> kept);
/// A page made of strangers' files: its script may draw, and reach nothing of this origin.
void set_report(httplib::Response& response, const RequestFolder& folder, const Outcome& outcome,
                std::shared_ptr<void> kept);

}  // namespace meshsmooth::gateway
