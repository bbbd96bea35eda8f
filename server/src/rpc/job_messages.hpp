#pragma once

#include "engine.hpp"
#include "job.hpp"
#include "meshsmooth/v1/smoothing.pb.h"

/// What callers are told of a job.
namespace meshsmooth::server {

[[nodiscard]] v1::Progress encode_progress(const JobSnapshot& now, int queue_position);

/// The current state of the job.
[[nodiscard]] v1::Job encode_job(const Job& job, const Engine& engine);

[[nodiscard]] v1::ResultHeader encode_result_header(const Job& job, const JobSnapshot& now,
                                                    bool in_place);

/// The smoother's summary with the server's additions: waiting times, options, version.
[[nodiscard]] v1::Summary encode_job_summary(const Job& job, const JobSnapshot& now);

}  // namespace meshsmooth::server
