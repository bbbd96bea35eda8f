#pragma once

#include <string_view>

/// The parts of the report's page, as they lie in this folder.
namespace meshsmooth::cli::page {

extern const std::string_view html;  // with {{names}} to replace
extern const std::string_view css;
extern const std::string_view camera;
extern const std::string_view viewer;
extern const std::string_view script;

}  // namespace meshsmooth::cli::page
