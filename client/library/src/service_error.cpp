#include "service_error.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <iterator>
#include <string_view>

#include "wire/status_details.hpp"

namespace meshsmooth::client {
namespace {

/// What must be true of a call besides its status and text.
enum class Condition { none, never_connected, unanswered, cancelled };

/// Calls that fail without a reason, by what is seen of them: not a meshsmooth server ended them,
/// but gRPC or a proxy.
struct Failure {
  std::array<StatusCode, 2> statuses;
  Condition condition;
  int reset;  // error code of an RST_STREAM; -1: any text
  std::array<std::string_view, 3> texts;
  std::string_view hint;
};

#include "failures.inc"

bool contains(std::string_view text, std::string_view word) {
  return !word.empty() && text.find(word) != std::string_view::npos;
}

std::string seconds_text(double seconds) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g s", seconds);
  return text;
}

/// Newer gRPCs put the text in parentheses and more behind it.
bool was_reset(std::string_view text, int code) {
  const std::string words = "error code " + std::to_string(code);
  const std::size_t at = text.find(words);
  if (!contains(text, "RST_STREAM") || at == std::string_view::npos) return false;
  const std::size_t end = at + words.size();
  return end == text.size() || text[end] < '0' || text[end] > '9';
}

bool never_connected(std::string_view text) {
  return std::ranges::any_of(kNeverConnected,
                             [&](std::string_view word) { return contains(text, word); });
}

bool holds(Condition condition, std::string_view text, const CallFacts& facts) {
  switch (condition) {
    case Condition::none:
      return true;
    case Condition::never_connected:
      return never_connected(text);
    case Condition::unanswered:
      return !facts.answered;
    case Condition::cancelled:
      return facts.cancelled_by_caller;
  }
  return false;
}

/// Whether a failed call is one of these.
bool matches(const Failure& failure, StatusCode code, std::string_view text,
             const CallFacts& facts) {
  const bool any_text = failure.reset < 0 && failure.texts.front().empty();
  return std::ranges::find(failure.statuses, code) != failure.statuses.end() &&
         holds(failure.condition, text, facts) &&
         (any_text || (failure.reset >= 0 && was_reset(text, failure.reset)) ||
          std::ranges::any_of(failure.texts,
                              [&](std::string_view word) { return contains(text, word); }));
}

/// What an error that no meshsmooth server sent usually means.
std::string foreign_hint(const grpc::Status& status, const CallFacts& facts) {
  const auto code = static_cast<StatusCode>(status.error_code());
  const auto* const found = std::ranges::find_if(kFailures, [&](const Failure& failure) {
    return matches(failure, code, status.error_message(), facts);
  });
  if (found == std::end(kFailures)) return {};
  constexpr std::string_view kServer = "{server}";
  std::string hint(found->hint);
  if (const std::size_t at = hint.find(kServer); at != std::string::npos) {
    hint.replace(at, kServer.size(), facts.server);
  }
  return hint;
}

/// What a proxy makes of a server that died under a call (HAProxy 2.6 ends the stream without a
/// status, or resets it), and gRPC's server of a call that comes while it shuts down. A server of
/// ours that cancels a job says why.
bool broken_off(const grpc::Status& status) {
  return (status.error_code() == grpc::StatusCode::UNKNOWN &&
          status.error_message().starts_with("Stream removed")) ||
         status.error_code() == grpc::StatusCode::CANCELLED;
}

/// A connection that broke may come back, or another server be behind it; an address where nobody
/// answers does not.
std::optional<std::chrono::nanoseconds> foreign_retry_delay(const grpc::Status& status,
                                                            const CallFacts& facts) {
  const bool broke = status.error_code() == grpc::StatusCode::UNAVAILABLE &&
                     !never_connected(status.error_message());
  if (!broke && (facts.cancelled_by_caller || !broken_off(status))) return std::nullopt;
  return std::chrono::milliseconds(100);
}

std::string foreign_message(const grpc::Status& status, const CallFacts& facts) {
  if (status.error_code() == grpc::StatusCode::DEADLINE_EXCEEDED) {
    return "the call did not end within its " + seconds_text(facts.timeout_seconds);
  }
  if (facts.cancelled_by_caller) return "cancelled";
  return facts.server + ": " +
         (status.error_message().empty() ? "the call failed without a message"
                                         : status.error_message());
}

}  // namespace

ServiceError to_service_error(const grpc::Status& status, const CallFacts& facts) {
  const auto code = static_cast<StatusCode>(status.error_code());
  const auto details = wire::decode_status_details(status.error_details());
  if (!details || details->reason.empty()) {
    return {code,
            {},
            foreign_message(status, facts),
            {},
            foreign_hint(status, facts),
            foreign_retry_delay(status, facts)};
  }
  std::string hint;
  if (details->retry_delay) {
    const double delay = std::chrono::duration<double>(*details->retry_delay).count();
    hint = delay > 0 ? "try again in " + seconds_text(delay) : std::string(kAtOnceHint);
  }
  if (code == StatusCode::unauthenticated) hint = kTokenHint;
  return {code,
          details->reason,
          status.error_message(),
          details->metadata,
          std::move(hint),
          details->retry_delay};
}

ServiceError broken_answer(const std::string& what) {
  return {StatusCode::data_loss, {}, what, {}, std::string(kBrokenAnswerHint)};
}

}  // namespace meshsmooth::client
