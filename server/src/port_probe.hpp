#pragma once

#include <chrono>
#include <string>

namespace meshsmooth::server {

/// Whether a server answers new connections: a listener that has stopped accepting still completes
/// TCP's handshake, so a first byte of the protocol must come back. Opens one connection. Blocks
/// for at most `timeout`, and while a host name is resolved.
///
/// @param listen   HOST:PORT or unix:PATH, as in the settings
/// @param port     the bound port, which replaces that of `listen`
/// @param tls      whether it speaks TLS
[[nodiscard]] bool port_answers(const std::string& listen, int port, bool tls,
                                std::chrono::milliseconds timeout);

}  // namespace meshsmooth::server
