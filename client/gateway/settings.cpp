#include "settings.hpp"

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <CLI/Option.hpp>
#include <CLI/Validators.hpp>
#include <algorithm>
#include <charconv>
#include <iostream>
#include <thread>

#include "meshsmooth/error_reason.hpp"

namespace meshsmooth::gateway {
namespace {

namespace fs = std::filesystem;

struct Flags {
  std::string listen = "127.0.0.1:8080";
  std::string server, tls_ca, tls_cert, tls_key, tls_server_name;
  bool tls = false;
  double upload_timeout = 600, job_timeout = 3600, result_ttl = 600, drain_grace = 30;
};

/// "--max-requests" is also MESHSMOOTH_GATEWAY_MAX_REQUESTS.
void name_in_environment(CLI::App& app) {
  for (CLI::Option* option : app.get_options()) {
    std::string name = option->get_single_name();
    std::ranges::transform(name, name.begin(), [](unsigned char c) {
      return c == '-' ? '_' : static_cast<char>(std::toupper(c));
    });
    if (name != "HELP" && name != "VERSION") option->envname("MESHSMOOTH_GATEWAY_" + name);
  }
}

void add_flags(CLI::App& app, Settings& settings, Flags& flags) {
  app.add_option("--listen", flags.listen, "Address of the HTTP server: HOST:PORT")
      ->capture_default_str();
  CLI::Option* cert = app.add_option("--listen-tls-cert", settings.tls_cert,
                                     "PEM file of its certificate chain, for HTTPS [plain HTTP]");
  CLI::Option* key = app.add_option("--listen-tls-key", settings.tls_key, "PEM file of its key");
  cert->needs(key);
  key->needs(cert);
  app.add_flag("--insecure", settings.insecure,
               "Allow an address without TLS that other machines can reach, because something else "
               "protects it");
  app.add_flag("--allow-anonymous", settings.allow_anonymous,
               "Serve callers without a token on an address that other machines can reach");

  app.add_option("--server", flags.server, "Server address, as of `meshsmooth smooth`")->required();
  app.add_flag("--tls", flags.tls, "TLS on the way to the server; implied by the next four flags");
  app.add_option("--tls-ca", flags.tls_ca, "PEM file of the server's authorities [the system's]");
  app.add_option("--tls-cert", flags.tls_cert, "PEM file of the gateway's client certificate");
  app.add_option("--tls-key", flags.tls_key, "PEM file of the key of --tls-cert");
  app.add_option("--tls-server-name", flags.tls_server_name, "Name in the server's certificate");
  app.add_option("--token-file", settings.token_file,
                 "File with a bearer token for callers who bring none");
  app.add_option("--client", settings.client, "The program meshsmooth [beside this one]");

  app.add_option("--folder", settings.folder, "Folder of uploads and results [a temporary one]");
  app.add_option("--max-upload-bytes", settings.max_upload_bytes, "Largest request, in bytes")
      ->check(CLI::Range(std::uint64_t{1}, std::uint64_t{1} << 50))
      ->capture_default_str();
  app.add_option("--max-client-bytes", settings.max_client_bytes,
                 "Address space of a process that reads and writes a mesh, in bytes; 0: no limit")
      ->capture_default_str();
  app.add_option("--max-requests", settings.max_requests, "Jobs at a time; more are refused")
      ->check(CLI::Range(1, 4096))
      ->capture_default_str();
  app.add_option(
         "--max-connections", settings.max_connections,
         "Connections at a time; for more, those of slow uploads and downloads end, else they wait")
      ->check(CLI::Range(1, 4096))
      ->capture_default_str();
  app.add_option("--max-kept-jobs", settings.max_kept_jobs,
                 "Jobs with an address that are kept; the oldest that has ended makes room")
      ->check(CLI::Range(1, 4096))
      ->capture_default_str();
  app.add_option("--clients", settings.clients,
                 "Processes that read, send and write meshes at a time; others wait")
      ->check(CLI::Range(1, 1024))
      ->capture_default_str();
  const CLI::Range seconds(0.0, 1e7);
  app.add_option("--upload-timeout", flags.upload_timeout, "Longest upload, in seconds")
      ->check(seconds)
      ->capture_default_str();
  app.add_option("--job-timeout", flags.job_timeout, "Longest job with its wait, in seconds")
      ->check(seconds)
      ->capture_default_str();
  app.add_option("--result-ttl", flags.result_ttl,
                 "Time that the result of a job with an address is kept, in seconds")
      ->check(seconds)
      ->capture_default_str();
  app.add_option("--drain-grace", flags.drain_grace,
                 "Time that jobs have to end after SIGTERM, in seconds")
      ->check(seconds)
      ->capture_default_str();
}

void take_listen(const std::string& listen, Settings& settings) {
  const std::size_t colon = listen.rfind(':');
  const std::string port = colon == std::string::npos ? "" : listen.substr(colon + 1);
  const auto [end, error] = std::from_chars(port.data(), port.data() + port.size(), settings.port);
  if (colon == std::string::npos || port.empty() || error != std::errc() ||
      end != port.data() + port.size() || settings.port < 0 || settings.port > 65535) {
    throw CLI::ValidationError("--listen", listen + " is not HOST:PORT");
  }
  settings.host = listen.substr(0, colon);
  if (settings.host.starts_with('[') && settings.host.ends_with(']')) {
    settings.host = settings.host.substr(1, settings.host.size() - 2);
  }
}

void take(const Flags& flags, Settings& settings) {
  take_listen(flags.listen, settings);
  const auto seconds = [](double value) {
    return std::chrono::seconds(static_cast<std::int64_t>(std::max(value, 1.0)));
  };
  settings.upload_timeout = seconds(flags.upload_timeout);
  settings.job_timeout = seconds(flags.job_timeout);
  settings.result_ttl = seconds(flags.result_ttl);
  settings.drain_grace = seconds(flags.drain_grace);
  settings.server_flags = {"--server=" + flags.server};
  if (flags.tls) settings.server_flags.emplace_back("--tls");
  const auto add = [&](const char* flag, const std::string& value, bool file) {
    // The processes that read them work in folders of their own.
    if (value.empty()) return;
    settings.server_flags.push_back(flag + (file ? fs::absolute(value).string() : value));
  };
  add("--tls-ca=", flags.tls_ca, true);
  add("--tls-cert=", flags.tls_cert, true);
  add("--tls-key=", flags.tls_key, true);
  add("--tls-server-name=", flags.tls_server_name, false);
  if (!settings.token_file.empty()) settings.token_file = fs::absolute(settings.token_file);
  if (settings.client.empty()) {
    settings.client = fs::read_symlink("/proc/self/exe").parent_path() / "meshsmooth";
  }
  settings.client = fs::absolute(settings.client);
  std::error_code error;
  if (!fs::is_regular_file(settings.client, error)) {
    throw CLI::ValidationError("--client", "there is no program " + settings.client.string());
  }
  if (settings.is_public() && settings.tls_cert.empty() && !settings.insecure) {
    throw CLI::ValidationError(
        "--listen", flags.listen +
                        " can be reached by other machines without TLS: set --listen-tls-cert and "
                        "--listen-tls-key, or --insecure where something else protects it");
  }
}

}  // namespace

bool Settings::is_public() const {
  const bool digits = host.find_first_not_of("0123456789.") == std::string::npos;
  return host != "localhost" && host != "::1" && !(digits && host.starts_with("127."));
}

std::optional<Settings> read_settings(int argc, char** argv, int& exit_code) {
  Settings settings;
  Flags flags;
  // Half of their time they wait for the server.
  settings.clients = std::max(4, 2 * static_cast<int>(std::thread::hardware_concurrency()));
  CLI::App app(
      "Serves the clients of plain HTTP by a meshsmooth server: uploads of any format, results of "
      "the same or another. Every flag is also a variable, as MESHSMOOTH_GATEWAY_MAX_REQUESTS.");
  app.set_version_flag("--version", "meshsmooth-gateway " MESHSMOOTH_VERSION);
  add_flags(app, settings, flags);
  name_in_environment(app);
  try {
    app.parse(argc, argv);
    take(flags, settings);
  } catch (const CLI::Success& help) {
    exit_code = app.exit(help);
    return std::nullopt;
  } catch (const CLI::ParseError& error) {
    std::cerr << "meshsmooth-gateway: " << error.what() << std::endl;
    exit_code = static_cast<int>(ExitCode::usage);
    return std::nullopt;
  }
  return settings;
}

}  // namespace meshsmooth::gateway
