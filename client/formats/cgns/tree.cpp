#include "cgns/tree.hpp"

#include <string_view>

#include "cgns/adf_file.hpp"
#include "hdf5_file.hpp"
#include "text.hpp"

namespace meshsmooth::formats {
namespace {

std::string below(const std::string& parent, const std::string& name) {
  return parent == "/" ? "/" + name : parent + "/" + name;
}

/// A node is a group with the attributes "label" and "type", and the dataset " data"; of a link
/// " link" leads to the node, " file" names the file where it is another one.
class Hdf5Tree final : public CgnsTree {
 public:
  Hdf5Tree(const std::filesystem::path& path, const std::string& bytes)
      : CgnsTree(path), file_(path, bytes) {}

  [[nodiscard]] bool exists(const std::string& node) const override {
    return file_.has(target(node));
  }
  [[nodiscard]] bool has_data(const std::string& node) const override {
    return file_.has(data_name(node));
  }
  [[nodiscard]] std::vector<std::int64_t> integers(const std::string& node) const override {
    return file_.integers(data_name(node));
  }
  [[nodiscard]] std::vector<double> reals(const std::string& node) const override {
    return file_.reals(data_name(node));
  }
  [[nodiscard]] bool is_single_precision(const std::string& node) const override {
    return file_.is_single_precision(data_name(node));
  }
  [[nodiscard]] std::string data_name(const std::string& node) const override {
    return target(node) + "/ data";
  }

 protected:
  [[nodiscard]] std::vector<Child> list(const std::string& parent) const override {
    std::vector<Child> found;
    for (const std::string& name : file_.children(parent)) {
      if (name.starts_with(" ")) continue;
      const std::string child = below(parent, name);
      if (!file_.has(child)) {
        found.push_back({child, "", "another file"});
        continue;
      }
      const std::string node = target(child);
      if (!file_.has(node)) {
        const std::string file = child + "/ file";
        found.push_back({child, "", file_.has(file) ? file_.text(file).c_str() : "nothing"});
      } else {
        found.push_back({node, file_.text_attribute(node, "label"), ""});
      }
    }
    return found;
  }
  [[nodiscard]] std::string characters(const std::string& node) const override {
    return file_.text(data_name(node));
  }

 private:
  /// Of a link what it leads to, by HDF5's own link in it.
  [[nodiscard]] std::string target(const std::string& node) const {
    const bool link = file_.has(node) && file_.text_attribute(node, "type") == "LK";
    return link ? node + "/ link" : node;
  }

  Hdf5File file_;
};

/// The data of a link are "FILE>PATH"; within the file there is no FILE.
class AdfTree final : public CgnsTree {
 public:
  AdfTree(const std::filesystem::path& path, const std::string& bytes)
      : CgnsTree(path), file_(path, bytes) {}

  [[nodiscard]] bool exists(const std::string& node) const override {
    return file_.find(target(node)) != nullptr;
  }
  [[nodiscard]] bool has_data(const std::string& node) const override {
    const AdfFile::Node* found = file_.find(target(node));
    return found != nullptr && found->chunk_count != 0;
  }
  [[nodiscard]] std::vector<std::int64_t> integers(const std::string& node) const override {
    return file_.integers(target(node));
  }
  [[nodiscard]] std::vector<double> reals(const std::string& node) const override {
    return file_.reals(target(node));
  }
  [[nodiscard]] bool is_single_precision(const std::string& node) const override {
    const AdfFile::Node* found = file_.find(target(node));
    return found != nullptr && found->type == "R4";
  }
  [[nodiscard]] std::string data_name(const std::string& node) const override {
    return target(node);
  }

 protected:
  [[nodiscard]] std::vector<Child> list(const std::string& parent) const override {
    std::vector<Child> found;
    const AdfFile::Node* node = file_.find(parent);
    if (node == nullptr) return found;
    for (const std::string& name : node->children) {
      const std::string child = below(parent, name);
      const std::string path = target(child);
      if (const AdfFile::Node* at = file_.find(path)) {
        found.push_back({path, at->label, ""});
      } else {
        found.push_back({child, "", file_.text(child)});
      }
    }
    return found;
  }
  [[nodiscard]] std::string characters(const std::string& node) const override {
    return file_.text(target(node));
  }

 private:
  [[nodiscard]] std::string target(const std::string& node) const {
    const AdfFile::Node* found = file_.find(node);
    if (found == nullptr || found->type != "LK") return node;
    const std::string link = file_.text(node).c_str();
    return link.starts_with('>') ? link.substr(1) : link;
  }

  AdfFile file_;
};

}  // namespace

std::vector<std::string> CgnsTree::children(const std::string& parent,
                                            const std::string& label) const {
  std::vector<std::string> found;
  for (const Child& child : list(parent)) {
    // Solutions are often in a file of their own, which has the grid or is linked to it.
    const bool solution = child.path.find("Solution") != std::string::npos;
    if (!child.other_file.empty() && !solution) {
      fail("the node \"" + child.path + "\" is a link to " + child.other_file +
           "; links to other files are not followed: merge them (cgnsconvert -l)");
    }
    if (child.label == label) found.push_back(child.path);
  }
  return found;
}

std::string CgnsTree::text(const std::string& node) const {
  std::string text = characters(node).c_str();
  text.erase(text.find_last_not_of(' ') + 1);
  return text;
}

std::pair<std::int64_t, std::int64_t> CgnsTree::range(const std::string& node) const {
  const std::vector<std::int64_t> ends = integers(node);
  if (ends.size() != 2 || ends[0] < 1 || ends[1] < ends[0]) fail("\"" + node + "\" is no range");
  return {ends[0], ends[1]};
}

void CgnsTree::fail(const std::string& what) const { formats::fail("FORMAT_ERROR", path_, what); }

std::string cgns_name(const std::string& node) {
  constexpr std::string_view kLink = "/ link";
  const std::string_view path = std::string_view(node).substr(
      0, node.size() - (node.ends_with(kLink) ? kLink.size() : std::size_t{0}));
  return std::string(path.substr(path.rfind('/') + 1));
}

std::unique_ptr<CgnsTree> open_cgns(const std::filesystem::path& path, const std::string& bytes) {
  if (is_adf(bytes)) return std::make_unique<AdfTree>(path, bytes);
  return std::make_unique<Hdf5Tree>(path, bytes);
}

}  // namespace meshsmooth::formats
