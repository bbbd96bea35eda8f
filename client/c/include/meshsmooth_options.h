#ifndef MESHSMOOTH_OPTIONS_H
#define MESHSMOOTH_OPTIONS_H

// Made by scripts/tables from proto/declaration; do not edit.
// clang-format off

#include <stddef.h>
#include <stdint.h>

/// What functions return: OK, or the status of a failed call with gRPC's numbers.
enum meshsmooth_status {
  MESHSMOOTH_OK = 0,
  MESHSMOOTH_CANCELLED = 1,
  MESHSMOOTH_UNKNOWN = 2,
  MESHSMOOTH_INVALID_ARGUMENT = 3,
  MESHSMOOTH_DEADLINE_EXCEEDED = 4,
  MESHSMOOTH_NOT_FOUND = 5,
  MESHSMOOTH_ALREADY_EXISTS = 6,
  MESHSMOOTH_PERMISSION_DENIED = 7,
  MESHSMOOTH_RESOURCE_EXHAUSTED = 8,
  MESHSMOOTH_FAILED_PRECONDITION = 9,
  MESHSMOOTH_ABORTED = 10,
  MESHSMOOTH_OUT_OF_RANGE = 11,
  MESHSMOOTH_UNIMPLEMENTED = 12,
  MESHSMOOTH_INTERNAL = 13,
  MESHSMOOTH_UNAVAILABLE = 14,
  MESHSMOOTH_DATA_LOSS = 15,
  MESHSMOOTH_UNAUTHENTICATED = 16,
};

/// The methods.
enum meshsmooth_method {
  /// Moves each node down the energy of the elements around it; a valid mesh stays valid.
  MESHSMOOTH_METHOD_OPTIMIZE = 1,
  /// Moves each node towards the weighted mean of its neighbours.
  MESHSMOOTH_METHOD_LAPLACIAN = 2,
  /// A Laplacian step that is taken only if the worst mean ratio around the node does not fall.
  MESHSMOOTH_METHOD_SMART_LAPLACIAN = 3,
  /// A step with lambda, then one with mu: keeps the volume of a surface.
  MESHSMOOTH_METHOD_TAUBIN = 4,
  /// Averages, then pushes nodes back towards their original and previous positions.
  MESHSMOOTH_METHOD_HC_LAPLACIAN = 5,
  /// A low-pass filter of as many terms as iterations: keeps the volume of a surface.
  MESHSMOOTH_METHOD_WINDOWED_SINC = 6,
  /// The method of `move`: some nodes go to given positions, the mesh follows and stays valid.
  MESHSMOOTH_METHOD_MOVE = 7,
};

/// The order in which the nodes of one sweep see each other's moves.
enum meshsmooth_form {
  MESHSMOOTH_FORM_AUTOMATIC = 0,  ///< The method's own: `MethodTraits::forms`, the first.
  MESHSMOOTH_FORM_JACOBI = 1,  ///< Reads the old positions, writes new ones.
  MESHSMOOTH_FORM_GAUSS_SEIDEL = 2,  ///< In place, colour by colour; deterministic.
  MESHSMOOTH_FORM_ASYNCHRONOUS = 3,  ///< In place, unordered; not deterministic.
};

/// The weights of a node's neighbours.
enum meshsmooth_weighting {
  MESHSMOOTH_WEIGHTING_UNIFORM = 1,  ///< The mean of the 1-ring.
  MESHSMOOTH_WEIGHTING_INVERSE_EDGE_LENGTH = 2,  ///< Ring node j by 1 / |x_j - x_i|.
  MESHSMOOTH_WEIGHTING_EDGE_LENGTH = 3,  ///< Ring node j by |x_j - x_i|.
  /// Centroids of the ball's elements by their volume (area).
  MESHSMOOTH_WEIGHTING_BALL_VOLUME = 4,
};

/// How the series of `WindowedSinc` fades out.
enum meshsmooth_window {
  /// Keeps the size of a mesh to 0.1 %. The default of VTK from 9.4 on.
  MESHSMOOTH_WINDOW_NUTTALL = 1,
  MESHSMOOTH_WINDOW_HAMMING = 2,  ///< Changes the size by up to 0.5 %. That of VTK before 9.4.
};

/// The quality that `Optimize` aims at.
enum meshsmooth_goal {
  MESHSMOOTH_GOAL_AVERAGE = 1,  ///< The mean: sum of the inverse mean ratios.
  MESHSMOOTH_GOAL_BALANCED = 2,  ///< The mean and the worst: sum of their squares.
  /// The worst: sum of their fourth powers, then up to the 32nd in poor balls.
  MESHSMOOTH_GOAL_WORST = 3,
};

/// The shape that `Optimize` gives each element.
enum meshsmooth_target {
  /// Its shape in `JobInput::reference`. Without one: simplices their ideal shape; other elements
  /// right angles at their own aspect ratio where it is meant, as in a boundary layer, else equal edges
  /// (docs/methods.md, Targets).
  MESHSMOOTH_TARGET_AUTOMATIC = 1,
  MESHSMOOTH_TARGET_IDEAL = 2,  ///< The ideal shape of its type: equal edges.
  MESHSMOOTH_TARGET_INPUT = 3,  ///< Its shape in the input.
  MESHSMOOTH_TARGET_REFERENCE = 4,  ///< Its shape in `JobInput::reference`, which must be there.
};

/// Where `Move` begins to solve for the displacement.
enum meshsmooth_start {
  MESHSMOOTH_START_COLD = 1,  ///< At 0.
  /// Where the last two warm motions on the same kept reference and fixed nodes lead to, if they were
  /// smooth: fewer iterations to the same residual. The bits depend on those motions, what they differ by
  /// is within the residual.
  MESHSMOOTH_START_WARM = 2,
};

/// What nodes on the boundary and between regions may do.
enum meshsmooth_boundary_policy {
  MESHSMOOTH_BOUNDARY_POLICY_FIXED = 1,  ///< They stay.
  /// They move in their plane or on their curved part, along their crease; corners stay.
  MESHSMOOTH_BOUNDARY_POLICY_SLIDE = 2,
  MESHSMOOTH_BOUNDARY_POLICY_FREE = 3,  ///< They move like all others.
};

/// What happens to a mesh that arrives with inverted elements.
enum meshsmooth_tangled_policy {
  /// The method repairs what it can; the summary counts the rest.
  MESHSMOOTH_TANGLED_POLICY_REPAIR = 1,
  MESHSMOOTH_TANGLED_POLICY_REFUSE = 2,  ///< `InvalidMesh` (MESH_TANGLED).
};

/// How much the evaluation of a mesh reports.
enum meshsmooth_quality_detail {
  MESHSMOOTH_QUALITY_DETAIL_FULL = 1,  ///< Every metric of every element.
  /// Counts of inverted and degenerate, volumes, worst elements: a third of the time.
  MESHSMOOTH_QUALITY_DETAIL_BRIEF = 2,
};

/// The metrics that a job reports.
enum meshsmooth_quality_metric {
  /// Every type, worst corner; 1 = ideal, negative = inverted.
  MESHSMOOTH_QUALITY_METRIC_MEAN_RATIO = 1,
  /// Every type, worst corner, ideal corner = 1; a pyramid may exceed 1; of a curved element a lower bound
  /// of the least in it, by about 0.003.
  MESHSMOOTH_QUALITY_METRIC_SCALED_JACOBIAN = 2,
  MESHSMOOTH_QUALITY_METRIC_RADIUS_RATIO = 3,  ///< Tetrahedra: 3 inradius / circumradius, signed.
  MESHSMOOTH_QUALITY_METRIC_MIN_DIHEDRAL_ANGLE = 4,  ///< Tetrahedra, degrees; 0 when inverted.
  MESHSMOOTH_QUALITY_METRIC_MAX_DIHEDRAL_ANGLE = 5,  ///< Tetrahedra, degrees; 180 when inverted.
  MESHSMOOTH_QUALITY_METRIC_MIN_ANGLE = 6,  ///< Triangles, degrees; 0 when inverted.
  MESHSMOOTH_QUALITY_METRIC_MAX_ANGLE = 7,  ///< Triangles, degrees; 180 when inverted.
};

/// The kind of a backend.
enum meshsmooth_backend_kind {
  MESHSMOOTH_BACKEND_KIND_AUTOMATIC = 0,  ///< The server chooses.
  MESHSMOOTH_BACKEND_KIND_CPU = 1,  ///< The processor's cores.
  MESHSMOOTH_BACKEND_KIND_CUDA = 2,  ///< An NVIDIA GPU.
};

/// The state of a job.
enum meshsmooth_job_state {
  MESHSMOOTH_JOB_STATE_UNSPECIFIED = 0,  ///< Of no job; a state that a newer server reports.
  MESHSMOOTH_JOB_STATE_RECEIVING = 1,  ///< Its data arrives.
  MESHSMOOTH_JOB_STATE_QUEUED = 2,  ///< It waits for a lane.
  MESHSMOOTH_JOB_STATE_RUNNING = 3,  ///< It computes.
  MESHSMOOTH_JOB_STATE_SENDING = 4,  ///< Its result leaves.
  MESHSMOOTH_JOB_STATE_SUCCEEDED = 5,  ///< Its result is there.
  MESHSMOOTH_JOB_STATE_FAILED = 6,  ///< It ended with an error.
  MESHSMOOTH_JOB_STATE_CANCELLED = 7,  ///< Its caller ended it.
  MESHSMOOTH_JOB_STATE_EXPIRED = 8,  ///< It succeeded, and its result was kept; the result is gone.
};

/// Why a job stopped.
enum meshsmooth_stop_reason {
  MESHSMOOTH_STOP_REASON_CONVERGED = 1,  ///< The largest move fell below the tolerance.
  /// The worst element reached `Optimize::target_quality`.
  MESHSMOOTH_STOP_REASON_TARGET_REACHED = 2,
  MESHSMOOTH_STOP_REASON_ITERATION_LIMIT = 3,  ///< `SmoothOptions::max_iterations` were done.
  MESHSMOOTH_STOP_REASON_COMPUTE_BUDGET = 4,  ///< `SmoothOptions::compute_budget` was used up.
  MESHSMOOTH_STOP_REASON_STAGNATED = 5,  ///< Nodes are held back, or moves no longer shrink.
  /// Cancelled by a caller who wants the positions reached.
  MESHSMOOTH_STOP_REASON_CANCELLED_WITH_RESULT = 6,
};

/// The rule by which a job converged or stagnated.
enum meshsmooth_end_rule {
  MESHSMOOTH_END_RULE_NONE = 0,  ///< It ended by a limit, a target or the caller.
  MESHSMOOTH_END_RULE_AT_REST = 1,  ///< No node moves any more.
  MESHSMOOTH_END_RULE_SMALL_MOVES = 2,  ///< The largest move fell below the tolerance.
  /// `Optimize`: further sweeps would lower the energy by less than the tolerance.
  MESHSMOOTH_END_RULE_SMALL_GAINS = 3,
  /// Moves no longer shrink; `Optimize`: tangled balls do not become better.
  MESHSMOOTH_END_RULE_NO_PROGRESS = 4,
  MESHSMOOTH_END_RULE_ALL_HELD = 5,  ///< Every move was rejected.
};

/// The options of a job, filled by meshsmooth_options_init. An enumeration that is 0 has its
/// default. Every member has 8 bytes; later versions have more of them behind these.
typedef struct meshsmooth_options {
  size_t size;  ///< sizeof(meshsmooth_options)
  int64_t method;  ///< How nodes move, MESHSMOOTH_METHOD_…
  /// Weights of the neighbours, MESHSMOOTH_WEIGHTING_…; of laplacian, smart_laplacian.
  int64_t weighting;
  double relaxation;  ///< Share of the step that is taken, (0, 1]; of laplacian, smart_laplacian.
  double lambda;  ///< Factor of the first step, (0, 1]; of taubin.
  double mu;  ///< Factor of the second step, below minus lambda; of taubin.
  double alpha;  ///< Weight of the original position, [0, 1]; of hc_laplacian.
  double beta;  ///< Share of the node's own difference, [0, 1]; of hc_laplacian.
  int64_t goal;  ///< Elements to improve: all, the worst, or both, MESHSMOOTH_GOAL_…; of optimize.
  /// Worst mean ratio of movable elements that ends the run, [0, 1); of optimize.
  double target_quality;
  int64_t target;  ///< Shape that elements aim at, MESHSMOOTH_TARGET_…; of optimize, move.
  double stay;  ///< Weight that holds nodes at their input positions, 0 or more; of optimize.
  int64_t window;  ///< Window of the filter's series, MESHSMOOTH_WINDOW_…; of windowed_sinc.
  /// Eigenvalue of the ring operator below which the shape stays, [0.001, 2]; of windowed_sinc.
  double pass_band;
  double least_step;  ///< Smallest share of the motion that is tried, (0, 1]; of move.
  /// Start of the solver; warm: from earlier motions of a session, MESHSMOOTH_START_…; of move.
  int64_t start;
  /// Most sweeps, 0: only evaluate; taubin and windowed-sinc 20, hc-laplacian 10, 0 or more; -1:
  /// unset.
  int64_t iterations;
  /// Largest move, or decrease of optimize's energy, that ends the job, 0 or more.
  double tolerance;
  double absolute_tolerance;  ///< Largest move that ends the job, 0 or more; -1: unset.
  /// Computing time after which the best result so far is returned, above 0; 0: unset.
  double compute_budget_seconds;
  int64_t boundary;  ///< What nodes on the boundary do, MESHSMOOTH_BOUNDARY_POLICY_….
  double feature_angle;  ///< Angle at which facets form a crease, [1, 90], in degrees.
  double movement_limit;  ///< Farthest that a node may go, above 0; 0: unset.
  /// Whether movement_limit is a share of the bounding box's diagonal.
  int64_t movement_limit_relative;
  double only_below;  ///< Only elements of lower quality are improved, (0, 1]; 0: unset.
  int64_t only_below_rings;  ///< Rings of nodes around these that move too, 0 or more.
  int64_t guard;  ///< Valid elements stay valid; 0: they may not.
  int64_t never_worse;  ///< Nodes go back where the result would be worse.
  /// What never_worse keeps; else the least values of both. 'scaled_jacobian': optimize also raises
  /// its least value, MESHSMOOTH_QUALITY_METRIC_…; 0: unset.
  int64_t metric;
  int64_t tangled;  ///< What happens to a mesh with inverted elements, MESHSMOOTH_TANGLED_POLICY_….
  /// Elements of lower quality are counted by what holds them: summary.poor, (0, 1]; 0: unset.
  double report_below;
  /// Order of the moves in a sweep; else the method's own, MESHSMOOTH_FORM_…; 0: unset.
  int64_t form;
  int64_t history;  ///< The summary has the moves of each sweep.
  int64_t quality;  ///< 'brief': no metrics, counts only, MESHSMOOTH_QUALITY_DETAIL_….
  int64_t backend;  ///< Where the server computes, MESHSMOOTH_BACKEND_KIND_….
  double timeout_seconds;  ///< Of all attempts together; 0: unset.
  double result_ttl_seconds;  ///< Time that the server keeps the result for attach; 0: unset.
  const char* request_id;  ///< UUID under which the same job is joined; null: unset.
  int64_t max_attempts;  ///< Attempts where the server is busy or gone.
  /// Span of the caller, in the format of W3C Trace Context; null: unset.
  const char* traceparent;
} meshsmooth_options;

#endif  // MESHSMOOTH_OPTIONS_H
