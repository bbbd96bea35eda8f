// What the HTML report embeds: escaped texts, encoded arrays, the surface and the worst elements.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "html_report.hpp"
#include "meshsmooth/smoother.hpp"
#include "report/encoding.hpp"
#include "report/limited_elements.hpp"
#include "report/scene.hpp"
#include "report/shown_elements.hpp"
#include "report/surface.hpp"

namespace meshsmooth::cli {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

/// A cube of `n`^3 hexahedra, or of six tetrahedra each.
Mesh cube(int n, bool tetrahedra, bool float32 = false) {
  Mesh mesh;
  std::vector<Vec3d> positions;
  const int m = n + 1;
  for (int k = 0; k < m; ++k) {
    for (int j = 0; j < m; ++j) {
      for (int i = 0; i < m; ++i) positions.push_back({1.0 * i, 1.0 * j, 1.0 * k});
    }
  }
  ElementBlock block{tetrahedra ? ElementType::tetrahedron : ElementType::hexahedron, {}};
  static constexpr int kPaths[6][3] = {{1, 3, 7}, {3, 2, 7}, {2, 6, 7},
                                       {6, 4, 7}, {4, 5, 7}, {5, 1, 7}};
  for (int k = 0; k < n; ++k) {
    for (int j = 0; j < n; ++j) {
      for (int i = 0; i < n; ++i) {
        const auto corner = [&](int bits) {
          return NodeId{((k + (bits >> 2)) * m + j + (bits >> 1 & 1)) * m + i + (bits & 1)};
        };
        if (tetrahedra) {
          for (const auto& [a, b, c] : kPaths) {
            for (const int bits : {0, a, b, c}) block.nodes.push_back(corner(bits));
          }
        } else {
          for (const int bits : {0, 1, 3, 2, 4, 5, 7, 6}) block.nodes.push_back(corner(bits));
        }
      }
    }
  }
  mesh.blocks.push_back(std::move(block));
  if (float32) {
    std::vector<Vec3f> single;
    for (const Vec3d p : positions) single.push_back(vec3_cast<float>(p));
    mesh.positions = single;
  } else {
    mesh.positions = positions;
  }
  return mesh;
}

std::string decode_base64(const std::string& text) {
  static const std::string kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string bytes;
  unsigned bits = 0;
  int count = 0;
  for (const char c : text) {
    if (c == '=') break;
    bits = bits << 6 | static_cast<unsigned>(kDigits.find(c));
    if ((count += 6) >= 8) bytes += static_cast<char>(bits >> (count -= 8) & 0xFF);
  }
  return bytes;
}

/// The first array of that name after `where`.
template <class T>
std::vector<T> array_of(const std::string& json, const std::string& where,
                        const std::string& name) {
  const std::size_t part = json.find('"' + where + "\":{");
  const std::string key = '"' + name + "\":\"";
  const std::size_t begin = json.find(key, part) + key.size();
  const std::string bytes = decode_base64(json.substr(begin, json.find('"', begin) - begin));
  std::vector<T> values(bytes.size() / sizeof(T));
  std::memcpy(values.data(), bytes.data(), bytes.size());
  return values;
}

TEST(HtmlReport, ShowsNoInterfaceElements) {
  const Mesh mesh = cube(2, false);
  const MeshTopology topology(mesh);
  DrawnMesh drawn{topology.view(), mesh.positions_view(), std::nullopt,
                  SurfaceOrientation(topology.view(), mesh.positions_view())};
  EXPECT_EQ(choose_elements(drawn, 8, {}, {}).size(), 8U);
  drawn.interfaces = {1, 0, 0, 1, 0, 0, 0, 0};
  std::set<std::size_t> shown;
  for (const ShownElement& element : choose_elements(drawn, 8, {}, {})) {
    shown.insert(element.element);
  }
  EXPECT_EQ(shown, (std::set<std::size_t>{1, 2, 4, 5, 6, 7}));
}

TEST(HtmlReportEncoding, EscapesWhatHtmlMeans) {
  EXPECT_EQ(escape_html("a<b>&\"c'`"), "a&#60;b&#62;&#38;&#34;c&#39;&#96;");
  EXPECT_EQ(escape_html("Gehäuse 网格 🧊.vtu"), "Gehäuse 网格 🧊.vtu");
}

TEST(HtmlReportEncoding, ReplacesWhatIsNoUtf8) {
  const std::string replaced = "\xEF\xBF\xBD";
  for (const std::string bad : {"\x80", "\xC0\x80", "\xED\xA0\x80", "\xF8", "\xF5\x80\x80\x80",
                                "\xE2\x82", "\x01", "\x7F"}) {
    EXPECT_THAT(escape_html("a" + bad + "b"), AllOf(HasSubstr(replaced), Not(HasSubstr(bad))))
        << bad;
    EXPECT_THAT(json_string("a" + bad + "b"), Not(HasSubstr(bad)));
  }
}

TEST(HtmlReportEncoding, KeepsScriptsClosed) {
  std::mt19937 random(7);
  for (int round = 0; round < 500; ++round) {
    std::string text;
    for (auto n = random() % 40; n > 0; --n) text += static_cast<char>(random() % 256);
    text += "</script><!--";
    for (const std::string& safe : {json_string(text), escape_html(text)}) {
      EXPECT_EQ(safe.find('<'), std::string::npos);
      EXPECT_EQ(safe.find('>'), std::string::npos);
    }
  }
  EXPECT_EQ(json_string("a\"b\\\n"), R"("a\u0022b\u005c\u000a")");
}

TEST(HtmlReportEncoding, EncodesEveryLength) {
  std::string bytes;
  for (int n = 0; n < 100; ++n) {
    EXPECT_EQ(decode_base64(base64(std::as_bytes(std::span(bytes)))), bytes);
    bytes += static_cast<char>(n * 37);
  }
}

TEST(HtmlReportSurface, IsTheBoundaryOfVolumeElements) {
  for (const bool tetrahedra : {false, true}) {
    const Mesh mesh = cube(5, tetrahedra);
    const MeshTopology topology(mesh);
    const Surface surface = find_surface(topology.view());
    EXPECT_EQ(surface.triangles.size(), 6U * 5 * 5 * 2);
    EXPECT_EQ(surface.whole_count, surface.triangles.size());

    std::vector<NodeId> nodes = surface.nodes;
    std::ranges::sort(nodes);
    EXPECT_EQ(nodes, find_boundary_nodes(topology.view()));
    const auto& positions = std::get<std::vector<Vec3d>>(mesh.positions);
    double volume = 0;  // facets look outwards
    for (const auto& triangle : surface.triangles) {
      const auto at = [&](int n) {
        return positions[static_cast<std::size_t>(surface.nodes[triangle.corners[n]])];
      };
      volume += dot(at(0), cross(at(1), at(2))) / 6;
    }
    EXPECT_NEAR(volume, 125, 1e-9);
  }
}

TEST(HtmlReportSurface, IsWhatSurfaceElementsAre) {
  Mesh mesh;
  mesh.positions = std::vector<Vec3d>{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {2, 0, 0}};
  mesh.blocks = {{ElementType::triangle, {1, 4, 2}}, {ElementType::quad, {0, 1, 2, 3}}};
  const Surface surface = find_surface(MeshTopology(mesh).view());
  ASSERT_EQ(surface.triangles.size(), 3U);
  EXPECT_EQ(surface.triangles[0].edges, 7);
  EXPECT_EQ(surface.triangles[1].element, 1U);
  EXPECT_EQ(surface.triangles[1].edges, 3) << "the diagonal is no edge";
  EXPECT_EQ(surface.triangles[2].edges, 6);
}

TEST(HtmlReportSurface, BecomesSimplerCellByCell) {
  const Mesh mesh = cube(20, true);
  const Surface whole = find_surface(MeshTopology(mesh).view());
  std::vector<Vec3d> positions;
  for (const NodeId node : whole.nodes)
    positions.push_back(position_of(mesh.positions_view(), node));
  EXPECT_EQ(simplify(whole, positions, 1024).triangles.size(), whole.triangles.size());
  const Surface simple = simplify(whole, positions, 8);
  EXPECT_EQ(simple.whole_count, whole.triangles.size());
  EXPECT_GT(simple.triangles.size(), 100U);
  EXPECT_LT(simple.triangles.size(), whole.triangles.size() / 3);
}

/// A cube whose inner nodes are disturbed, and the same disturbed otherwise.
struct Pair {
  explicit Pair(Mesh mesh) : before(mesh), after(std::move(mesh)) {
    std::mt19937 random(3);
    std::uniform_real_distribution<double> way(-0.7, 0.7);
    for (Mesh* m : {&before, &after}) {
      for (Vec3d& p : std::get<std::vector<Vec3d>>(m->positions)) {
        p += Vec3d{way(random), way(random), way(random)};
      }
    }
  }
  Mesh before, after;
  MeshTopology topology{after};
  DrawnMesh drawn{topology.view(), after.positions_view(), before.positions_view(), {}};
};

TEST(HtmlReportElements, AreTheWorstOfBothStates) {
  for (const bool tetrahedra : {false, true}) {
    const Pair pair(cube(6, tetrahedra));
    const auto elements = choose_elements(pair.drawn, 40, {}, {});
    EXPECT_GE(elements.size(), 20U);
    EXPECT_LE(elements.size(), 40U);

    std::set<std::size_t> ids;
    for (const ShownElement& shown : elements) ids.insert(shown.element);
    EXPECT_EQ(ids.size(), elements.size());
    for (const Mesh* mesh : {&pair.before, &pair.after}) {
      const QualityStats stats = measure_quality(*mesh);
      for (const ElementQuality& worst : stats.worst) {
        // With hexahedra inverted ones rank first, whatever their mean ratio.
        if (!tetrahedra) break;
        EXPECT_TRUE(ids.contains(static_cast<std::size_t>(worst.element)));
      }
    }
    for (std::size_t n = 1; n < elements.size(); ++n) {
      EXPECT_LE(elements[n].measure.inverted, elements[n - 1].measure.inverted);
    }
  }
}

TEST(HtmlReportElements, KnowInvertedHexahedraOfPositiveCorners) {
  // The Jacobian is negative between the corners alone.
  std::mt19937 random(11);
  std::uniform_real_distribution<double> way(-0.55, 0.55);
  for (int round = 0; round < 20'000; ++round) {
    Mesh mesh = cube(1, false);
    for (Vec3d& p : std::get<std::vector<Vec3d>>(mesh.positions)) {
      p += Vec3d{way(random), way(random), way(random)};
    }
    const QualityStats stats = measure_quality(mesh);
    if (stats.inverted_count == 0 || stats.worst.front().mean_ratio <= 0) continue;
    const MeshTopology topology(mesh);
    const auto chosen =
        choose_elements({topology.view(), mesh.positions_view(), std::nullopt, {}}, 1, {}, {});
    ASSERT_EQ(chosen.size(), 1U);
    EXPECT_TRUE(chosen.front().measure.inverted);
    return;
  }
  FAIL() << "no such hexahedron found";
}

TEST(HtmlReportElements, AreMarked) {
  Pair pair(cube(3, true));
  pair.before.positions = pair.after.positions;
  std::vector<std::uint8_t> fixed(pair.after.node_count());
  for (const NodeId node : find_boundary_nodes(pair.topology.view())) {
    fixed[static_cast<std::size_t>(node)] = 1;
  }
  pair.drawn.before = pair.before.positions_view();
  const std::vector<std::int64_t> blocking = {17};
  const auto elements = choose_elements(pair.drawn, 1'000, blocking, fixed);
  EXPECT_EQ(elements.size(), pair.after.element_count());
  const LockedStats locked = measure_locked(pair.topology.view(), fixed, pair.drawn.positions, {});
  std::int64_t count = 0;
  for (const ShownElement& shown : elements) {
    count += (shown.marks & kLocked) != 0;
    EXPECT_TRUE(shown.marks & kNotMoved);
    EXPECT_EQ((shown.marks & kBlocksMotion) != 0, shown.element == 17);
  }
  EXPECT_EQ(count, locked.element_count);
}

/// A cube of tetrahedra with disturbed inner nodes, and what a job leaves of it.
struct Job {
  explicit Job(SmoothOptions with) : options(std::move(with)), before(cube(5, true)) {
    std::mt19937 random(3);
    std::uniform_real_distribution<double> way(-0.2, 0.2);
    for (const NodeId node : find_boundary_nodes(MeshTopology(before).view())) fixed[at(node)] = 1;
    for (std::size_t n = 0; n < fixed.size(); ++n) {
      if (fixed[n] != 0) continue;
      std::get<std::vector<Vec3d>>(before.positions)[n] += Vec3d{way(random), way(random), 0};
    }
    after = before;
    poor = make_smoother("cpu")->smooth(after, options).poor.value();
    drawn.positions = after.positions_view();
    drawn.before = before.positions_view();
  }
  static std::size_t at(NodeId node) { return static_cast<std::size_t>(node); }
  [[nodiscard]] std::vector<ShownElement> elements() const {
    return choose_elements(drawn, 10'000, {}, fixed);
  }

  SmoothOptions options;
  Mesh before, after;
  std::vector<std::uint8_t> fixed = std::vector<std::uint8_t>(before.node_count());
  PoorElements poor;
  MeshTopology topology{before};
  DrawnMesh drawn{topology.view(), {}, {}, {}};
};

TEST(HtmlReportElements, AreMarkedAsLimitedWhereTheJobCountsThem) {
  // The regular lattice, the optimum, has 0.84.
  for (const Target target : {Target::automatic, Target::ideal}) {
    const Job job({.method = Optimize{.target = target},
                   .max_iterations = 200,
                   .tolerance = {.value = 1e-9},
                   .report_below = 0.85});
    auto elements = job.elements();
    ASSERT_EQ(elements.size(), job.after.element_count());
    EXPECT_TRUE(mark_limited(job.drawn, elements, job.options, job.fixed));
    std::int64_t locked = 0, limited = 0;
    for (const ShownElement& shown : elements) {
      const bool poor = shown.measure.mean_ratio < job.options.report_below;
      locked += poor && (shown.marks & kLocked) != 0;
      limited += (shown.marks & kLimited) != 0;
      EXPECT_TRUE(poor || (shown.marks & kLimited) == 0);
    }
    EXPECT_GT(limited, 0);
    EXPECT_EQ(locked, job.poor.locked_count);
    EXPECT_EQ(limited, job.poor.limited_count);
  }
}

TEST(HtmlReportElements, AreNotLimitedWhereANodeGainsByAMove) {
  const Job job({.max_iterations = 0, .report_below = 0.85});
  auto elements = job.elements();
  EXPECT_TRUE(mark_limited(job.drawn, elements, job.options, job.fixed));
  const auto limited = std::ranges::count_if(
      elements, [](const ShownElement& shown) { return (shown.marks & kLimited) != 0; });
  EXPECT_LT(limited, job.poor.element_count / 4);
  EXPECT_NEAR(static_cast<double>(limited), static_cast<double>(job.poor.limited_count),
              0.02 * static_cast<double>(job.poor.element_count))
      << "in the job's own sweep nodes have moved before";
}

TEST(HtmlReportElements, AreNotMarkedAsLimitedWhereMoreThanTheirBallsCounts) {
  Job job({.max_iterations = 20, .report_below = 0.85});
  auto elements = job.elements();
  const auto is_told = [&](SmoothOptions options) {
    options.report_below = 0.85;
    return mark_limited(job.drawn, elements, options, job.fixed);
  };
  EXPECT_FALSE(is_told({.method = Optimize{.target = Target::input}}));
  EXPECT_FALSE(is_told({.method = Optimize{.stay = 1}}));
  EXPECT_FALSE(is_told({.boundary = BoundaryPolicy::slide}));
  EXPECT_FALSE(is_told({.movement_limit = MovementLimit{.value = 1}}));
  EXPECT_FALSE(is_told({.only_below = OnlyBelow{.quality = 0.5}}));
  for (const ShownElement& shown : elements) EXPECT_FALSE(shown.marks & kLimited);

  const Mesh boxes = cube(2, false);
  const MeshTopology topology(boxes);
  std::vector<ShownElement> none;
  const DrawnMesh drawn{topology.view(), boxes.positions_view(), std::nullopt, {}};
  EXPECT_FALSE(mark_limited(drawn, none, {.report_below = 0.85}, {}));
}

TEST(HtmlReportScene, HoldsIdsAndPositions) {
  const Pair pair(cube(4, false));
  const auto elements = choose_elements(pair.drawn, 30, {}, {});
  for (const std::int64_t offset : {std::int64_t{1'000}, std::int64_t{1} << 40, std::int64_t{-5}}) {
    const Scene scene = make_scene(pair.drawn, elements,
                                   {[&](std::int64_t id) { return id + offset; },
                                    [&](std::int64_t id) { return id + 2 * offset; }});
    const bool wide = offset != 1'000;
    const auto ids = [&](const std::string& name) {
      if (wide) return array_of<std::int64_t>(scene.json, "elements", name + "64");
      const auto narrow = array_of<std::uint32_t>(scene.json, "elements", name);
      return std::vector<std::int64_t>(narrow.begin(), narrow.end());
    };
    const auto nodes = array_of<std::uint32_t>(scene.json, "elements", "nodes");
    const auto node_ids = ids("nodeIds");
    ASSERT_EQ(nodes.size(), 8 * elements.size());
    for (std::size_t e = 0; e < elements.size(); ++e) {
      EXPECT_EQ(ids("ids")[e], static_cast<std::int64_t>(elements[e].element) + offset);
      for (std::size_t n = 0; n < 8; ++n) {
        EXPECT_EQ(node_ids[nodes[8 * e + n]], elements[e].nodes[n] + 2 * offset);
      }
    }
    const auto quality = array_of<std::array<float, 4>>(scene.json, "elements", "quality");
    EXPECT_FLOAT_EQ(quality[0][1], static_cast<float>(elements[0].measure.mean_ratio));
    for (const auto& p : array_of<Vec3f>(scene.json, "surface", "after")) {
      EXPECT_LE(std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}), 1.0001F);
    }
  }
}

TEST(HtmlReportScene, LeavesOutPositionsThatAreTheSame) {
  Pair pair(cube(4, true));
  pair.before.positions = pair.after.positions;
  pair.drawn.before = pair.before.positions_view();
  const auto scene =
      make_scene(pair.drawn, choose_elements(pair.drawn, 30, {}, {}),
                 {[](std::int64_t id) { return id; }, [](std::int64_t id) { return id; }});
  EXPECT_THAT(scene.json, Not(HasSubstr("\"before\"")));
}

TEST(HtmlReportScene, StaysSmall) {
  const auto same = [](std::int64_t id) { return id + (std::int64_t{1} << 40); };
  const auto check = [&](const DrawnMesh& drawn, std::size_t width) {
    const auto elements = choose_elements(drawn, kMostShownElements, {}, {});
    const Scene scene = make_scene(drawn, elements, {same, same});
    EXPECT_LE(scene.triangle_count, kMostShownTriangles);
    EXPECT_LE(scene.json.size(), 1'450'000 + 60 * (scene.triangle_count + width * elements.size()));
  };
  {
    const Pair pair(cube(46, true));
    check(pair.drawn, 4);
  }
  {
    const Pair pair(cube(25, false));
    check(pair.drawn, 12);
  }
  // Triangles that share no node, all of which moved: the most bytes for each.
  Pair soup{Mesh{std::vector<Vec3d>(150'000), {{ElementType::triangle, {}}}, {}}};
  for (NodeId n = 0; n < 150'000; ++n) soup.after.blocks[0].nodes.push_back(n);
  const MeshTopology topology(soup.after);
  soup.drawn.topology = topology.view();
  soup.drawn.orientation = SurfaceOrientation(topology.view(), soup.after.positions_view());
  check(soup.drawn, 1);
}

TEST(HtmlReport, HoldsHostileNamesAndExtremeMeshes) {
  Mesh mesh = cube(1, false);
  for (Vec3d& p : std::get<std::vector<Vec3d>>(mesh.positions)) p = 1e300 * p;
  const formats::MeshFile file(mesh);
  const std::string html =
      quality_html("in/<script>alert('{{scene}}')<!--\xff\".vtu", file, measure_quality(mesh));
  EXPECT_THAT(
      html,
      AllOf(Not(HasSubstr("<script>alert")), Not(HasSubstr("<!--\xff")), Not(HasSubstr("in/&")),
            HasSubstr("&#60;script&#62;alert(&#39;{{scene}}&#39;)&#60;!--\xEF\xBF\xBD&#34;.vtu")));
}

}  // namespace
}  // namespace meshsmooth::cli
