#pragma once

#include <string_view>

namespace meshsmooth::wire {

/// Whether nobody but this machine can overhear what goes to or from HOST:PORT,
/// [HOST]:PORT or unix:PATH. False when in doubt: names are not looked up.
[[nodiscard]] bool is_local_address(std::string_view address);

}  // namespace meshsmooth::wire
