#pragma once

#include <grpcpp/channel.h>

#include <memory>
#include <string>

#include "meshsmooth/client.hpp"

namespace meshsmooth::client {

/// A channel that shows `credentials` with every call; does not connect yet. To what
/// dns:[//RESOLVER/]NAME:PORT, ipv4:A:PORT,B:PORT or ipv6:… names, all servers of it. Throws
/// InvalidOption (CREDENTIALS_UNUSABLE) naming the file that cannot be read, or
/// when a token would travel in clear.
[[nodiscard]] std::shared_ptr<grpc::Channel> open_channel(const std::string& target,
                                                          const Credentials& credentials);

}  // namespace meshsmooth::client
