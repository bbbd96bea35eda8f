#include <dlfcn.h>

#include <cstdlib>
#include <iostream>
#include <memory>
#include <stdexcept>

#include "gpu/peers.hpp"
#include "gpu/sweep_timer.hpp"

#if __has_include(<cusparse.h>)
#include <cusparse.h>
#endif

namespace meshsmooth::bench {
namespace {

// The part of cuSPARSE's C interface that is used, so that neither its headers
// nor its library are needed to build.
constexpr int kNonTranspose = 0;
constexpr int kIndexBaseZero = 0;
constexpr int kIndex32 = 2;
constexpr int kFloat32 = 0;  // CUDA_R_32F
constexpr int kColumnOrder = 1;
constexpr int kRowOrder = 2;

struct Algorithm {
  const char* name;
  int value;
};
constexpr Algorithm kAlgorithms[] = {{"default", 0}, {"ALG1", 4}, {"ALG2", 6}, {"ALG3", 12}};

#if __has_include(<cusparse.h>)
static_assert(kNonTranspose == CUSPARSE_OPERATION_NON_TRANSPOSE);
static_assert(kIndexBaseZero == CUSPARSE_INDEX_BASE_ZERO && kIndex32 == CUSPARSE_INDEX_32I);
static_assert(kFloat32 == CUDA_R_32F);
static_assert(kColumnOrder == CUSPARSE_ORDER_COL && kRowOrder == CUSPARSE_ORDER_ROW);
static_assert(kAlgorithms[0].value == CUSPARSE_SPMM_ALG_DEFAULT);
static_assert(kAlgorithms[1].value == CUSPARSE_SPMM_CSR_ALG1);
static_assert(kAlgorithms[2].value == CUSPARSE_SPMM_CSR_ALG2);
static_assert(kAlgorithms[3].value == CUSPARSE_SPMM_CSR_ALG3);
#endif

using Handle = void*;

/// The library, opened for the rest of the process.
class Cusparse {
 public:
  explicit Cusparse(void* library) {
    load(library, create, "cusparseCreate");
    load(library, destroy, "cusparseDestroy");
    load(library, set_stream, "cusparseSetStream");
    load(library, get_version, "cusparseGetVersion");
    load(library, error_string, "cusparseGetErrorString");
    load(library, create_csr, "cusparseCreateCsr");
    load(library, destroy_sparse, "cusparseDestroySpMat");
    load(library, create_dense, "cusparseCreateDnMat");
    load(library, destroy_dense, "cusparseDestroyDnMat");
    load(library, buffer_size, "cusparseSpMM_bufferSize");
    load(library, preprocess, "cusparseSpMM_preprocess");
    load(library, multiply, "cusparseSpMM");
  }

  void check(int status, const char* what) const {
    if (status != 0) throw std::runtime_error(std::string(what) + ": " + error_string(status));
  }

  int (*create)(Handle*) = nullptr;
  int (*destroy)(Handle) = nullptr;
  int (*set_stream)(Handle, cudaStream_t) = nullptr;
  int (*get_version)(Handle, int*) = nullptr;
  const char* (*error_string)(int) = nullptr;
  int (*create_csr)(Handle*, std::int64_t rows, std::int64_t columns, std::int64_t entries,
                    void* row_starts, void* column_ids, void* values, int start_type, int id_type,
                    int base, int value_type) = nullptr;
  int (*destroy_sparse)(Handle) = nullptr;
  int (*create_dense)(Handle*, std::int64_t rows, std::int64_t columns, std::int64_t stride,
                      void* values, int value_type, int order) = nullptr;
  int (*destroy_dense)(Handle) = nullptr;
  int (*buffer_size)(Handle, int op_a, int op_b, const void* alpha, Handle a, Handle b,
                     const void* beta, Handle c, int type, int algorithm,
                     std::size_t* bytes) = nullptr;
  int (*preprocess)(Handle, int op_a, int op_b, const void* alpha, Handle a, Handle b,
                    const void* beta, Handle c, int type, int algorithm, void* buffer) = nullptr;
  int (*multiply)(Handle, int op_a, int op_b, const void* alpha, Handle a, Handle b,
                  const void* beta, Handle c, int type, int algorithm, void* buffer) = nullptr;

 private:
  template <class Function>
  static void load(void* library, Function& function, const char* name) {
    function = reinterpret_cast<Function>(dlsym(library, name));
    if (function == nullptr) throw std::runtime_error(std::string("libcusparse has no ") + name);
  }
};

using Owner = std::unique_ptr<void, int (*)(Handle)>;

/// Row n holds the shares that the ring of n has in its mean.
struct Matrix {
  std::vector<std::int32_t> starts = {0};
  std::vector<NodeId> columns;
  std::vector<float> values;
};

Matrix make_matrix(const HostTopology& topology) {
  Matrix matrix;
  for (std::size_t node = 0; node < topology.rings.node_count(); ++node) {
    const auto ring = topology.rings.of(node);
    if (topology.boundary[node] != 0 || ring.empty()) {
      matrix.columns.push_back(static_cast<NodeId>(node));
      matrix.values.push_back(1);
    } else {
      matrix.columns.insert(matrix.columns.end(), ring.begin(), ring.end());
      matrix.values.insert(matrix.values.end(), ring.size(),
                           1.0F / static_cast<float>(ring.size()));
    }
    matrix.starts.push_back(static_cast<std::int32_t>(matrix.columns.size()));
  }
  return matrix;
}

class Measurement {
 public:
  Measurement(const Cusparse& library, const PeerInput& input)
      : library_(library),
        input_(input),
        node_count_(input.positions.size()),
        heap_(Memory::plain, stream_),
        handle_(make_handle()) {
    const Matrix matrix = make_matrix(input.topology);
    starts_ = uploaded(matrix.starts);
    columns_ = uploaded(matrix.columns);
    values_ = uploaded(matrix.values);
    stream_.synchronize();
  }

  [[nodiscard]] int version() const {
    int version = 0;
    library_.check(library_.get_version(handle_.get(), &version), "asking for the version");
    return version;
  }

  PeerSweep measure(int order, const Algorithm& algorithm) {
    PeerSweep result;
    result.name = std::string("cuSPARSE SpMM ") +
                  (order == kRowOrder ? "row-major " : "column-major ") + algorithm.name;
    try {
      run(order, algorithm.value, result);
    } catch (const std::runtime_error& error) {
      result.skipped = error.what();
    }
    return result;
  }

 private:
  Owner make_handle() const {
    Handle handle = nullptr;
    library_.check(library_.create(&handle), "making a cuSPARSE handle");
    Owner owner(handle, library_.destroy);
    library_.check(library_.set_stream(handle, stream_.get()), "giving cuSPARSE a stream");
    return owner;
  }

  template <class T>
  DeviceArray<T> uploaded(const std::vector<T>& values) {
    DeviceArray<T> array(heap_, values.size());
    array.upload(values.data());
    return array;
  }

  /// A descriptor of its own for every case: cuSPARSE keeps what it found out
  /// about a matrix in there.
  Owner sparse() {
    Handle matrix = nullptr;
    const auto n = static_cast<std::int64_t>(node_count_);
    library_.check(library_.create_csr(&matrix, n, n, static_cast<std::int64_t>(values_.size()),
                                       starts_.data(), columns_.data(), values_.data(), kIndex32,
                                       kIndex32, kIndexBaseZero, kFloat32),
                   "describing the matrix");
    return {matrix, library_.destroy_sparse};
  }

  Owner dense(DeviceArray<float>& values, int order) {
    Handle matrix = nullptr;
    const auto n = static_cast<std::int64_t>(node_count_);
    library_.check(library_.create_dense(&matrix, n, 3, order == kRowOrder ? 3 : n, values.data(),
                                         kFloat32, order),
                   "describing the positions");
    return {matrix, library_.destroy_dense};
  }

  void run(int order, int algorithm, PeerSweep& result) {
    const Layout layout = order == kRowOrder ? Layout::aos : Layout::soa;
    std::vector<float> packed(3 * node_count_);
    for (std::size_t node = 0; node < node_count_; ++node) {
      const Vec3f place = input_.positions[node];
      packed[float_index(layout, node_count_, node, 0)] = place.x;
      packed[float_index(layout, node_count_, node, 1)] = place.y;
      packed[float_index(layout, node_count_, node, 2)] = place.z;
    }
    DeviceArray<float> first = uploaded(packed);
    DeviceArray<float> second(heap_, packed.size());
    const Owner a = sparse(), x = dense(first, order), y = dense(second, order);
    const float one = 1, zero = 0;
    std::size_t bytes = 0;
    library_.check(library_.buffer_size(handle_.get(), kNonTranspose, kNonTranspose, &one, a.get(),
                                        x.get(), &zero, y.get(), kFloat32, algorithm, &bytes),
                   "sizing the buffer");
    DeviceArray<char> buffer(heap_, bytes);
    // It only makes some algorithms faster; others do not have it.
    static_cast<void>(library_.preprocess(handle_.get(), kNonTranspose, kNonTranspose, &one,
                                          a.get(), x.get(), &zero, y.get(), kFloat32, algorithm,
                                          buffer.data()));
    const auto sweep = [&](const Owner& from, const Owner& to) {
      library_.check(
          library_.multiply(handle_.get(), kNonTranspose, kNonTranspose, &one, a.get(), from.get(),
                            &zero, to.get(), kFloat32, algorithm, buffer.data()),
          "multiplying");
    };

    static_assert(kCheckedSweeps == 2);
    sweep(x, y);
    sweep(y, x);
    first.download(packed.data());
    stream_.synchronize();
    std::vector<Vec3f> found(node_count_);
    for (std::size_t node = 0; node < node_count_; ++node) {
      found[node] = {packed[float_index(layout, node_count_, node, 0)],
                     packed[float_index(layout, node_count_, node, 1)],
                     packed[float_index(layout, node_count_, node, 2)]};
    }
    result.largest_difference = largest_difference(found, input_.expected);

    const int sweeps = timed_sweeps(node_count_);
    const double milliseconds = quickest_milliseconds(stream_, input_.repeats, [&] {
      for (int pair = 0; pair < sweeps / 2; ++pair) {
        sweep(x, y);
        sweep(y, x);
      }
    });
    result.microseconds = 1000 * milliseconds / sweeps;
  }

  const Cusparse& library_;
  const PeerInput& input_;
  std::size_t node_count_;
  Stream stream_;
  DeviceHeap heap_;
  Owner handle_;
  DeviceArray<std::int32_t> starts_;
  DeviceArray<NodeId> columns_;
  DeviceArray<float> values_;
};

void* open_library() {
  const char* const named = std::getenv("MESHSMOOTH_CUSPARSE");
  for (const char* const name : {named, "libcusparse.so.12"}) {
    if (name == nullptr) continue;
    void* const library = dlopen(name, RTLD_NOW | RTLD_LOCAL);
    if (library != nullptr) return library;
    std::cerr << "SKIPPED cuSPARSE as " << name << ": " << dlerror() << '\n';
  }
  std::cerr << "SKIPPED cuSPARSE: the comparison with it is missing from this run; "
               "MESHSMOOTH_CUSPARSE names its library"
            << std::endl;
  return nullptr;
}

}  // namespace

std::vector<PeerSweep> measure_cusparse(const PeerInput& input) {
  void* const opened = open_library();
  if (opened == nullptr) return {};
  const Cusparse library(opened);
  Measurement measurement(library, input);
  std::cerr << "cuSPARSE " << measurement.version() << std::endl;
  std::vector<PeerSweep> sweeps;
  for (const int order : {kColumnOrder, kRowOrder}) {
    for (const Algorithm& algorithm : kAlgorithms) {
      sweeps.push_back(measurement.measure(order, algorithm));
      if (!sweeps.back().skipped.empty()) {
        std::cerr << "SKIPPED " << sweeps.back().name << ": " << sweeps.back().skipped << std::endl;
      }
    }
  }
  return sweeps;
}

}  // namespace meshsmooth::bench
