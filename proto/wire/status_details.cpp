#include "wire/status_details.hpp"

#include <algorithm>
#include <map>

#include "meshsmooth/v1/error_details.pb.h"
#include "wire/codec.hpp"

namespace meshsmooth::wire {
namespace {

// The names under which every googleapis knows the messages.
constexpr std::string_view kErrorInfoUrl = "type.googleapis.com/google.rpc.ErrorInfo";
constexpr std::string_view kRetryInfoUrl = "type.googleapis.com/google.rpc.RetryInfo";
constexpr std::string_view kBadRequestUrl = "type.googleapis.com/google.rpc.BadRequest";

// gRPC's metadata limit is 8 KiB for all headers together. The message goes
// into the trailer up to three times: as grpc-message, in Status and in
// BadRequest.
constexpr std::size_t kMaxTextBytes = 700;
constexpr std::size_t kMaxMetadataBytes = 120;
constexpr std::size_t kMaxMetadataCount = 8;

// Cuts at a code point: a string field must be UTF-8.
std::string shorten(std::string_view text, std::size_t max_bytes) {
  if (text.size() <= max_bytes) return std::string(text);
  std::size_t end = max_bytes;
  while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0) == 0x80) --end;
  return std::string(text.substr(0, end));
}

void pack(std::string_view url, const google::protobuf::Message& message, v1::Status* status) {
  google::protobuf::Any* any = status->add_details();
  any->set_type_url(std::string(url));
  any->set_value(message.SerializeAsString());
}

}  // namespace

std::string encode_status_details(const StatusDetails& details) {
  const std::string message = shorten(details.message, kMaxTextBytes);
  v1::Status status;
  status.set_code(details.code);
  status.set_message(message);

  v1::ErrorInfo info;
  info.set_reason(details.reason);
  info.set_domain(std::string(kErrorDomain));
  v1::BadRequest bad_request;
  for (const auto& [key, value] : details.metadata) {
    if (info.metadata_size() == kMaxMetadataCount) break;
    (*info.mutable_metadata())[shorten(key, kMaxMetadataBytes)] = shorten(value, kMaxMetadataBytes);
    if (key == "field") {
      v1::BadRequest::FieldViolation* violation = bad_request.add_field_violations();
      violation->set_field(shorten(value, kMaxMetadataBytes));
      violation->set_description(message);
    }
  }
  pack(kErrorInfoUrl, info, &status);
  if (bad_request.field_violations_size() > 0) pack(kBadRequestUrl, bad_request, &status);
  if (details.retry_delay) {
    v1::RetryInfo retry;
    *retry.mutable_retry_delay() = encode_duration(*details.retry_delay);
    pack(kRetryInfoUrl, retry, &status);
  }
  return status.SerializeAsString();
}

std::optional<StatusDetails> decode_status_details(std::string_view bytes) {
  v1::Status status;
  if (!status.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) return std::nullopt;
  StatusDetails details{.code = status.code(),
                        .message = status.message(),
                        .reason = {},
                        .metadata = {},
                        .retry_delay = {}};
  for (const google::protobuf::Any& any : status.details()) {
    if (any.type_url() == kErrorInfoUrl) {
      v1::ErrorInfo info;
      if (!info.ParseFromString(any.value()) || info.domain() != kErrorDomain) continue;
      details.reason = info.reason();
      const std::map<std::string, std::string> sorted(info.metadata().begin(),
                                                      info.metadata().end());
      details.metadata.assign(sorted.begin(), sorted.end());
    } else if (any.type_url() == kRetryInfoUrl) {
      v1::RetryInfo retry;
      if (!retry.ParseFromString(any.value()) || !is_duration(retry.retry_delay())) continue;
      details.retry_delay = std::chrono::nanoseconds(static_cast<std::int64_t>(
          std::clamp(decode_seconds(retry.retry_delay()), 0.0, 1e6) * 1e9));
    }
  }
  return details;
}

}  // namespace meshsmooth::wire
