#include "report.hpp"

#include <algorithm>
#include <cctype>
#include <utility>

#include "service_error.hpp"
#include "wire/codec.hpp"

namespace meshsmooth::client {

JobProgress decode_progress(const v1::Progress& message) {
  JobProgress progress;
  progress.state = wire::decode_state(message.state());
  progress.queue_position = message.queue_position();
  if (message.stage() != v1::STAGE_UNSPECIFIED && v1::Stage_IsValid(message.stage())) {
    progress.stage = v1::Stage_Name(message.stage()).substr(std::string("STAGE_").size());
    std::transform(progress.stage.begin(), progress.stage.end(), progress.stage.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  }
  progress.iteration = message.iteration();
  progress.max_displacement = message.max_displacement();
  progress.rms_displacement = message.rms_displacement();
  return progress;
}

std::string SmoothReport::to_json() const { return message ? wire::to_json(*message) : "{}"; }

SmoothReport decode_report(v1::Summary summary_message, const std::string& job_name,
                           const std::string& request_id) {
  SmoothReport report;
  report.message = std::make_shared<const v1::Summary>(std::move(summary_message));
  const v1::Summary& summary = *report.message;
  if (!wire::has_json(summary)) {
    throw broken_answer("cannot decode the summary: invalid duration");
  }
  try {
    report.summary = wire::decode_summary(summary);
    report.queue_seconds = wire::decode_seconds(summary.timings().queue());
    report.receive_seconds = wire::decode_seconds(summary.timings().receive());
    report.send_seconds = wire::decode_seconds(summary.timings().send());
  } catch (const Error& error) {
    throw broken_answer("cannot decode the summary: " + std::string(error.what()));
  }
  report.job_name = job_name;
  report.request_id = request_id;
  report.topology_reused = summary.execution().topology_reused();
  report.server_version = summary.execution().server_version();
  return report;
}

}  // namespace meshsmooth::client
