#include "config.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <cstdlib>
#include <fstream>

namespace meshsmooth::server {
namespace {

ServerConfig parse(std::vector<std::string> arguments) {
  ServerConfig config;
  CLI::App app;
  add_options(app, config);
  app.set_config("--config");
  std::reverse(arguments.begin(), arguments.end());
  app.parse(arguments);
  return config;
}

TEST(Config, IsTheDefaultsWithoutArguments) {
  EXPECT_EQ(describe(parse({}), '\n'), describe(ServerConfig{}, '\n'));
}

TEST(Config, ReadsFlags) {
  const ServerConfig config =
      parse({"--listen", "0.0.0.0:1", "--lanes", "3", "--host-memory-limit-bytes", "2GiB",
             "--drain-grace-seconds", "1.5"});

  EXPECT_EQ(config.listen, "0.0.0.0:1");
  EXPECT_EQ(config.lanes, 3);
  EXPECT_EQ(config.host_memory_limit_bytes, std::int64_t{2} << 30);
  EXPECT_EQ(config.drain_grace_seconds, 1.5);
}

TEST(Config, ReadsTheDevicesMemory) {
  setenv("MESHSMOOTH_DEVICE_BYTES", "3GiB", 1);
  const ServerConfig config = parse({"--backend", "cuda:1", "--idle-pinned-bytes", "64MiB"});
  unsetenv("MESHSMOOTH_DEVICE_BYTES");

  EXPECT_EQ(config.backend, "cuda:1");
  EXPECT_EQ(config.device_bytes, std::int64_t{3} << 30);
  EXPECT_EQ(config.idle_pinned_bytes, std::int64_t{64} << 20);
}

TEST(Config, ReadsTheEnvironmentButPrefersFlags) {
  setenv("MESHSMOOTH_LANES", "5", 1);
  setenv("MESHSMOOTH_MAX_QUEUED_JOBS", "7", 1);
  const ServerConfig config = parse({"--lanes", "3"});
  unsetenv("MESHSMOOTH_LANES");
  unsetenv("MESHSMOOTH_MAX_QUEUED_JOBS");

  EXPECT_EQ(config.lanes, 3);
  EXPECT_EQ(config.max_queued_jobs, 7);
}

TEST(Config, NamesTheFlagThatIsOutOfRange) {
  try {
    parse({"--lanes", "-1"});
    FAIL();
  } catch (const CLI::ValidationError& error) {
    EXPECT_THAT(error.what(), ::testing::HasSubstr("--lanes"));
  }
  EXPECT_THROW(parse({"--log-level", "loud"}), CLI::ValidationError);
  EXPECT_THROW(parse({"--lame-duck-seconds", "-1"}), CLI::ValidationError);
  EXPECT_THROW(parse({"--no-such-flag"}), CLI::ExtrasError);
}

TEST(Config, ReadsWhatItPrints) {
  ServerConfig config;
  config.listen = "unix:/run/meshsmooth.sock";
  config.lanes = 4;
  config.max_connection_age_seconds = 0;
  const std::string path = ::testing::TempDir() + "meshsmooth_config_test.toml";
  std::ofstream(path) << describe(config, '\n');

  EXPECT_EQ(describe(parse({"--config", path}), '\n'), describe(config, '\n'));
}

}  // namespace
}  // namespace meshsmooth::server
