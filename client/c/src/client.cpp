#include "meshsmooth/client.hpp"

#include "call.hpp"
#include "error.hpp"
#include "handles.hpp"
#include "mesh.hpp"
#include "options.hpp"
#include "structures.hpp"

using namespace meshsmooth::c;
using meshsmooth::client::Client;
using meshsmooth::client::Credentials;

namespace {

std::string text_or_empty(const char* text) { return text != nullptr ? text : ""; }

Credentials read_credentials(const meshsmooth_credentials* given) {
  if (given == nullptr) return {};
  const meshsmooth_credentials in = read_structure(given, "credentials");
  return {.tls = in.tls != 0,
          .tls_ca = text_or_empty(in.tls_ca),
          .tls_cert = text_or_empty(in.tls_cert),
          .tls_key = text_or_empty(in.tls_key),
          .tls_server_name = text_or_empty(in.tls_server_name),
          .token_file = text_or_empty(in.token_file)};
}

}  // namespace

const char* meshsmooth_version(void) { return MESHSMOOTH_VERSION; }

int meshsmooth_client_create(const char* target, const meshsmooth_credentials* credentials,
                             meshsmooth_client** client, meshsmooth_error** error) {
  return guarded(error, [&] {
    need(client, "client");
    *client = nullptr;
    need(target, "target");
    *client =
        new meshsmooth_client{std::make_shared<Client>(target, read_credentials(credentials))};
  });
}

void meshsmooth_client_free(meshsmooth_client* client) { delete client; }

int meshsmooth_cancel_create(meshsmooth_cancel** cancel, meshsmooth_error** error) {
  return guarded(error, [&] {
    need(cancel, "cancel");
    *cancel = nullptr;
    *cancel = new meshsmooth_cancel;
  });
}

void meshsmooth_cancel_request(meshsmooth_cancel* cancel) {
  if (cancel != nullptr) cancel->source.request_stop();
}

void meshsmooth_cancel_free(meshsmooth_cancel* cancel) { delete cancel; }

int meshsmooth_smooth(meshsmooth_client* client, const meshsmooth_mesh* mesh,
                      const meshsmooth_options* options, const meshsmooth_call* call, void* result,
                      meshsmooth_report** report, meshsmooth_error** error) {
  return guarded(error, [&] {
    if (report != nullptr) *report = nullptr;
    need(client, "client");
    need(result, "result");
    auto [read, input] = read_mesh(mesh);
    Job job = read_options(options, meshsmooth::Optimize{});
    const Accompaniment accompaniment(call, job.request);
    meshsmooth::client::SmoothReport done =
        client->client->smooth(read, job.smooth, job.request, input);
    hand_over(std::move(done), read.positions_view(), result, report);
  });
}
