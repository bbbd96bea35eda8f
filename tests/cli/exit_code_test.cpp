#include "exit_code.hpp"

#include <gtest/gtest.h>

#include "meshsmooth/client.hpp"
#include "support/scratch_folder.hpp"
#include "text_file.hpp"

namespace meshsmooth::cli {
namespace {

using client::ServiceError;
using client::StatusCode;

ExitCode exit_code_of_service(StatusCode code, const std::string& reason = "") {
  return exit_code_of(ServiceError(code, reason, "", {}, ""));
}

TEST(ExitCode, FollowsTheReasonWhereverItWasFound) {
  EXPECT_EQ(exit_code_of(InvalidMesh("REPEATED_NODE", "")), ExitCode::bad_mesh);
  EXPECT_EQ(exit_code_of_service(StatusCode::invalid_argument, "REPEATED_NODE"),
            ExitCode::bad_mesh);
  EXPECT_EQ(exit_code_of_service(StatusCode::invalid_argument, "OPTION_OUT_OF_RANGE"),
            ExitCode::usage);
  EXPECT_EQ(exit_code_of_service(StatusCode::failed_precondition, "BACKEND_NOT_AVAILABLE"),
            ExitCode::refused);
  EXPECT_EQ(exit_code_of(NotSupported("BACKEND_NOT_AVAILABLE", "")), ExitCode::refused);
  EXPECT_EQ(exit_code_of(Error("FORMAT_ERROR", "")), ExitCode::bad_mesh);
  EXPECT_EQ(exit_code_of(Error("FILE_NOT_WRITABLE", "")), ExitCode::failed);
}

TEST(ExitCode, FollowsTheStatusOfErrorsWithoutAReason) {
  EXPECT_EQ(exit_code_of_service(StatusCode::unavailable), ExitCode::refused);
  EXPECT_EQ(exit_code_of_service(StatusCode::resource_exhausted, "QUEUE_FULL"), ExitCode::refused);
  EXPECT_EQ(exit_code_of_service(StatusCode::deadline_exceeded), ExitCode::stopped);
  EXPECT_EQ(exit_code_of_service(StatusCode::cancelled), ExitCode::stopped);
  EXPECT_EQ(exit_code_of_service(StatusCode::internal), ExitCode::failed);
  EXPECT_EQ(exit_code_of(Cancelled("", "")), ExitCode::stopped);
  EXPECT_EQ(exit_code_of(std::runtime_error("")), ExitCode::failed);
}

TEST(ErrorLine, IsOneLineOfWhatReasonAndHint) {
  EXPECT_EQ(error_line(ServiceError(StatusCode::unavailable, "DRAINING", "leaving\nsoon", {},
                                    "try again at once, or elsewhere")),
            "leaving soon (DRAINING); try again at once, or elsewhere");
  EXPECT_EQ(error_line(ServiceError(StatusCode::unavailable, "", "no", {},
                                    "set Credentials::tls_ca or Credentials::tls_server_name.")),
            "no; set --tls-ca or --tls-server-name.");
  EXPECT_EQ(error_line(std::runtime_error("bad")), "bad");
}

TEST(TextFile, ReplacesAFileAndLeavesNothingElse) {
  const meshsmooth::testing::ScratchFolder scratch;
  const std::filesystem::path folder = scratch.path();
  const std::filesystem::path path = scratch.path("report.json");

  check_text_file_writable(path);
  EXPECT_TRUE(std::filesystem::is_empty(folder));
  write_text_file(path, "first");
  write_text_file(path, "second");

  EXPECT_EQ(std::filesystem::file_size(path), 6);
  EXPECT_THROW(check_text_file_writable(folder), Error);
  EXPECT_THROW(check_text_file_writable(folder / "none" / "report.json"), Error);
  std::filesystem::remove(path);
  EXPECT_TRUE(std::filesystem::is_empty(folder));
}

TEST(ErrorJson, HasAllThatAProgramActsOn) {
  EXPECT_EQ(error_json(ServiceError(StatusCode::invalid_argument, "REPEATED_NODE", "element \"7\"",
                                    {{"element", "7"}}, "see Credentials::tls_ca"),
                       ExitCode::bad_mesh),
            "{\"error\": {\"reason\": \"REPEATED_NODE\", \"message\": \"element \\u00227\\u0022\", "
            "\"hint\": \"see --tls-ca\", \"exit_code\": 3, \"details\": {\"element\": \"7\"}}}");
}

TEST(ErrorJson, HasAReasonForWhatTheParserRefusesAndAStatusForWhatHasNone) {
  EXPECT_EQ(parse_error_reason(CLI::ValidationError("--goal", "no")), "OPTION_OUT_OF_RANGE");
  EXPECT_EQ(parse_error_reason(CLI::ExtrasError({"--no"})), "OPTION_MISPLACED");
  EXPECT_NE(error_json(ServiceError(StatusCode::unavailable, "", "gone", {}, ""), ExitCode::refused)
                .find("\"reason\": \"UNAVAILABLE\""),
            std::string::npos);
}

}  // namespace
}  // namespace meshsmooth::cli
