#include "wire/codec.hpp"

#include <google/protobuf/unknown_field_set.h>
#include <google/protobuf/util/json_util.h>
#include <google/protobuf/util/time_util.h>

#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "meshsmooth/error.hpp"

namespace meshsmooth::wire {
namespace {

using google::protobuf::util::TimeUtil;

[[noreturn]] void throw_not_supported(const std::string& field, const std::string& what) {
  throw NotSupported("OPTION_NOT_SUPPORTED", field + ": " + what, {{"field", field}});
}

void refuse_unknown_fields(const google::protobuf::Message& message, const std::string& where) {
  const auto& unknown = message.GetReflection()->GetUnknownFields(message);
  if (unknown.empty()) return;
  const std::string number = std::to_string(unknown.field(0).number());
  throw_not_supported(where + "#" + number,
                      "this server does not know field number " + number + "; it may be too old");
}

Weighting decode_weighting(v1::Weighting weighting, const std::string& field) {
  switch (weighting) {
    case v1::WEIGHTING_UNSPECIFIED:
    case v1::WEIGHTING_UNIFORM:
      return Weighting::uniform;
    case v1::WEIGHTING_INVERSE_EDGE_LENGTH:
      return Weighting::inverse_edge_length;
    case v1::WEIGHTING_EDGE_LENGTH:
      return Weighting::edge_length;
    case v1::WEIGHTING_BALL_VOLUME:
      return Weighting::ball_volume;
    default:
      throw_not_supported(field, "unknown weighting " + std::to_string(weighting));
  }
}

v1::Weighting encode_weighting(Weighting weighting) {
  switch (weighting) {
    case Weighting::uniform:
      return v1::WEIGHTING_UNIFORM;
    case Weighting::inverse_edge_length:
      return v1::WEIGHTING_INVERSE_EDGE_LENGTH;
    case Weighting::edge_length:
      return v1::WEIGHTING_EDGE_LENGTH;
    case Weighting::ball_volume:
      return v1::WEIGHTING_BALL_VOLUME;
  }
  __builtin_unreachable();
}

template <class Averaging, class Message>
Averaging decode_averaging(const Message& message, const std::string& name) {
  refuse_unknown_fields(message, name);
  Averaging method;
  method.weighting = decode_weighting(message.weighting(), name + ".weighting");
  if (message.has_relaxation_factor()) method.relaxation = message.relaxation_factor();
  return method;
}

Goal decode_goal(v1::Goal goal) {
  switch (goal) {
    case v1::GOAL_AVERAGE:
      return Goal::average;
    case v1::GOAL_UNSPECIFIED:
    case v1::GOAL_BALANCED:
      return Goal::balanced;
    case v1::GOAL_WORST:
      return Goal::worst;
    default:
      throw_not_supported("optimize.goal", "unknown goal " + std::to_string(goal));
  }
}

Method decode_method(const v1::SmoothingOptions& message, const Method& fallback) {
  switch (message.method_case()) {
    case v1::SmoothingOptions::METHOD_NOT_SET:
      return fallback;
    case v1::SmoothingOptions::kLaplacian:
      return decode_averaging<Laplacian>(message.laplacian(), "laplacian");
    case v1::SmoothingOptions::kSmartLaplacian:
      return decode_averaging<SmartLaplacian>(message.smart_laplacian(), "smart_laplacian");
    case v1::SmoothingOptions::kTaubin: {
      refuse_unknown_fields(message.taubin(), "taubin");
      Taubin method;
      if (message.taubin().has_lambda()) method.lambda = message.taubin().lambda();
      if (message.taubin().has_mu()) method.mu = message.taubin().mu();
      return method;
    }
    case v1::SmoothingOptions::kHcLaplacian: {
      refuse_unknown_fields(message.hc_laplacian(), "hc_laplacian");
      HcLaplacian method;
      if (message.hc_laplacian().has_alpha()) method.alpha = message.hc_laplacian().alpha();
      if (message.hc_laplacian().has_beta()) method.beta = message.hc_laplacian().beta();
      return method;
    }
    case v1::SmoothingOptions::kOptimize: {
      refuse_unknown_fields(message.optimize(), "optimize");
      Optimize method;
      method.goal = decode_goal(message.optimize().goal());
      if (message.has_target_quality()) method.target_quality = message.target_quality();
      return method;
    }
  }
  __builtin_unreachable();
}

v1::Goal encode_goal(Goal goal) {
  switch (goal) {
    case Goal::average:
      return v1::GOAL_AVERAGE;
    case Goal::balanced:
      return v1::GOAL_BALANCED;
    case Goal::worst:
      return v1::GOAL_WORST;
  }
  __builtin_unreachable();
}

struct EncodeMethod {
  v1::SmoothingOptions& message;

  void operator()(const Laplacian& method) const {
    message.mutable_laplacian()->set_weighting(encode_weighting(method.weighting));
    message.mutable_laplacian()->set_relaxation_factor(method.relaxation);
  }
  void operator()(const SmartLaplacian& method) const {
    message.mutable_smart_laplacian()->set_weighting(encode_weighting(method.weighting));
    message.mutable_smart_laplacian()->set_relaxation_factor(method.relaxation);
  }
  void operator()(const Taubin& method) const {
    message.mutable_taubin()->set_lambda(method.lambda);
    message.mutable_taubin()->set_mu(method.mu);
  }
  void operator()(const HcLaplacian& method) const {
    message.mutable_hc_laplacian()->set_alpha(method.alpha);
    message.mutable_hc_laplacian()->set_beta(method.beta);
  }
  void operator()(const Optimize& method) const {
    message.mutable_optimize()->set_goal(encode_goal(method.goal));
    message.set_target_quality(method.target_quality);
  }
};

Form decode_form(v1::Form form) {
  switch (form) {
    case v1::FORM_UNSPECIFIED:
      return Form::automatic;
    case v1::FORM_JACOBI:
      return Form::jacobi;
    case v1::FORM_GAUSS_SEIDEL:
      return Form::gauss_seidel;
    case v1::FORM_ASYNCHRONOUS:
      return Form::asynchronous;
    default:
      throw_not_supported("form", "unknown form " + std::to_string(form));
  }
}

v1::Form encode_form(Form form) {
  switch (form) {
    case Form::automatic:
      return v1::FORM_UNSPECIFIED;
    case Form::jacobi:
      return v1::FORM_JACOBI;
    case Form::gauss_seidel:
      return v1::FORM_GAUSS_SEIDEL;
    case Form::asynchronous:
      return v1::FORM_ASYNCHRONOUS;
  }
  __builtin_unreachable();
}

BoundaryPolicy decode_boundary(v1::BoundaryPolicy policy) {
  switch (policy) {
    case v1::BOUNDARY_POLICY_UNSPECIFIED:
    case v1::BOUNDARY_POLICY_FIXED:
      return BoundaryPolicy::fixed;
    case v1::BOUNDARY_POLICY_FREE:
      return BoundaryPolicy::free;
    case v1::BOUNDARY_POLICY_SLIDE:
      return BoundaryPolicy::slide;
    default:
      throw_not_supported("boundary_policy", "unknown policy " + std::to_string(policy));
  }
}

v1::BoundaryPolicy encode_boundary(BoundaryPolicy policy) {
  switch (policy) {
    case BoundaryPolicy::fixed:
      return v1::BOUNDARY_POLICY_FIXED;
    case BoundaryPolicy::free:
      return v1::BOUNDARY_POLICY_FREE;
    case BoundaryPolicy::slide:
      return v1::BOUNDARY_POLICY_SLIDE;
  }
  __builtin_unreachable();
}

TangledPolicy decode_tangled(v1::TangledPolicy policy) {
  switch (policy) {
    case v1::TANGLED_POLICY_UNSPECIFIED:
    case v1::TANGLED_POLICY_REPAIR:
      return TangledPolicy::repair;
    case v1::TANGLED_POLICY_REFUSE:
      return TangledPolicy::refuse;
    default:
      throw_not_supported("tangled_policy", "unknown policy " + std::to_string(policy));
  }
}

constexpr std::int32_t kMaxNanos = 999'999'999;

bool is_timestamp(const google::protobuf::Timestamp& message) {
  return message.seconds() >= TimeUtil::kTimestampMinSeconds &&
         message.seconds() <= TimeUtil::kTimestampMaxSeconds && message.nanos() >= 0 &&
         message.nanos() <= kMaxNanos;
}

}  // namespace

v1::SmoothingOptions encode_options(const SmoothOptions& options) {
  v1::SmoothingOptions message;
  std::visit(EncodeMethod{message}, options.method);
  message.set_form(encode_form(options.form));
  message.set_max_iteration_count(options.max_iterations);
  if (options.tolerance.relative) {
    message.set_convergence_tolerance(options.tolerance.value);
  } else {
    message.set_absolute_tolerance(options.tolerance.value);
  }
  message.set_boundary_policy(encode_boundary(options.boundary));
  if (options.boundary == BoundaryPolicy::slide) {
    message.set_feature_angle_degrees(options.feature_angle);
  }
  message.set_guard(options.guard);
  message.set_tangled_policy(options.tangled == TangledPolicy::repair ? v1::TANGLED_POLICY_REPAIR
                                                                      : v1::TANGLED_POLICY_REFUSE);
  if (options.movement_limit) {
    if (options.movement_limit->relative) {
      message.set_movement_limit(options.movement_limit->value);
    } else {
      message.set_absolute_movement_limit(options.movement_limit->value);
    }
  }
  if (options.compute_budget) {
    *message.mutable_compute_budget() = encode_duration(*options.compute_budget);
  }
  return message;
}

SmoothOptions decode_options(const v1::SmoothingOptions& message) {
  refuse_unknown_fields(message, "options");
  if (message.has_feature_angle_degrees() &&
      message.boundary_policy() != v1::BOUNDARY_POLICY_SLIDE) {
    throw_not_supported("feature_angle_degrees", "only a boundary that sliding has it");
  }
  if (message.has_target_quality() && !message.has_optimize()) {
    throw_not_supported("target_quality", "only optimize stops at a quality");
  }
  SmoothOptions options;
  options.method = decode_method(message, options.method);
  options.form = decode_form(message.form());
  if (message.has_max_iteration_count()) options.max_iterations = message.max_iteration_count();
  if (message.has_absolute_tolerance()) {
    options.tolerance = {.value = message.absolute_tolerance(), .relative = false};
  } else if (message.has_convergence_tolerance()) {
    options.tolerance = {.value = message.convergence_tolerance(), .relative = true};
  }
  options.boundary = decode_boundary(message.boundary_policy());
  if (message.has_feature_angle_degrees()) options.feature_angle = message.feature_angle_degrees();
  if (message.has_guard()) options.guard = message.guard();
  options.tangled = decode_tangled(message.tangled_policy());
  if (message.has_absolute_movement_limit()) {
    options.movement_limit = {.value = message.absolute_movement_limit(), .relative = false};
  } else if (message.has_movement_limit()) {
    options.movement_limit = {.value = message.movement_limit(), .relative = true};
  }
  if (message.has_compute_budget()) {
    options.compute_budget = decode_duration(message.compute_budget(), "compute_budget");
  }
  validate(options);
  return options;
}

v1::ElementType encode_element_type(ElementType type) {
  return static_cast<v1::ElementType>(static_cast<int>(type) + 1);
}

ElementType decode_element_type(v1::ElementType type, const std::string& field) {
  if (type < v1::ELEMENT_TYPE_TRIANGLE || type > v1::ELEMENT_TYPE_HEXAHEDRON) {
    throw_not_supported(field, "unknown element type " + std::to_string(type));
  }
  return static_cast<ElementType>(static_cast<int>(type) - 1);
}

static_assert(static_cast<int>(ElementType::triangle) + 1 == v1::ELEMENT_TYPE_TRIANGLE &&
              static_cast<int>(ElementType::hexahedron) + 1 == v1::ELEMENT_TYPE_HEXAHEDRON);

v1::Stage encode_stage(Stage stage) {
  switch (stage) {
    case Stage::find_neighbours:
      return v1::STAGE_FIND_NEIGHBOURS;
    case Stage::find_boundary:
      return v1::STAGE_FIND_BOUNDARY;
    case Stage::iterate:
      return v1::STAGE_ITERATE;
    case Stage::evaluate:
      return v1::STAGE_EVALUATE;
  }
  __builtin_unreachable();
}

std::chrono::nanoseconds decode_duration(const google::protobuf::Duration& message,
                                         const std::string& field) {
  constexpr std::int64_t kNanosPerSecond = 1'000'000'000;
  if (message.seconds() < 0 || message.nanos() < 0 || message.nanos() >= kNanosPerSecond) {
    throw InvalidOption("OPTION_OUT_OF_RANGE", field + ": not a duration of 0 or more",
                        {{"field", field}});
  }
  if (message.seconds() >= std::numeric_limits<std::int64_t>::max() / kNanosPerSecond) {
    return std::chrono::nanoseconds::max();
  }
  return std::chrono::nanoseconds(message.seconds() * kNanosPerSecond + message.nanos());
}

google::protobuf::Duration encode_duration(std::chrono::nanoseconds duration) {
  return TimeUtil::NanosecondsToDuration(duration.count());
}

google::protobuf::Duration encode_seconds(double seconds) {
  return TimeUtil::NanosecondsToDuration(std::llround(seconds * 1e9));
}

bool is_duration(const google::protobuf::Duration& message) {
  const bool one_sign = message.seconds() == 0 || message.nanos() == 0 ||
                        (message.seconds() < 0) == (message.nanos() < 0);
  return message.seconds() >= TimeUtil::kDurationMinSeconds &&
         message.seconds() <= TimeUtil::kDurationMaxSeconds && message.nanos() >= -kMaxNanos &&
         message.nanos() <= kMaxNanos && one_sign;
}

double decode_seconds(const google::protobuf::Duration& message) {
  if (!is_duration(message)) {
    throw InvalidOption("OPTION_OUT_OF_RANGE", "a number of seconds that is no duration");
  }
  return static_cast<double>(message.seconds()) + message.nanos() * 1e-9;
}

std::string to_json(const google::protobuf::Message& message) {
  google::protobuf::util::JsonPrintOptions options;
  options.add_whitespace = true;
  options.always_print_primitive_fields = true;
  options.preserve_proto_field_names = true;
  std::string text;
  const auto status = google::protobuf::util::MessageToJsonString(message, &text, options);
  if (!status.ok()) throw Error("INTERNAL", "cannot write JSON: " + status.ToString());
  return text;
}

// By reflection, so that a field that is added is not forgotten.
bool has_json(const google::protobuf::Message& message) {
  if (const auto* duration = dynamic_cast<const google::protobuf::Duration*>(&message)) {
    return is_duration(*duration);
  }
  if (const auto* time = dynamic_cast<const google::protobuf::Timestamp*>(&message)) {
    return is_timestamp(*time);
  }
  using Field = google::protobuf::FieldDescriptor;
  const google::protobuf::Reflection& reflection = *message.GetReflection();
  std::vector<const Field*> fields;
  reflection.ListFields(message, &fields);
  for (const Field* field : fields) {
    if (field->cpp_type() != Field::CPPTYPE_MESSAGE) continue;
    // Asked for its entries, a map makes them all.
    if (field->is_map() &&
        field->message_type()->map_value()->cpp_type() != Field::CPPTYPE_MESSAGE) {
      continue;
    }
    if (!field->is_repeated()) {
      if (!has_json(reflection.GetMessage(message, field))) return false;
      continue;
    }
    for (int i = 0; i < reflection.FieldSize(message, field); ++i) {
      if (!has_json(reflection.GetRepeatedMessage(message, field, i))) return false;
    }
  }
  return true;
}

}  // namespace meshsmooth::wire
