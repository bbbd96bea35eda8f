// Watches a long job on a server at HOST:PORT and cancels it; then runs the same job with a budget
// of compute time and takes the positions reached.
#include <chrono>
#include <iostream>
#include <meshsmooth/client.hpp>
#include <stop_token>

#include "grid.hpp"

using namespace std::chrono_literals;
namespace client = meshsmooth::client;

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: progress_and_cancel HOST:PORT\n";
    return 2;
  }
  meshsmooth::Mesh mesh = make_grid(30);
  const meshsmooth::Mesh original = mesh;

  // Plain averaging with a free boundary shrinks the block for thousands of sweeps.
  meshsmooth::SmoothOptions options;
  options.method = meshsmooth::Laplacian{};
  options.boundary = meshsmooth::BoundaryPolicy::free;
  options.guard = false;
  options.max_iterations = 1'000'000;
  options.tolerance = {.value = 0, .relative = false};

  client::Client server(argv[1]);
  std::stop_source stop;
  client::RequestOptions request;
  request.progress_interval = 10ms;
  request.stop = stop.get_token();
  request.on_progress = [&](const client::JobProgress& progress) {  // on this thread
    std::cout << client::job_state_name(progress.state) << ' ' << progress.stage << ' '
              << progress.iteration << '\n';
    if (progress.iteration >= 10) stop.request_stop();
  };

  try {
    server.smooth(mesh, options, request);
    std::cout << "not reached: the job was cancelled\n";
    return 1;
  } catch (const client::ServiceError& error) {
    if (error.code() != client::StatusCode::cancelled) throw;
    // A call that fails leaves the mesh as it was.
    std::cout << "cancelled, mesh unchanged: " << (mesh.positions == original.positions) << '\n';
  }

  options.compute_budget = 50ms;
  const auto report = server.smooth(mesh, options);
  std::cout << "budget used up: "
            << (report.summary.stop_reason == meshsmooth::StopReason::compute_budget)
            << ", moved nodes: " << report.summary.nodes.moved << '\n';
}
