#pragma once

#include <cstdint>
#include <exception>
#include <functional>
#include <memory>

#include "engine.hpp"
#include "job.hpp"
#include "meshsmooth/v1/smoothing.pb.h"

namespace meshsmooth::server {

/// How the arrays of one call travel to its job, and those of the result back. Thread-safe.
class Transfer {
 public:
  using Uploaded = std::function<void(std::int64_t bytes, const std::exception_ptr& error)>;
  using Downloaded = std::function<void()>;

  Transfer() = default;
  virtual ~Transfer() = default;
  Transfer(const Transfer&) = delete;
  Transfer& operator=(const Transfer&) = delete;

  /// Whether the arrays stay where caller and server both reach them. Else they travel in chunks of
  /// the call's stream, and there is nothing to `upload` or `download`.
  [[nodiscard]] virtual bool in_place() const = 0;
  /// Whether the server has a copy of its own of all inputs once they are uploaded: the caller
  /// hears of it.
  [[nodiscard]] virtual bool copies_inputs() const = 0;

  /// Completes the mesh of the job, and calls `done` once, by this thread or another. Leaves the
  /// mesh incomplete when the job is asked to stop. `done` must keep this and the job alive.
  /// @returns whether another thread does it.
  virtual bool upload(Job& job, Uploaded done) const = 0;
  /// Brings the result to its place, and calls `done` once, the same way.
  virtual void download(std::shared_ptr<const JobResult> result, Downloaded done) const = 0;
};

/// In the chunks of the stream.
class ChunkTransfer final : public Transfer {
 public:
  [[nodiscard]] bool in_place() const override { return false; }
  [[nodiscard]] bool copies_inputs() const override { return false; }
  bool upload(Job&, Uploaded) const override { return false; }
  void download(std::shared_ptr<const JobResult>, Downloaded) const override {}
};

/// That of a spec whose other fields `job` has. Coordinates that the smoother can read in place
/// are left there. Throws Error (SHARED_MEMORY_NOT_FOUND, SHARED_MEMORY_OUT_OF_RANGE),
/// InvalidOption (OPTION_OUT_OF_RANGE: not the arrays of the job in their order), NotSupported
/// (OPTION_NOT_SUPPORTED).
[[nodiscard]] std::shared_ptr<const Transfer> decode_transfer(const v1::JobSpec& spec,
                                                              Engine& engine, JobRequest& job);
/// Leaves of a spec what defines the job.
void clear_transfer(v1::JobSpec& spec);
/// Adds how arrays can travel.
void encode_transport(const Transport& transport, v1::GetServerInfoResponse& info);

}  // namespace meshsmooth::server
