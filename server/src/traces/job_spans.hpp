#pragma once

#include <functional>
#include <optional>
#include <string>

#include "meshsmooth/trace_settings.hpp"
#include "traces/span.hpp"

namespace meshsmooth::server {

class Job;

/// 16 hex digits, not all 0.
using MakeId = std::function<std::string()>;

/// The spans of a job that has ended: the job, below it `receive`, `queue`, `run` and `send`, below
/// `run` the stages of the pipeline. Of stages only times are known, so they follow each other
/// without gaps. Nothing where the trace is not sampled.
[[nodiscard]] std::optional<JobSpans> make_spans(const Job& job, const TraceSettings& settings,
                                                 const MakeId& make_id);

}  // namespace meshsmooth::server
