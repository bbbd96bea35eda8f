#include "service.hpp"

#include <error.H>

#include <cstdlib>
#include <stdexcept>

namespace meshsmooth_foam {
namespace {

const char* of_environment(const char* name) {
  const char* value = std::getenv(name);
  return value != nullptr && *value != '\0' ? value : nullptr;
}

/// Its texts, which C's structure points to.
struct Credentials {
  explicit Credentials(const Foam::dictionary& entries) {
    given.size = sizeof given;
    given.tls = entries.lookupOrDefault<bool>("tls", false) ? 1 : 0;
    given.tls_ca = text(entries, "tlsCA", ca);
    given.tls_cert = text(entries, "tlsCert", cert);
    given.tls_key = text(entries, "tlsKey", key);
    given.tls_server_name = text(entries, "tlsServerName", name);
    given.token_file = text(entries, "tokenFile", token);
  }

  static const char* text(const Foam::dictionary& entries, const char* key, Foam::fileName& kept) {
    if (!entries.readIfPresent(key, kept)) return nullptr;
    kept.expand();
    return kept.c_str();
  }

  meshsmooth_credentials given{};
  Foam::fileName ca, cert, key, name, token;
};

/// What both jobs of a step have.
meshsmooth_options common_options(const Foam::dictionary& entries) {
  meshsmooth_options options{};
  meshsmooth_error* error = nullptr;
  meshsmooth_options_init(&options, sizeof options, &error);
  check(error, nullptr);
  options.boundary = MESHSMOOTH_BOUNDARY_POLICY_SLIDE;
  options.feature_angle =
      entries.lookupOrDefault<Foam::scalar>("featureAngle", options.feature_angle);
  options.timeout_seconds = entries.lookupOrDefault<Foam::scalar>("timeout", 0);
  return options;
}

}  // namespace

Service::Service(const Foam::dictionary& entries) {
  const NoTraps scope;
  const char* named = of_environment("MESHSMOOTH_SERVER");
  Foam::string address = entries.lookupOrDefault<Foam::string>("server", named ? named : "");
  if (address.empty()) {
    const char* binary = of_environment("MESHSMOOTH_SERVER_BINARY");
    try {
      own_ = std::make_unique<LocalServer>(binary ? binary : "meshsmooth-server");
    } catch (const std::runtime_error& failure) {
      FatalErrorInFunction << failure.what() << Foam::nl
                           << "Install meshsmooth-server, or name a server that runs by the entry "
                              "\"server\" of the motion solver, or by $MESHSMOOTH_SERVER"
                           << Foam::exit(Foam::FatalError);
    }
    address = own_->address();
  }
  least_share_ = entries.lookupOrDefault<Foam::scalar>("leastShare", 1);
  motion_ = sweeps_ = common_options(entries);
  motion_.method = MESHSMOOTH_METHOD_MOVE;
  motion_.quality = MESHSMOOTH_QUALITY_DETAIL_BRIEF;
  motion_.start = MESHSMOOTH_START_WARM;
  quick_motion_ = motion_;
  quick_motion_.tolerance = 2.5e-3;  // no sweep while elements keep half of their shapes
  quick_motion_.iterations = 7;      // later ones have global steps, which cost far more
  quick_motion_.least_step = 1;
  sweeps_.method = MESHSMOOTH_METHOD_OPTIMIZE;
  sweeps_.target = MESHSMOOTH_TARGET_REFERENCE;
  sweeps_.iterations = entries.lookupOrDefault<Foam::label>("sweeps", 5);
  sweeps_.tolerance = entries.lookupOrDefault<Foam::scalar>("tolerance", sweeps_.tolerance);
  const Credentials credentials(entries);
  meshsmooth_error* error = nullptr;
  meshsmooth_client_create(address.c_str(), own_ ? nullptr : &credentials.given, &client_, &error);
  check(error, nullptr);
}

Service::~Service() {
  const NoTraps scope;
  meshsmooth_client_free(client_);
}

void check(meshsmooth_error* error, const Part* part) {
  if (error == nullptr) return;
  const std::string reason = meshsmooth_error_reason(error);
  const std::string message = meshsmooth_error_message(error);
  const std::string hint = meshsmooth_error_hint(error);
  std::int64_t element = meshsmooth_error_element(error);
  const std::int64_t node = meshsmooth_error_node(error);
  meshsmooth_error_free(error);

  auto& stream = FatalErrorInFunction;
  stream << "meshsmooth: ";
  if (!reason.empty()) stream << reason.c_str() << ": ";
  stream << message.c_str();
  if (!hint.empty()) stream << Foam::nl << hint.c_str();
  if (part != nullptr && element >= 0) {
    for (const Elements& block : part->elements) {
      if (element < static_cast<std::int64_t>(block.origins.size())) {
        stream << Foam::nl << "Its element is of " << part->kind << " "
               << block.origins[static_cast<std::size_t>(element)];
        break;
      }
      element -= static_cast<std::int64_t>(block.origins.size());
    }
  }
  if (part != nullptr && node >= 0 && part->points[static_cast<std::size_t>(node)] >= 0) {
    stream << Foam::nl << "Its node is point " << part->points[static_cast<std::size_t>(node)];
  }
  stream << Foam::exit(Foam::FatalError);
}

}  // namespace meshsmooth_foam
