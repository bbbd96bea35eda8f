#include "rpc/status.hpp"

#include <gtest/gtest.h>

#include <new>
#include <stdexcept>

#include "busy.hpp"
#include "meshsmooth/error.hpp"

namespace meshsmooth::server {
namespace {

using grpc::StatusCode;

template <class Exception>
wire::StatusDetails describe(const Exception& error) {
  return describe_error(std::make_exception_ptr(error), "jobs/1");
}

// The table of docs/protocol.md.
TEST(Status, HasTheCodeOfTheExceptionsType) {
  EXPECT_EQ(describe(InvalidMesh("INDEX_OUT_OF_RANGE", "")).code, StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(describe(InvalidOption("OPTION_OUT_OF_RANGE", "")).code, StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(describe(NotSupported("OPTION_NOT_SUPPORTED", "")).code, StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(describe(OutOfMemory("MESH_TOO_LARGE", "")).code, StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(describe(Cancelled("CANCELLED_BY_CLIENT", "")).code, StatusCode::CANCELLED);
  EXPECT_EQ(describe(DeadlineExceeded("STREAM_IDLE", "")).code, StatusCode::DEADLINE_EXCEEDED);
  EXPECT_EQ(describe(DeviceError("DEVICE_LOST", "", true)).code, StatusCode::UNAVAILABLE);
  EXPECT_EQ(describe(DeviceError("DEVICE_ERROR", "", false)).code, StatusCode::INTERNAL);
  EXPECT_EQ(describe(std::bad_alloc()).code, StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(describe(std::logic_error("")).code, StatusCode::INTERNAL);
  EXPECT_EQ(describe(42).code, StatusCode::INTERNAL);
}

TEST(Status, HasTheCodeOfItsReasonWhereThatSaysMore) {
  EXPECT_EQ(describe(InvalidMesh("CHECKSUM_MISMATCH", "")).code, StatusCode::DATA_LOSS);
  EXPECT_EQ(describe(NotSupported("BACKEND_NOT_AVAILABLE", "")).code,
            StatusCode::FAILED_PRECONDITION);
  EXPECT_EQ(describe(Error("JOB_NOT_FOUND", "")).code, StatusCode::NOT_FOUND);
  EXPECT_EQ(describe(Error("DRAINING", "")).code, StatusCode::UNAVAILABLE);
}

TEST(Status, AsksForARetryOnlyWhereOneHelps) {
  for (const char* reason : {"QUEUE_FULL", "HOST_MEMORY_BUSY", "DEVICE_MEMORY_BUSY"}) {
    EXPECT_EQ(describe(Busy(reason, "", {}, std::chrono::milliseconds(70))).retry_delay,
              std::chrono::milliseconds(70))
        << reason;
  }
  EXPECT_TRUE(describe(Error("DRAINING", "")).retry_delay);
  EXPECT_FALSE(describe(OutOfMemory("MESH_TOO_LARGE", "")).retry_delay);
  EXPECT_FALSE(describe(InvalidMesh("REPEATED_NODE", "")).retry_delay);
}

TEST(Status, KeepsMessageReasonAndDetails) {
  const wire::StatusDetails details =
      describe(InvalidMesh("REPEATED_NODE", "element 7: node 3 twice", {{"element", "7"}}));
  const grpc::Status status = to_status(details);

  EXPECT_EQ(status.error_code(), StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(status.error_message(), "element 7: node 3 twice");
  const auto decoded = wire::decode_status_details(status.error_details());
  ASSERT_TRUE(decoded);
  EXPECT_EQ(decoded->reason, "REPEATED_NODE");
  EXPECT_EQ(decoded->metadata, (ErrorDetails{{"element", "7"}}));
}

TEST(Status, OfTheUnforeseenNamesOnlyTheIncident) {
  const wire::StatusDetails details = describe(std::logic_error("secret"));

  EXPECT_EQ(details.message.find("secret"), std::string::npos);
  EXPECT_EQ(details.metadata, (ErrorDetails{{"incident", "jobs/1"}}));
}

}  // namespace
}  // namespace meshsmooth::server
