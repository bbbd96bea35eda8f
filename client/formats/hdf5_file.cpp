#include "hdf5_file.hpp"

#include <hdf5.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "readers.hpp"
#include "text.hpp"

namespace meshsmooth::formats {
namespace {

/// What one of HDF5's ids stands for; negative: nothing.
class Handle {
 public:
  Handle(hid_t id, herr_t (*close)(hid_t)) : id_(id), close_(close) {}
  ~Handle() {
    if (id_ >= 0) close_(id_);
  }
  Handle(Handle&& other) noexcept : id_(std::exchange(other.id_, -1)), close_(other.close_) {}
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
  Handle& operator=(Handle&&) = delete;
  operator hid_t() const { return id_; }

 private:
  hid_t id_;
  herr_t (*close_)(hid_t);
};

/// The cause of the last call's failure.
struct Cause {
  std::string text = "unknown error";
  bool truncated = false;
};

Cause last_cause() {
  Cause cause;
  H5Ewalk2(
      H5E_DEFAULT, H5E_WALK_DOWNWARD,
      [](unsigned, const H5E_error2_t* error, void* data) -> herr_t {
        auto& found = *static_cast<Cause*>(data);
        if (error->desc != nullptr) found.text = error->desc;
        if (error->min_num == H5E_TRUNCATED) found.truncated = true;
        return 0;
      },
      &cause);
  return cause;
}

herr_t refuse_external_link(const char*, const char*, const char*, const char*, unsigned*, hid_t,
                            void*) {
  return -1;
}

herr_t add_name(hid_t, const char* name, const H5L_info_t*, void* names) {
  try {
    static_cast<std::vector<std::string>*>(names)->emplace_back(name);
  } catch (...) {
    return -1;
  }
  return 0;
}

bool has_own_data(hid_t dataset) {
  const Handle creation(H5Dget_create_plist(dataset), H5Pclose);
  return creation >= 0 && H5Pget_layout(creation) != H5D_VIRTUAL &&
         H5Pget_external_count(creation) == 0;
}

/// Stops at a link that leads to another file, or to a dataset that does.
herr_t find_other_file(hid_t group, const char* name, const H5L_info_t* link, void*) {
  if (link->type == H5L_TYPE_SOFT) return 0;  // to what has a link of its own
  if (link->type != H5L_TYPE_HARD) return 1;
  const Handle object(H5Oopen(group, name, H5P_DEFAULT), H5Oclose);
  if (object < 0) return -1;
  return H5Iget_type(object) == H5I_DATASET && !has_own_data(object) ? 1 : 0;
}

/// HDF5 tries again at the program's end to write what a full disk did not take, and crashes. All
/// files are closed here, with their errors heard.
[[maybe_unused]] const herr_t kWithoutExitHandler = H5dont_atexit();

/// Deflate makes 1032 bytes of one at most.
constexpr std::size_t kHighestCompression = 1100;

}  // namespace

class Hdf5File::Impl {
 public:
  Impl(std::filesystem::path path, std::size_t size, const std::string* bytes)
      : path_(std::move(path)), size_(size) {
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);  // errors are for our messages, not the terminal
    H5Pset_elink_cb(links_, refuse_external_link, nullptr);
    const Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
    H5Pset_fclose_degree(access, H5F_CLOSE_STRONG);
    if (bytes != nullptr) {
      H5Pset_fapl_core(access, std::size_t{1} << 20, 0);
      H5Pset_file_image(access, const_cast<char*>(bytes->data()), bytes->size());
      // HDF5 wants a name for it that no file has.
      file_ = H5Fopen((path_ / "in memory").c_str(), H5F_ACC_RDONLY, access);
    } else {
      file_ = H5Fopen(path_.c_str(), H5F_ACC_RDWR, access);
    }
    if (file_ >= 0) return;
    const Cause cause = last_cause();
    formats::fail(cause.truncated ? "FILE_TRUNCATED" : "FORMAT_ERROR", path_,
                  "HDF5 cannot open it: " + cause.text);
  }
  ~Impl() {
    if (file_ >= 0) H5Fclose(file_);
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  [[noreturn]] void fail(const std::string& what) const {
    formats::fail("FORMAT_ERROR", path_, what);
  }
  [[noreturn]] void fail_by_cause(const std::string& what) const {
    fail(what + ": " + last_cause().text);
  }

  void close() {
    if (H5Fclose(std::exchange(file_, -1)) < 0) {
      formats::fail("FILE_NOT_WRITABLE", path_, "HDF5 cannot write it: " + last_cause().text);
    }
  }
  [[nodiscard]] Handle find(const std::string& object) const {
    return {H5Oopen(file_, object.c_str(), links_), H5Oclose};
  }
  [[nodiscard]] Handle open(const std::string& object) const {
    Handle found = find(object);
    if (found < 0) fail("there is no \"" + object + "\" (links to other files are not followed)");
    return found;
  }
  /// One whose data are in this file.
  [[nodiscard]] Handle open_dataset(const std::string& name) const {
    Handle dataset = open(name);
    if (H5Iget_type(dataset) != H5I_DATASET) fail("\"" + name + "\" is no dataset");
    if (!has_own_data(dataset)) fail("the data of \"" + name + "\" are in another file");
    return dataset;
  }
  [[nodiscard]] Handle type_of(const Handle& dataset, const std::string& name) const {
    Handle type(H5Dget_type(dataset), H5Tclose);
    if (type < 0) fail_by_cause("the dataset \"" + name + "\" has no type");
    return type;
  }
  [[nodiscard]] std::vector<std::size_t> shape_of(const Handle& dataset,
                                                  const std::string& name) const {
    const Handle space(H5Dget_space(dataset), H5Sclose);
    if (space < 0 || H5Sget_simple_extent_ndims(space) < 0) {
      fail_by_cause("the dataset \"" + name + "\" has no size");
    }
    if (H5Sget_simple_extent_type(space) == H5S_NULL) return {0};
    std::vector<hsize_t> sizes(static_cast<std::size_t>(H5Sget_simple_extent_ndims(space)));
    if (!sizes.empty()) H5Sget_simple_extent_dims(space, sizes.data(), nullptr);
    return {sizes.begin(), sizes.end()};
  }
  /// Checks before anything of this size is allocated.
  [[nodiscard]] std::size_t count_of(const Handle& dataset, const std::string& name,
                                     std::size_t element_size) const {
    const std::size_t most = size_ * kHighestCompression / std::max<std::size_t>(element_size, 1);
    std::size_t count = 1;
    for (const std::size_t size : shape_of(dataset, name)) {
      if (size != 0 && count > most / size) {
        fail("the dataset \"" + name + "\" has more values than the file can hold");
      }
      count *= size;
    }
    return count;
  }
  template <class T>
  [[nodiscard]] std::vector<T> read(const std::string& name, hid_t memory_type) const {
    const Handle dataset = open_dataset(name);
    const Handle type = type_of(dataset, name);
    const H5T_class_t kind = H5Tget_class(type);
    const bool whole = std::numeric_limits<T>::is_integer;
    if (kind != H5T_INTEGER && (whole || kind != H5T_FLOAT)) {
      fail("the dataset \"" + name + "\" does not hold " + (whole ? "whole numbers" : "numbers"));
    }
    std::vector<T> values(count_of(dataset, name, H5Tget_size(type)));
    if (!values.empty() &&
        H5Dread(dataset, memory_type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) < 0) {
      fail_by_cause("cannot read the dataset \"" + name + "\"");
    }
    return values;
  }

 private:
  std::filesystem::path path_;
  std::size_t size_;
  Handle links_ = {H5Pcreate(H5P_LINK_ACCESS), H5Pclose};
  hid_t file_ = -1;
};

Hdf5File::Hdf5File(std::filesystem::path path) {
  const auto size = static_cast<std::size_t>(std::filesystem::file_size(path));
  impl_ = std::make_unique<Impl>(std::move(path), size, nullptr);
}
Hdf5File::Hdf5File(std::filesystem::path path, const std::string& bytes)
    : impl_(std::make_unique<Impl>(std::move(path), bytes.size(), &bytes)) {}
Hdf5File::~Hdf5File() = default;

void Hdf5File::fail(const std::string& what) const { impl_->fail(what); }

bool Hdf5File::has(const std::string& object) const { return impl_->find(object) >= 0; }

std::vector<std::string> Hdf5File::children(const std::string& group) const {
  const Handle parent = impl_->open(group);
  std::vector<std::string> names;
  if (H5Iget_type(parent) != H5I_GROUP) impl_->fail("\"" + group + "\" is no group");
  // In any other order HDF5 1.10 makes a table, and frees what is not in it where a file is
  // damaged.
  if (H5Literate(parent, H5_INDEX_NAME, H5_ITER_NATIVE, nullptr, add_name, &names) < 0) {
    impl_->fail_by_cause("cannot list the group \"" + group + "\"");
  }
  std::ranges::sort(names);
  return names;
}

void Hdf5File::check_own_data() const {
  const Handle root = impl_->open("/");
  const herr_t found = H5Lvisit(root, H5_INDEX_NAME, H5_ITER_NATIVE, find_other_file, nullptr);
  if (found < 0) impl_->fail_by_cause("cannot list its objects");
  if (found > 0) impl_->fail("some of its data are in another file");
}

std::vector<double> Hdf5File::reals(const std::string& dataset) const {
  return impl_->read<double>(dataset, H5T_NATIVE_DOUBLE);
}

std::vector<std::int64_t> Hdf5File::integers(const std::string& dataset) const {
  return impl_->read<std::int64_t>(dataset, H5T_NATIVE_INT64);
}

std::string Hdf5File::text(const std::string& dataset) const {
  const Handle data = impl_->open_dataset(dataset);
  const Handle type = impl_->type_of(data, dataset);
  const H5T_class_t kind = H5Tget_class(type);
  const Handle base(kind == H5T_ARRAY ? H5Tget_super(type) : H5Tcopy(type), H5Tclose);
  const bool characters = H5Tget_class(base) == H5T_INTEGER && H5Tget_size(base) == 1;
  const bool strings = H5Tget_class(base) == H5T_STRING && H5Tis_variable_str(base) == 0;
  if (!characters && !strings) impl_->fail("the dataset \"" + dataset + "\" holds no text");
  const std::size_t width = H5Tget_size(type);
  std::string bytes(impl_->count_of(data, dataset, width) * width, '\0');
  if (!bytes.empty() && H5Dread(data, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, bytes.data()) < 0) {
    impl_->fail_by_cause("cannot read the dataset \"" + dataset + "\"");
  }
  return bytes;
}

bool Hdf5File::is_single_precision(const std::string& dataset) const {
  const Handle type = impl_->type_of(impl_->open_dataset(dataset), dataset);
  return H5Tget_class(type) == H5T_FLOAT && H5Tget_size(type) <= sizeof(float);
}

bool Hdf5File::is_whole(const std::string& dataset) const {
  const Handle type = impl_->type_of(impl_->open_dataset(dataset), dataset);
  return H5Tget_class(type) == H5T_INTEGER;
}

std::vector<std::size_t> Hdf5File::shape(const std::string& dataset) const {
  return impl_->shape_of(impl_->open_dataset(dataset), dataset);
}

std::string Hdf5File::text_attribute(const std::string& object, const std::string& name) const {
  constexpr std::size_t kLongest = 65536;  // HDF5's own limit
  const Handle owner = impl_->open(object);
  const Handle attribute(H5Aopen(owner, name.c_str(), H5P_DEFAULT), H5Aclose);
  if (attribute < 0) return {};
  const Handle type(H5Aget_type(attribute), H5Tclose);
  const Handle space(H5Aget_space(attribute), H5Sclose);
  if (H5Tget_class(type) != H5T_STRING || H5Tis_variable_str(type) != 0) return {};
  const std::size_t width = H5Tget_size(type);
  if (H5Sget_simple_extent_npoints(space) != 1 || width > kLongest) return {};
  std::string bytes(width, '\0');
  if (H5Aread(attribute, type, bytes.data()) < 0) {
    impl_->fail_by_cause("cannot read the attribute \"" + name + "\" of \"" + object + "\"");
  }
  return bytes.c_str();
}

std::optional<std::int64_t> Hdf5File::integer_attribute(const std::string& object,
                                                        const std::string& name) const {
  const Handle owner = impl_->open(object);
  const Handle attribute(H5Aopen(owner, name.c_str(), H5P_DEFAULT), H5Aclose);
  if (attribute < 0) return std::nullopt;
  const Handle type(H5Aget_type(attribute), H5Tclose);
  const Handle space(H5Aget_space(attribute), H5Sclose);
  std::int64_t value = 0;
  if (H5Tget_class(type) != H5T_INTEGER || H5Sget_simple_extent_npoints(space) != 1 ||
      H5Aread(attribute, H5T_NATIVE_INT64, &value) < 0) {
    return std::nullopt;
  }
  return value;
}

void Hdf5File::overwrite(const std::string& dataset, std::span<const double> values) {
  const Handle data = impl_->open_dataset(dataset);
  const Handle type = impl_->type_of(data, dataset);
  if (H5Tget_class(type) != H5T_FLOAT) {
    impl_->fail("the coordinates in \"" + dataset + "\" are whole numbers");
  }
  if (impl_->count_of(data, dataset, H5Tget_size(type)) != values.size()) {
    impl_->fail("the dataset \"" + dataset + "\" is not of the size that was read");
  }
  if (H5Dwrite(data, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) < 0) {
    impl_->fail_by_cause("cannot write the dataset \"" + dataset + "\"");
  }
}

void Hdf5File::close() { impl_->close(); }

}  // namespace meshsmooth::formats
