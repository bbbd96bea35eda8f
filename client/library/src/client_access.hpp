#pragma once

#include <grpcpp/channel.h>

#include <memory>
#include <string>

#include "meshsmooth/client.hpp"

namespace meshsmooth::client {

/// A `Client` over a channel made elsewhere, e.g. one into this very process.
struct ClientAccess {
  /// `name` stands for the server in messages.
  [[nodiscard]] static Client make(std::shared_ptr<grpc::Channel> channel,
                                   const std::string& name = "the embedded server");
};

}  // namespace meshsmooth::client
