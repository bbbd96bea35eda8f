#include "config.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <sstream>

#include "meshsmooth/error.hpp"
#include "settings.hpp"
#include "support/scratch_folder.hpp"

namespace meshsmooth::server {
namespace {

using meshsmooth::testing::ScratchFolder;
using ::testing::AllOf;
using ::testing::ContainsRegex;
using ::testing::HasSubstr;

/// An environment variable for the length of a test.
class Environment {
 public:
  Environment(const char* name, const char* value) : name_(name) { setenv(name, value, 1); }
  ~Environment() { unsetenv(name_); }

 private:
  const char* name_;
};

class Config : public ::testing::Test {
 protected:
  [[nodiscard]] std::string file_with(const std::string& text) const {
    return files_.write("config.toml", text);
  }

 private:
  ScratchFolder files_;
};

ServerConfig read(std::vector<const char*> arguments) {
  arguments.insert(arguments.begin(), "meshsmooth-server");
  CLI::App app;
  return read_config(app, static_cast<int>(arguments.size()), arguments.data());
}

std::string error_of(const std::vector<const char*>& arguments) {
  try {
    (void)read(arguments);
  } catch (const InvalidOption& error) {
    return error.what();
  }
  return "no error";
}

TEST_F(Config, IsTheDefaultsWithoutArguments) {
  EXPECT_EQ(describe(read({})), describe(ServerConfig{}));
}

TEST_F(Config, ReadsFlags) {
  const ServerConfig config =
      read({"--listen", "0.0.0.0:1", "--lanes", "3", "--host-memory-limit-bytes", "2GiB",
            "--drain-grace-seconds", "1.5", "--idle-pinned-bytes=64MiB", "--backend", "cuda:1"});

  EXPECT_EQ(config.listen, "0.0.0.0:1");
  EXPECT_EQ(config.lanes, 3);
  EXPECT_EQ(config.host_memory_limit_bytes, std::int64_t{2} << 30);
  EXPECT_EQ(config.drain_grace, std::chrono::milliseconds(1500));
  EXPECT_EQ(config.idle_pinned_bytes, std::int64_t{64} << 20);
  EXPECT_EQ(config.backend, "cuda:1");
}

TEST_F(Config, PrefersFlagsToEnvironmentToFileToDefaults) {
  const std::string path = file_with("lanes = 1\nmax-queued-jobs = 1\nmax-kept-jobs = 1\n");
  const Environment lanes("MESHSMOOTH_LANES", "2");
  const Environment queued("MESHSMOOTH_MAX_QUEUED_JOBS", "2");
  const Environment file("MESHSMOOTH_CONFIG", path.c_str());
  const Environment empty("MESHSMOOTH_MAX_NODE_COUNT", "");

  const ServerConfig config = read({"--lanes", "3"});

  EXPECT_EQ(config.lanes, 3);
  EXPECT_EQ(config.max_queued_jobs, 2);
  EXPECT_EQ(config.max_kept_jobs, 1);
  EXPECT_EQ(config.max_node_count, INT32_MAX);
}

// The whole table: every key works in each of the three sources.
TEST_F(Config, TakesEverySettingFromFlagEnvironmentAndFile) {
  for (const auto& [key, value] : list_settings({})) {
    std::string line;
    std::istringstream lines(describe(ServerConfig{}));
    while (std::getline(lines, line) && !line.starts_with(key + " = ")) {
    }
    const std::string text = std::visit(
        []<class T>(const T& v) {
          if constexpr (std::is_same_v<T, std::string>) {
            return v;
          } else {
            std::ostringstream out;
            out << std::boolalpha << v;
            return out.str();
          }
        },
        value);
    std::string name = "MESHSMOOTH_" + key;
    for (char& c : name) c = c == '-' ? '_' : static_cast<char>(std::toupper(c));

    if (!text.empty()) {  // a flag has no way to say nothing
      EXPECT_EQ(describe(read({("--" + key + "=" + text).c_str()})), describe(ServerConfig{}))
          << key;
    }
    EXPECT_EQ(describe(read({"--config", file_with(line).c_str()})), describe(ServerConfig{}));
    const Environment wrong(name.c_str(), "\x01");
    EXPECT_THAT(error_of({}), AllOf(HasSubstr(key + ": "), HasSubstr(name)));
  }
}

TEST_F(Config, NamesFieldValueAndSourceOfAWrongValue) {
  EXPECT_THAT(error_of({"--lanes", "-1"}),
              AllOf(HasSubstr("lanes: "), HasSubstr("\"-1\""), HasSubstr("flag --lanes"),
                    ContainsRegex("0 (to|-) 1024")));  // by CLI11's version
  EXPECT_THAT(error_of({"--lame-duck-seconds", "soon"}),
              AllOf(HasSubstr("lame-duck-seconds: "), HasSubstr("\"soon\"")));
  EXPECT_THAT(error_of({"--lame-duck-seconds", "nan"}), HasSubstr("nan is not a number"));
  EXPECT_THAT(error_of({"--max-receive-message-bytes", "1048576"}),
              ContainsRegex("2097152 (to|-) "));
  EXPECT_THAT(error_of({"--max-job-bytes", "lots"}), HasSubstr("\"lots\" (flag --max-job-bytes)"));
  for (const char* wrong : {"0,0", "-1", "1,", ",1", "a", "0 1"}) {
    EXPECT_THAT(error_of({"--devices", wrong}), HasSubstr("devices: ")) << wrong;
  }
  EXPECT_EQ(read({"--devices", "0,2"}).devices, "0,2");
  EXPECT_EQ(read({"--devices", "all"}).devices, "all");
  EXPECT_THAT(error_of({"--listen", "here"}), HasSubstr("it is not HOST:PORT or unix:PATH"));
  EXPECT_THAT(error_of({"--backend", "cuda:x"}),
              HasSubstr("it is not one of auto, cpu, cuda, cuda:N"));
  {
    const Environment level("MESHSMOOTH_LOG_LEVEL", "loud");
    EXPECT_THAT(error_of({}), AllOf(HasSubstr("log-level: "), HasSubstr("\"loud\""),
                                    HasSubstr("environment, MESHSMOOTH_LOG_LEVEL")));
  }
  const std::string path = file_with("# nothing\nlanes = 4\nmax-queued-jobs = 0\n");
  EXPECT_THAT(error_of({"--config", path.c_str()}),
              AllOf(HasSubstr("max-queued-jobs: "), HasSubstr("\"0\""),
                    HasSubstr("file " + path + ", line 3")));
}

// A container engine makes one where the file that it should mount is missing.
TEST_F(Config, RefusesAFolderInsteadOfAFile) {
  EXPECT_THROW((void)read({"--config", "/"}), InvalidOption);
}

TEST_F(Config, RefusesAFractionThatIsNoNumber) {
  EXPECT_THROW((void)read({"--max-connection-upload-share=nan"}), InvalidOption);
}

TEST_F(Config, SaysWhatIsWrongWithAFile) {
  const auto error_of_file = [&](const std::string& text) {
    return error_of({"--config", file_with(text).c_str()});
  };
  EXPECT_THAT(error_of_file("lane = 4"),
              AllOf(HasSubstr("lane: there is no such setting"), HasSubstr("line 1")));
  EXPECT_THAT(error_of_file("config = \"x\""), HasSubstr("there is no such setting"));
  EXPECT_THAT(error_of_file("help = true"), HasSubstr("there is no such setting"));
  EXPECT_THAT(error_of_file("lanes = 4\nlanes = 4"), HasSubstr("duplicate setting"));
  EXPECT_THAT(error_of_file("[server]"), HasSubstr("no value"));
  EXPECT_THAT(error_of_file("lanes = [4]"), HasSubstr("neither a number"));
  EXPECT_THAT(error_of_file("lanes ="), HasSubstr("neither a number"));
  EXPECT_THAT(error_of_file("lanes = 4\n\x1b[2J = 1"), HasSubstr("line 2 is not text"));
  EXPECT_THAT(error_of_file("listen = \"a:1"), HasSubstr("neither a number"));
  EXPECT_THAT(error_of_file("listen = \"a:1\" b"), HasSubstr("neither a number"));
  EXPECT_THAT(error_of({"--config", "/nowhere/at/all.toml"}), HasSubstr("cannot read"));
}

TEST_F(Config, ReadsFilesWithCommentsQuotesAndSpaces) {
  const ServerConfig config = read({"--config", file_with("\n  # a comment\n\tlanes=2 # two\n"
                                                          "listen = 'unix:a # \\ b' # c\n"
                                                          "backend = \"cpu\"\r\n")
                                                    .c_str()});

  EXPECT_EQ(config.lanes, 2);
  EXPECT_EQ(config.listen, "unix:a # \\ b");
  EXPECT_EQ(config.backend, "cpu");
}

TEST_F(Config, LeavesArgumentsThatDoNotExistToTheParser) {
  EXPECT_THROW((void)read({"--no-such-flag"}), CLI::ExtrasError);
  EXPECT_THROW((void)read({"--lanes"}), CLI::ParseError);
  EXPECT_THROW((void)read({"--lanes", "1", "--lanes", "2"}), CLI::ParseError);
}

// docs/operations.md has the table of settings as this test makes it.
TEST_F(Config, IsDocumentedByTheTableOfSettings) {
  std::string table = "| Setting | Default | Meaning |\n| --- | --- | --- |\n";
  std::istringstream lines(describe(ServerConfig{}));
  for (const Setting& setting : settings()) {
    std::string line;
    std::getline(lines, line);
    std::string value = line.substr(setting.key.size() + 3);
    if (value.starts_with('"')) value = value.substr(1, value.size() - 2);
    table += "| `" + setting.key + "` | " + (value.empty() ? "–" : "`" + value + "`") + " | " +
             setting.text + " |\n";
  }
  std::ifstream file(MESHSMOOTH_DOCS "/operations.md");
  const std::string text((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  EXPECT_THAT(text, HasSubstr(table + "\n"));
}

TEST_F(Config, ReadsWhatItPrints) {
  ServerConfig config;
  config.listen = R"(unix:/run/mesh "smooth" \ # .sock)";
  config.lanes = 4;
  config.max_connection_age = std::chrono::seconds(0);
  config.drain_grace = std::chrono::nanoseconds(123456789012345);
  config.max_job_bytes = INT64_MAX;

  EXPECT_EQ(describe(read({"--config", file_with(describe(config)).c_str()})), describe(config));
}

}  // namespace
}  // namespace meshsmooth::server
