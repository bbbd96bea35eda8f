#pragma once

#include <filesystem>
#include <functional>

#include "json_line.hpp"

namespace meshsmooth::corpus {

/// Takes one mesh file through read, quality, smooth (with the defaults of the command line), write
/// in the same format and compare. `report` gets one object a step: {"step": "read", …}; the last
/// one has "reason" and "error" where a step fails. Writes into `folder`, which it makes and
/// removes.
void run_file(const std::filesystem::path& file, const std::filesystem::path& folder,
              const std::function<void(const JsonLine&)>& report);

}  // namespace meshsmooth::corpus
