#pragma once

#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

#include "http/request.hpp"
#include "problem.hpp"
#include "service.hpp"

namespace meshsmooth::gateway {

inline constexpr const char* kJson = "application/json";
inline constexpr const char* kHtml = "text/html; charset=utf-8";

/// In one line; bytes that are no UTF-8 are replaced.
[[nodiscard]] std::string to_text(const nlohmann::json& object);

[[nodiscard]] Answer problem_answer(const Problem& problem);
[[nodiscard]] Answer text_answer(std::string_view text, const char* type);
[[nodiscard]] Answer json_answer(const nlohmann::json& object);

/// A file as it is read. `kept` lives as long.
[[nodiscard]] Answer file_answer(const std::filesystem::path& path, const char* type,
                                 std::shared_ptr<void> kept = nullptr);
[[nodiscard]] Answer mesh_answer(const RequestFolder& folder, const Outcome& outcome,
                                 std::shared_ptr<void> kept = nullptr);
/// A page made of strangers' files: its script may draw, and reach nothing of this origin.
[[nodiscard]] Answer report_answer(const RequestFolder& folder, const Outcome& outcome,
                                   std::shared_ptr<void> kept = nullptr);

}  // namespace meshsmooth::gateway
