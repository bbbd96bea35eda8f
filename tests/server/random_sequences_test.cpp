// Random sequences of calls on one job, compared with a model of what the protocol promises.
// MESHSMOOTH_RANDOM_SEQUENCES=10000 for the long form.
#include <gtest/gtest.h>

#include <cstdlib>
#include <map>
#include <memory>
#include <random>
#include <sstream>

#include "server/attach_call.hpp"
#include "server/conservation.hpp"
#include "server/smooth_call.hpp"
#include "support/in_process_server.hpp"

namespace meshsmooth::testing {
namespace {

using grpc::StatusCode;

std::string reason_of(const grpc::Status& status) {
  return wire::decode_status_details(status.error_details()).value_or(wire::StatusDetails{}).reason;
}

/// One job of one request id, as the protocol has it, beside the same job on a server.
class Model {
 public:
  Model(InProcessServer& server, Stub& stub, unsigned seed)
      : server_(server), stub_(stub), random_(seed), id_(make_id(seed)) {}
  ~Model() {
    server_.fake().release();
    calls_.clear();
    if (!name_.empty()) {
      wait_until_ended();
      delete_job();
    }
  }

  void step() {
    switch (draw(8)) {
      case 0:
      case 1:
        return open();
      case 2:
        return upload();
      case 3:
        return leave();
      case 4:
        return cancel_job(draw(2) == 0);
      case 5:
        return attach();
      case 6:
        return remove();
      case 7:
        return draw(2) == 0 ? hold() : release();
    }
  }

  [[nodiscard]] std::string story() const { return story_.str(); }

 private:
  enum class State { none, receiving, active, kept, gone };
  struct Call {
    std::unique_ptr<SmoothCall> call;
    bool brings_mesh;
  };

  int draw(int count) { return static_cast<int>(random_() % static_cast<unsigned>(count)); }
  static std::string make_id(unsigned seed) {
    char text[37];
    std::snprintf(text, sizeof text, "%08x-0000-4000-8000-000000000000", seed);
    return text;
  }
  void tell(const std::string& what) { story_ << what << "; "; }

  [[nodiscard]] v1::JobSpec spec(bool kept, bool other) const {
    v1::JobSpec spec = TwoTetrahedra::spec();
    spec.set_request_id(id_);
    if (kept) spec.mutable_result_ttl()->set_seconds(1000);
    if (other) spec.mutable_options()->mutable_taubin();
    return spec;
  }
  [[nodiscard]] std::string result() const {
    return early_ ? bytes_of(mesh_.coordinates) : mesh_.moved();
  }

  void open() {
    const bool kept = draw(2) == 0, other = draw(4) == 0;
    tell(std::string("open") + (kept ? " kept" : "") + (other ? " other" : ""));
    auto call = std::make_unique<SmoothCall>(stub_);
    call->send(spec(kept, other));
    const bool joins =
        state_ == State::receiving || state_ == State::active || state_ == State::kept;
    if (joins && (kept != kept_ || other != other_)) {
      EXPECT_EQ(call->finish().error_code(), StatusCode::ALREADY_EXISTS);
      return;
    }
    const std::string name = call->read_accepted();
    if (!joins) {
      EXPECT_NE(name, name_);
      name_ = name;
      state_ = State::receiving;
      kept_ = kept;
      other_ = other;
      early_ = false;
      calls_.push_back({std::move(call), true});
      return;
    }
    EXPECT_EQ(name, name_);
    const auto stop = call->read();
    EXPECT_TRUE(stop && stop->has_stop_sending());
    call->half_close();
    if (state_ == State::kept) {
      expect_result(*call);
    } else {
      calls_.push_back({std::move(call), false});
    }
  }

  void upload() {
    if (state_ != State::receiving) return;
    tell("upload");
    for (Call& c : calls_) {
      if (!c.brings_mesh) continue;
      c.call->send_data(mesh_);
      c.call->half_close();
    }
    state_ = State::active;
    if (!held_ || early_) {
      run_out();
    } else {
      wait_for_state(stub_, name_, v1::STATE_RUNNING);
    }
  }

  void leave() {
    if (calls_.empty()) return;
    tell("leave");
    const auto place = calls_.begin() + draw(static_cast<int>(calls_.size()));
    const bool brings_mesh = place->brings_mesh;
    place->call->cancel();
    place->call->finish();
    calls_.erase(place);
    if (brings_mesh && state_ == State::receiving) {
      for (const Call& c : calls_) {
        EXPECT_EQ(c.call->finish().error_code(), StatusCode::UNAVAILABLE);
        EXPECT_EQ(c.call->details().reason, "UPLOAD_LOST");
      }
      end(v1::STATE_CANCELLED);
    } else if (calls_.empty() && !kept_) {
      end(v1::STATE_CANCELLED);
    }
  }

  void cancel_job(bool result_kept) {
    if (state_ == State::none) return;
    tell(result_kept ? "finish early" : "cancel job");
    grpc::ClientContext context;
    v1::CancelJobRequest request;
    request.set_name(name_);
    request.set_result_kept(result_kept);
    v1::CancelJobResponse response;
    EXPECT_TRUE(stub_.CancelJob(&context, request, &response).ok());
    if (state_ != State::receiving && state_ != State::active) return;
    if (result_kept) {
      early_ = true;
      if (state_ == State::active) run_out();
      return;
    }
    for (const Call& c : calls_) {
      EXPECT_EQ(c.call->finish().error_code(), StatusCode::CANCELLED);
      EXPECT_EQ(c.call->details().reason, "CANCELLED_BY_JOB_CALL");
    }
    end(v1::STATE_CANCELLED);
  }

  void attach() {
    if (state_ == State::none || state_ == State::receiving || state_ == State::active) return;
    const int offset = draw(130);
    tell("attach at " + std::to_string(offset));
    AttachCall call(stub_, name_, offset);
    const grpc::Status& status = call.finish();
    if (offset > 120) {
      EXPECT_EQ(reason_of(status), "RESULT_OFFSET_PAST_END");
    } else if (state_ == State::kept) {
      EXPECT_TRUE(status.ok()) << status.error_message();
      EXPECT_EQ(call.result(), result().substr(static_cast<std::size_t>(offset)));
    } else {
      EXPECT_FALSE(status.ok());
    }
  }

  void remove() {
    if (state_ == State::none) return;
    tell("delete");
    const StatusCode code = delete_job();
    if (state_ == State::receiving || state_ == State::active) {
      EXPECT_EQ(code, StatusCode::FAILED_PRECONDITION);
      return;
    }
    EXPECT_EQ(code, StatusCode::OK);
    state_ = State::none;
    name_.clear();
  }

  void hold() {
    tell("hold");
    server_.fake().hold();
    held_ = true;
  }
  void release() {
    tell("release");
    server_.fake().release();
    held_ = false;
    if (state_ == State::active) run_out();
  }

  // The job runs to its end, and whoever waits has its result.
  void run_out() {
    for (const Call& c : calls_) expect_result(*c.call);
    calls_.clear();
    wait_for_state(stub_, name_, v1::STATE_SUCCEEDED);
    state_ = kept_ ? State::kept : State::gone;
  }
  void end(v1::State state) {
    calls_.clear();
    wait_for_state(stub_, name_, state);
    state_ = State::gone;
  }
  void expect_result(SmoothCall& call) {
    EXPECT_TRUE(call.finish().ok()) << call.finish().error_message();
    EXPECT_EQ(call.result(), result());
  }

  StatusCode delete_job() {
    grpc::ClientContext context;
    v1::DeleteJobRequest request;
    request.set_name(name_);
    v1::DeleteJobResponse response;
    return stub_.DeleteJob(&context, request, &response).error_code();
  }
  void wait_until_ended() {
    for (;;) {
      const v1::State state = get_job(stub_, name_).state();
      if (state >= v1::STATE_SUCCEEDED) return;
      std::this_thread::yield();
    }
  }

  InProcessServer& server_;
  Stub& stub_;
  std::mt19937 random_;
  const std::string id_;
  const TwoTetrahedra mesh_;
  State state_ = State::none;
  std::string name_;
  bool kept_ = false, other_ = false, early_ = false, held_ = false;
  std::vector<Call> calls_;
  std::ostringstream story_;
};

TEST(RandomSequences, AreAnsweredAsTheModelSays) {
  const char* const wanted = std::getenv("MESHSMOOTH_RANDOM_SEQUENCES");
  const unsigned count = wanted == nullptr ? 300 : static_cast<unsigned>(std::atoi(wanted));
  InProcessServer server;
  Stub stub(server.channel());
  expect_healthy_service(stub);
  Conservation conservation(stub);
  for (unsigned seed = 0; seed < count; ++seed) {
    {
      Model model(server, stub, seed);
      for (int i = 0; i < 16 && !::testing::Test::HasFailure(); ++i) model.step();
      ASSERT_FALSE(::testing::Test::HasFailure()) << "seed " << seed << ": " << model.story();
    }
    if (seed % 50 == 0) conservation.check();
  }
  conservation.check();
}

}  // namespace
}  // namespace meshsmooth::testing
