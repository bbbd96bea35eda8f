// Specs and chunks of an upload against a plain model of what an upload may be.
#include <memory_resource>
#include <optional>
#include <vector>

#include "fuzz/choices.hpp"
#include "meshsmooth/error.hpp"
#include "wire/crc32c.hpp"
#include "wire/mesh_assembler.hpp"

namespace {

using namespace meshsmooth;
using meshsmooth::testing::Choices;
using meshsmooth::testing::require;

/// Counts what is allocated, for it must be what was announced.
class CountingMemory final : public std::pmr::memory_resource {
 public:
  std::size_t living_bytes = 0;

 private:
  void* do_allocate(std::size_t bytes, std::size_t alignment) override {
    living_bytes += bytes;
    return std::pmr::new_delete_resource()->allocate(bytes, alignment);
  }
  void do_deallocate(void* place, std::size_t bytes, std::size_t alignment) override {
    living_bytes -= bytes;
    std::pmr::new_delete_resource()->deallocate(place, bytes, alignment);
  }
  [[nodiscard]] bool do_is_equal(const memory_resource& other) const noexcept override {
    return this == &other;
  }
};

v1::TopologySpec make_spec(Choices& choices) {
  v1::TopologySpec spec;
  spec.set_node_count(choices.number());
  for (std::size_t left = choices.below(4); left > 0; --left) {
    v1::ElementBlock* block = spec.add_element_blocks();
    block->set_element_type(static_cast<v1::ElementType>(choices.below(8)));
    block->set_element_count(choices.number());
  }
  spec.set_fixed_mask_present(choices.flag());
  spec.set_element_regions_present(choices.flag());
  return spec;
}

/// The upload as one would write it down: four arrays one after the other.
class Model {
 public:
  explicit Model(const wire::MeshLayout& layout)
      : sizes_{layout.elements_bytes, layout.fixed_mask_bytes, layout.element_regions_bytes,
               layout.coordinates_bytes} {
    skip();
  }

  [[nodiscard]] bool complete() const { return array_ == 4; }
  [[nodiscard]] v1::ArrayId array() const {
    static constexpr v1::ArrayId kIds[] = {v1::ARRAY_ID_ELEMENTS, v1::ARRAY_ID_FIXED_MASK,
                                           v1::ARRAY_ID_ELEMENT_REGIONS, v1::ARRAY_ID_COORDINATES};
    return complete() ? v1::ARRAY_ID_COORDINATES : kIds[array_];
  }
  [[nodiscard]] std::int64_t offset() const { return complete() ? sizes_[3] : offset_; }
  [[nodiscard]] std::int64_t left() const { return complete() ? 0 : sizes_[array_] - offset_; }
  [[nodiscard]] bool takes(const v1::Chunk& chunk) const {
    const std::string& data = chunk.data();
    return !complete() && chunk.array_id() == array() && chunk.offset_bytes() == offset_ &&
           static_cast<std::int64_t>(data.size()) <= left() &&
           (!chunk.has_crc32c() ||
            chunk.crc32c() == wire::crc32c(std::as_bytes(std::span(data.data(), data.size()))));
  }
  void take(const v1::Chunk& chunk) {
    offset_ += static_cast<std::int64_t>(chunk.data().size());
    bytes_ += chunk.data();
    skip();
  }
  [[nodiscard]] const std::string& bytes() const { return bytes_; }

 private:
  void skip() {
    while (array_ < 4 && offset_ == sizes_[array_]) {
      ++array_;
      offset_ = 0;
    }
  }

  const std::array<std::int64_t, 4> sizes_;
  std::size_t array_ = 0;
  std::int64_t offset_ = 0;
  std::string bytes_;
};

v1::Chunk make_chunk(Choices& choices, const Model& model) {
  v1::Chunk chunk;
  const std::uint8_t kind = choices.byte();
  chunk.set_array_id((kind & 7) == 1 ? static_cast<v1::ArrayId>(choices.number()) : model.array());
  chunk.set_offset_bytes((kind & 7) == 2 ? choices.number() : model.offset());
  std::string data = choices.text(200);
  if ((kind & 7) != 3) {  // as much as fits
    data.resize(std::min(data.size(), static_cast<std::size_t>(model.left())));
  }
  if ((kind & 8) != 0) {
    chunk.set_crc32c((kind & 16) != 0 ? static_cast<std::uint32_t>(choices.number())
                                      : wire::crc32c(std::as_bytes(std::span(data))));
  }
  chunk.set_data(std::move(data));
  return chunk;
}

void check_complete(wire::MeshAssembler& assembler, const Model& model, bool named) {
  assembler.finish();
  const TopologyView topology = assembler.topology();
  std::string arrays;
  const auto append = [&](std::span<const std::byte> bytes) {
    arrays.append(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  };
  for (const ElementBlockView& block : topology.blocks) append(std::as_bytes(block.nodes));
  append(std::as_bytes(topology.fixed));
  append(std::as_bytes(topology.regions));
  append(assembler.coordinate_bytes());
  require(arrays == model.bytes(), "the arrays are what was sent");
  if (named) {
    require(assembler.topology_name() == wire::topology_name(topology),
            "the name by pieces is that of the whole");
  }
  try {  // what the arrays say is for core
    validate(topology, as_view(assembler.positions()));
  } catch (const Error&) {
  }
}

void upload(Choices& choices, const wire::MeshLayout& layout, CountingMemory& memory) {
  wire::MeshAssembler assembler(layout, &memory);
  require(memory.living_bytes == static_cast<std::size_t>(layout.total_bytes()),
          "as much is allocated as was announced");
  const bool named = choices.flag();
  if (named) assembler.name_topology();
  Model model(layout);
  while (!choices.empty()) {
    const v1::Chunk chunk = make_chunk(choices, model);
    const bool welcome = model.takes(chunk);
    try {
      assembler.add(chunk);
    } catch (const InvalidMesh& error) {
      require(!welcome, error.what());
      return;
    }
    require(welcome, "a chunk was taken that does not fit");
    model.take(chunk);
    require(assembler.received_bytes() == static_cast<std::int64_t>(model.bytes().size()),
            "the received bytes are counted");
    require(assembler.complete() == model.complete(), "complete when all has come");
  }
  if (model.complete()) {
    check_complete(assembler, model, named);
  } else {
    try {
      assembler.finish();
      require(false, "an upload that ends early was called complete");
    } catch (const InvalidMesh&) {
    }
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Choices choices({data, size});
  const v1::TopologySpec spec = make_spec(choices);
  const auto type = static_cast<v1::ScalarType>(choices.below(4));
  std::optional<wire::MeshLayout> layout;
  try {
    layout = wire::decode_layout(spec, type, {.max_mesh_bytes = 1 << 14});
  } catch (const Error&) {
    return 0;
  }
  CountingMemory memory;
  upload(choices, *layout, memory);
  require(memory.living_bytes == 0, "all memory came back");
  return 0;
}
