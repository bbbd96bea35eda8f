#pragma once

#include <optional>
#include <stop_token>

#include "meshsmooth.h"
#include "meshsmooth/client.hpp"
#include "structures.hpp"

/// What cancels calls.
struct meshsmooth_cancel {
  std::stop_source source;
};

namespace meshsmooth::c {

/// Connects what accompanies a call of C with its request, while it lives.
class Accompaniment {
 public:
  /// @param given null: nothing does
  Accompaniment(const meshsmooth_call* given, client::RequestOptions& request) {
    if (given == nullptr) return;
    call_ = read_structure(given, "call");
    request.stop = source_.get_token();
    if (call_.cancel != nullptr) {
      stop_by_handle_.emplace(call_.cancel->source.get_token(), Stop{&source_});
    }
    if (call_.on_progress == nullptr) return;
    request.on_progress = [this](const client::JobProgress& progress) { pass_on(progress); };
  }
  Accompaniment(const Accompaniment&) = delete;
  Accompaniment& operator=(const Accompaniment&) = delete;

 private:
  struct Stop {
    std::stop_source* source;
    void operator()() const { source->request_stop(); }
  };

  void pass_on(const client::JobProgress& progress) {
    const meshsmooth_progress shown = {.size = sizeof(meshsmooth_progress),
                                       .state = static_cast<int64_t>(progress.state),
                                       .queue_position = progress.queue_position,
                                       .stage = progress.stage.c_str(),
                                       .iteration = progress.iteration,
                                       .max_displacement = progress.max_displacement,
                                       .rms_displacement = progress.rms_displacement};
    if (call_.on_progress(&shown, call_.user_data) != 0) source_.request_stop();
  }

  meshsmooth_call call_ = {};
  std::stop_source source_;
  std::optional<std::stop_callback<Stop>> stop_by_handle_;  // goes before what it stops
};

}  // namespace meshsmooth::c
