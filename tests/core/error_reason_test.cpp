// The table of reasons agrees with the sources that give them and with docs/protocol.md.
#include "meshsmooth/error_reason.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <regex>
#include <set>
#include <string>

namespace meshsmooth {
namespace {

namespace fs = std::filesystem;

const fs::path kRoot = MESHSMOOTH_SOURCE_DIR;

std::string read(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// The literals in the sources that have the form of a reason.
std::set<std::string> literals() {
  // Not reasons: what gRPC, the health service, the environment and file formats call things.
  const std::set<std::string> others = {"RST_STREAM",
                                        "NOT_SERVING",
                                        "STAGE_",
                                        "SOURCE_DATE_EPOCH",
                                        "MARKER_TAG",
                                        "MARKER_ELEMS",
                                        "SEND_RECEIVE",
                                        "SEND_RECV",
                                        "ANSA_NAME",
                                        "BAR_4",
                                        "CELL_DATA",
                                        "HEXA_32",
                                        "HEXA_56",
                                        "HEXA_64",
                                        "LOOKUP_TABLE",
                                        "NULL_ARRAY",
                                        "PENTA_24",
                                        "PENTA_38",
                                        "PENTA_40",
                                        "POINT_DATA",
                                        "PYRA_14",
                                        "PYRA_21",
                                        "PYRA_29",
                                        "PYRA_30",
                                        "QUAD_12",
                                        "QUAD_16",
                                        "TETRA_16",
                                        "TETRA_20",
                                        "TRI_10",
                                        "TRI_9",
                                        "UNSTRUCTURED_GRID",
                                        "X_Y",
                                        "X_Y_Z"};
  const std::regex form("\"([A-Z]+(_[A-Z0-9]+)+|INTERNAL|DRAINING)\"");
  std::set<std::string> found;
  for (const char* folder : {"core", "proto/wire", "server", "client"}) {
    for (const auto& entry : fs::recursive_directory_iterator(kRoot / folder)) {
      const fs::path& path = entry.path();
      if (!std::set<std::string>{".cpp", ".hpp", ".cu", ".cuh"}.contains(path.extension()) ||
          path.stem() == "error_reason") {
        continue;
      }
      const std::string text = read(path);
      for (std::sregex_iterator match(text.begin(), text.end(), form), end; match != end; ++match) {
        const std::string name = (*match)[1];
        const bool is_variable = name.starts_with("MESHSMOOTH_") || name.starts_with("OTEL_");
        if (!is_variable && !others.contains(name)) found.insert(name);
      }
    }
  }
  return found;
}

TEST(ErrorReasons, AreThoseThatTheSourcesGive) {
  const std::set<std::string> given = literals();
  EXPECT_GT(given.size(), 40U) << "has the form of reasons changed?";
  for (const std::string& name : given) EXPECT_NE(find_error_reason(name), nullptr) << name;
  for (const ErrorReason& reason : error_reasons()) {
    EXPECT_TRUE(given.contains(std::string(reason.name))) << reason.name << " is given nowhere";
  }
}

TEST(ErrorReasons, AreUniqueAndComplete) {
  std::set<std::string_view> names;
  for (const ErrorReason& reason : error_reasons()) {
    EXPECT_TRUE(names.insert(reason.name).second) << reason.name;
    EXPECT_FALSE(reason.meaning.empty()) << reason.name;
    EXPECT_NE(reason.exit_code, ExitCode::done) << reason.name;
    EXPECT_EQ(find_error_reason(reason.name), &reason);
    EXPECT_TRUE(!reason.retry_delay || reason.retry.starts_with("yes")) << reason.name;
  }
  EXPECT_EQ(find_error_reason("NO_SUCH_REASON"), nullptr);
  EXPECT_EQ(find_error_reason(""), nullptr);
}

TEST(ErrorReasons, HaveTheExitCodesOfTheirKind) {
  EXPECT_EQ(find_error_reason("QUEUE_FULL")->exit_code, ExitCode::refused);
  EXPECT_EQ(find_error_reason("INDEX_OUT_OF_RANGE")->exit_code, ExitCode::bad_mesh);
  EXPECT_EQ(find_error_reason("OPTION_OUT_OF_RANGE")->exit_code, ExitCode::usage);
  EXPECT_EQ(find_error_reason("DEADLINE_RUNNING")->exit_code, ExitCode::stopped);
  EXPECT_EQ(find_error_reason("INTERNAL")->exit_code, ExitCode::failed);
}

std::string code_list(std::string_view keys) {
  if (keys.empty()) return "–";
  std::string text = "`";
  for (const char c : keys) text += c == ',' ? "`," : c == ' ' ? " `" : std::string(1, c);
  return text + "`";
}

/// The tables of docs/protocol.md, of what the server and of what the clients give.
std::array<std::string, 2> tables() {
  std::string server =
      "| Reason | Code | With | Try again? | Meaning |\n| --- | --- | --- | --- | --- |\n";
  std::string client = "| Reason | Meaning |\n| --- | --- |\n";
  for (const ErrorReason& r : error_reasons()) {
    const std::string name = "| `" + std::string(r.name) + "` | ";
    const std::string meaning = std::string(r.meaning) + " |\n";
    if (r.origin == ErrorOrigin::client) {
      client += name + meaning;
    } else {
      server += name + std::string(status_code_name(r.status)) + " | " + code_list(r.metadata) +
                " | " + std::string(r.retry) + " | " + meaning;
    }
  }
  return {server, client};
}

TEST(ErrorReasons, StandInTheDocumentationAsTheyAreHere) {
  const std::string protocol = read(kRoot / "docs/protocol.md");
  for (const std::string& table : tables()) {
    EXPECT_NE(protocol.find(table), std::string::npos) << "docs/protocol.md lacks\n" << table;
  }
}

// As grpc/status.h numbers them; what it does not know is a failure.
TEST(ErrorReasons, HaveTheStatusesOfGrpc) {
  EXPECT_EQ(status_code_name(StatusCode::cancelled), "CANCELLED");
  EXPECT_EQ(status_code_name(StatusCode::out_of_range), "OUT_OF_RANGE");
  EXPECT_EQ(status_code_name(StatusCode::unauthenticated), "UNAUTHENTICATED");
  EXPECT_EQ(exit_code_of(StatusCode::deadline_exceeded), ExitCode::stopped);
  EXPECT_EQ(exit_code_of(StatusCode::unavailable), ExitCode::refused);
  EXPECT_EQ(exit_code_of(StatusCode::internal), ExitCode::failed);
  EXPECT_EQ(exit_code_of(static_cast<StatusCode>(99)), ExitCode::failed);
}

}  // namespace
}  // namespace meshsmooth
