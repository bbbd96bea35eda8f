// R20: who comes in over TLS, and what those hear who do not.
#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <grpcpp/version_info.h>
#include <gtest/gtest.h>
#include <openssl/ssl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <thread>

#include "meshsmooth/client.hpp"
#include "support/certificates.hpp"
#include "support/in_process_server.hpp"
#include "support/scratch_folder.hpp"

namespace meshsmooth::testing {
namespace {

using client::Client;
using client::Credentials;
using client::ServiceError;
using ::testing::AllOf;
using ::testing::HasSubstr;

Mesh one_tetrahedron() {
  Mesh mesh;
  mesh.positions = std::vector<Vec3d>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  mesh.blocks = {{ElementType::tetrahedron, {0, 1, 2, 3}}};
  return mesh;
}

/// A server with a certificate, its authority, and a folder with the files.
class Tls : public ::testing::Test {
 protected:
  Tls() {
    config_.listen = "127.0.0.1:0";
    config_.credentials_reload_interval = std::chrono::seconds(1);
    config_.tls_cert = files_.path("server.pem");
    config_.tls_key = files_.path("server.key");
    give_server(authority_.issue("server", "DNS:localhost,IP:127.0.0.1"));
    files_.write("ca.pem", authority_.certificate());
  }

  void give_server(const KeyPair& pair) {
    files_.write("server.pem", pair.certificate);
    files_.write("server.key", pair.key);
  }
  void ask_for_certificates(const CertificateAuthority& authority) {
    config_.tls_client_ca = files_.write("clients.pem", authority.certificate());
  }
  void start() { server_ = std::make_unique<InProcessServer>(config_); }

  Credentials credentials(const KeyPair& pair = {}) {
    Credentials credentials{.tls_ca = files_.path("ca.pem")};
    if (pair.certificate.empty()) return credentials;
    credentials.tls_cert = files_.write("client.pem", pair.certificate);
    credentials.tls_key = files_.write("client.key", pair.key);
    return credentials;
  }
  [[nodiscard]] std::string address() const {
    return "127.0.0.1:" + std::to_string(server_->server().port());
  }
  Client connect(const Credentials& credentials) { return Client(address(), credentials); }

  void expect_welcome(const Credentials& credentials) {
    Client client = connect(credentials);
    Mesh mesh = one_tetrahedron();
    EXPECT_NO_THROW(client.smooth(mesh, {.method = Laplacian{}}));
  }
  /// What the client is told.
  std::string expect_closed(const Credentials& credentials) {
    const int started = server_->fake().started();
    Client client = connect(credentials);
    Mesh mesh = one_tetrahedron();
    client::RequestOptions request;
    request.timeout = std::chrono::seconds(60);  // it is told long before
    request.max_attempts = 1;
    std::string told;
    try {
      client.smooth(mesh, {.method = Laplacian{}}, request);
      ADD_FAILURE() << "it came in";
    } catch (const ServiceError& error) {
      EXPECT_EQ(error.code(), client::StatusCode::unavailable) << error.what();
      told = std::string(error.what()) + "; " + error.hint();
    }
    EXPECT_EQ(server_->fake().started(), started);
    return told;
  }

  const ScratchFolder files_;
  const CertificateAuthority authority_{"server authority"};
  const CertificateAuthority client_authority_{"client authority"};
  server::ServerConfig config_ = quiet_config();
  std::unique_ptr<InProcessServer> server_;
};

TEST_F(Tls, WelcomesWhoTrustsTheServer) {
  start();
  expect_welcome(credentials());
}

TEST_F(Tls, HintsAtAnAuthorityThatTheClientDoesNotTrust) {
  start();
  files_.write("ca.pem", CertificateAuthority("another").certificate());
  EXPECT_THAT(expect_closed(credentials()), HasSubstr("Credentials::tls_ca"));
}

TEST_F(Tls, HintsAtAServerCertificateOfAnotherName) {
  give_server(authority_.issue("server", "DNS:elsewhere.example"));
  start();
  EXPECT_THAT(expect_closed(credentials()), HasSubstr("Credentials::tls_server_name"));

  Credentials named = credentials();
  named.tls_server_name = "elsewhere.example";
  expect_welcome(named);
}

TEST_F(Tls, HintsAtTlsToAClientWithout) {
  start();
  EXPECT_THAT(expect_closed({}), HasSubstr("Credentials::tls"));
}

TEST_F(Tls, HintsAtAServerWithoutTls) {
  config_.tls_cert = config_.tls_key = "";
  start();
  EXPECT_THAT(expect_closed(credentials()), HasSubstr("without TLS"));
}

TEST_F(Tls, WelcomesAClientWithTheRightCertificate) {
  ask_for_certificates(client_authority_);
  start();
  expect_welcome(credentials(client_authority_.issue("alice", "")));
}

TEST_F(Tls, IsClosedToAClientWithoutCertificate) {
  ask_for_certificates(client_authority_);
  start();
  EXPECT_THAT(expect_closed(credentials()), HasSubstr("Credentials::tls_cert"));
}

TEST_F(Tls, IsClosedToACertificateOfAnotherAuthority) {
  ask_for_certificates(client_authority_);
  start();
  expect_closed(credentials(CertificateAuthority("client authority").issue("alice", "")));
  expect_closed(credentials(authority_.issue("alice", "")));
}

TEST_F(Tls, IsClosedToAnExpiredCertificate) {
  ask_for_certificates(client_authority_);
  start();
  expect_closed(credentials(client_authority_.issue("alice", "", -60)));
}

TEST_F(Tls, KeepsTheJobsOfDifferentCertificatesApart) {
  ask_for_certificates(client_authority_);
  start();
  Client alice = connect(credentials(client_authority_.issue("alice", "")));
  Client also_alice = connect(credentials(client_authority_.issue("someone", "DNS:alice")));
  Client bob = connect(credentials(client_authority_.issue("bob", "")));
  Mesh mesh = one_tetrahedron();

  const std::string job = alice.smooth(mesh, {.method = Laplacian{}}).job_name;

  EXPECT_EQ(alice.list_jobs().size(), 1);
  EXPECT_EQ(also_alice.list_jobs().size(), 1);
  EXPECT_EQ(bob.list_jobs().size(), 0);
  EXPECT_EQ(alice.get_job(job).name, job);
  EXPECT_THROW((void)bob.get_job(job), ServiceError);
}

// A connection under way goes on; a new one sees the new files.
TEST_F(Tls, TakesANewServerCertificateWithoutARestart) {
  start();
  Client old = connect(credentials());
  EXPECT_TRUE(old.healthy());

  const CertificateAuthority next("next authority");
  give_server(next.issue("server", "IP:127.0.0.1"));
  files_.write("next.pem", next.certificate());
  const Credentials trusting_next{.tls_ca = files_.path("next.pem")};
  for (bool welcome = false; !welcome;) {  // the test's timeout ends a wait in vain
    try {
      welcome = connect(trusting_next).healthy(std::chrono::seconds(1));
    } catch (const ServiceError&) {
    }
  }
  EXPECT_TRUE(old.healthy());
  expect_closed(credentials());
}

TEST_F(Tls, TakesANewClientAuthorityWithoutARestart) {
  ask_for_certificates(client_authority_);
  start();
  const KeyPair pair = client_authority_.issue("alice", "");
  expect_welcome(credentials(pair));

  const CertificateAuthority next("next authority");
  files_.write("clients.pem", next.certificate());
  const Credentials after = credentials(next.issue("alice", ""));
  for (bool welcome = false; !welcome;) {
    try {
      welcome = connect(after).healthy(std::chrono::seconds(1));
    } catch (const ServiceError&) {
    }
  }
  expect_closed(credentials(pair));
}

TEST_F(Tls, NamesTheFileThatIsWrongAtTheStart) {
  const auto error_of_start = [&] {
    try {
      start();
    } catch (const InvalidOption& error) {
      return std::string(error.what());
    }
    return std::string("it started");
  };
  config_.tls_cert = files_.path("nowhere.pem");
  EXPECT_THAT(error_of_start(), AllOf(HasSubstr("tls-cert"), HasSubstr("nowhere.pem")));
  config_.tls_cert = files_.write("empty.pem", "");
  EXPECT_THAT(error_of_start(), HasSubstr("tls-cert"));
  config_.tls_cert = files_.path("ca.pem");
  EXPECT_THAT(error_of_start(), AllOf(HasSubstr("tls-key"), HasSubstr("mismatch")));
  config_.tls_cert = "";
  EXPECT_THAT(error_of_start(), HasSubstr("belong together"));
}

TEST_F(Tls, RefusesAnAddressInClearThatOthersReach) {
  config_.tls_cert = config_.tls_key = "";
  for (const char* listen : {"0.0.0.0:0", "[::]:0", "example.org:0", "127.evil.example:0"}) {
    config_.listen = listen;
    try {
      start();
      ADD_FAILURE() << listen;
    } catch (const InvalidOption& error) {
      EXPECT_THAT(error.what(), AllOf(HasSubstr("listen"), HasSubstr("without TLS"))) << listen;
    }
  }
  config_.listen = "0.0.0.0:0";
  config_.insecure = true;
  config_.i_accept_old_grpc = true;
  EXPECT_NO_THROW(start());
}

TEST_F(Tls, RefusesAnAddressThatOthersReachWithAnOldGrpc) {
  if (GRPC_CPP_VERSION_MAJOR > 1 || GRPC_CPP_VERSION_MINOR >= 66) {
    GTEST_SKIP() << "gRPC " << GRPC_CPP_VERSION_STRING << " is not an old one";
  }
  config_.listen = "0.0.0.0:0";
  try {
    start();
    ADD_FAILURE() << "it started";
  } catch (const InvalidOption& error) {
    EXPECT_THAT(error.what(), AllOf(HasSubstr("listen"), HasSubstr("0.0.0.0:0"),
                                    HasSubstr("behind-proxy"), HasSubstr("i-accept-old-grpc")));
  }
  config_.behind_proxy = true;
  EXPECT_NO_THROW(start());
}

/// The version that a handshake of at most `version` ends in; 0: none.
int handshake(const std::string& address, int version) {
  SSL_CTX* context = SSL_CTX_new(TLS_client_method());
  SSL_CTX_set_security_level(context, 0);  // else it is this side that refuses old versions
  SSL_CTX_set_min_proto_version(context, TLS1_VERSION);
  SSL_CTX_set_max_proto_version(context, version);
  SSL_CTX_set_alpn_protos(context, reinterpret_cast<const unsigned char*>("\x02h2"), 3);
  const int file = ::socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(static_cast<std::uint16_t>(std::stoi(address.substr(address.find(':') + 1))));
  to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  int reached = 0;
  SSL* ssl = SSL_new(context);
  if (::connect(file, reinterpret_cast<const sockaddr*>(&to), sizeof to) == 0) {
    SSL_set_fd(ssl, file);
    if (SSL_connect(ssl) == 1) reached = SSL_version(ssl);
  }
  SSL_free(ssl);
  ::close(file);
  SSL_CTX_free(context);
  return reached;
}

TEST_F(Tls, SpeaksNoVersionBefore12) {
  start();
  EXPECT_EQ(handshake(address(), TLS1_VERSION), 0);
  EXPECT_EQ(handshake(address(), TLS1_1_VERSION), 0);
  EXPECT_EQ(handshake(address(), TLS1_2_VERSION), TLS1_2_VERSION);
  EXPECT_EQ(handshake(address(), TLS1_3_VERSION), TLS1_3_VERSION);
}

TEST(Credentials, ThatCannotBeUsedAreNamed) {
  const ScratchFolder files;
  const auto error_of = [](const std::string& target, const Credentials& credentials) {
    try {
      const Client client(target, credentials);
    } catch (const InvalidOption& error) {
      return std::string(error.what());
    }
    return std::string("none");
  };
  EXPECT_THAT(error_of("127.0.0.1:1", {.tls_ca = files.path("no.pem")}),
              AllOf(HasSubstr("tls_ca"), HasSubstr("no.pem")));
  EXPECT_THAT(error_of("127.0.0.1:1", {.tls_cert = files.path("no.pem")}), HasSubstr("tls_key"));
  EXPECT_THAT(error_of("127.0.0.1:1", {.token_file = files.write("empty", "\n")}),
              HasSubstr("token_file"));
  const std::string token = files.write("token", "secret\n");
  EXPECT_THAT(error_of("example.org:1", {.token_file = token}), HasSubstr("in clear"));
  EXPECT_EQ(error_of("example.org:1", {.tls = true, .token_file = token}), "none");
  EXPECT_EQ(error_of("127.0.0.1:1", {.token_file = token}), "none");
}

TEST(Token, OfTheClientIsReadAnewForEveryCall) {
  const ScratchFolder files;
  server::ServerConfig config = quiet_config();
  config.listen = "127.0.0.1:0";
  config.token_file = files.write("tokens", "alice:first\nbob:second\n");
  InProcessServer server(config);
  const std::string address = "127.0.0.1:" + std::to_string(server.server().port());
  Client client(address, {.token_file = files.write("token", "first\n")});
  Mesh mesh = one_tetrahedron();
  const std::string job = client.smooth(mesh, {.method = Laplacian{}}).job_name;
  EXPECT_EQ(client.get_job(job).name, job);

  files.write("token", "second\n");
  EXPECT_THROW((void)client.get_job(job), ServiceError);  // it is another's
  files.write("token", "third\n");
  try {
    (void)client.list_jobs();
    FAIL();
  } catch (const ServiceError& error) {
    EXPECT_EQ(error.code(), client::StatusCode::unauthenticated);
    EXPECT_EQ(error.reason(), "TOKEN_UNKNOWN");
    EXPECT_THAT(error.hint(), HasSubstr("Credentials::token_file"));
  }
  try {
    (void)Client(address).list_jobs();
    FAIL();
  } catch (const ServiceError& error) {
    EXPECT_EQ(error.reason(), "TOKEN_MISSING");
    EXPECT_THAT(error.hint(), HasSubstr("Credentials::token_file"));
  }
  EXPECT_TRUE(Client(address).healthy());  // probes have no token
}

}  // namespace
}  // namespace meshsmooth::testing
