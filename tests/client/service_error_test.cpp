#include "service_error.hpp"

#include <gmock/gmock.h>

namespace meshsmooth::client {
namespace {

using ::testing::HasSubstr;

// Texts as they arrived through real proxies.
struct Foreign {
  const char* name;
  grpc::StatusCode code;
  const char* message;
  const char* hint;
};

class ServiceErrorHint : public ::testing::TestWithParam<Foreign> {};

TEST_P(ServiceErrorHint, SaysWhatAnErrorFromInBetweenMeans) {
  const grpc::Status status(GetParam().code, GetParam().message);

  const ServiceError error = to_service_error(status, {.server = "host:1"});

  EXPECT_EQ(error.reason(), "");
  EXPECT_THAT(error.hint(), HasSubstr(GetParam().hint));
  EXPECT_THAT(error.what(), HasSubstr(GetParam().message));
}

INSTANTIATE_TEST_SUITE_P(
    All, ServiceErrorHint,
    ::testing::Values(
        Foreign{"BodyLimit", grpc::StatusCode::INTERNAL, "Received RST_STREAM with error code 0",
                "client_max_body_size"},
        Foreign{"ProxyEndWithNewGrpc", grpc::StatusCode::INTERNAL,
                "Stream removed (RST_STREAM (Received RST_STREAM with error code 2))",
                "client_max_body_size"},
        Foreign{"ProxyPause", grpc::StatusCode::INTERNAL, "Received RST_STREAM with error code 1",
                "grpc_read_timeout"},
        Foreign{"ProxyEnd", grpc::StatusCode::INTERNAL, "Received RST_STREAM with error code 2",
                "client_max_body_size"},
        Foreign{"HaProxyTimeout", grpc::StatusCode::UNKNOWN, "Stream removed", "timeout server"},
        Foreign{"Http1", grpc::StatusCode::UNAVAILABLE,
                "failed to connect to all addresses; last error: INTERNAL: ipv4:127.0.0.1:5: "
                "Trying to connect an http1.x server",
                "HTTP/2"},
        Foreign{"NoServerReady", grpc::StatusCode::UNAVAILABLE,
                "no server behind this proxy is ready", "a proxy answers at host:1"},
        Foreign{"HaProxy", grpc::StatusCode::CANCELLED, "Received RST_STREAM with error code 8",
                "HAProxy"},
        Foreign{"NoBackend", grpc::StatusCode::UNAVAILABLE,
                "Received http2 header with status: 502", "a proxy answers at host:1"},
        Foreign{"NoBackendWhileSending", grpc::StatusCode::UNAVAILABLE,
                "Received RST_STREAM with error code 7", "a proxy answers at host:1"},
        Foreign{"NoServer", grpc::StatusCode::UNAVAILABLE,
                "failed to connect to all addresses; last error: refused", "--listen host:1"},
        Foreign{"UnknownName", grpc::StatusCode::UNAVAILABLE,
                "DNS resolution failed for x:1: Domain name not found", "the name is not known"},
        Foreign{"OtherAuthority", grpc::StatusCode::UNAVAILABLE,
                "failed to connect to all addresses; SSL: CERTIFICATE_VERIFY_FAILED",
                "set Credentials::tls_ca"},
        Foreign{"Died", grpc::StatusCode::UNAVAILABLE, "Socket closed", "send it again"},
        Foreign{"NoService", grpc::StatusCode::UNIMPLEMENTED, "unknown method",
                "not a meshsmooth server"}),
    [](const auto& test) { return std::string(test.param.name); });

TEST(ServiceError, HasNoHintWhenTheCallerCancelled) {
  const grpc::Status status(grpc::StatusCode::CANCELLED, "Received RST_STREAM with error code 8");

  const ServiceError error =
      to_service_error(status, {.server = "host:1", .cancelled_by_caller = true});

  EXPECT_STREQ(error.what(), "cancelled");
  EXPECT_EQ(error.hint(), "");
}

TEST(ServiceError, TellsADeadlineThatNobodyAnsweredFromASlowJob) {
  const grpc::Status status(grpc::StatusCode::DEADLINE_EXCEEDED, "Deadline Exceeded");

  EXPECT_THAT(to_service_error(status, {.server = "host:1"}).hint(), HasSubstr("more time"));
  EXPECT_THAT(to_service_error(status, {.server = "host:1", .answered = false}).hint(),
              HasSubstr("grpc_pass"));
}

TEST(ServiceError, TakesDetailsThatAreNoStatusForNone) {
  const grpc::Status status(grpc::StatusCode::INTERNAL, "broken", "\xff\xff garbage");

  const ServiceError error = to_service_error(status, {.server = "host:1"});

  EXPECT_EQ(error.reason(), "");
  EXPECT_STREQ(error.what(), "host:1: broken");
}

// What ended by itself in between may do better elsewhere; what a caller ended does not.
TEST(ServiceError, SaysWhichCallsThatBrokeOffAreWorthAnother) {
  const auto is_retried = [](grpc::StatusCode code, const std::string& message,
                             bool cancelled_by_caller = false) {
    return to_service_error({code, message},
                            {.server = "host:1", .cancelled_by_caller = cancelled_by_caller})
        .retry_delay()
        .has_value();
  };
  EXPECT_TRUE(is_retried(grpc::StatusCode::UNAVAILABLE, "Socket closed"));
  EXPECT_TRUE(is_retried(grpc::StatusCode::UNKNOWN, "Stream removed"));
  EXPECT_TRUE(is_retried(grpc::StatusCode::CANCELLED, "Received RST_STREAM with error code 8"));
  EXPECT_TRUE(is_retried(grpc::StatusCode::CANCELLED, "CANCELLED"));
  EXPECT_FALSE(
      is_retried(grpc::StatusCode::CANCELLED, "Received RST_STREAM with error code 8", true));
  EXPECT_FALSE(is_retried(grpc::StatusCode::UNAVAILABLE, "failed to connect to all addresses"));
  EXPECT_FALSE(is_retried(grpc::StatusCode::UNKNOWN, "an exception"));
  EXPECT_FALSE(is_retried(grpc::StatusCode::INTERNAL, "Received RST_STREAM with error code 0"));
}

}  // namespace
}  // namespace meshsmooth::client
