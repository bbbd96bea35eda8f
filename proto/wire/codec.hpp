#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include "meshsmooth/backend_name.hpp"
#include "meshsmooth/job_state.hpp"
#include "meshsmooth/options.hpp"
#include "meshsmooth/smoother.hpp"
#include "meshsmooth/summary.hpp"
#include "meshsmooth/v1/mesh.pb.h"
#include "meshsmooth/v1/smoothing.pb.h"
#include "wire/wire_enum.hpp"

/// Between the messages of meshsmooth.v1 and the types of core. Nothing else
/// converts them. `encode_` makes messages, `decode_` reads them. Values that
/// came over the wire are hostile: what is unknown or out of range throws
/// `InvalidOption` (OPTION_OUT_OF_RANGE) or `NotSupported`
/// (OPTION_NOT_SUPPORTED) with the detail "field".
namespace meshsmooth::wire {

/// An enumerator on the wire.
template <class Enum>
[[nodiscard]] constexpr typename WireEnum<Enum>::Type encode_enum(Enum value) {
  return static_cast<typename WireEnum<Enum>::Type>(static_cast<int>(value) +
                                                    WireEnum<Enum>::first);
}

/// Nothing for a number that this build does not know. 0 is the first enumerator or, where they
/// count from 1, left to the caller and nothing.
template <class Enum>
[[nodiscard]] constexpr std::optional<Enum> decode_enum(int number) {
  const int index = number - WireEnum<Enum>::first;
  if (index < 0 || index >= static_cast<int>(kEnumNames<Enum>.size())) return std::nullopt;
  return static_cast<Enum>(index);
}

/// Throws `NotSupported` when the message, or one in it, has a field that this build does not
/// know: `where`, a path of field names, tells in which; empty for the outermost. O(size).
void refuse_unknown_fields(const google::protobuf::Message& message, const std::string& where = "");

/// All fields set, the defaults too.
[[nodiscard]] v1::SmoothingOptions encode_options(const SmoothOptions& options);

/// What is unset becomes core's default. `history` is not part of the message
/// (JobSpec.iteration_history_included). Fields that this build does not know
/// are refused: they may be a method or an option of a newer client. The result
/// has passed `validate`.
[[nodiscard]] SmoothOptions decode_options(const v1::SmoothingOptions& message);

/// All that core says; queueing, receiving, sending, `options`, topology_reused
/// and server_version are the server's to add.
[[nodiscard]] v1::Summary encode_summary(const SmoothSummary& summary);

/// Metrics that this build does not know are left out; an unknown stop reason
/// throws `NotSupported` (RESPONSE_NOT_UNDERSTOOD).
[[nodiscard]] SmoothSummary decode_summary(const v1::Summary& message);

/// Of a field `element_quality_metrics`: metrics that this build knows, each once.
[[nodiscard]] std::vector<QualityMetric> decode_metrics(
    const google::protobuf::RepeatedField<int>& metrics);

[[nodiscard]] v1::ElementType encode_element_type(ElementType type);
[[nodiscard]] ElementType decode_element_type(v1::ElementType type, const std::string& field);

/// `unspecified` for a state that this build does not know.
[[nodiscard]] JobState decode_state(v1::State state);

/// A negative or malformed duration throws; more than 292 years are cut.
[[nodiscard]] std::chrono::nanoseconds decode_duration(const google::protobuf::Duration& message,
                                                       const std::string& field);
[[nodiscard]] google::protobuf::Duration encode_duration(std::chrono::nanoseconds duration);
[[nodiscard]] google::protobuf::Duration encode_seconds(double seconds);
/// Whether protobuf takes it for a duration: some 10,000 years at most, of one sign.
[[nodiscard]] bool is_duration(const google::protobuf::Duration& message);
/// Throws `InvalidOption` when it is none.
[[nodiscard]] double decode_seconds(const google::protobuf::Duration& message);

/// Proto3 JSON with original field names, indented; fields without presence
/// are printed even when zero. Throws `Error` when the message has none.
[[nodiscard]] std::string to_json(const google::protobuf::Message& message);

/// Whether it has: each duration and each time in it, however deep, is one. What came over the wire
/// may hold others.
[[nodiscard]] bool has_json(const google::protobuf::Message& message);

}  // namespace meshsmooth::wire
