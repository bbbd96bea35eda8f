#include "meshsmooth/server.hpp"

#include <absl/synchronization/mutex.h>
#include <grpcpp/ext/proto_server_reflection_plugin.h>
#include <grpcpp/health_check_service_interface.h>
#include <grpcpp/server.h>
#include <grpcpp/server_builder.h>

#include <atomic>
#include <chrono>
#include <mutex>
#include <string>
#include <utility>

#include "admin_server.hpp"
#include "engine.hpp"
#include "event_threads.hpp"
#include "listener.hpp"
#include "log.hpp"
#include "meshsmooth/error.hpp"
#include "meshsmooth/v1/smoothing.grpc.pb.h"
#include "metrics_page.hpp"
#include "port_probe.hpp"
#include "rpc/call_limits.hpp"
#include "rpc/smoothing_service.hpp"
#include "rpc/transport_limits.hpp"
#include "rpc/transport_security.hpp"

namespace meshsmooth::server {
namespace {

// Additional time for calls that have nothing left to wait for.
constexpr auto kCallSlack = std::chrono::milliseconds(500);
// For gRPC once the calls have ended: connections whose clients do not listen use all of it.
constexpr auto kShutdownTime = std::chrono::milliseconds(300);
// Probes give up after a second.
constexpr auto kProbeTimeout = std::chrono::milliseconds(800);

}  // namespace

struct Server::Impl {
  Impl(ServerConfig the_config, SmootherFactory the_factory)
      : config(std::move(the_config)), factory(std::move(the_factory)) {}

  void set_serving(bool serving) {
    grpc::HealthCheckServiceInterface* health = server->GetHealthCheckService();
    health->SetServingStatus(serving);
    health->SetServingStatus(v1::SmoothingService::service_full_name(), serving);
  }

  // A process without a lane should be replaced.
  [[nodiscard]] HttpAnswer health() const {
    if (device_lost) return {503, "no lane left\n"};
    return {200, "ok\n"};
  }

  // Whether new calls are accepted.
  [[nodiscard]] HttpAnswer readiness() {
    if (device_lost) return {503, "no lane left\n"};
    if (draining) return {503, "draining\n"};
    if (running_engine == nullptr) return {503, "starting\n"};
    if (listener && listener->port() != 0 && port_watch.is_dead()) {
      return {503, "the port does not answer\n"};
    }
    return {200, "ok\n"};
  }

  void start_admin() {
    if (config.admin_listen.empty()) return;
    admin = std::make_unique<AdminServer>(
        config.admin_listen,
        AdminServer::Pages{{"/metrics",
                            [this] {
                              return HttpAnswer{200, metrics_page(running_engine)};
                            }},
                           {"/healthz", [this] { return health(); }},
                           {"/readyz", [this] { return readiness(); }}});
  }

  const ServerConfig config;
  const SmootherFactory factory;
  std::unique_ptr<Engine> engine;
  std::unique_ptr<Listener> listener;
  PortWatch port_watch{[this] {
    return port_answers(config.listen, listener->port(), !config.tls_cert.empty(), kProbeTimeout);
  }};
  std::unique_ptr<CallLimits> calls;
  std::unique_ptr<Authenticator> authenticator;
  std::unique_ptr<grpc::Service> service;
  std::unique_ptr<grpc::Server> server;
  std::unique_ptr<grpc::experimental::ExternalConnectionAcceptor> acceptor;

  std::atomic<bool> device_lost = false;
  std::atomic<bool> draining = false;
  std::atomic<const Engine*> running_engine = nullptr;  // set once it serves
  std::once_flag drained;
  std::atomic<bool> forced = false;

  std::unique_ptr<AdminServer> admin;  // uses all of the above
};

Server::Server(ServerConfig config, SmootherFactory factory)
    : impl_(std::make_unique<Impl>(std::move(config), std::move(factory))) {}

Server::~Server() {
  force_shutdown();
  drain();
}

void Server::start(std::function<void()> on_device_lost) {
  set_log(impl_->config.log_level, impl_->config.log_format);
  // Debian builds Abseil with its search for cycles of locks, which ends the process where
  // gRPC 1.83 takes two in either order.
  absl::SetMutexDeadlockDetectionMode(absl::OnDeadlockCycle::kIgnore);
  reserve_event_threads();
  // Both apply to servers that are built afterwards.
  grpc::EnableDefaultHealthCheckService(true);
  grpc::reflection::InitProtoReflectionServerBuilderPlugin();

  Impl& impl = *impl_;
  const auto credentials = make_server_credentials(impl.config);
  impl.start_admin();  // before the device is warmed up, which may take long
  auto engine = std::make_unique<Engine>(
      impl.config, impl.factory, [&impl, lost = std::move(on_device_lost)] {
        log_error("lane_broken", "no lane is left; restart the server");
        impl.device_lost = true;
        impl.set_serving(false);
        lost();
      });
  impl.calls = std::make_unique<CallLimits>(call_limits(impl.config),
                                            [&impl](const std::string& connection) {
                                              if (!impl.listener) return;
                                              log_cut(connection, "too many unfinished calls");
                                              impl.listener->cut(connection);
                                            });
  impl.authenticator = std::make_unique<Authenticator>(impl.config, engine->metrics(), *impl.calls);
  impl.service = make_smoothing_service(*engine, *impl.authenticator);
  grpc::ServerBuilder builder;
  configure_transport(builder, engine->config(), engine->transport_bytes());
  if (!impl.config.listen.empty()) {
    Listener::Limits limits = listener_limits(impl.config);
    limits.unanswered_budget_bytes = [&engine = *engine] {
      return static_cast<std::uint64_t>(engine.unanswered_budget_bytes());
    };
    impl.listener = std::make_unique<Listener>(impl.config.listen, limits);
    using Experimental = grpc::ServerBuilder::experimental_type;
    impl.acceptor = builder.experimental().AddExternalConnectionAcceptor(
        Experimental::ExternalConnectionType::FROM_FD, credentials);
  }
  builder.RegisterService(impl.service.get());
  impl.engine = std::move(engine);
  impl.server = builder.BuildAndStart();
  if (!impl.server) throw Error("INTERNAL", "gRPC does not start");
  if (impl.listener) {
    impl.listener->start([&impl](int descriptor, int listener) {
      grpc::experimental::ExternalConnectionAcceptor::NewConnectionParameters connection;
      connection.listener_fd = listener;
      connection.fd = descriptor;
      impl.acceptor->HandleNewConnection(&connection);
    });
  }
  impl.set_serving(true);
  impl.running_engine = impl.engine.get();
  log_start(impl.engine->config(), impl.engine->devices(), port(), admin_port(),
            impl.engine->passed_over());
  if (impl.listener) check_descriptors(impl.config);
}

bool Server::device_lost() const { return impl_->device_lost; }

int Server::port() const { return impl_->listener ? impl_->listener->port() : 0; }

int Server::admin_port() const { return impl_->admin ? impl_->admin->port() : 0; }

std::shared_ptr<grpc::Channel> Server::in_process_channel() {
  return impl_->server->InProcessChannel(grpc::ChannelArguments());
}

void Server::drain() {
  std::call_once(impl_->drained, [&impl = *impl_] {
    if (!impl.server) return;
    Engine& engine = *impl.engine;
    const ServerConfig& config = engine.config();
    log_event("drain");
    impl.draining = true;
    impl.set_serving(false);
    engine.wait(Clock::now() + config.lame_duck, impl.forced);
    engine.refuse_new();
    engine.reject_waiting();
    engine.wait_idle(Clock::now() + config.drain_grace, impl.forced);
    engine.stop_all();
    // Let the calls return their status: Shutdown breaks them off on an in-process channel.
    engine.wait_idle(Clock::now() + config.drop_timeout + kCallSlack, false);
    if (impl.listener) impl.listener->close();
    impl.server->Shutdown(std::chrono::system_clock::now() + kShutdownTime);
    impl.server->Wait();
    engine.close();
    log_event("end");
  });
}

void Server::force_shutdown() {
  impl_->forced = true;
  if (impl_->engine) impl_->engine->wake();
}

}  // namespace meshsmooth::server
