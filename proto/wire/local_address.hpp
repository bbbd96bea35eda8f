#pragma once

#include <sys/un.h>

#include <optional>
#include <string>
#include <string_view>

namespace meshsmooth::wire {

/// Whether nobody but this machine can overhear what goes to or from HOST:PORT,
/// [HOST]:PORT or unix:PATH. False when in doubt: names are not looked up.
[[nodiscard]] bool is_local_address(std::string_view address);

/// The address of a Unix socket; nothing for a path that is too long for one.
[[nodiscard]] std::optional<sockaddr_un> socket_address(const std::string& path);

}  // namespace meshsmooth::wire
