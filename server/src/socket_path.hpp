#pragma once

#include <string>

namespace meshsmooth::server {

/// Whether the path is that of a socket which no process has any more, as one that was killed
/// leaves behind. Connects to nobody.
[[nodiscard]] bool is_dead_socket(const std::string& path);

/// Gives an unbound Unix socket a path that its owner alone may open, in place of a dead socket,
/// and listens. `setting` is named in errors. Throws InvalidOption (OPTION_OUT_OF_RANGE), also
/// where another server listens there; of two that start at once, one gets the path.
void listen_on_path(int socket, const std::string& path, const std::string& setting);

}  // namespace meshsmooth::server
