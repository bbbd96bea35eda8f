#include "lane.hpp"

#include <exception>
#include <utility>

#include "meshsmooth/error.hpp"

namespace meshsmooth::server {

Lane::Lane(std::unique_ptr<Smoother> smoother, JobQueue& queue, std::function<void()> on_broken)
    : smoother_(std::move(smoother)),
      queue_(queue),
      on_broken_(std::move(on_broken)),
      thread_([this] { run(); }) {}

void Lane::join() {
  if (thread_.joinable()) thread_.join();
}

void Lane::run() {
  while (!broken_) {
    const std::shared_ptr<Job> job = queue_.pop();
    if (!job) return;
    busy_ = true;
    run_job(*job);
    busy_ = false;
  }
  on_broken_();
}

void Lane::run_job(Job& job) {
  if (const std::exception_ptr cause = job.stop_cause()) {
    job.end(cause);
    return;
  }
  if (job.request().deadline && Clock::now() >= *job.request().deadline) {
    job.end(std::make_exception_ptr(
        DeadlineExceeded("DEADLINE_IN_QUEUE", "the deadline passed before the job could run")));
    return;
  }
  job.start();
  // No deadline: that of its calls ends them, and the last of them the job.
  const JobControl control{
      .stop = job.stop_token(),
      .finish_early = &job.finish_early_flag(),
      .deadline = {},
      .on_progress = [&job](const Progress& progress) { job.report(progress); }};
  try {
    wire::MeshAssembler& mesh = job.mesh();
    job.finish(
        smoother_->smooth(mesh.topology(), mesh.positions(), job.request().options, control));
  } catch (const DeviceError& error) {
    broken_ = error.fatal();
    job.end(std::current_exception());
  } catch (...) {
    job.end(std::current_exception());
  }
}

}  // namespace meshsmooth::server
