#pragma once

// Made by scripts/tables from proto/declaration; do not edit.
// clang-format off

#include "meshsmooth/enums.hpp"
#include "meshsmooth/v1/smoothing.pb.h"

namespace meshsmooth::wire {

/// What an enumeration is on the wire: its type there, and the number of its first enumerator.
template <class Enum>
struct WireEnum;

template <>
struct WireEnum<Form> {
  using Type = v1::Form;
  static constexpr int first = 0;
};
static_assert(v1::FORM_UNSPECIFIED == 0 &&
              v1::FORM_JACOBI == 1 &&
              v1::FORM_GAUSS_SEIDEL == 2 &&
              v1::FORM_ASYNCHRONOUS == 3 &&
              v1::Form_ARRAYSIZE == 4);

template <>
struct WireEnum<Weighting> {
  using Type = v1::Weighting;
  static constexpr int first = 1;
};
static_assert(v1::WEIGHTING_UNSPECIFIED == 0 &&
              v1::WEIGHTING_UNIFORM == 1 &&
              v1::WEIGHTING_INVERSE_EDGE_LENGTH == 2 &&
              v1::WEIGHTING_EDGE_LENGTH == 3 &&
              v1::WEIGHTING_BALL_VOLUME == 4 &&
              v1::Weighting_ARRAYSIZE == 5);

template <>
struct WireEnum<Window> {
  using Type = v1::Window;
  static constexpr int first = 1;
};
static_assert(v1::WINDOW_UNSPECIFIED == 0 &&
              v1::WINDOW_NUTTALL == 1 &&
              v1::WINDOW_HAMMING == 2 &&
              v1::Window_ARRAYSIZE == 3);

template <>
struct WireEnum<Goal> {
  using Type = v1::Goal;
  static constexpr int first = 1;
};
static_assert(v1::GOAL_UNSPECIFIED == 0 &&
              v1::GOAL_AVERAGE == 1 &&
              v1::GOAL_BALANCED == 2 &&
              v1::GOAL_WORST == 3 &&
              v1::Goal_ARRAYSIZE == 4);

template <>
struct WireEnum<Target> {
  using Type = v1::Target;
  static constexpr int first = 1;
};
static_assert(v1::TARGET_UNSPECIFIED == 0 &&
              v1::TARGET_AUTOMATIC == 1 &&
              v1::TARGET_IDEAL == 2 &&
              v1::TARGET_INPUT == 3 &&
              v1::TARGET_REFERENCE == 4 &&
              v1::Target_ARRAYSIZE == 5);

template <>
struct WireEnum<Start> {
  using Type = v1::Start;
  static constexpr int first = 1;
};
static_assert(v1::START_UNSPECIFIED == 0 &&
              v1::START_COLD == 1 &&
              v1::START_WARM == 2 &&
              v1::Start_ARRAYSIZE == 3);

template <>
struct WireEnum<Derivative> {
  using Type = v1::Derivative;
  static constexpr int first = 1;
};
static_assert(v1::DERIVATIVE_UNSPECIFIED == 0 &&
              v1::DERIVATIVE_NONE == 1 &&
              v1::DERIVATIVE_TANGENT == 2 &&
              v1::DERIVATIVE_COTANGENT == 3 &&
              v1::Derivative_ARRAYSIZE == 4);

template <>
struct WireEnum<BoundaryPolicy> {
  using Type = v1::BoundaryPolicy;
  static constexpr int first = 1;
};
static_assert(v1::BOUNDARY_POLICY_UNSPECIFIED == 0 &&
              v1::BOUNDARY_POLICY_FIXED == 1 &&
              v1::BOUNDARY_POLICY_SLIDE == 2 &&
              v1::BOUNDARY_POLICY_FREE == 3 &&
              v1::BoundaryPolicy_ARRAYSIZE == 4);

template <>
struct WireEnum<TangledPolicy> {
  using Type = v1::TangledPolicy;
  static constexpr int first = 1;
};
static_assert(v1::TANGLED_POLICY_UNSPECIFIED == 0 &&
              v1::TANGLED_POLICY_REPAIR == 1 &&
              v1::TANGLED_POLICY_REFUSE == 2 &&
              v1::TangledPolicy_ARRAYSIZE == 3);

template <>
struct WireEnum<QualityDetail> {
  using Type = v1::QualityDetail;
  static constexpr int first = 1;
};
static_assert(v1::QUALITY_DETAIL_UNSPECIFIED == 0 &&
              v1::QUALITY_DETAIL_FULL == 1 &&
              v1::QUALITY_DETAIL_BRIEF == 2 &&
              v1::QualityDetail_ARRAYSIZE == 3);

template <>
struct WireEnum<QualityMetric> {
  using Type = v1::QualityMetric;
  static constexpr int first = 1;
};
static_assert(v1::QUALITY_METRIC_UNSPECIFIED == 0 &&
              v1::QUALITY_METRIC_MEAN_RATIO == 1 &&
              v1::QUALITY_METRIC_SCALED_JACOBIAN == 2 &&
              v1::QUALITY_METRIC_RADIUS_RATIO == 3 &&
              v1::QUALITY_METRIC_MIN_DIHEDRAL_ANGLE == 4 &&
              v1::QUALITY_METRIC_MAX_DIHEDRAL_ANGLE == 5 &&
              v1::QUALITY_METRIC_MIN_ANGLE == 6 &&
              v1::QUALITY_METRIC_MAX_ANGLE == 7 &&
              v1::QualityMetric_ARRAYSIZE == 8);

template <>
struct WireEnum<BackendKind> {
  using Type = v1::BackendKind;
  static constexpr int first = 0;
};
static_assert(v1::BACKEND_KIND_UNSPECIFIED == 0 &&
              v1::BACKEND_KIND_CPU == 1 &&
              v1::BACKEND_KIND_CUDA == 2 &&
              v1::BackendKind_ARRAYSIZE == 3);

template <>
struct WireEnum<Priority> {
  using Type = v1::Priority;
  static constexpr int first = 1;
};
static_assert(v1::PRIORITY_UNSPECIFIED == 0 &&
              v1::PRIORITY_BATCH == 1 &&
              v1::PRIORITY_NORMAL == 2 &&
              v1::PRIORITY_INTERACTIVE == 3 &&
              v1::Priority_ARRAYSIZE == 4);

template <>
struct WireEnum<JobState> {
  using Type = v1::State;
  static constexpr int first = 0;
};
static_assert(v1::STATE_UNSPECIFIED == 0 &&
              v1::STATE_RECEIVING == 1 &&
              v1::STATE_QUEUED == 2 &&
              v1::STATE_RUNNING == 3 &&
              v1::STATE_SENDING == 4 &&
              v1::STATE_SUCCEEDED == 5 &&
              v1::STATE_FAILED == 6 &&
              v1::STATE_CANCELLED == 7 &&
              v1::STATE_EXPIRED == 8 &&
              v1::State_ARRAYSIZE == 9);

template <>
struct WireEnum<Stage> {
  using Type = v1::Stage;
  static constexpr int first = 1;
};
static_assert(v1::STAGE_UNSPECIFIED == 0 &&
              v1::STAGE_FIND_NEIGHBOURS == 1 &&
              v1::STAGE_FIND_BOUNDARY == 2 &&
              v1::STAGE_ITERATE == 3 &&
              v1::STAGE_EVALUATE == 4 &&
              v1::Stage_ARRAYSIZE == 5);

template <>
struct WireEnum<StopReason> {
  using Type = v1::StopReason;
  static constexpr int first = 1;
};
static_assert(v1::STOP_REASON_UNSPECIFIED == 0 &&
              v1::STOP_REASON_CONVERGED == 1 &&
              v1::STOP_REASON_TARGET_REACHED == 2 &&
              v1::STOP_REASON_ITERATION_LIMIT == 3 &&
              v1::STOP_REASON_COMPUTE_BUDGET == 4 &&
              v1::STOP_REASON_STAGNATED == 5 &&
              v1::STOP_REASON_CANCELLED_WITH_RESULT == 6 &&
              v1::StopReason_ARRAYSIZE == 7);

template <>
struct WireEnum<EndRule> {
  using Type = v1::EndRule;
  static constexpr int first = 0;
};
static_assert(v1::END_RULE_UNSPECIFIED == 0 &&
              v1::END_RULE_AT_REST == 1 &&
              v1::END_RULE_SMALL_MOVES == 2 &&
              v1::END_RULE_SMALL_GAINS == 3 &&
              v1::END_RULE_NO_PROGRESS == 4 &&
              v1::END_RULE_ALL_HELD == 5 &&
              v1::EndRule_ARRAYSIZE == 6);

}  // namespace meshsmooth::wire
