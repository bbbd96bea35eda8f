// The tests in a network namespace of their own, where the rights suffice, and the client that
// some of them need in a process of its own.
#include <grpc/grpc.h>
#include <gtest/gtest.h>

#include <cstring>
#include <iostream>
#include <string>

#include "meshsmooth/client.hpp"
#include "network/bad_network.hpp"
#include "network/large_mesh.hpp"

namespace {

using namespace meshsmooth::client;
using meshsmooth::testing::BadNetwork;
using meshsmooth::testing::mesh_of_bytes;

/// One job of so many bytes; 0 when it succeeds.
int run_client(const std::string& target, std::size_t bytes) {
  try {
    meshsmooth::Mesh mesh = mesh_of_bytes(bytes);
    meshsmooth::SmoothOptions options;
    options.method = meshsmooth::SmartLaplacian{};
    options.max_iterations = 1;
    RequestOptions request;
    request.max_attempts = 1;
    Client(target).smooth(mesh, options, request);
    return 0;
  } catch (const ServiceError& error) {
    std::cout << error.reason() << " " << error.what() << std::endl;
    return 1;
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc == 4 && std::strcmp(argv[1], "client") == 0) {
    return run_client(argv[2], std::stoul(argv[3]));
  }
  ::testing::InitGoogleTest(&argc, argv);
  BadNetwork::enter_private_network();
  grpc_init();  // for good: whenever its last user goes, gRPC may wait 10 s for a poller
  return RUN_ALL_TESTS();
}
