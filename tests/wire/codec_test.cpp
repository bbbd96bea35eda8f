#include "wire/codec.hpp"

#include <gmock/gmock.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/unknown_field_set.h>
#include <google/protobuf/util/message_differencer.h>
#include <gtest/gtest.h>

#include <cctype>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "meshsmooth/error.hpp"

namespace meshsmooth::wire {
namespace {

using namespace std::chrono_literals;
using google::protobuf::util::MessageDifferencer;

// "REASON field" of what decoding throws.
std::string refusal(const std::function<void(v1::SmoothingOptions&)>& change) {
  v1::SmoothingOptions message;
  change(message);
  try {
    (void)decode_options(message);
  } catch (const Error& error) {
    std::string text = error.reason();
    for (const auto& [key, value] : error.details()) {
      if (key == "field") text += " " + value;
    }
    return text;
  }
  return "accepted";
}

// Through the codec and back; equal messages mean equal options.
void expect_round_trip(const SmoothOptions& options) {
  const v1::SmoothingOptions message = encode_options(options);
  EXPECT_TRUE(MessageDifferencer::Equals(message, encode_options(decode_options(message))))
      << message.DebugString();
}

TEST(DecodeOptions, FillsInCoresDefaults) {
  EXPECT_TRUE(MessageDifferencer::Equals(encode_options(decode_options({})),
                                         encode_options(SmoothOptions{})));
}

TEST(DecodeOptions, TakesOptimizeWhenNoMethodIsNamed) {
  EXPECT_TRUE(std::holds_alternative<Optimize>(decode_options({}).method));
  EXPECT_TRUE(encode_options(SmoothOptions{}).has_optimize());
}

TEST(DecodeOptions, LeavesTheIterationLimitToTheMethod) {
  v1::SmoothingOptions message;
  message.mutable_taubin();
  EXPECT_EQ(iteration_limit(decode_options(message)), 20);
  EXPECT_EQ(encode_options({.method = Taubin{}}).max_iteration_count(), 20);
  message.set_max_iteration_count(0);
  EXPECT_EQ(iteration_limit(decode_options(message)), 0);
}

// Fields of the protocol and of core, by name, in both directions.
TEST(MethodTraits, NameEveryFieldOfTheProtocol) {
  const auto& options = *v1::SmoothingOptions::descriptor();
  const auto& methods = *options.FindOneofByName("method");
  EXPECT_EQ(static_cast<std::size_t>(methods.field_count()), std::variant_size_v<Method>);
  for_each_method([&]<class M>(const M&) {
    const auto* own = options.FindFieldByName(std::string(MethodTraits<M>::name));
    ASSERT_NE(own, nullptr) << MethodTraits<M>::name;
    int in_message = 0;
    for_each_field<M>([&]<class Field>(const Field& field) {
      const google::protobuf::Descriptor* where = own->message_type();
      if constexpr (std::is_same_v<Field, NumberField<M>>) {
        if (field.in_options) where = &options;
        ASSERT_NE(where->FindFieldByName(std::string(field.name)), nullptr) << field.name;
        EXPECT_TRUE(where->FindFieldByName(std::string(field.name))->has_presence());
      } else {
        const auto* choice = where->FindFieldByName(std::string(field.name));
        ASSERT_NE(choice, nullptr) << field.name;
        ASSERT_EQ(choice->enum_type()->value_count(), static_cast<int>(field.choices.size()) + 1);
        for (std::size_t i = 0; i < field.choices.size(); ++i) {
          std::string word(field.choices[i]);
          for (char& c : word) c = c == '-' ? '_' : static_cast<char>(std::toupper(c));
          EXPECT_THAT(choice->enum_type()->FindValueByNumber(static_cast<int>(i) + 1)->name(),
                      ::testing::EndsWith("_" + word));
        }
      }
      in_message += where != &options;
    });
    EXPECT_EQ(own->message_type()->field_count(), in_message) << MethodTraits<M>::name;
  });
}

TEST(DecodeOptions, FillsInTheDefaultsOfAChosenMethod) {
  v1::SmoothingOptions message;
  message.mutable_taubin()->set_lambda(0.4);

  const auto method = std::get<Taubin>(decode_options(message).method);

  EXPECT_EQ(method.lambda, 0.4);
  EXPECT_EQ(method.mu, Taubin{}.mu);
}

TEST(DecodeOptions, ReadsWhatEncodeWrote) {
  expect_round_trip({});
  for (const Weighting weighting : {Weighting::uniform, Weighting::inverse_edge_length,
                                    Weighting::edge_length, Weighting::ball_volume}) {
    expect_round_trip({.method = Laplacian{weighting, 0.5}});
    expect_round_trip({.method = SmartLaplacian{weighting, 0.25}});
  }
  expect_round_trip({.method = Taubin{0.5, -0.6}});
  expect_round_trip({.method = WindowedSinc{Window::hamming, 0.03}});
  expect_round_trip({.method = Move{Target::ideal, 0.125}});
  expect_round_trip({.method = Move{.derivative = Derivative::cotangent}});
  expect_round_trip({.method = HcLaplacian{0.1, 0.9}});
  for (const Goal goal : {Goal::average, Goal::balanced, Goal::worst}) {
    expect_round_trip({.method = Optimize{goal, 0.25}});
  }
  for (const bool relative : {false, true}) {
    expect_round_trip({.movement_limit = MovementLimit{0.125, relative}});
  }
  for (const Form form : {Form::automatic, Form::jacobi, Form::gauss_seidel, Form::asynchronous}) {
    expect_round_trip({.method = SmartLaplacian{}, .form = form});
  }
  expect_round_trip({.boundary = BoundaryPolicy::slide, .feature_angle = 45});
  EXPECT_EQ(decode_options(encode_options({.feature_angle = 45})).feature_angle, 45);
  expect_round_trip({.max_iterations = 0,
                     .tolerance = {.value = 0.125, .relative = false},
                     .boundary = BoundaryPolicy::free,
                     .guard = false,
                     .tangled = TangledPolicy::refuse,
                     .compute_budget = 1500ms});
}

TEST(DecodeOptions, KeepsEveryValue) {
  const SmoothOptions options =
      decode_options(encode_options({.method = SmartLaplacian{Weighting::edge_length, 0.5},
                                     .form = Form::jacobi,
                                     .max_iterations = 7,
                                     .tolerance = {.value = 0.25, .relative = false},
                                     .boundary = BoundaryPolicy::free,
                                     .guard = false,
                                     .tangled = TangledPolicy::refuse,
                                     .compute_budget = 1500ms}));

  EXPECT_EQ(std::get<SmartLaplacian>(options.method).weighting, Weighting::edge_length);
  EXPECT_EQ(std::get<SmartLaplacian>(options.method).relaxation, 0.5);
  EXPECT_EQ(options.form, Form::jacobi);
  EXPECT_EQ(options.max_iterations, 7);
  EXPECT_EQ(options.tolerance.value, 0.25);
  EXPECT_FALSE(options.tolerance.relative);
  EXPECT_EQ(options.boundary, BoundaryPolicy::free);
  EXPECT_FALSE(options.guard);
  EXPECT_EQ(options.tangled, TangledPolicy::refuse);
  EXPECT_EQ(options.compute_budget, std::chrono::nanoseconds(1500ms));
}

TEST(DecodeOptions, KeepsGoalAndTargetOfOptimize) {
  for (const Goal goal : {Goal::average, Goal::balanced, Goal::worst}) {
    const SmoothOptions options = decode_options(encode_options({.method = Optimize{goal, 0.25}}));

    EXPECT_EQ(std::get<Optimize>(options.method).goal, goal);
    EXPECT_EQ(std::get<Optimize>(options.method).target_quality, 0.25);
  }
  v1::SmoothingOptions bare;
  bare.mutable_optimize();
  EXPECT_EQ(std::get<Optimize>(decode_options(bare).method).goal, Goal::balanced);
  EXPECT_EQ(std::get<Optimize>(decode_options(bare).method).target_quality, 0);
}

TEST(DecodeOptions, GivesTheDefaultMethodItsFields) {
  v1::SmoothingOptions message;
  message.set_target_quality(0.25);
  EXPECT_EQ(std::get<Optimize>(decode_options(message).method).target_quality, 0.25);
}

TEST(DecodeOptions, KeepsWhatOptimizeAimsAt) {
  for (const Target target : {Target::automatic, Target::ideal, Target::input, Target::reference}) {
    const SmoothOptions options =
        decode_options(encode_options({.method = Optimize{.target = target, .stay = 0.5}}));
    EXPECT_EQ(std::get<Optimize>(options.method).target, target);
    EXPECT_EQ(std::get<Optimize>(options.method).stay, 0.5);
  }
  const Vec3d reference[] = {{0, 0, 0}};
  const JobInput given{.reference = std::span<const Vec3d>(reference)};
  EXPECT_EQ(encode_options(with_target_of({}, given)).optimize().target(), v1::TARGET_REFERENCE);
}

TEST(DecodeOptions, KeepsTheLimitOfBadElements) {
  const SmoothOptions options =
      decode_options(encode_options({.only_below = OnlyBelow{.quality = 0.25, .rings = 7}}));
  ASSERT_TRUE(options.only_below);
  EXPECT_EQ(options.only_below->quality, 0.25);
  EXPECT_EQ(options.only_below->rings, 7);
  EXPECT_FALSE(decode_options({}).only_below);
  EXPECT_EQ(decode_options(encode_options({.report_below = 0.25})).report_below, 0.25);
  EXPECT_FALSE(decode_options({}).report_below);
  EXPECT_FALSE(decode_options(encode_options({.never_worse = false})).never_worse);
  EXPECT_TRUE(decode_options({}).never_worse);
  EXPECT_EQ(decode_options(encode_options({.metric = QualityMetric::scaled_jacobian})).metric,
            QualityMetric::scaled_jacobian);
  EXPECT_FALSE(decode_options({}).metric);
  v1::SmoothingOptions rings;
  rings.set_only_below_rings(3);
  EXPECT_THROW((void)decode_options(rings), NotSupported);
}

TEST(DecodeOptions, KeepsWhatTheMovementLimitIsAShareOf) {
  for (const bool relative : {false, true}) {
    const SmoothOptions options =
        decode_options(encode_options({.movement_limit = MovementLimit{0.125, relative}}));

    EXPECT_EQ(options.movement_limit.value().value, 0.125);
    EXPECT_EQ(options.movement_limit.value().relative, relative);
  }
  EXPECT_FALSE(decode_options({}).movement_limit);
}

// Bytes as they were recorded: what a field means never changes.
TEST(DecodeOptions, ReadsRecordedBytes) {
  using namespace std::string_literals;
  const auto read = [](const std::string& bytes) {
    v1::SmoothingOptions message;
    EXPECT_TRUE(message.ParseFromString(bytes));
    return decode_options(message);
  };
  const SmoothOptions share = read(
      "\x2a\x02\x08\x03"             // optimize { goal: GOAL_WORST }
      "\x68\x02"                     // tangled_policy: TANGLED_POLICY_REFUSE
      "\x71\0\0\0\0\0\0\xd0\x3f"     // target_quality: 0.25
      "\x79\0\0\0\0\0\0\xc0\x3f"s);  // movement_limit: 0.125
  const SmoothOptions length =
      read("\x89\x01\0\0\0\0\0\0\xe0\x3f"s);  // absolute_movement_limit: 0.5

  EXPECT_EQ(std::get<Optimize>(share.method).goal, Goal::worst);
  EXPECT_EQ(std::get<Optimize>(share.method).target_quality, 0.25);
  EXPECT_EQ(share.tangled, TangledPolicy::refuse);
  EXPECT_EQ(share.movement_limit.value().value, 0.125);
  EXPECT_TRUE(share.movement_limit.value().relative);
  EXPECT_EQ(length.movement_limit.value().value, 0.5);
  EXPECT_FALSE(length.movement_limit.value().relative);
}

TEST(DecodeOptions, PrefersAbsoluteLengths) {
  v1::SmoothingOptions message;
  message.set_convergence_tolerance(0.5);
  message.set_absolute_tolerance(0.25);

  message.set_movement_limit(0.5);
  message.set_absolute_movement_limit(0.125);

  EXPECT_EQ(decode_options(message).tolerance.value, 0.25);
  EXPECT_EQ(decode_options(message).movement_limit.value().value, 0.125);
}

TEST(DecodeOptions, RefusesWhatIsOutOfRangeByItsField) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(refusal([](auto& o) { o.set_max_iteration_count(-1); }),
            "OPTION_OUT_OF_RANGE max_iteration_count");
  EXPECT_EQ(refusal([](auto& o) { o.set_convergence_tolerance(-1); }),
            "OPTION_OUT_OF_RANGE convergence_tolerance");
  EXPECT_EQ(refusal([&](auto& o) { o.set_absolute_tolerance(nan); }),
            "OPTION_OUT_OF_RANGE absolute_tolerance");
  EXPECT_EQ(refusal([](auto& o) { o.mutable_laplacian()->set_relaxation_factor(0); }),
            "OPTION_OUT_OF_RANGE laplacian.relaxation_factor");
  EXPECT_EQ(refusal([](auto& o) { o.mutable_smart_laplacian()->set_relaxation_factor(1.5); }),
            "OPTION_OUT_OF_RANGE smart_laplacian.relaxation_factor");
  EXPECT_EQ(refusal([](auto& o) { o.mutable_taubin()->set_mu(0.5); }),
            "OPTION_OUT_OF_RANGE taubin.mu");
  EXPECT_EQ(refusal([](auto& o) { o.mutable_hc_laplacian()->set_alpha(2); }),
            "OPTION_OUT_OF_RANGE hc_laplacian.alpha");
  EXPECT_EQ(refusal([](auto& o) {
              o.mutable_optimize();
              o.set_target_quality(1);
            }),
            "OPTION_OUT_OF_RANGE target_quality");
  EXPECT_EQ(refusal([](auto& o) { o.set_movement_limit(0); }),
            "OPTION_OUT_OF_RANGE movement_limit");
  EXPECT_EQ(refusal([&](auto& o) { o.set_absolute_movement_limit(nan); }),
            "OPTION_OUT_OF_RANGE absolute_movement_limit");
  EXPECT_EQ(refusal([](auto& o) { o.mutable_compute_budget()->set_seconds(-1); }),
            "OPTION_OUT_OF_RANGE compute_budget");
  EXPECT_EQ(refusal([](auto& o) { o.mutable_compute_budget()->set_nanos(2'000'000'000); }),
            "OPTION_OUT_OF_RANGE compute_budget");
}

TEST(DecodeOptions, RefusesWhatThisServerDoesNotHave) {
  EXPECT_EQ(refusal([](auto& o) {
              o.mutable_optimize();
              o.set_form(v1::FORM_JACOBI);
            }),
            "OPTION_NOT_SUPPORTED form");
  EXPECT_EQ(refusal([](auto& o) {
              o.mutable_laplacian();
              o.set_target_quality(0.5);
            }),
            "OPTION_NOT_SUPPORTED target_quality");
  EXPECT_EQ(refusal([](auto& o) { o.set_feature_angle_degrees(30); }), "accepted");
  EXPECT_EQ(refusal([](auto& o) {
              o.mutable_laplacian();
              o.set_feature_angle_degrees(30);
            }),
            "OPTION_NOT_SUPPORTED feature_angle_degrees");
}

TEST(DecodeOptions, RefusesUnknownEnumValuesInsteadOfTakingTheDefault) {
  EXPECT_EQ(refusal([](auto& o) { o.set_form(static_cast<v1::Form>(99)); }),
            "OPTION_NOT_SUPPORTED form");
  EXPECT_EQ(refusal([](auto& o) {
              o.mutable_laplacian()->set_weighting(static_cast<v1::Weighting>(99));
            }),
            "OPTION_NOT_SUPPORTED laplacian.weighting");
  EXPECT_EQ(refusal([](auto& o) { o.mutable_optimize()->set_goal(static_cast<v1::Goal>(99)); }),
            "OPTION_NOT_SUPPORTED optimize.goal");
  EXPECT_EQ(refusal([](auto& o) { o.set_boundary_policy(static_cast<v1::BoundaryPolicy>(99)); }),
            "OPTION_NOT_SUPPORTED boundary_policy");
  EXPECT_EQ(refusal([](auto& o) { o.set_tangled_policy(static_cast<v1::TangledPolicy>(99)); }),
            "OPTION_NOT_SUPPORTED tangled_policy");
}

// A method that a newer client knows arrives as an unknown field.
TEST(DecodeOptions, RefusesUnknownMethods) {
  EXPECT_EQ(refusal([](auto& o) {
              o.GetReflection()->MutableUnknownFields(&o)->AddLengthDelimited(99, "");
            }),
            "OPTION_NOT_SUPPORTED options#99");
  EXPECT_EQ(refusal([](auto& o) {
              auto* taubin = o.mutable_taubin();
              taubin->GetReflection()->MutableUnknownFields(taubin)->AddVarint(9, 1);
            }),
            "OPTION_NOT_SUPPORTED options.taubin#9");
}

TEST(DecodeDuration, CutsWhatNanosecondsCannotHold) {
  google::protobuf::Duration message;
  message.set_seconds(std::numeric_limits<std::int64_t>::max());

  EXPECT_EQ(decode_duration(message, "queue_timeout"), std::chrono::nanoseconds::max());
}

TEST(ElementTypes, ComeBackAsTheyWereSent) {
  for (const ElementType type : kElementTypes) {
    EXPECT_EQ(decode_element_type(encode_element_type(type), "element_type"), type);
  }
  EXPECT_EQ(v1::ElementType_Name(encode_element_type(ElementType::wedge)), "ELEMENT_TYPE_WEDGE");
  EXPECT_THROW((void)decode_element_type(v1::ELEMENT_TYPE_UNSPECIFIED, "f"), NotSupported);
}

// Every field has its own value, so that two that were swapped are seen.
SmoothSummary full_summary() {
  SmoothSummary s;
  s.stop_reason = StopReason::stagnated;
  s.motion = {.reached = 0.375,
              .step_count = 3,
              .rejected_step_count = 5,
              .linear_iteration_count = 44,
              .linear_residual = 0.5,
              .linear_seconds = 1.5,
              .blocking_element_count = 12,
              .blocking_elements = {7, 9}};
  s.kept_quality = {.metric = QualityMetric::scaled_jacobian,
                    .for_mean_ratio = 51,
                    .for_scaled_jacobian = 52,
                    .for_mean = 53};
  s.fit = {.surface = {.triangles = 61,
                       .patches = 62,
                       .curves = 63,
                       .corners = 64,
                       .open_edges = 65,
                       .non_manifold_edges = 66,
                       .degenerate_triangles = 67},
           .node_count = 68,
           .reached_count = 69,
           .held_count = 70,
           .fixed_count = 71,
           .unmatched_corner_count = 72,
           .unmatched_curve_count = 73,
           .step_count = 74,
           .input_off_surface = true,
           .input_to_surface = {0.5, 0.25},
           .result_to_surface = {0.125, 0.0625},
           .surface_to_result = {2, 1},
           .parts = {{false, 75, {8, 4}}, {true, 76, {32, 16}}}};
  s.poor = {.below = 0.25, .element_count = 43, .locked_count = 41, .limited_count = 2};
  s.convergence = {.iteration_count = 1,
                   .end_rule = EndRule::all_held,
                   .remaining_gain = 0.125,
                   .last_max_displacement = 2,
                   .last_rms_displacement = 3,
                   .tolerance = 4,
                   .bounding_box_diagonal = 5,
                   .held_node_count = 6,
                   .max_displacements = {7, 8},
                   .rms_displacements = {9, 10},
                   .moved_node_counts = {11, 12},
                   .energies = {1.5, 1.25},
                   .worst_mean_ratios = {0.2, 0.3}};
  s.quality_before = {.element_count = 13,
                      .inverted_count = 14,
                      .degenerate_count = 15,
                      .sum_absolute_volume = 16,
                      .metrics = {{.metric = QualityMetric::radius_ratio,
                                   .element_count = 17,
                                   .min = 18,
                                   .percentile_1 = 19,
                                   .mean = 20,
                                   .max = 21,
                                   .histogram_lower = 22,
                                   .histogram_upper = 23,
                                   .histogram = {24, 25}}},
                      .worst = {{26, ElementType::wedge, 27, 28}},
                      .mirrored_count = 62,
                      .mirrored = {3, 5}};
  s.quality_before.enclosed_volume = 50;
  s.quality_before.collapsed_count = 63;
  s.quality_before.interface_count = 64;
  s.quality_after.element_count = 29;
  s.quality_after.enclosed_volume = 51;
  s.locked = {30, 31, ElementQuality{32, ElementType::hexahedron, 33, 34}};
  s.nodes = {.total = 35,
             .boundary = 36,
             .fixed = 37,
             .isolated = 38,
             .moved = 39,
             .between_regions = 52,
             .coincident = 65,
             .paired = 66,
             .sliding_in_plane = 53,
             .sliding_on_line = 54,
             .curved = 55,
             .sliding_on_surface = 56,
             .sliding_on_curve = 57,
             .on_non_manifold_edges = 61};
  s.deviation = {.tolerance = 58, .result_to_input = 59, .input_to_result = 60};
  s.times = {.upload_seconds = 40,
             .find_neighbours_seconds = 41,
             .find_boundary_seconds = 42,
             .iterate_seconds = 43,
             .evaluate_seconds = 44,
             .download_seconds = 45};
  s.backend = "cuda:2";
  s.device_name = "NVIDIA H200";
  s.thread_count = 46;
  s.colour_count = 47;
  s.host_peak_bytes = 48;
  s.device_peak_bytes = 49;
  return s;
}

TEST(DecodeSummary, ReadsWhatEncodeWrote) {
  const SmoothSummary s = decode_summary(encode_summary(full_summary()));

  EXPECT_EQ(s.stop_reason, StopReason::stagnated);
  EXPECT_EQ(s.convergence.end_rule, EndRule::all_held);
  EXPECT_EQ(s.convergence.remaining_gain, 0.125);
  EXPECT_EQ(s.motion.value().reached, 0.375);
  EXPECT_EQ(s.motion->step_count, 3);
  EXPECT_EQ(s.motion->rejected_step_count, 5);
  EXPECT_EQ(s.motion->linear_iteration_count, 44);
  EXPECT_EQ(s.motion->linear_residual, 0.5);
  EXPECT_EQ(s.motion->linear_seconds, 1.5);
  EXPECT_EQ(s.motion->blocking_element_count, 12);
  EXPECT_EQ(s.motion->blocking_elements, (std::vector<std::int64_t>{7, 9}));
  EXPECT_EQ(s.poor.value().below, 0.25);
  EXPECT_EQ(s.poor->element_count, 43);
  EXPECT_EQ(s.poor->locked_count, 41);
  EXPECT_EQ(s.poor->limited_count, 2);
  EXPECT_EQ(s.kept_quality.value().metric, QualityMetric::scaled_jacobian);
  EXPECT_EQ(s.kept_quality->for_mean_ratio, 51);
  EXPECT_EQ(s.kept_quality->for_scaled_jacobian, 52);
  EXPECT_EQ(s.kept_quality->for_mean, 53);
  ASSERT_TRUE(s.fit);
  EXPECT_EQ(s.fit->surface.triangles, 61);
  EXPECT_EQ(s.fit->surface.patches, 62);
  EXPECT_EQ(s.fit->surface.curves, 63);
  EXPECT_EQ(s.fit->surface.corners, 64);
  EXPECT_EQ(s.fit->surface.open_edges, 65);
  EXPECT_EQ(s.fit->surface.non_manifold_edges, 66);
  EXPECT_EQ(s.fit->surface.degenerate_triangles, 67);
  EXPECT_EQ(s.fit->node_count, 68);
  EXPECT_EQ(s.fit->reached_count, 69);
  EXPECT_EQ(s.fit->held_count, 70);
  EXPECT_EQ(s.fit->fixed_count, 71);
  EXPECT_EQ(s.fit->unmatched_corner_count, 72);
  EXPECT_EQ(s.fit->unmatched_curve_count, 73);
  EXPECT_EQ(s.fit->step_count, 74);
  EXPECT_TRUE(s.fit->input_off_surface);
  EXPECT_EQ(s.fit->input_to_surface.largest, 0.5);
  EXPECT_EQ(s.fit->input_to_surface.mean, 0.25);
  EXPECT_EQ(s.fit->result_to_surface.largest, 0.125);
  EXPECT_EQ(s.fit->surface_to_result.mean, 1);
  ASSERT_EQ(s.fit->parts.size(), 2u);
  EXPECT_FALSE(s.fit->parts[0].curve);
  EXPECT_TRUE(s.fit->parts[1].curve);
  EXPECT_EQ(s.fit->parts[1].node_count, 76);
  EXPECT_EQ(s.fit->parts[1].distance.largest, 32);
  EXPECT_EQ(s.convergence.held_node_count, 6);
  EXPECT_THAT(s.convergence.moved_node_counts, ::testing::ElementsAre(11, 12));
  EXPECT_THAT(s.convergence.energies, ::testing::ElementsAre(1.5, 1.25));
  EXPECT_THAT(s.convergence.worst_mean_ratios, ::testing::ElementsAre(0.2, 0.3));
  EXPECT_EQ(s.quality_before.sum_absolute_volume, 16);
  EXPECT_EQ(s.quality_before.metrics.at(0).metric, QualityMetric::radius_ratio);
  EXPECT_THAT(s.quality_before.metrics.at(0).histogram, ::testing::ElementsAre(24, 25));
  EXPECT_EQ(s.quality_before.worst.at(0).type, ElementType::wedge);
  EXPECT_EQ(s.quality_before.enclosed_volume, 50);
  EXPECT_EQ(s.quality_before.mirrored_count, 62);
  EXPECT_THAT(s.quality_before.mirrored, ::testing::ElementsAre(3, 5));
  EXPECT_EQ(s.quality_before.collapsed_count, 63);
  EXPECT_EQ(s.quality_before.interface_count, 64);
  EXPECT_EQ(s.nodes.coincident, 65);
  EXPECT_EQ(s.nodes.paired, 66);
  EXPECT_EQ(s.quality_after.element_count, 29);
  EXPECT_EQ(s.locked.worst.value().element, 32);
  EXPECT_EQ(s.nodes.isolated, 38);
  EXPECT_EQ(s.nodes.between_regions, 52);
  EXPECT_EQ(s.nodes.sliding_in_plane, 53);
  EXPECT_EQ(s.nodes.sliding_on_line, 54);
  EXPECT_EQ(s.nodes.curved, 55);
  EXPECT_EQ(s.nodes.sliding_on_surface, 56);
  EXPECT_EQ(s.nodes.sliding_on_curve, 57);
  EXPECT_EQ(s.nodes.on_non_manifold_edges, 61);
  EXPECT_EQ(s.deviation.tolerance, 58);
  EXPECT_EQ(s.deviation.result_to_input, 59);
  EXPECT_EQ(s.deviation.input_to_result, 60);
  EXPECT_EQ(s.times.evaluate_seconds, 44);
  EXPECT_EQ(s.backend, "cuda:2");
  EXPECT_EQ(s.device_name, "NVIDIA H200");
  EXPECT_EQ(s.thread_count, 46);
  EXPECT_EQ(s.device_peak_bytes, 49);
}

TEST(DecodeSummary, LosesNothingInBothDirections) {
  const v1::Summary once = encode_summary(full_summary());

  EXPECT_TRUE(MessageDifferencer::Equals(once, encode_summary(decode_summary(once))));
}

TEST(EncodeSummary, SetsEveryFieldThatCoreKnows) {
  const std::string json = to_json(encode_summary(full_summary()));

  for (int value = 1; value <= 51; ++value) {
    EXPECT_THAT(json, ::testing::ContainsRegex("[^0-9]" + std::to_string(value) + "[^0-9]"));
  }
}

TEST(DecodeSummary, LeavesOutMetricsOfNewerServers) {
  v1::Summary message = encode_summary(full_summary());
  message.mutable_quality_before()->add_metrics()->set_metric(static_cast<v1::QualityMetric>(99));

  EXPECT_EQ(decode_summary(message).quality_before.metrics.size(), 1U);
}

TEST(DecodeSummary, RefusesAStopReasonItDoesNotKnow) {
  v1::Summary message = encode_summary(full_summary());
  message.set_stop_reason(static_cast<v1::StopReason>(99));

  EXPECT_THROW((void)decode_summary(message), NotSupported);
}

google::protobuf::RepeatedField<int> metric_list(std::initializer_list<int> metrics) {
  return {metrics.begin(), metrics.end()};
}

TEST(DecodeMetrics, DecodesEveryMetric) {
  google::protobuf::RepeatedField<int> list;
  for (const QualityMetric metric : kQualityMetrics) list.Add(encode_enum(metric));

  EXPECT_EQ(decode_metrics(list),
            std::vector<QualityMetric>(kQualityMetrics.begin(), kQualityMetrics.end()));
  EXPECT_EQ(list.size() + 1, v1::QualityMetric_ARRAYSIZE);
  EXPECT_TRUE(decode_metrics({}).empty());
}

TEST(DecodeMetrics, RefusesWhatIsUnknownOrListedTwice) {
  for (const int unknown : {0, 8, -1, INT32_MAX}) {
    EXPECT_THROW((void)decode_metrics(metric_list({1, unknown})), NotSupported) << unknown;
  }
  EXPECT_THROW((void)decode_metrics(metric_list({2, 1, 2})), InvalidOption);
}

TEST(ToJson, KeepsFieldNamesAndPrintsZeros) {
  v1::QualityStats message;
  message.set_element_count(5);

  const std::string json = to_json(message);

  EXPECT_THAT(json, ::testing::HasSubstr("\"element_count\": \"5\""));
  EXPECT_THAT(json, ::testing::HasSubstr("\"inverted_element_count\": \"0\""));
}

/// Whether there is JSON of the message, found out by making it.
bool can_be_written(const google::protobuf::Message& message) {
  try {
    return !to_json(message).empty();
  } catch (const Error&) {
    return false;
  }
}

TEST(HasJson, SaysWhetherItCanBeWritten) {
  struct Time {
    std::int64_t seconds;
    std::int32_t nanos;
    bool is_duration;
    bool is_timestamp;
  };
  for (const Time& time :
       {Time{0, 0, true, true}, Time{0, -1, true, false}, Time{0, 999'999'999, true, true},
        Time{0, 1'000'000'000, false, false}, Time{-1, 0, true, true}, Time{-1, 1, false, true},
        Time{253'402'300'799, 0, true, true}, Time{253'402'300'800, 0, true, false},
        Time{-62'135'596'800, 0, true, true}, Time{-62'135'596'801, 0, true, false},
        Time{315'576'000'000, 0, true, false}, Time{315'576'000'001, 0, false, false},
        Time{-315'576'000'001, 0, false, false}, Time{INT64_MAX, INT32_MAX, false, false},
        Time{INT64_MIN, INT32_MIN, false, false}}) {
    v1::ListJobsResponse response;
    (*response.add_jobs()->mutable_error()->mutable_metadata())["key"] = "value";
    v1::Job& job = *response.add_jobs();
    auto& budget = *job.mutable_summary()->mutable_options()->mutable_compute_budget();
    budget.set_seconds(time.seconds);
    budget.set_nanos(time.nanos);
    EXPECT_EQ(has_json(response), time.is_duration) << time.seconds << ' ' << time.nanos;
    EXPECT_EQ(can_be_written(response), time.is_duration) << time.seconds << ' ' << time.nanos;
    job.clear_summary();
    job.mutable_end_time()->set_seconds(time.seconds);
    job.mutable_end_time()->set_nanos(time.nanos);
    EXPECT_EQ(has_json(response), time.is_timestamp) << time.seconds << ' ' << time.nanos;
    EXPECT_EQ(can_be_written(response), time.is_timestamp) << time.seconds << ' ' << time.nanos;
  }
}

TEST(RefuseUnknownFields, NamesTheMessageHoweverDeep) {
  const auto refused_field = [](const v1::JobSpec& spec) -> std::string {
    try {
      refuse_unknown_fields(spec);
    } catch (const NotSupported& error) {
      return error.details().front().second;
    }
    return "";
  };
  v1::JobSpec spec;
  v1::ElementBlock* const block = spec.mutable_inline_topology()->add_element_blocks();
  spec.mutable_options()->mutable_laplacian();
  EXPECT_EQ(refused_field(spec), "");

  const auto add_unknown = [](google::protobuf::Message& message) {
    message.GetReflection()->MutableUnknownFields(&message)->AddVarint(999, 1);
  };
  add_unknown(spec);
  EXPECT_EQ(refused_field(spec), "JobSpec#999");
  spec.DiscardUnknownFields();
  add_unknown(*block);
  EXPECT_EQ(refused_field(spec), "inline_topology.element_blocks#999");
  spec.DiscardUnknownFields();
  add_unknown(*spec.mutable_options()->mutable_laplacian());
  EXPECT_EQ(refused_field(spec), "options.laplacian#999");
}

}  // namespace
}  // namespace meshsmooth::wire
