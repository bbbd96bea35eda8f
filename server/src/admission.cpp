#include "admission.hpp"

#include <map>
#include <random>
#include <utility>

#include "meshsmooth/error.hpp"
#include "meshsmooth/staging_memory.hpp"

namespace meshsmooth::server {
namespace {

// Of the memory, for the calls of one caller that attach to jobs.
constexpr double kReadersShare = 1.0 / 16;

std::string random_instance() {
  constexpr char kDigits[] = "0123456789abcdef";
  std::random_device random;
  std::string text(8, '0');
  for (char& digit : text) digit = kDigits[random() % 16];
  return text;
}

// What a stream holds in addition to the mesh: its window, the chunk just read and the one being
// written.
std::int64_t bytes_of_stream(const ServerConfig& config) {
  return Admission::window_bytes(config) + 2 * std::int64_t{config.max_receive_message_bytes};
}

// The same of one that uploads nothing.
std::int64_t bytes_of_reader(const ServerConfig& config) {
  constexpr std::int64_t kRequestBytes = 64 << 10;
  return kRequestBytes + 2 * std::int64_t{config.result_chunk_bytes};
}

// A fraction of all host and device memory.
MemoryEstimate part_of(const MemoryBytes& limit, double fraction) {
  const auto share = [&](std::int64_t bytes) {
    return bytes == INT64_MAX ? bytes
                              : static_cast<std::int64_t>(fraction * static_cast<double>(bytes));
  };
  std::int64_t device_bytes = 0;  // of all devices, unless one of them is the host
  for (const std::int64_t bytes : limit.device_bytes) {
    device_bytes = bytes > INT64_MAX - device_bytes ? INT64_MAX : device_bytes + bytes;
  }
  return {.host_bytes = share(limit.host_bytes), .device_bytes = share(device_bytes)};
}

// The first field in which two requests differ; empty when they are equal.
std::string differing_field(const std::map<std::string, std::string>& a,
                            const std::map<std::string, std::string>& b) {
  for (const auto* from : {&a, &b}) {
    for (const auto& [name, bytes] : *from) {
      const auto* const other = from == &a ? &b : &a;
      const auto found = other->find(name);
      if (found == other->end() || found->second != bytes) return name;
    }
  }
  return {};
}

std::int64_t block_bytes(std::int64_t bytes) {
  return static_cast<std::int64_t>(StagingMemory::block_bytes(static_cast<std::size_t>(bytes)));
}

}  // namespace

Admission::Admission(const ServerConfig& config, const Smoother& smoother, MemoryBudget& budget,
                     TopologyCache& topologies, JobQueue& queue, JobStore& store,
                     std::pmr::memory_resource* memory, Job::EndObserver end_observer)
    : config_(config),
      smoother_(smoother),
      budget_(budget),
      topologies_(topologies),
      queue_(queue),
      store_(store),
      memory_(memory),
      end_observer_(std::move(end_observer)),
      stream_bytes_(bytes_of_stream(config)),
      reader_bytes_(bytes_of_reader(config)),
      instance_(random_instance()),
      uploads_(part_of(budget.limit(), config.max_connection_upload_share)),
      callers_(part_of(budget.limit(), config.max_caller_memory_share),
               "the unfinished jobs of this caller"),
      readers_(part_of(budget.limit(), kReadersShare), "the calls of this caller that attach") {}

// gRPC's flow control lets it grow up to 8 MiB (measured) where it is not set.
std::int64_t Admission::window_bytes(const ServerConfig& config) {
  constexpr std::int64_t kAdaptiveWindowBytes = 8 << 20;
  return config.stream_window_bytes > 0 ? config.stream_window_bytes : kAdaptiveWindowBytes;
}

std::int64_t Admission::topology_bytes(const wire::MeshLayout& layout) {
  return block_bytes(layout.elements_bytes) + block_bytes(layout.fixed_mask_bytes) +
         block_bytes(layout.element_regions_bytes) + block_bytes(layout.kept_reference_bytes);
}

MemoryEstimate Admission::estimate(const JobRequest& request) const {
  const wire::MeshLayout& layout = request.layout;
  const MemoryEstimate own = smoother_.estimate(layout.size(), request.options);
  const MemoryEstimate need{
      .host_bytes = topology_bytes(layout) + block_bytes(layout.coordinates_bytes) +
                    block_bytes(layout.reference_bytes) +
                    block_bytes(layout.prescribed_nodes_bytes()) +
                    block_bytes(layout.prescribed_coordinates_bytes()) +
                    block_bytes(layout.node_pairs_bytes()) +
                    2 * block_bytes(layout.surface_bytes()) +  // as it comes, and as the job has it
                    own.host_bytes + stream_bytes_,
      .device_bytes = own.device_bytes};
  budget_.check_fits(need);
  if (need.host_bytes > config_.max_job_bytes) {
    throw OutOfMemory("MESH_TOO_LARGE",
                      "the job needs " + std::to_string(need.host_bytes) +
                          " bytes, this server gives a job at most " +
                          std::to_string(config_.max_job_bytes),
                      {{"need_bytes", std::to_string(need.host_bytes)},
                       {"limit_bytes", std::to_string(config_.max_job_bytes)}});
  }
  return need;
}

void Admission::check_limits() const {
  JobRequest smallest;  // one tetrahedron
  smallest.layout.node_count = 4;
  smallest.layout.blocks = {{ElementType::tetrahedron, 1}};
  smallest.layout.elements_bytes = 4 * sizeof(NodeId);
  smallest.layout.coordinates_bytes = 4 * sizeof(Vec3d);
  try {
    static_cast<void>(estimate(smallest));
  } catch (const OutOfMemory& error) {
    throw InvalidOption("OPTION_OUT_OF_RANGE",
                        "host-memory-limit-bytes, device-bytes or max-job-bytes: no job fits, not "
                        "even one of four nodes: " +
                            std::string(error.what()),
                        {{"field", "host-memory-limit-bytes"}});
  }
}

Reservation Admission::reserve(MemoryEstimate need, const std::vector<int>& preferred_devices) {
  for (;;) {
    try {
      return budget_.reserve(need, preferred_devices);
    } catch (const OutOfMemory& error) {
      if (error.reason() == "MESH_TOO_LARGE" || !topologies_.evict_one()) throw;
    }
  }
}

Subscription Admission::admit(const JobRequest& request, const Job::Observer& observer) {
  // The second iteration is only needed when another call with this request id was faster.
  for (;;) {
    if (auto joined = join(request, observer)) return std::move(*joined);
    const MemoryEstimate need = estimate(request);
    UploadShare upload = uploads_.take(request.connection, need);
    UploadShare of_caller = callers_.take(request.share, need);
    Reservation reservation =
        reserve(need, request.topology ? request.topology->devices() : std::vector<int>{});
    queue_.check_room(request.share_or_caller(), request.layout.total_bytes());
    Subscription subscription;
    subscription.stream = reservation.split({stream_bytes_, 0});
    const std::int64_t sequence = next_sequence_++;
    subscription.job = std::make_shared<Job>(
        "jobs/" + instance_ + "-" + std::to_string(sequence), sequence, request,
        std::move(reservation),
        block_bytes(request.layout.coordinates_bytes) + request.element_quality_bytes(),
        std::move(upload), memory_, end_observer_);
    subscription.job->count_against(std::move(of_caller));
    subscription.observer_id = subscription.job->observe(observer, request.progress_wanted).value();
    if (store_.add(subscription.job)) return subscription;
  }
}

std::optional<Subscription> Admission::join(const JobRequest& request,
                                            const Job::Observer& observer) {
  const auto job = store_.find_request(request.caller, request.request_id);
  if (!job || !job->joinable()) return std::nullopt;
  if (const std::string field = differing_field(job->request().fields, request.fields);
      !field.empty()) {
    throw Error("REQUEST_ID_REUSED",
                "request_id " + request.request_id + " belongs to " + job->name() +
                    ", whose field " + field + " differs; use a new id for a new job",
                {{"field", field}, {"name", job->name()}});
  }
  UploadShare reader = readers_.take(request.share, {stream_bytes_, 0});
  Subscription subscription{job, 0, true, reserve({stream_bytes_, 0}), std::move(reader)};
  const auto observer_id = job->observe(observer);
  if (!observer_id) return std::nullopt;
  subscription.observer_id = *observer_id;
  return subscription;
}

Subscription Admission::subscribe(const std::shared_ptr<Job>& job, const std::string& share,
                                  const Job::Observer& observer) {
  UploadShare reader = readers_.take(share, {reader_bytes_, 0});
  Subscription subscription{job, 0, true, reserve({reader_bytes_, 0}), std::move(reader)};
  if (const auto observer_id = job->observe(observer)) {
    subscription.observer_id = *observer_id;
    return subscription;
  }
  if (const std::exception_ptr cause = job->stop_cause()) std::rethrow_exception(cause);
  if (const std::exception_ptr error = job->snapshot().error) std::rethrow_exception(error);
  throw Error("RESULT_NOT_KEPT", job->name() + " has ended; its result is no longer kept",
              {{"name", job->name()}});
}

}  // namespace meshsmooth::server
