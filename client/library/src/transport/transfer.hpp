#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "meshsmooth/v1/smoothing.grpc.pb.h"
#include "service_error.hpp"

namespace meshsmooth::client {

/// An array of a job, or the part of it that is still to be sent.
struct ArrayPart {
  v1::ArrayId id;
  std::int64_t offset_bytes;
  std::span<const std::byte> rest;
};

/// A place that client and server both reach, for the arrays of one job after the other: none of
/// them travels in chunks. Given up in the end unless it is `keep`-ed: the server may still write
/// to the place of a job that did not end well.
class Transfer {
 public:
  /// What an array takes at most beyond its bytes.
  static constexpr std::size_t kAlignment = 64;

  Transfer() = default;
  virtual ~Transfer() = default;
  Transfer(const Transfer&) = delete;
  Transfer& operator=(const Transfer&) = delete;

  /// Copies the arrays of a job to the place, but for those that lie there, and leaves room for
  /// those of its result. `positions` stay as they are.
  /// @param parts  the first array is the last; blocks of an array follow without a gap.
  /// @param spec  gets where the arrays lie.
  /// @returns whether there was room.
  [[nodiscard]] virtual bool upload(std::span<const ArrayPart> parts, std::size_t result_bytes,
                                    v1::JobSpec& spec) = 0;
  /// @returns the arrays of the result of the job, one after the other, once its summary is there.
  [[nodiscard]] virtual std::span<const std::byte> download() const = 0;
  /// Has the first bytes of the result be the `positions`.
  virtual void hold_positions(std::size_t bytes) = 0;
  /// Of an earlier result, until the next are held; empty: none.
  [[nodiscard]] virtual std::span<std::byte> positions() const = 0;
  /// Whether the place is lost, or the server asks for it: give it up. Does not wait.
  [[nodiscard]] virtual bool ended() const = 0;
  /// For another job of the client. Afterwards only destruction makes sense.
  virtual void keep() = 0;
};

/// The transfers of one client. Thread-safe.
class Transport {
 public:
  Transport() = default;
  virtual ~Transport() = default;
  Transport(const Transport&) = delete;
  Transport& operator=(const Transport&) = delete;

  /// One for so many bytes; null when there is none now, which has one made.
  [[nodiscard]] virtual std::unique_ptr<Transfer> open(std::size_t bytes) = 0;
  /// Whether the server refused the transfer, not the job.
  [[nodiscard]] virtual bool refused(const ServiceError& error) const = 0;
};

/// To a server, by its address; null where all arrays travel in chunks. The stub must outlive it.
[[nodiscard]] std::unique_ptr<Transport> make_transport(const std::string& target,
                                                        v1::SmoothingService::Stub& stub);

}  // namespace meshsmooth::client
