#include "host_memory.hpp"

#include <malloc.h>
#include <sys/mman.h>

#include <cstddef>
#include <new>

namespace meshsmooth::server {
namespace {

// Mapping a smaller block costs more than keeping it in the heap.
constexpr std::size_t kMinMappedBytes = 1 << 20;

class HostMemory final : public std::pmr::memory_resource {
  void* do_allocate(std::size_t bytes, std::size_t alignment) override {
    if (bytes < kMinMappedBytes) {
      return std::pmr::new_delete_resource()->allocate(bytes, alignment);
    }
    void* data = mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (data == MAP_FAILED) throw std::bad_alloc();
    madvise(data, bytes, MADV_HUGEPAGE);  // only advice: failing is fine
    return data;
  }

  void do_deallocate(void* data, std::size_t bytes, std::size_t alignment) override {
    if (bytes < kMinMappedBytes) {
      std::pmr::new_delete_resource()->deallocate(data, bytes, alignment);
    } else {
      munmap(data, bytes);
    }
  }

  [[nodiscard]] bool do_is_equal(const memory_resource& other) const noexcept override {
    return this == &other;
  }
};

}  // namespace

std::pmr::memory_resource* host_memory() {
  static HostMemory memory;
  return &memory;
}

void keep_heap_warm() {
  mallopt(M_MMAP_THRESHOLD, 32 << 20);  // the maximum of glibc
  // Each arena retains its share.
  constexpr int kArenas = 4;
  mallopt(M_ARENA_MAX, kArenas);
  mallopt(M_TRIM_THRESHOLD, static_cast<int>(kKeptHeapBytes / kArenas));
  mallopt(M_TOP_PAD, 16 << 20);
}

}  // namespace meshsmooth::server
