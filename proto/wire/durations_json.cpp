// The part of codec.hpp for durations and JSON.
#include <google/protobuf/stubs/common.h>
#include <google/protobuf/util/json_util.h>
#include <google/protobuf/util/time_util.h>

#include <cmath>
#include <limits>
#include <vector>

#include "meshsmooth/error.hpp"
#include "wire/codec.hpp"

namespace meshsmooth::wire {
namespace {

using google::protobuf::util::TimeUtil;

constexpr std::int32_t kMaxNanos = 999'999'999;

bool is_timestamp(const google::protobuf::Timestamp& message) {
  return message.seconds() >= TimeUtil::kTimestampMinSeconds &&
         message.seconds() <= TimeUtil::kTimestampMaxSeconds && message.nanos() >= 0 &&
         message.nanos() <= kMaxNanos;
}

}  // namespace

std::chrono::nanoseconds decode_duration(const google::protobuf::Duration& message,
                                         const std::string& field) {
  constexpr std::int64_t kNanosPerSecond = 1'000'000'000;
  if (message.seconds() < 0 || message.nanos() < 0 || message.nanos() >= kNanosPerSecond) {
    throw InvalidOption("OPTION_OUT_OF_RANGE", field + ": not a duration of 0 or more",
                        {{"field", field}});
  }
  if (message.seconds() >= std::numeric_limits<std::int64_t>::max() / kNanosPerSecond) {
    return std::chrono::nanoseconds::max();
  }
  return std::chrono::nanoseconds(message.seconds() * kNanosPerSecond + message.nanos());
}

google::protobuf::Duration encode_duration(std::chrono::nanoseconds duration) {
  return TimeUtil::NanosecondsToDuration(duration.count());
}

google::protobuf::Duration encode_seconds(double seconds) {
  return TimeUtil::NanosecondsToDuration(std::llround(seconds * 1e9));
}

bool is_duration(const google::protobuf::Duration& message) {
  const bool one_sign = message.seconds() == 0 || message.nanos() == 0 ||
                        (message.seconds() < 0) == (message.nanos() < 0);
  return message.seconds() >= TimeUtil::kDurationMinSeconds &&
         message.seconds() <= TimeUtil::kDurationMaxSeconds && message.nanos() >= -kMaxNanos &&
         message.nanos() <= kMaxNanos && one_sign;
}

double decode_seconds(const google::protobuf::Duration& message) {
  if (!is_duration(message)) {
    throw InvalidOption("OPTION_OUT_OF_RANGE",
                        "invalid duration: seconds and nanos out of range or of different signs");
  }
  return static_cast<double>(message.seconds()) + message.nanos() * 1e-9;
}

std::string to_json(const google::protobuf::Message& message) {
  google::protobuf::util::JsonPrintOptions options;
  options.add_whitespace = true;
#if GOOGLE_PROTOBUF_VERSION >= 5026000  // renamed there
  options.always_print_fields_with_no_presence = true;
#else
  options.always_print_primitive_fields = true;
#endif
  options.preserve_proto_field_names = true;
  std::string text;
  const auto status = google::protobuf::util::MessageToJsonString(message, &text, options);
  if (!status.ok()) throw Error("INTERNAL", "cannot write JSON: " + status.ToString());
  return text;
}

// By reflection, so that a field that is added is not forgotten.
bool has_json(const google::protobuf::Message& message) {
  if (const auto* duration = dynamic_cast<const google::protobuf::Duration*>(&message)) {
    return is_duration(*duration);
  }
  if (const auto* time = dynamic_cast<const google::protobuf::Timestamp*>(&message)) {
    return is_timestamp(*time);
  }
  using Field = google::protobuf::FieldDescriptor;
  const google::protobuf::Reflection& reflection = *message.GetReflection();
  std::vector<const Field*> fields;
  reflection.ListFields(message, &fields);
  for (const Field* field : fields) {
    if (field->cpp_type() != Field::CPPTYPE_MESSAGE) continue;
    // Asked for its entries, a map makes them all.
    if (field->is_map() &&
        field->message_type()->map_value()->cpp_type() != Field::CPPTYPE_MESSAGE) {
      continue;
    }
    if (!field->is_repeated()) {
      if (!has_json(reflection.GetMessage(message, field))) return false;
      continue;
    }
    for (int i = 0; i < reflection.FieldSize(message, field); ++i) {
      if (!has_json(reflection.GetRepeatedMessage(message, field, i))) return false;
    }
  }
  return true;
}

}  // namespace meshsmooth::wire
