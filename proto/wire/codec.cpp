#include "wire/codec.hpp"

#include <google/protobuf/unknown_field_set.h>

#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include "meshsmooth/option_table.hpp"
#include "wire/field_value.hpp"

namespace meshsmooth::wire {
namespace {

// Where a field of a method stands: in the options themselves or in the method's message.
template <class M, class Field>
constexpr bool stands_in_options(const Field&) {
  return false;
}
template <class M>
constexpr bool stands_in_options(const NumberField<M>& field) {
  return field.in_options;
}

// "taubin.mu", "target_quality".
template <class M, class Field>
std::string path_of(const Field& field) {
  const std::string name(field.name);
  return stands_in_options<M>(field) ? name : std::string(MethodTraits<M>::name) + "." + name;
}

template <class M>
void encode_method(const M& method, v1::SmoothingOptions& options) {
  Message& own =
      *options.GetReflection()->MutableMessage(&options, &field_of(options, MethodTraits<M>::name));
  for_each_field<M>([&](const auto& field) {
    Message& target = stands_in_options<M>(field) ? options : own;
    set_field(target, field_of(target, field.name), method.*field.member);
  });
}

template <class M>
M decode_method(const v1::SmoothingOptions& options) {
  const Message& own =
      options.GetReflection()->GetMessage(options, &field_of(options, MethodTraits<M>::name));
  M method;
  for_each_field<M>([&](const auto& field) {
    const Message& source = stands_in_options<M>(field) ? options : own;
    get_field(source, field_of(source, field.name), path_of<M>(field), field.name,
              method.*field.member);
  });
  return method;
}

// Of the method that the options name; unset: the default.
Method decode_method(const v1::SmoothingOptions& options) {
  Method method = SmoothOptions{}.method;
  const bool unset = options.method_case() == v1::SmoothingOptions::METHOD_NOT_SET;
  const Method by_default = method;
  for_each_method([&]<class M>(const M&) {
    const FieldDescriptor& own = field_of(options, MethodTraits<M>::name);
    if (options.GetReflection()->HasField(options, &own) ||
        (unset && std::holds_alternative<M>(by_default))) {
      method = decode_method<M>(options);
      return;
    }
    for_each_field<M>([&](const auto& field) {
      if (!stands_in_options<M>(field)) return;
      if (options.GetReflection()->HasField(options, &field_of(options, field.name))) {
        throw_not_supported(std::string(field.name),
                            "only " + std::string(MethodTraits<M>::name) + " has it");
      }
    });
  });
  return method;
}

// Of the members of the options that the wire has as they are.
template <class Visit>
void for_each_option(const v1::SmoothingOptions& message, const Visit& visit) {
  std::apply(
      [&](const auto&... options) { (visit(options, field_of(message, options.name)), ...); },
      kOptionFields);
}

QualityMetric decode_metric(int metric, const std::string& field) {
  return decode_choice<QualityMetric>(metric, field, "metric");
}

std::string path_to(const std::string& where, const FieldDescriptor& field) {
  return (where.empty() ? "" : where + ".") + std::string(field.name());
}

}  // namespace

void refuse_unknown_fields(const Message& message, const std::string& where) {
  const google::protobuf::Reflection& reflection = *message.GetReflection();
  if (const auto& unknown = reflection.GetUnknownFields(message); !unknown.empty()) {
    const std::string number = std::to_string(unknown.field(0).number());
    throw_not_supported(
        (where.empty() ? std::string(message.GetDescriptor()->name()) : where) + "#" + number,
        "this server does not know field number " + number + "; it may be too old");
  }
  std::vector<const FieldDescriptor*> set;
  reflection.ListFields(message, &set);
  for (const FieldDescriptor* field : set) {
    if (field->cpp_type() != FieldDescriptor::CPPTYPE_MESSAGE) continue;
    const std::string path = path_to(where, *field);
    if (!field->is_repeated()) refuse_unknown_fields(reflection.GetMessage(message, field), path);
    for (int i = 0; field->is_repeated() && i < reflection.FieldSize(message, field); ++i) {
      refuse_unknown_fields(reflection.GetRepeatedMessage(message, field, i), path);
    }
  }
}

v1::SmoothingOptions encode_options(const SmoothOptions& options) {
  v1::SmoothingOptions message;
  std::visit([&](const auto& method) { encode_method(method, message); }, options.method);
  if (aims_at_reference(options)) message.mutable_optimize()->set_target(v1::TARGET_REFERENCE);
  for_each_option(message, [&](const auto& option, const FieldDescriptor& field) {
    set_field(message, field, options.*option.member);
  });
  message.set_max_iteration_count(iteration_limit(options));
  if (options.tolerance.relative) {
    message.set_convergence_tolerance(options.tolerance.value);
  } else {
    message.set_absolute_tolerance(options.tolerance.value);
  }
  if (options.boundary == BoundaryPolicy::slide || sweeps_as_optimize(options.method)) {
    message.set_feature_angle_degrees(options.feature_angle);
  }
  if (options.movement_limit) {
    if (options.movement_limit->relative) {
      message.set_movement_limit(options.movement_limit->value);
    } else {
      message.set_absolute_movement_limit(options.movement_limit->value);
    }
  }
  if (options.only_below) {
    message.set_only_below(options.only_below->quality);
    message.set_only_below_rings(options.only_below->rings);
  }
  return message;
}

SmoothOptions decode_options(const v1::SmoothingOptions& message) {
  refuse_unknown_fields(message, "options");
  SmoothOptions options;
  options.method = decode_method(message);
  if (message.has_feature_angle_degrees() &&
      message.boundary_policy() != v1::BOUNDARY_POLICY_SLIDE &&
      !sweeps_as_optimize(options.method)) {
    throw_not_supported("feature_angle_degrees", "only a sliding boundary and optimize have it");
  }
  for_each_option(message, [&](const auto& option, const FieldDescriptor& field) {
    get_field(message, field, std::string(option.name), option.noun, options.*option.member);
  });
  if (message.has_max_iteration_count()) options.max_iterations = message.max_iteration_count();
  if (message.has_absolute_tolerance()) {
    options.tolerance = {.value = message.absolute_tolerance(), .relative = false};
  } else if (message.has_convergence_tolerance()) {
    options.tolerance = {.value = message.convergence_tolerance(), .relative = true};
  }
  if (message.has_feature_angle_degrees()) options.feature_angle = message.feature_angle_degrees();
  if (message.has_absolute_movement_limit()) {
    options.movement_limit = {.value = message.absolute_movement_limit(), .relative = false};
  } else if (message.has_movement_limit()) {
    options.movement_limit = {.value = message.movement_limit(), .relative = true};
  }
  if (message.has_only_below()) {
    options.only_below = {.quality = message.only_below()};
    if (message.has_only_below_rings()) options.only_below->rings = message.only_below_rings();
  } else if (message.has_only_below_rings()) {
    throw_not_supported("only_below_rings", "only a job with only_below has it");
  }
  validate(options);
  return options;
}

std::vector<QualityMetric> decode_metrics(const google::protobuf::RepeatedField<int>& metrics) {
  std::vector<QualityMetric> result;
  for (const int metric : metrics) {
    result.push_back(decode_metric(metric, "element_quality_metrics"));
  }
  validate_metrics(result);
  return result;
}

v1::ElementType encode_element_type(ElementType type) {
  return static_cast<v1::ElementType>(static_cast<int>(type) + 1);
}

ElementType decode_element_type(v1::ElementType type, const std::string& field) {
  if (type == v1::ELEMENT_TYPE_UNSPECIFIED || !v1::ElementType_IsValid(type)) {
    throw_not_supported(field, "unknown element type " + std::to_string(type));
  }
  return static_cast<ElementType>(static_cast<int>(type) - 1);
}

static_assert(static_cast<int>(ElementType::triangle) + 1 == v1::ELEMENT_TYPE_TRIANGLE &&
              static_cast<int>(ElementType::hexahedron) + 1 == v1::ELEMENT_TYPE_HEXAHEDRON &&
              static_cast<int>(ElementType::tetrahedron10) + 1 == v1::ELEMENT_TYPE_TETRAHEDRON10 &&
              static_cast<int>(ElementType::hexahedron27) + 1 == v1::ELEMENT_TYPE_HEXAHEDRON27 &&
              kElementTypeCount + 1 == v1::ElementType_ARRAYSIZE);

JobState decode_state(v1::State state) {
  return decode_enum<JobState>(state).value_or(JobState::unspecified);
}

}  // namespace meshsmooth::wire
