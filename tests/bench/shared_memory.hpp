#pragma once

#include <map>
#include <memory>
#include <string>

#include "meshsmooth/client.hpp"

namespace meshsmooth::bench {

/// The ways of a mesh to a server on this host: over its Unix socket in chunks, and in shared
/// memory.
class SharedMemory {
 public:
  /// `address`: unix:PATH.
  explicit SharedMemory(const std::string& address);
  ~SharedMemory();

  /// Sends the mesh until all ways are open to one of its size.
  void warm_up(Mesh& mesh, const SmoothOptions& options);

  struct Seconds {
    double chunks;  // over the Unix socket
    double copied;  // into a segment and out of it
    double inside;  // arrays that lie in a segment, where the result stays
  };
  /// Of a call each way; needs a mesh that was warmed up.
  [[nodiscard]] Seconds measure(Mesh& mesh, const SmoothOptions& options);

 private:
  class Inside;

  client::Client client_;
  const std::string address_;
  std::map<const Mesh*, std::unique_ptr<Inside>> inside_;
};

}  // namespace meshsmooth::bench
