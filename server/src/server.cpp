#include "meshsmooth/server.hpp"

#include <grpcpp/ext/proto_server_reflection_plugin.h>
#include <grpcpp/health_check_service_interface.h>
#include <grpcpp/resource_quota.h>
#include <grpcpp/server.h>
#include <grpcpp/server_builder.h>
#include <sys/stat.h>

#include <atomic>
#include <chrono>
#include <mutex>
#include <utility>

#include "admin_server.hpp"
#include "engine.hpp"
#include "log.hpp"
#include "meshsmooth/error.hpp"
#include "meshsmooth/v1/smoothing.grpc.pb.h"
#include "metrics_page.hpp"
#include "port_probe.hpp"
#include "rpc/smoothing_service.hpp"
#include "rpc/transport_security.hpp"

namespace meshsmooth::server {
namespace {

constexpr int kMaxReflectionThreads = 16;
// Additional time for calls that have nothing left to wait for.
constexpr auto kCallSlack = std::chrono::seconds(1);
// Probes give up after a second.
constexpr auto kProbeTimeout = std::chrono::milliseconds(800);

int to_milliseconds(ServerConfig::Duration duration) {
  return static_cast<int>(std::chrono::duration_cast<std::chrono::milliseconds>(duration).count());
}

void configure(grpc::ServerBuilder& builder, const ServerConfig& config) {
  builder.SetMaxReceiveMessageSize(config.max_receive_message_bytes);
  builder.AddChannelArgument(GRPC_ARG_MAX_METADATA_SIZE, config.max_metadata_bytes);
  builder.AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS, config.max_concurrent_streams);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS, to_milliseconds(config.keepalive_time));
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIMEOUT_MS,
                             to_milliseconds(config.keepalive_timeout));
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MIN_RECV_PING_INTERVAL_WITHOUT_DATA_MS,
                             to_milliseconds(config.min_client_ping_interval));
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_PERMIT_WITHOUT_CALLS, 1);
  if (config.max_connection_age > ServerConfig::Duration::zero()) {
    builder.AddChannelArgument(GRPC_ARG_MAX_CONNECTION_AGE_MS,
                               to_milliseconds(config.max_connection_age));
  }
  // Two servers must not share a port by accident.
  builder.AddChannelArgument(GRPC_ARG_ALLOW_REUSEPORT, 0);
  if (config.stream_window_bytes > 0) {
    builder.AddChannelArgument(GRPC_ARG_HTTP2_BDP_PROBE, 0);
    builder.AddChannelArgument(GRPC_ARG_HTTP2_STREAM_LOOKAHEAD_BYTES, config.stream_window_bytes);
  }
  // Reflection holds a thread for each open stream; it waits for one when there are too many.
  grpc::ResourceQuota quota("meshsmooth");
  quota.SetMaxThreads(kMaxReflectionThreads);
  builder.SetResourceQuota(quota);
  builder.SetSyncServerOption(grpc::ServerBuilder::NUM_CQS, 1);
  builder.SetSyncServerOption(grpc::ServerBuilder::MIN_POLLERS, 1);
  builder.SetSyncServerOption(grpc::ServerBuilder::MAX_POLLERS, 2);
}

// What is created during its lifetime is the owner's only. The mask is that of the whole process.
class OwnerOnly {
 public:
  OwnerOnly() : old_(umask(S_IRWXG | S_IRWXO | S_IXUSR)) {}
  ~OwnerOnly() { umask(old_); }
  OwnerOnly(const OwnerOnly&) = delete;
  OwnerOnly& operator=(const OwnerOnly&) = delete;

 private:
  const mode_t old_;
};

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
  [[nodiscard]] HttpAnswer readiness() const {
    if (device_lost) return {503, "no lane left\n"};
    if (draining) return {503, "draining\n"};
    if (running_engine == nullptr) return {503, "starting\n"};
    if (port != 0 && !port_answers(config.listen, port, !config.tls_cert.empty(), kProbeTimeout)) {
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
  std::unique_ptr<Authenticator> authenticator;
  std::unique_ptr<grpc::Service> service;
  std::unique_ptr<grpc::Server> server;
  int port = 0;

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
  impl.authenticator = std::make_unique<Authenticator>(impl.config, engine->metrics());
  impl.service = make_smoothing_service(*engine, *impl.authenticator);
  grpc::ServerBuilder builder;
  configure(builder, engine->config());
  if (!impl.config.listen.empty()) {
    builder.AddListeningPort(impl.config.listen, credentials, &impl.port);
  }
  builder.RegisterService(impl.service.get());
  impl.engine = std::move(engine);
  {
    const OwnerOnly socket_mode;  // by the mask, since gRPC binds and listens in one step
    impl.server = builder.BuildAndStart();
  }
  if (!impl.server) {
    throw InvalidOption("OPTION_OUT_OF_RANGE",
                        "listen: cannot serve on " + impl.config.listen +
                            "; is the address right and the port free?",
                        {{"field", "listen"}});
  }
  impl.set_serving(true);
  impl.running_engine = impl.engine.get();
  log_start(impl.engine->config(), impl.engine->devices(), impl.port, admin_port(),
            impl.engine->passed_over());
}

bool Server::device_lost() const { return impl_->device_lost; }

int Server::port() const { return impl_->port; }

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
    impl.server->Shutdown(std::chrono::system_clock::now() + std::chrono::seconds(1));
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
