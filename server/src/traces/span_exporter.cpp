#include "traces/span_exporter.hpp"

#include <httplib.h>

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <exception>
#include <optional>
#include <utility>

#include "log.hpp"
#include "traces/job_spans.hpp"

namespace meshsmooth::server {
namespace {

constexpr auto kLastTimeout = std::chrono::milliseconds(500);
constexpr auto kConnectTimeout = std::chrono::milliseconds(1000);

std::mt19937_64 seeded() {
  std::random_device device;
  std::seed_seq seed{device(), device(), device(), device()};
  return std::mt19937_64(seed);
}

}  // namespace

SpanExporter::SpanExporter(TraceSettings settings)
    : settings_(std::move(settings)), random_(seeded()) {
  if (settings_.endpoint.empty()) return;
  const std::size_t slash = settings_.endpoint.find('/', settings_.endpoint.find("://") + 3);
  host_ = settings_.endpoint.substr(0, slash);
  path_ = slash == std::string::npos ? "/" : settings_.endpoint.substr(slash);
  thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
}

SpanExporter::~SpanExporter() { close(); }

void SpanExporter::close() {
  if (!thread_.joinable()) return;
  thread_.request_stop();
  std::unique_lock lock(mutex_);
  wake_.wait_for(lock, kLastTimeout, [this] { return closed_; });
}

std::string SpanExporter::make_id() {
  std::uint64_t id = 0;
  while (id == 0) id = random_();
  return fmt::format("{:016x}", id);
}

void SpanExporter::add(const Job& ended) noexcept try {
  if (settings_.endpoint.empty()) return;
  const std::lock_guard lock(mutex_);
  std::optional<JobSpans> job = make_spans(ended, settings_, [this] { return make_id(); });
  if (!job) return;
  if (waiting_spans_ + job->spans.size() > settings_.max_queued_spans) {
    counts_.dropped += static_cast<std::int64_t>(job->spans.size());
    return;
  }
  waiting_spans_ += job->spans.size();
  waiting_.push_back(std::move(*job));
  if (waiting_spans_ >= settings_.max_batch_spans) wake_.notify_one();
} catch (const std::exception& error) {
  log_error("trace_lost", error.what());
}

SpanExporter::Counts SpanExporter::counts() const {
  const std::lock_guard lock(mutex_);
  return counts_;
}

std::vector<JobSpans> SpanExporter::take_batch() {
  std::vector<JobSpans> batch;
  for (std::size_t size = 0; !waiting_.empty() && size < settings_.max_batch_spans;) {
    size += waiting_.front().spans.size();
    waiting_spans_ -= waiting_.front().spans.size();
    batch.push_back(std::move(waiting_.front()));
    waiting_.pop_front();
  }
  return batch;
}

SpanExporter::Answer SpanExporter::send(const std::vector<JobSpans>& batch,
                                        std::chrono::milliseconds timeout) const {
  httplib::Client client(host_);
  client.set_connection_timeout(std::min(timeout, kConnectTimeout));
  client.set_read_timeout(timeout);
  client.set_write_timeout(timeout);
  const httplib::Headers headers(settings_.headers.begin(), settings_.headers.end());
  const httplib::Result result =
      client.Post(path_, headers, to_otlp_json(batch, settings_.resource), "application/json");
  if (!result) return Answer::none;
  constexpr int kTooMany = 429, kServerErrors = 500;
  if (result->status == kTooMany || result->status >= kServerErrors) return Answer::none;
  return result->status / 100 == 2 ? Answer::taken : Answer::refused;
}

void SpanExporter::finish_batch(std::vector<JobSpans> batch, Answer answer) {
  std::unique_lock lock(mutex_);
  for (auto job = batch.rbegin(); job != batch.rend(); ++job) {
    const std::size_t size = job->spans.size();
    if (answer == Answer::none && waiting_spans_ + size <= settings_.max_queued_spans) {
      waiting_spans_ += size;
      waiting_.push_front(std::move(*job));
    } else {
      (answer == Answer::taken ? counts_.sent : counts_.dropped) += static_cast<std::int64_t>(size);
    }
  }
  const bool was_told = std::exchange(told_, answer != Answer::taken);
  lock.unlock();
  if (answer == Answer::taken || was_told) return;
  log_warning("traces_not_taken", answer == Answer::none ? host_ + " does not answer"
                                                         : host_ + " refuses the spans of jobs");
}

void SpanExporter::run(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  while (!stop.stop_requested()) {
    wake_.wait_for(lock, stop, settings_.delay,
                   [this] { return waiting_spans_ >= settings_.max_batch_spans && !told_; });
    const bool last = stop.stop_requested();
    Answer answer = Answer::taken;
    while (!waiting_.empty() && answer != Answer::none) {
      std::vector<JobSpans> batch = take_batch();
      lock.unlock();
      answer = send(batch, last ? std::min(kLastTimeout, settings_.timeout) : settings_.timeout);
      finish_batch(std::move(batch), answer);
      lock.lock();
    }
  }
  counts_.dropped += static_cast<std::int64_t>(waiting_spans_);
  closed_ = true;
  wake_.notify_all();
}

}  // namespace meshsmooth::server
