from google.protobuf import duration_pb2 as _duration_pb2
from google.protobuf import timestamp_pb2 as _timestamp_pb2
from meshsmooth.v1 import mesh_pb2 as _mesh_pb2
from google.protobuf.internal import containers as _containers
from google.protobuf.internal import enum_type_wrapper as _enum_type_wrapper
from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from typing import ClassVar as _ClassVar, Iterable as _Iterable, Mapping as _Mapping, Optional as _Optional, Union as _Union

BACKEND_KIND_CPU: BackendKind
BACKEND_KIND_CUDA: BackendKind
BACKEND_KIND_UNSPECIFIED: BackendKind
BOUNDARY_POLICY_FIXED: BoundaryPolicy
BOUNDARY_POLICY_FREE: BoundaryPolicy
BOUNDARY_POLICY_SLIDE: BoundaryPolicy
BOUNDARY_POLICY_UNSPECIFIED: BoundaryPolicy
DERIVATIVE_COTANGENT: Derivative
DERIVATIVE_NONE: Derivative
DERIVATIVE_TANGENT: Derivative
DERIVATIVE_UNSPECIFIED: Derivative
DESCRIPTOR: _descriptor.FileDescriptor
END_RULE_ALL_HELD: EndRule
END_RULE_AT_REST: EndRule
END_RULE_NO_PROGRESS: EndRule
END_RULE_SMALL_GAINS: EndRule
END_RULE_SMALL_MOVES: EndRule
END_RULE_UNSPECIFIED: EndRule
FORM_ASYNCHRONOUS: Form
FORM_GAUSS_SEIDEL: Form
FORM_JACOBI: Form
FORM_UNSPECIFIED: Form
GOAL_AVERAGE: Goal
GOAL_BALANCED: Goal
GOAL_UNSPECIFIED: Goal
GOAL_WORST: Goal
PRIORITY_BATCH: Priority
PRIORITY_INTERACTIVE: Priority
PRIORITY_NORMAL: Priority
PRIORITY_UNSPECIFIED: Priority
QUALITY_DETAIL_BRIEF: QualityDetail
QUALITY_DETAIL_FULL: QualityDetail
QUALITY_DETAIL_UNSPECIFIED: QualityDetail
QUALITY_METRIC_MAX_ANGLE: QualityMetric
QUALITY_METRIC_MAX_DIHEDRAL_ANGLE: QualityMetric
QUALITY_METRIC_MEAN_RATIO: QualityMetric
QUALITY_METRIC_MIN_ANGLE: QualityMetric
QUALITY_METRIC_MIN_DIHEDRAL_ANGLE: QualityMetric
QUALITY_METRIC_RADIUS_RATIO: QualityMetric
QUALITY_METRIC_SCALED_JACOBIAN: QualityMetric
QUALITY_METRIC_UNSPECIFIED: QualityMetric
STAGE_EVALUATE: Stage
STAGE_FIND_BOUNDARY: Stage
STAGE_FIND_NEIGHBOURS: Stage
STAGE_ITERATE: Stage
STAGE_UNSPECIFIED: Stage
START_COLD: Start
START_UNSPECIFIED: Start
START_WARM: Start
STATE_CANCELLED: State
STATE_EXPIRED: State
STATE_FAILED: State
STATE_QUEUED: State
STATE_RECEIVING: State
STATE_RUNNING: State
STATE_SENDING: State
STATE_SUCCEEDED: State
STATE_UNSPECIFIED: State
STOP_REASON_CANCELLED_WITH_RESULT: StopReason
STOP_REASON_COMPUTE_BUDGET: StopReason
STOP_REASON_CONVERGED: StopReason
STOP_REASON_ITERATION_LIMIT: StopReason
STOP_REASON_STAGNATED: StopReason
STOP_REASON_TARGET_REACHED: StopReason
STOP_REASON_UNSPECIFIED: StopReason
TANGLED_POLICY_REFUSE: TangledPolicy
TANGLED_POLICY_REPAIR: TangledPolicy
TANGLED_POLICY_UNSPECIFIED: TangledPolicy
TARGET_AUTOMATIC: Target
TARGET_IDEAL: Target
TARGET_INPUT: Target
TARGET_REFERENCE: Target
TARGET_UNSPECIFIED: Target
WEIGHTING_BALL_VOLUME: Weighting
WEIGHTING_EDGE_LENGTH: Weighting
WEIGHTING_INVERSE_EDGE_LENGTH: Weighting
WEIGHTING_UNIFORM: Weighting
WEIGHTING_UNSPECIFIED: Weighting
WINDOW_HAMMING: Window
WINDOW_NUTTALL: Window
WINDOW_UNSPECIFIED: Window

class Accepted(_message.Message):
    __slots__ = ["device_reserved_bytes", "host_reserved_bytes", "job", "topology_name"]
    DEVICE_RESERVED_BYTES_FIELD_NUMBER: _ClassVar[int]
    HOST_RESERVED_BYTES_FIELD_NUMBER: _ClassVar[int]
    JOB_FIELD_NUMBER: _ClassVar[int]
    TOPOLOGY_NAME_FIELD_NUMBER: _ClassVar[int]
    device_reserved_bytes: int
    host_reserved_bytes: int
    job: Job
    topology_name: str
    def __init__(self, job: _Optional[_Union[Job, _Mapping]] = ..., topology_name: _Optional[str] = ..., host_reserved_bytes: _Optional[int] = ..., device_reserved_bytes: _Optional[int] = ...) -> None: ...

class AttachJobRequest(_message.Message):
    __slots__ = ["name", "result_offset_bytes"]
    NAME_FIELD_NUMBER: _ClassVar[int]
    RESULT_OFFSET_BYTES_FIELD_NUMBER: _ClassVar[int]
    name: str
    result_offset_bytes: int
    def __init__(self, name: _Optional[str] = ..., result_offset_bytes: _Optional[int] = ...) -> None: ...

class AttachJobResponse(_message.Message):
    __slots__ = ["chunk", "progress", "result", "summary"]
    CHUNK_FIELD_NUMBER: _ClassVar[int]
    PROGRESS_FIELD_NUMBER: _ClassVar[int]
    RESULT_FIELD_NUMBER: _ClassVar[int]
    SUMMARY_FIELD_NUMBER: _ClassVar[int]
    chunk: _mesh_pb2.Chunk
    progress: Progress
    result: ResultHeader
    summary: Summary
    def __init__(self, progress: _Optional[_Union[Progress, _Mapping]] = ..., result: _Optional[_Union[ResultHeader, _Mapping]] = ..., chunk: _Optional[_Union[_mesh_pb2.Chunk, _Mapping]] = ..., summary: _Optional[_Union[Summary, _Mapping]] = ...) -> None: ...

class Backend(_message.Message):
    __slots__ = ["busy_lane_count", "device_index", "healthy", "kind", "lane_count", "name", "reserved_bytes", "total_bytes"]
    BUSY_LANE_COUNT_FIELD_NUMBER: _ClassVar[int]
    DEVICE_INDEX_FIELD_NUMBER: _ClassVar[int]
    HEALTHY_FIELD_NUMBER: _ClassVar[int]
    KIND_FIELD_NUMBER: _ClassVar[int]
    LANE_COUNT_FIELD_NUMBER: _ClassVar[int]
    NAME_FIELD_NUMBER: _ClassVar[int]
    RESERVED_BYTES_FIELD_NUMBER: _ClassVar[int]
    TOTAL_BYTES_FIELD_NUMBER: _ClassVar[int]
    busy_lane_count: int
    device_index: int
    healthy: bool
    kind: BackendKind
    lane_count: int
    name: str
    reserved_bytes: int
    total_bytes: int
    def __init__(self, kind: _Optional[_Union[BackendKind, str]] = ..., name: _Optional[str] = ..., device_index: _Optional[int] = ..., total_bytes: _Optional[int] = ..., reserved_bytes: _Optional[int] = ..., lane_count: _Optional[int] = ..., busy_lane_count: _Optional[int] = ..., healthy: bool = ...) -> None: ...

class BoundaryDeviation(_message.Message):
    __slots__ = ["input_to_result", "result_to_input", "tolerance"]
    INPUT_TO_RESULT_FIELD_NUMBER: _ClassVar[int]
    RESULT_TO_INPUT_FIELD_NUMBER: _ClassVar[int]
    TOLERANCE_FIELD_NUMBER: _ClassVar[int]
    input_to_result: float
    result_to_input: float
    tolerance: float
    def __init__(self, tolerance: _Optional[float] = ..., result_to_input: _Optional[float] = ..., input_to_result: _Optional[float] = ...) -> None: ...

class CancelJobRequest(_message.Message):
    __slots__ = ["name", "result_kept"]
    NAME_FIELD_NUMBER: _ClassVar[int]
    RESULT_KEPT_FIELD_NUMBER: _ClassVar[int]
    name: str
    result_kept: bool
    def __init__(self, name: _Optional[str] = ..., result_kept: bool = ...) -> None: ...

class CancelJobResponse(_message.Message):
    __slots__ = ["job"]
    JOB_FIELD_NUMBER: _ClassVar[int]
    job: Job
    def __init__(self, job: _Optional[_Union[Job, _Mapping]] = ...) -> None: ...

class ConvergenceStats(_message.Message):
    __slots__ = ["bounding_box_diagonal", "end_rule", "energies", "held_node_count", "iteration_count", "last_max_displacement", "last_rms_displacement", "max_displacements", "moved_node_counts", "remaining_gain", "rms_displacements", "tolerance", "worst_mean_ratios"]
    BOUNDING_BOX_DIAGONAL_FIELD_NUMBER: _ClassVar[int]
    END_RULE_FIELD_NUMBER: _ClassVar[int]
    ENERGIES_FIELD_NUMBER: _ClassVar[int]
    HELD_NODE_COUNT_FIELD_NUMBER: _ClassVar[int]
    ITERATION_COUNT_FIELD_NUMBER: _ClassVar[int]
    LAST_MAX_DISPLACEMENT_FIELD_NUMBER: _ClassVar[int]
    LAST_RMS_DISPLACEMENT_FIELD_NUMBER: _ClassVar[int]
    MAX_DISPLACEMENTS_FIELD_NUMBER: _ClassVar[int]
    MOVED_NODE_COUNTS_FIELD_NUMBER: _ClassVar[int]
    REMAINING_GAIN_FIELD_NUMBER: _ClassVar[int]
    RMS_DISPLACEMENTS_FIELD_NUMBER: _ClassVar[int]
    TOLERANCE_FIELD_NUMBER: _ClassVar[int]
    WORST_MEAN_RATIOS_FIELD_NUMBER: _ClassVar[int]
    bounding_box_diagonal: float
    end_rule: EndRule
    energies: _containers.RepeatedScalarFieldContainer[float]
    held_node_count: int
    iteration_count: int
    last_max_displacement: float
    last_rms_displacement: float
    max_displacements: _containers.RepeatedScalarFieldContainer[float]
    moved_node_counts: _containers.RepeatedScalarFieldContainer[int]
    remaining_gain: float
    rms_displacements: _containers.RepeatedScalarFieldContainer[float]
    tolerance: float
    worst_mean_ratios: _containers.RepeatedScalarFieldContainer[float]
    def __init__(self, iteration_count: _Optional[int] = ..., last_max_displacement: _Optional[float] = ..., last_rms_displacement: _Optional[float] = ..., tolerance: _Optional[float] = ..., bounding_box_diagonal: _Optional[float] = ..., held_node_count: _Optional[int] = ..., max_displacements: _Optional[_Iterable[float]] = ..., rms_displacements: _Optional[_Iterable[float]] = ..., moved_node_counts: _Optional[_Iterable[int]] = ..., energies: _Optional[_Iterable[float]] = ..., worst_mean_ratios: _Optional[_Iterable[float]] = ..., end_rule: _Optional[_Union[EndRule, str]] = ..., remaining_gain: _Optional[float] = ...) -> None: ...

class DeleteJobRequest(_message.Message):
    __slots__ = ["name"]
    NAME_FIELD_NUMBER: _ClassVar[int]
    name: str
    def __init__(self, name: _Optional[str] = ...) -> None: ...

class DeleteJobResponse(_message.Message):
    __slots__ = []
    def __init__(self) -> None: ...

class DeleteTopologyRequest(_message.Message):
    __slots__ = ["name"]
    NAME_FIELD_NUMBER: _ClassVar[int]
    name: str
    def __init__(self, name: _Optional[str] = ...) -> None: ...

class DeleteTopologyResponse(_message.Message):
    __slots__ = []
    def __init__(self) -> None: ...

class ElementQuality(_message.Message):
    __slots__ = ["element", "element_type", "mean_ratio", "scaled_jacobian"]
    ELEMENT_FIELD_NUMBER: _ClassVar[int]
    ELEMENT_TYPE_FIELD_NUMBER: _ClassVar[int]
    MEAN_RATIO_FIELD_NUMBER: _ClassVar[int]
    SCALED_JACOBIAN_FIELD_NUMBER: _ClassVar[int]
    element: int
    element_type: _mesh_pb2.ElementType
    mean_ratio: float
    scaled_jacobian: float
    def __init__(self, element: _Optional[int] = ..., element_type: _Optional[_Union[_mesh_pb2.ElementType, str]] = ..., mean_ratio: _Optional[float] = ..., scaled_jacobian: _Optional[float] = ...) -> None: ...

class Execution(_message.Message):
    __slots__ = ["backend_kind", "colour_count", "device_index", "device_name", "device_peak_bytes", "host_peak_bytes", "server_version", "thread_count", "topology_reused"]
    BACKEND_KIND_FIELD_NUMBER: _ClassVar[int]
    COLOUR_COUNT_FIELD_NUMBER: _ClassVar[int]
    DEVICE_INDEX_FIELD_NUMBER: _ClassVar[int]
    DEVICE_NAME_FIELD_NUMBER: _ClassVar[int]
    DEVICE_PEAK_BYTES_FIELD_NUMBER: _ClassVar[int]
    HOST_PEAK_BYTES_FIELD_NUMBER: _ClassVar[int]
    SERVER_VERSION_FIELD_NUMBER: _ClassVar[int]
    THREAD_COUNT_FIELD_NUMBER: _ClassVar[int]
    TOPOLOGY_REUSED_FIELD_NUMBER: _ClassVar[int]
    backend_kind: BackendKind
    colour_count: int
    device_index: int
    device_name: str
    device_peak_bytes: int
    host_peak_bytes: int
    server_version: str
    thread_count: int
    topology_reused: bool
    def __init__(self, backend_kind: _Optional[_Union[BackendKind, str]] = ..., device_name: _Optional[str] = ..., device_index: _Optional[int] = ..., host_peak_bytes: _Optional[int] = ..., device_peak_bytes: _Optional[int] = ..., topology_reused: bool = ..., thread_count: _Optional[int] = ..., colour_count: _Optional[int] = ..., server_version: _Optional[str] = ...) -> None: ...

class FitStats(_message.Message):
    __slots__ = ["fixed_count", "held_count", "input_off_surface", "input_to_surface", "node_count", "parts", "reached_count", "result_to_surface", "step_count", "surface", "surface_to_result", "unmatched_corner_count", "unmatched_curve_count"]
    FIXED_COUNT_FIELD_NUMBER: _ClassVar[int]
    HELD_COUNT_FIELD_NUMBER: _ClassVar[int]
    INPUT_OFF_SURFACE_FIELD_NUMBER: _ClassVar[int]
    INPUT_TO_SURFACE_FIELD_NUMBER: _ClassVar[int]
    NODE_COUNT_FIELD_NUMBER: _ClassVar[int]
    PARTS_FIELD_NUMBER: _ClassVar[int]
    REACHED_COUNT_FIELD_NUMBER: _ClassVar[int]
    RESULT_TO_SURFACE_FIELD_NUMBER: _ClassVar[int]
    STEP_COUNT_FIELD_NUMBER: _ClassVar[int]
    SURFACE_FIELD_NUMBER: _ClassVar[int]
    SURFACE_TO_RESULT_FIELD_NUMBER: _ClassVar[int]
    UNMATCHED_CORNER_COUNT_FIELD_NUMBER: _ClassVar[int]
    UNMATCHED_CURVE_COUNT_FIELD_NUMBER: _ClassVar[int]
    fixed_count: int
    held_count: int
    input_off_surface: bool
    input_to_surface: SurfaceDistance
    node_count: int
    parts: _containers.RepeatedCompositeFieldContainer[TargetPart]
    reached_count: int
    result_to_surface: SurfaceDistance
    step_count: int
    surface: SurfaceCounts
    surface_to_result: SurfaceDistance
    unmatched_corner_count: int
    unmatched_curve_count: int
    def __init__(self, surface: _Optional[_Union[SurfaceCounts, _Mapping]] = ..., node_count: _Optional[int] = ..., reached_count: _Optional[int] = ..., held_count: _Optional[int] = ..., fixed_count: _Optional[int] = ..., unmatched_corner_count: _Optional[int] = ..., unmatched_curve_count: _Optional[int] = ..., step_count: _Optional[int] = ..., input_off_surface: bool = ..., input_to_surface: _Optional[_Union[SurfaceDistance, _Mapping]] = ..., result_to_surface: _Optional[_Union[SurfaceDistance, _Mapping]] = ..., surface_to_result: _Optional[_Union[SurfaceDistance, _Mapping]] = ..., parts: _Optional[_Iterable[_Union[TargetPart, _Mapping]]] = ...) -> None: ...

class GetJobRequest(_message.Message):
    __slots__ = ["name"]
    NAME_FIELD_NUMBER: _ClassVar[int]
    name: str
    def __init__(self, name: _Optional[str] = ...) -> None: ...

class GetJobResponse(_message.Message):
    __slots__ = ["job"]
    JOB_FIELD_NUMBER: _ClassVar[int]
    job: Job
    def __init__(self, job: _Optional[_Union[Job, _Mapping]] = ...) -> None: ...

class GetServerInfoRequest(_message.Message):
    __slots__ = []
    def __init__(self) -> None: ...

class GetServerInfoResponse(_message.Message):
    __slots__ = ["api_versions", "backends", "build_commit", "default_options", "draining", "element_types", "features", "limits", "method_defaults", "methods", "server_version"]
    API_VERSIONS_FIELD_NUMBER: _ClassVar[int]
    BACKENDS_FIELD_NUMBER: _ClassVar[int]
    BUILD_COMMIT_FIELD_NUMBER: _ClassVar[int]
    DEFAULT_OPTIONS_FIELD_NUMBER: _ClassVar[int]
    DRAINING_FIELD_NUMBER: _ClassVar[int]
    ELEMENT_TYPES_FIELD_NUMBER: _ClassVar[int]
    FEATURES_FIELD_NUMBER: _ClassVar[int]
    LIMITS_FIELD_NUMBER: _ClassVar[int]
    METHODS_FIELD_NUMBER: _ClassVar[int]
    METHOD_DEFAULTS_FIELD_NUMBER: _ClassVar[int]
    SERVER_VERSION_FIELD_NUMBER: _ClassVar[int]
    api_versions: _containers.RepeatedScalarFieldContainer[str]
    backends: _containers.RepeatedCompositeFieldContainer[Backend]
    build_commit: str
    default_options: SmoothingOptions
    draining: bool
    element_types: _containers.RepeatedScalarFieldContainer[_mesh_pb2.ElementType]
    features: _containers.RepeatedScalarFieldContainer[str]
    limits: Limits
    method_defaults: _containers.RepeatedCompositeFieldContainer[SmoothingOptions]
    methods: _containers.RepeatedScalarFieldContainer[str]
    server_version: str
    def __init__(self, server_version: _Optional[str] = ..., build_commit: _Optional[str] = ..., api_versions: _Optional[_Iterable[str]] = ..., features: _Optional[_Iterable[str]] = ..., limits: _Optional[_Union[Limits, _Mapping]] = ..., default_options: _Optional[_Union[SmoothingOptions, _Mapping]] = ..., backends: _Optional[_Iterable[_Union[Backend, _Mapping]]] = ..., methods: _Optional[_Iterable[str]] = ..., element_types: _Optional[_Iterable[_Union[_mesh_pb2.ElementType, str]]] = ..., draining: bool = ..., method_defaults: _Optional[_Iterable[_Union[SmoothingOptions, _Mapping]]] = ...) -> None: ...

class GetTopologyRequest(_message.Message):
    __slots__ = ["name"]
    NAME_FIELD_NUMBER: _ClassVar[int]
    name: str
    def __init__(self, name: _Optional[str] = ...) -> None: ...

class GetTopologyResponse(_message.Message):
    __slots__ = ["topology"]
    TOPOLOGY_FIELD_NUMBER: _ClassVar[int]
    topology: Topology
    def __init__(self, topology: _Optional[_Union[Topology, _Mapping]] = ...) -> None: ...

class HcLaplacian(_message.Message):
    __slots__ = ["alpha", "beta"]
    ALPHA_FIELD_NUMBER: _ClassVar[int]
    BETA_FIELD_NUMBER: _ClassVar[int]
    alpha: float
    beta: float
    def __init__(self, alpha: _Optional[float] = ..., beta: _Optional[float] = ...) -> None: ...

class InputTaken(_message.Message):
    __slots__ = []
    def __init__(self) -> None: ...

class Job(_message.Message):
    __slots__ = ["create_time", "element_count", "end_time", "error", "expire_time", "last_progress", "name", "node_count", "priority", "queue_position", "request_id", "start_time", "state", "summary"]
    CREATE_TIME_FIELD_NUMBER: _ClassVar[int]
    ELEMENT_COUNT_FIELD_NUMBER: _ClassVar[int]
    END_TIME_FIELD_NUMBER: _ClassVar[int]
    ERROR_FIELD_NUMBER: _ClassVar[int]
    EXPIRE_TIME_FIELD_NUMBER: _ClassVar[int]
    LAST_PROGRESS_FIELD_NUMBER: _ClassVar[int]
    NAME_FIELD_NUMBER: _ClassVar[int]
    NODE_COUNT_FIELD_NUMBER: _ClassVar[int]
    PRIORITY_FIELD_NUMBER: _ClassVar[int]
    QUEUE_POSITION_FIELD_NUMBER: _ClassVar[int]
    REQUEST_ID_FIELD_NUMBER: _ClassVar[int]
    START_TIME_FIELD_NUMBER: _ClassVar[int]
    STATE_FIELD_NUMBER: _ClassVar[int]
    SUMMARY_FIELD_NUMBER: _ClassVar[int]
    create_time: _timestamp_pb2.Timestamp
    element_count: int
    end_time: _timestamp_pb2.Timestamp
    error: JobError
    expire_time: _timestamp_pb2.Timestamp
    last_progress: Progress
    name: str
    node_count: int
    priority: Priority
    queue_position: int
    request_id: str
    start_time: _timestamp_pb2.Timestamp
    state: State
    summary: Summary
    def __init__(self, name: _Optional[str] = ..., request_id: _Optional[str] = ..., state: _Optional[_Union[State, str]] = ..., create_time: _Optional[_Union[_timestamp_pb2.Timestamp, _Mapping]] = ..., start_time: _Optional[_Union[_timestamp_pb2.Timestamp, _Mapping]] = ..., end_time: _Optional[_Union[_timestamp_pb2.Timestamp, _Mapping]] = ..., expire_time: _Optional[_Union[_timestamp_pb2.Timestamp, _Mapping]] = ..., priority: _Optional[_Union[Priority, str]] = ..., node_count: _Optional[int] = ..., element_count: _Optional[int] = ..., queue_position: _Optional[int] = ..., last_progress: _Optional[_Union[Progress, _Mapping]] = ..., error: _Optional[_Union[JobError, _Mapping]] = ..., summary: _Optional[_Union[Summary, _Mapping]] = ...) -> None: ...

class JobError(_message.Message):
    __slots__ = ["code", "message", "metadata", "reason"]
    class MetadataEntry(_message.Message):
        __slots__ = ["key", "value"]
        KEY_FIELD_NUMBER: _ClassVar[int]
        VALUE_FIELD_NUMBER: _ClassVar[int]
        key: str
        value: str
        def __init__(self, key: _Optional[str] = ..., value: _Optional[str] = ...) -> None: ...
    CODE_FIELD_NUMBER: _ClassVar[int]
    MESSAGE_FIELD_NUMBER: _ClassVar[int]
    METADATA_FIELD_NUMBER: _ClassVar[int]
    REASON_FIELD_NUMBER: _ClassVar[int]
    code: int
    message: str
    metadata: _containers.ScalarMap[str, str]
    reason: str
    def __init__(self, code: _Optional[int] = ..., reason: _Optional[str] = ..., message: _Optional[str] = ..., metadata: _Optional[_Mapping[str, str]] = ...) -> None: ...

class JobSpec(_message.Message):
    __slots__ = ["backend_kind", "coordinate_type", "element_quality_metrics", "inline_topology", "iteration_history_included", "max_result_chunk_bytes", "node_pair_count", "options", "prescribed_node_count", "priority", "progress_interval", "quality_detail", "queue_timeout", "request_id", "result_ttl", "shared_memory", "surface", "topology_kept", "topology_name", "validate_only"]
    BACKEND_KIND_FIELD_NUMBER: _ClassVar[int]
    COORDINATE_TYPE_FIELD_NUMBER: _ClassVar[int]
    ELEMENT_QUALITY_METRICS_FIELD_NUMBER: _ClassVar[int]
    INLINE_TOPOLOGY_FIELD_NUMBER: _ClassVar[int]
    ITERATION_HISTORY_INCLUDED_FIELD_NUMBER: _ClassVar[int]
    MAX_RESULT_CHUNK_BYTES_FIELD_NUMBER: _ClassVar[int]
    NODE_PAIR_COUNT_FIELD_NUMBER: _ClassVar[int]
    OPTIONS_FIELD_NUMBER: _ClassVar[int]
    PRESCRIBED_NODE_COUNT_FIELD_NUMBER: _ClassVar[int]
    PRIORITY_FIELD_NUMBER: _ClassVar[int]
    PROGRESS_INTERVAL_FIELD_NUMBER: _ClassVar[int]
    QUALITY_DETAIL_FIELD_NUMBER: _ClassVar[int]
    QUEUE_TIMEOUT_FIELD_NUMBER: _ClassVar[int]
    REQUEST_ID_FIELD_NUMBER: _ClassVar[int]
    RESULT_TTL_FIELD_NUMBER: _ClassVar[int]
    SHARED_MEMORY_FIELD_NUMBER: _ClassVar[int]
    SURFACE_FIELD_NUMBER: _ClassVar[int]
    TOPOLOGY_KEPT_FIELD_NUMBER: _ClassVar[int]
    TOPOLOGY_NAME_FIELD_NUMBER: _ClassVar[int]
    VALIDATE_ONLY_FIELD_NUMBER: _ClassVar[int]
    backend_kind: BackendKind
    coordinate_type: _mesh_pb2.ScalarType
    element_quality_metrics: _containers.RepeatedScalarFieldContainer[QualityMetric]
    inline_topology: _mesh_pb2.TopologySpec
    iteration_history_included: bool
    max_result_chunk_bytes: int
    node_pair_count: int
    options: SmoothingOptions
    prescribed_node_count: int
    priority: Priority
    progress_interval: _duration_pb2.Duration
    quality_detail: QualityDetail
    queue_timeout: _duration_pb2.Duration
    request_id: str
    result_ttl: _duration_pb2.Duration
    shared_memory: SharedMemoryUse
    surface: SurfaceSpec
    topology_kept: bool
    topology_name: str
    validate_only: bool
    def __init__(self, request_id: _Optional[str] = ..., inline_topology: _Optional[_Union[_mesh_pb2.TopologySpec, _Mapping]] = ..., topology_name: _Optional[str] = ..., coordinate_type: _Optional[_Union[_mesh_pb2.ScalarType, str]] = ..., options: _Optional[_Union[SmoothingOptions, _Mapping]] = ..., backend_kind: _Optional[_Union[BackendKind, str]] = ..., priority: _Optional[_Union[Priority, str]] = ..., queue_timeout: _Optional[_Union[_duration_pb2.Duration, _Mapping]] = ..., progress_interval: _Optional[_Union[_duration_pb2.Duration, _Mapping]] = ..., result_ttl: _Optional[_Union[_duration_pb2.Duration, _Mapping]] = ..., validate_only: bool = ..., max_result_chunk_bytes: _Optional[int] = ..., iteration_history_included: bool = ..., topology_kept: bool = ..., quality_detail: _Optional[_Union[QualityDetail, str]] = ..., element_quality_metrics: _Optional[_Iterable[_Union[QualityMetric, str]]] = ..., prescribed_node_count: _Optional[int] = ..., shared_memory: _Optional[_Union[SharedMemoryUse, _Mapping]] = ..., node_pair_count: _Optional[int] = ..., surface: _Optional[_Union[SurfaceSpec, _Mapping]] = ...) -> None: ...

class KeptQuality(_message.Message):
    __slots__ = ["for_mean", "for_mean_ratio", "for_scaled_jacobian", "metric"]
    FOR_MEAN_FIELD_NUMBER: _ClassVar[int]
    FOR_MEAN_RATIO_FIELD_NUMBER: _ClassVar[int]
    FOR_SCALED_JACOBIAN_FIELD_NUMBER: _ClassVar[int]
    METRIC_FIELD_NUMBER: _ClassVar[int]
    for_mean: int
    for_mean_ratio: int
    for_scaled_jacobian: int
    metric: QualityMetric
    def __init__(self, metric: _Optional[_Union[QualityMetric, str]] = ..., for_mean_ratio: _Optional[int] = ..., for_scaled_jacobian: _Optional[int] = ..., for_mean: _Optional[int] = ...) -> None: ...

class Laplacian(_message.Message):
    __slots__ = ["relaxation_factor", "weighting"]
    RELAXATION_FACTOR_FIELD_NUMBER: _ClassVar[int]
    WEIGHTING_FIELD_NUMBER: _ClassVar[int]
    relaxation_factor: float
    weighting: Weighting
    def __init__(self, weighting: _Optional[_Union[Weighting, str]] = ..., relaxation_factor: _Optional[float] = ...) -> None: ...

class LeaseSharedMemoryRequest(_message.Message):
    __slots__ = ["size_bytes"]
    SIZE_BYTES_FIELD_NUMBER: _ClassVar[int]
    size_bytes: int
    def __init__(self, size_bytes: _Optional[int] = ...) -> None: ...

class LeaseSharedMemoryResponse(_message.Message):
    __slots__ = ["segment_name", "size_bytes", "socket_path", "ticket"]
    SEGMENT_NAME_FIELD_NUMBER: _ClassVar[int]
    SIZE_BYTES_FIELD_NUMBER: _ClassVar[int]
    SOCKET_PATH_FIELD_NUMBER: _ClassVar[int]
    TICKET_FIELD_NUMBER: _ClassVar[int]
    segment_name: str
    size_bytes: int
    socket_path: str
    ticket: bytes
    def __init__(self, segment_name: _Optional[str] = ..., socket_path: _Optional[str] = ..., ticket: _Optional[bytes] = ..., size_bytes: _Optional[int] = ...) -> None: ...

class Limits(_message.Message):
    __slots__ = ["early_data_bytes", "max_chunk_bytes", "max_concurrent_streams", "max_element_count", "max_job_bytes", "max_node_count", "max_queue_timeout", "max_queued_job_count", "max_result_ttl", "max_shared_memory_bytes", "stream_idle_timeout"]
    EARLY_DATA_BYTES_FIELD_NUMBER: _ClassVar[int]
    MAX_CHUNK_BYTES_FIELD_NUMBER: _ClassVar[int]
    MAX_CONCURRENT_STREAMS_FIELD_NUMBER: _ClassVar[int]
    MAX_ELEMENT_COUNT_FIELD_NUMBER: _ClassVar[int]
    MAX_JOB_BYTES_FIELD_NUMBER: _ClassVar[int]
    MAX_NODE_COUNT_FIELD_NUMBER: _ClassVar[int]
    MAX_QUEUED_JOB_COUNT_FIELD_NUMBER: _ClassVar[int]
    MAX_QUEUE_TIMEOUT_FIELD_NUMBER: _ClassVar[int]
    MAX_RESULT_TTL_FIELD_NUMBER: _ClassVar[int]
    MAX_SHARED_MEMORY_BYTES_FIELD_NUMBER: _ClassVar[int]
    STREAM_IDLE_TIMEOUT_FIELD_NUMBER: _ClassVar[int]
    early_data_bytes: int
    max_chunk_bytes: int
    max_concurrent_streams: int
    max_element_count: int
    max_job_bytes: int
    max_node_count: int
    max_queue_timeout: _duration_pb2.Duration
    max_queued_job_count: int
    max_result_ttl: _duration_pb2.Duration
    max_shared_memory_bytes: int
    stream_idle_timeout: _duration_pb2.Duration
    def __init__(self, max_chunk_bytes: _Optional[int] = ..., max_job_bytes: _Optional[int] = ..., max_node_count: _Optional[int] = ..., max_element_count: _Optional[int] = ..., max_queued_job_count: _Optional[int] = ..., max_concurrent_streams: _Optional[int] = ..., max_result_ttl: _Optional[_Union[_duration_pb2.Duration, _Mapping]] = ..., max_queue_timeout: _Optional[_Union[_duration_pb2.Duration, _Mapping]] = ..., stream_idle_timeout: _Optional[_Union[_duration_pb2.Duration, _Mapping]] = ..., early_data_bytes: _Optional[int] = ..., max_shared_memory_bytes: _Optional[int] = ...) -> None: ...

class ListJobsRequest(_message.Message):
    __slots__ = ["page_size", "page_token", "states"]
    PAGE_SIZE_FIELD_NUMBER: _ClassVar[int]
    PAGE_TOKEN_FIELD_NUMBER: _ClassVar[int]
    STATES_FIELD_NUMBER: _ClassVar[int]
    page_size: int
    page_token: str
    states: _containers.RepeatedScalarFieldContainer[State]
    def __init__(self, page_size: _Optional[int] = ..., page_token: _Optional[str] = ..., states: _Optional[_Iterable[_Union[State, str]]] = ...) -> None: ...

class ListJobsResponse(_message.Message):
    __slots__ = ["jobs", "next_page_token"]
    JOBS_FIELD_NUMBER: _ClassVar[int]
    NEXT_PAGE_TOKEN_FIELD_NUMBER: _ClassVar[int]
    jobs: _containers.RepeatedCompositeFieldContainer[Job]
    next_page_token: str
    def __init__(self, jobs: _Optional[_Iterable[_Union[Job, _Mapping]]] = ..., next_page_token: _Optional[str] = ...) -> None: ...

class LockedStats(_message.Message):
    __slots__ = ["element_count", "inverted_element_count", "worst_element"]
    ELEMENT_COUNT_FIELD_NUMBER: _ClassVar[int]
    INVERTED_ELEMENT_COUNT_FIELD_NUMBER: _ClassVar[int]
    WORST_ELEMENT_FIELD_NUMBER: _ClassVar[int]
    element_count: int
    inverted_element_count: int
    worst_element: ElementQuality
    def __init__(self, element_count: _Optional[int] = ..., inverted_element_count: _Optional[int] = ..., worst_element: _Optional[_Union[ElementQuality, _Mapping]] = ...) -> None: ...

class MetricStats(_message.Message):
    __slots__ = ["element_count", "histogram", "histogram_lower", "histogram_upper", "max", "mean", "metric", "min", "percentile_1"]
    ELEMENT_COUNT_FIELD_NUMBER: _ClassVar[int]
    HISTOGRAM_FIELD_NUMBER: _ClassVar[int]
    HISTOGRAM_LOWER_FIELD_NUMBER: _ClassVar[int]
    HISTOGRAM_UPPER_FIELD_NUMBER: _ClassVar[int]
    MAX_FIELD_NUMBER: _ClassVar[int]
    MEAN_FIELD_NUMBER: _ClassVar[int]
    METRIC_FIELD_NUMBER: _ClassVar[int]
    MIN_FIELD_NUMBER: _ClassVar[int]
    PERCENTILE_1_FIELD_NUMBER: _ClassVar[int]
    element_count: int
    histogram: _containers.RepeatedScalarFieldContainer[int]
    histogram_lower: float
    histogram_upper: float
    max: float
    mean: float
    metric: QualityMetric
    min: float
    percentile_1: float
    def __init__(self, metric: _Optional[_Union[QualityMetric, str]] = ..., element_count: _Optional[int] = ..., min: _Optional[float] = ..., percentile_1: _Optional[float] = ..., mean: _Optional[float] = ..., max: _Optional[float] = ..., histogram_lower: _Optional[float] = ..., histogram_upper: _Optional[float] = ..., histogram: _Optional[_Iterable[int]] = ...) -> None: ...

class MotionStats(_message.Message):
    __slots__ = ["blocking_element_count", "blocking_elements", "linear_iteration_count", "linear_residual", "linear_time", "reached", "rejected_step_count", "step_count"]
    BLOCKING_ELEMENTS_FIELD_NUMBER: _ClassVar[int]
    BLOCKING_ELEMENT_COUNT_FIELD_NUMBER: _ClassVar[int]
    LINEAR_ITERATION_COUNT_FIELD_NUMBER: _ClassVar[int]
    LINEAR_RESIDUAL_FIELD_NUMBER: _ClassVar[int]
    LINEAR_TIME_FIELD_NUMBER: _ClassVar[int]
    REACHED_FIELD_NUMBER: _ClassVar[int]
    REJECTED_STEP_COUNT_FIELD_NUMBER: _ClassVar[int]
    STEP_COUNT_FIELD_NUMBER: _ClassVar[int]
    blocking_element_count: int
    blocking_elements: _containers.RepeatedScalarFieldContainer[int]
    linear_iteration_count: int
    linear_residual: float
    linear_time: _duration_pb2.Duration
    reached: float
    rejected_step_count: int
    step_count: int
    def __init__(self, reached: _Optional[float] = ..., step_count: _Optional[int] = ..., rejected_step_count: _Optional[int] = ..., linear_iteration_count: _Optional[int] = ..., linear_residual: _Optional[float] = ..., linear_time: _Optional[_Union[_duration_pb2.Duration, _Mapping]] = ..., blocking_element_count: _Optional[int] = ..., blocking_elements: _Optional[_Iterable[int]] = ...) -> None: ...

class Move(_message.Message):
    __slots__ = ["derivative", "least_step", "start", "target"]
    DERIVATIVE_FIELD_NUMBER: _ClassVar[int]
    LEAST_STEP_FIELD_NUMBER: _ClassVar[int]
    START_FIELD_NUMBER: _ClassVar[int]
    TARGET_FIELD_NUMBER: _ClassVar[int]
    derivative: Derivative
    least_step: float
    start: Start
    target: Target
    def __init__(self, target: _Optional[_Union[Target, str]] = ..., least_step: _Optional[float] = ..., start: _Optional[_Union[Start, str]] = ..., derivative: _Optional[_Union[Derivative, str]] = ...) -> None: ...

class NodeCounts(_message.Message):
    __slots__ = ["between_regions", "boundary", "coincident", "curved", "fixed", "isolated", "moved", "on_non_manifold_edges", "outside_only_below", "paired", "sliding_in_plane", "sliding_on_curve", "sliding_on_line", "sliding_on_surface", "total"]
    BETWEEN_REGIONS_FIELD_NUMBER: _ClassVar[int]
    BOUNDARY_FIELD_NUMBER: _ClassVar[int]
    COINCIDENT_FIELD_NUMBER: _ClassVar[int]
    CURVED_FIELD_NUMBER: _ClassVar[int]
    FIXED_FIELD_NUMBER: _ClassVar[int]
    ISOLATED_FIELD_NUMBER: _ClassVar[int]
    MOVED_FIELD_NUMBER: _ClassVar[int]
    ON_NON_MANIFOLD_EDGES_FIELD_NUMBER: _ClassVar[int]
    OUTSIDE_ONLY_BELOW_FIELD_NUMBER: _ClassVar[int]
    PAIRED_FIELD_NUMBER: _ClassVar[int]
    SLIDING_IN_PLANE_FIELD_NUMBER: _ClassVar[int]
    SLIDING_ON_CURVE_FIELD_NUMBER: _ClassVar[int]
    SLIDING_ON_LINE_FIELD_NUMBER: _ClassVar[int]
    SLIDING_ON_SURFACE_FIELD_NUMBER: _ClassVar[int]
    TOTAL_FIELD_NUMBER: _ClassVar[int]
    between_regions: int
    boundary: int
    coincident: int
    curved: int
    fixed: int
    isolated: int
    moved: int
    on_non_manifold_edges: int
    outside_only_below: int
    paired: int
    sliding_in_plane: int
    sliding_on_curve: int
    sliding_on_line: int
    sliding_on_surface: int
    total: int
    def __init__(self, total: _Optional[int] = ..., boundary: _Optional[int] = ..., fixed: _Optional[int] = ..., isolated: _Optional[int] = ..., moved: _Optional[int] = ..., between_regions: _Optional[int] = ..., sliding_in_plane: _Optional[int] = ..., sliding_on_line: _Optional[int] = ..., curved: _Optional[int] = ..., sliding_on_surface: _Optional[int] = ..., sliding_on_curve: _Optional[int] = ..., outside_only_below: _Optional[int] = ..., coincident: _Optional[int] = ..., on_non_manifold_edges: _Optional[int] = ..., paired: _Optional[int] = ...) -> None: ...

class Optimize(_message.Message):
    __slots__ = ["goal", "stay", "target"]
    GOAL_FIELD_NUMBER: _ClassVar[int]
    STAY_FIELD_NUMBER: _ClassVar[int]
    TARGET_FIELD_NUMBER: _ClassVar[int]
    goal: Goal
    stay: float
    target: Target
    def __init__(self, goal: _Optional[_Union[Goal, str]] = ..., target: _Optional[_Union[Target, str]] = ..., stay: _Optional[float] = ...) -> None: ...

class PoorElements(_message.Message):
    __slots__ = ["below", "element_count", "limited_count", "locked_count"]
    BELOW_FIELD_NUMBER: _ClassVar[int]
    ELEMENT_COUNT_FIELD_NUMBER: _ClassVar[int]
    LIMITED_COUNT_FIELD_NUMBER: _ClassVar[int]
    LOCKED_COUNT_FIELD_NUMBER: _ClassVar[int]
    below: float
    element_count: int
    limited_count: int
    locked_count: int
    def __init__(self, below: _Optional[float] = ..., element_count: _Optional[int] = ..., locked_count: _Optional[int] = ..., limited_count: _Optional[int] = ...) -> None: ...

class Progress(_message.Message):
    __slots__ = ["iteration", "max_displacement", "queue_position", "rms_displacement", "stage", "state"]
    ITERATION_FIELD_NUMBER: _ClassVar[int]
    MAX_DISPLACEMENT_FIELD_NUMBER: _ClassVar[int]
    QUEUE_POSITION_FIELD_NUMBER: _ClassVar[int]
    RMS_DISPLACEMENT_FIELD_NUMBER: _ClassVar[int]
    STAGE_FIELD_NUMBER: _ClassVar[int]
    STATE_FIELD_NUMBER: _ClassVar[int]
    iteration: int
    max_displacement: float
    queue_position: int
    rms_displacement: float
    stage: Stage
    state: State
    def __init__(self, state: _Optional[_Union[State, str]] = ..., queue_position: _Optional[int] = ..., stage: _Optional[_Union[Stage, str]] = ..., iteration: _Optional[int] = ..., max_displacement: _Optional[float] = ..., rms_displacement: _Optional[float] = ...) -> None: ...

class QualityStats(_message.Message):
    __slots__ = ["collapsed_element_count", "degenerate_element_count", "element_count", "enclosed_volume", "interface_element_count", "inverted_element_count", "metrics", "mirrored_element_count", "mirrored_elements", "sum_absolute_volume", "worst_elements"]
    COLLAPSED_ELEMENT_COUNT_FIELD_NUMBER: _ClassVar[int]
    DEGENERATE_ELEMENT_COUNT_FIELD_NUMBER: _ClassVar[int]
    ELEMENT_COUNT_FIELD_NUMBER: _ClassVar[int]
    ENCLOSED_VOLUME_FIELD_NUMBER: _ClassVar[int]
    INTERFACE_ELEMENT_COUNT_FIELD_NUMBER: _ClassVar[int]
    INVERTED_ELEMENT_COUNT_FIELD_NUMBER: _ClassVar[int]
    METRICS_FIELD_NUMBER: _ClassVar[int]
    MIRRORED_ELEMENTS_FIELD_NUMBER: _ClassVar[int]
    MIRRORED_ELEMENT_COUNT_FIELD_NUMBER: _ClassVar[int]
    SUM_ABSOLUTE_VOLUME_FIELD_NUMBER: _ClassVar[int]
    WORST_ELEMENTS_FIELD_NUMBER: _ClassVar[int]
    collapsed_element_count: int
    degenerate_element_count: int
    element_count: int
    enclosed_volume: float
    interface_element_count: int
    inverted_element_count: int
    metrics: _containers.RepeatedCompositeFieldContainer[MetricStats]
    mirrored_element_count: int
    mirrored_elements: _containers.RepeatedScalarFieldContainer[int]
    sum_absolute_volume: float
    worst_elements: _containers.RepeatedCompositeFieldContainer[ElementQuality]
    def __init__(self, element_count: _Optional[int] = ..., inverted_element_count: _Optional[int] = ..., degenerate_element_count: _Optional[int] = ..., metrics: _Optional[_Iterable[_Union[MetricStats, _Mapping]]] = ..., worst_elements: _Optional[_Iterable[_Union[ElementQuality, _Mapping]]] = ..., sum_absolute_volume: _Optional[float] = ..., enclosed_volume: _Optional[float] = ..., mirrored_element_count: _Optional[int] = ..., mirrored_elements: _Optional[_Iterable[int]] = ..., collapsed_element_count: _Optional[int] = ..., interface_element_count: _Optional[int] = ...) -> None: ...

class ResultHeader(_message.Message):
    __slots__ = ["coordinate_type", "element_quality_metrics", "in_place", "node_count", "size_bytes", "topology_name"]
    COORDINATE_TYPE_FIELD_NUMBER: _ClassVar[int]
    ELEMENT_QUALITY_METRICS_FIELD_NUMBER: _ClassVar[int]
    IN_PLACE_FIELD_NUMBER: _ClassVar[int]
    NODE_COUNT_FIELD_NUMBER: _ClassVar[int]
    SIZE_BYTES_FIELD_NUMBER: _ClassVar[int]
    TOPOLOGY_NAME_FIELD_NUMBER: _ClassVar[int]
    coordinate_type: _mesh_pb2.ScalarType
    element_quality_metrics: _containers.RepeatedScalarFieldContainer[QualityMetric]
    in_place: bool
    node_count: int
    size_bytes: int
    topology_name: str
    def __init__(self, node_count: _Optional[int] = ..., coordinate_type: _Optional[_Union[_mesh_pb2.ScalarType, str]] = ..., size_bytes: _Optional[int] = ..., topology_name: _Optional[str] = ..., element_quality_metrics: _Optional[_Iterable[_Union[QualityMetric, str]]] = ..., in_place: bool = ...) -> None: ...

class SharedMemoryArray(_message.Message):
    __slots__ = ["array_id", "offset_bytes"]
    ARRAY_ID_FIELD_NUMBER: _ClassVar[int]
    OFFSET_BYTES_FIELD_NUMBER: _ClassVar[int]
    array_id: _mesh_pb2.ArrayId
    offset_bytes: int
    def __init__(self, array_id: _Optional[_Union[_mesh_pb2.ArrayId, str]] = ..., offset_bytes: _Optional[int] = ...) -> None: ...

class SharedMemoryUse(_message.Message):
    __slots__ = ["inputs", "result_offset_bytes", "segment_name"]
    INPUTS_FIELD_NUMBER: _ClassVar[int]
    RESULT_OFFSET_BYTES_FIELD_NUMBER: _ClassVar[int]
    SEGMENT_NAME_FIELD_NUMBER: _ClassVar[int]
    inputs: _containers.RepeatedCompositeFieldContainer[SharedMemoryArray]
    result_offset_bytes: int
    segment_name: str
    def __init__(self, segment_name: _Optional[str] = ..., inputs: _Optional[_Iterable[_Union[SharedMemoryArray, _Mapping]]] = ..., result_offset_bytes: _Optional[int] = ...) -> None: ...

class SmartLaplacian(_message.Message):
    __slots__ = ["relaxation_factor", "weighting"]
    RELAXATION_FACTOR_FIELD_NUMBER: _ClassVar[int]
    WEIGHTING_FIELD_NUMBER: _ClassVar[int]
    relaxation_factor: float
    weighting: Weighting
    def __init__(self, weighting: _Optional[_Union[Weighting, str]] = ..., relaxation_factor: _Optional[float] = ...) -> None: ...

class SmoothRequest(_message.Message):
    __slots__ = ["chunk", "spec"]
    CHUNK_FIELD_NUMBER: _ClassVar[int]
    SPEC_FIELD_NUMBER: _ClassVar[int]
    chunk: _mesh_pb2.Chunk
    spec: JobSpec
    def __init__(self, spec: _Optional[_Union[JobSpec, _Mapping]] = ..., chunk: _Optional[_Union[_mesh_pb2.Chunk, _Mapping]] = ...) -> None: ...

class SmoothResponse(_message.Message):
    __slots__ = ["accepted", "chunk", "input_taken", "progress", "result", "stop_sending", "summary"]
    ACCEPTED_FIELD_NUMBER: _ClassVar[int]
    CHUNK_FIELD_NUMBER: _ClassVar[int]
    INPUT_TAKEN_FIELD_NUMBER: _ClassVar[int]
    PROGRESS_FIELD_NUMBER: _ClassVar[int]
    RESULT_FIELD_NUMBER: _ClassVar[int]
    STOP_SENDING_FIELD_NUMBER: _ClassVar[int]
    SUMMARY_FIELD_NUMBER: _ClassVar[int]
    accepted: Accepted
    chunk: _mesh_pb2.Chunk
    input_taken: InputTaken
    progress: Progress
    result: ResultHeader
    stop_sending: StopSending
    summary: Summary
    def __init__(self, accepted: _Optional[_Union[Accepted, _Mapping]] = ..., progress: _Optional[_Union[Progress, _Mapping]] = ..., result: _Optional[_Union[ResultHeader, _Mapping]] = ..., chunk: _Optional[_Union[_mesh_pb2.Chunk, _Mapping]] = ..., summary: _Optional[_Union[Summary, _Mapping]] = ..., stop_sending: _Optional[_Union[StopSending, _Mapping]] = ..., input_taken: _Optional[_Union[InputTaken, _Mapping]] = ...) -> None: ...

class SmoothingOptions(_message.Message):
    __slots__ = ["absolute_movement_limit", "absolute_tolerance", "boundary_policy", "compute_budget", "convergence_tolerance", "feature_angle_degrees", "form", "guard", "hc_laplacian", "laplacian", "max_iteration_count", "metric", "move", "movement_limit", "never_worse", "only_below", "only_below_rings", "optimize", "report_below", "smart_laplacian", "tangled_policy", "target_quality", "taubin", "windowed_sinc"]
    ABSOLUTE_MOVEMENT_LIMIT_FIELD_NUMBER: _ClassVar[int]
    ABSOLUTE_TOLERANCE_FIELD_NUMBER: _ClassVar[int]
    BOUNDARY_POLICY_FIELD_NUMBER: _ClassVar[int]
    COMPUTE_BUDGET_FIELD_NUMBER: _ClassVar[int]
    CONVERGENCE_TOLERANCE_FIELD_NUMBER: _ClassVar[int]
    FEATURE_ANGLE_DEGREES_FIELD_NUMBER: _ClassVar[int]
    FORM_FIELD_NUMBER: _ClassVar[int]
    GUARD_FIELD_NUMBER: _ClassVar[int]
    HC_LAPLACIAN_FIELD_NUMBER: _ClassVar[int]
    LAPLACIAN_FIELD_NUMBER: _ClassVar[int]
    MAX_ITERATION_COUNT_FIELD_NUMBER: _ClassVar[int]
    METRIC_FIELD_NUMBER: _ClassVar[int]
    MOVEMENT_LIMIT_FIELD_NUMBER: _ClassVar[int]
    MOVE_FIELD_NUMBER: _ClassVar[int]
    NEVER_WORSE_FIELD_NUMBER: _ClassVar[int]
    ONLY_BELOW_FIELD_NUMBER: _ClassVar[int]
    ONLY_BELOW_RINGS_FIELD_NUMBER: _ClassVar[int]
    OPTIMIZE_FIELD_NUMBER: _ClassVar[int]
    REPORT_BELOW_FIELD_NUMBER: _ClassVar[int]
    SMART_LAPLACIAN_FIELD_NUMBER: _ClassVar[int]
    TANGLED_POLICY_FIELD_NUMBER: _ClassVar[int]
    TARGET_QUALITY_FIELD_NUMBER: _ClassVar[int]
    TAUBIN_FIELD_NUMBER: _ClassVar[int]
    WINDOWED_SINC_FIELD_NUMBER: _ClassVar[int]
    absolute_movement_limit: float
    absolute_tolerance: float
    boundary_policy: BoundaryPolicy
    compute_budget: _duration_pb2.Duration
    convergence_tolerance: float
    feature_angle_degrees: float
    form: Form
    guard: bool
    hc_laplacian: HcLaplacian
    laplacian: Laplacian
    max_iteration_count: int
    metric: QualityMetric
    move: Move
    movement_limit: float
    never_worse: bool
    only_below: float
    only_below_rings: int
    optimize: Optimize
    report_below: float
    smart_laplacian: SmartLaplacian
    tangled_policy: TangledPolicy
    target_quality: float
    taubin: Taubin
    windowed_sinc: WindowedSinc
    def __init__(self, laplacian: _Optional[_Union[Laplacian, _Mapping]] = ..., smart_laplacian: _Optional[_Union[SmartLaplacian, _Mapping]] = ..., taubin: _Optional[_Union[Taubin, _Mapping]] = ..., hc_laplacian: _Optional[_Union[HcLaplacian, _Mapping]] = ..., optimize: _Optional[_Union[Optimize, _Mapping]] = ..., windowed_sinc: _Optional[_Union[WindowedSinc, _Mapping]] = ..., move: _Optional[_Union[Move, _Mapping]] = ..., form: _Optional[_Union[Form, str]] = ..., max_iteration_count: _Optional[int] = ..., convergence_tolerance: _Optional[float] = ..., absolute_tolerance: _Optional[float] = ..., boundary_policy: _Optional[_Union[BoundaryPolicy, str]] = ..., feature_angle_degrees: _Optional[float] = ..., guard: bool = ..., tangled_policy: _Optional[_Union[TangledPolicy, str]] = ..., target_quality: _Optional[float] = ..., movement_limit: _Optional[float] = ..., absolute_movement_limit: _Optional[float] = ..., compute_budget: _Optional[_Union[_duration_pb2.Duration, _Mapping]] = ..., only_below: _Optional[float] = ..., only_below_rings: _Optional[int] = ..., report_below: _Optional[float] = ..., never_worse: bool = ..., metric: _Optional[_Union[QualityMetric, str]] = ...) -> None: ...

class StopSending(_message.Message):
    __slots__ = []
    def __init__(self) -> None: ...

class Summary(_message.Message):
    __slots__ = ["boundary_deviation", "convergence", "execution", "fit", "flat_reference_element_count", "kept_quality", "locked", "motion", "nodes", "options", "poor", "quality_after", "quality_before", "stop_reason", "timings"]
    BOUNDARY_DEVIATION_FIELD_NUMBER: _ClassVar[int]
    CONVERGENCE_FIELD_NUMBER: _ClassVar[int]
    EXECUTION_FIELD_NUMBER: _ClassVar[int]
    FIT_FIELD_NUMBER: _ClassVar[int]
    FLAT_REFERENCE_ELEMENT_COUNT_FIELD_NUMBER: _ClassVar[int]
    KEPT_QUALITY_FIELD_NUMBER: _ClassVar[int]
    LOCKED_FIELD_NUMBER: _ClassVar[int]
    MOTION_FIELD_NUMBER: _ClassVar[int]
    NODES_FIELD_NUMBER: _ClassVar[int]
    OPTIONS_FIELD_NUMBER: _ClassVar[int]
    POOR_FIELD_NUMBER: _ClassVar[int]
    QUALITY_AFTER_FIELD_NUMBER: _ClassVar[int]
    QUALITY_BEFORE_FIELD_NUMBER: _ClassVar[int]
    STOP_REASON_FIELD_NUMBER: _ClassVar[int]
    TIMINGS_FIELD_NUMBER: _ClassVar[int]
    boundary_deviation: BoundaryDeviation
    convergence: ConvergenceStats
    execution: Execution
    fit: FitStats
    flat_reference_element_count: int
    kept_quality: KeptQuality
    locked: LockedStats
    motion: MotionStats
    nodes: NodeCounts
    options: SmoothingOptions
    poor: PoorElements
    quality_after: QualityStats
    quality_before: QualityStats
    stop_reason: StopReason
    timings: Timings
    def __init__(self, stop_reason: _Optional[_Union[StopReason, str]] = ..., convergence: _Optional[_Union[ConvergenceStats, _Mapping]] = ..., quality_before: _Optional[_Union[QualityStats, _Mapping]] = ..., quality_after: _Optional[_Union[QualityStats, _Mapping]] = ..., locked: _Optional[_Union[LockedStats, _Mapping]] = ..., nodes: _Optional[_Union[NodeCounts, _Mapping]] = ..., timings: _Optional[_Union[Timings, _Mapping]] = ..., execution: _Optional[_Union[Execution, _Mapping]] = ..., options: _Optional[_Union[SmoothingOptions, _Mapping]] = ..., boundary_deviation: _Optional[_Union[BoundaryDeviation, _Mapping]] = ..., flat_reference_element_count: _Optional[int] = ..., poor: _Optional[_Union[PoorElements, _Mapping]] = ..., motion: _Optional[_Union[MotionStats, _Mapping]] = ..., kept_quality: _Optional[_Union[KeptQuality, _Mapping]] = ..., fit: _Optional[_Union[FitStats, _Mapping]] = ...) -> None: ...

class SurfaceCounts(_message.Message):
    __slots__ = ["corner_count", "curve_count", "degenerate_triangle_count", "non_manifold_edge_count", "open_edge_count", "patch_count", "triangle_count"]
    CORNER_COUNT_FIELD_NUMBER: _ClassVar[int]
    CURVE_COUNT_FIELD_NUMBER: _ClassVar[int]
    DEGENERATE_TRIANGLE_COUNT_FIELD_NUMBER: _ClassVar[int]
    NON_MANIFOLD_EDGE_COUNT_FIELD_NUMBER: _ClassVar[int]
    OPEN_EDGE_COUNT_FIELD_NUMBER: _ClassVar[int]
    PATCH_COUNT_FIELD_NUMBER: _ClassVar[int]
    TRIANGLE_COUNT_FIELD_NUMBER: _ClassVar[int]
    corner_count: int
    curve_count: int
    degenerate_triangle_count: int
    non_manifold_edge_count: int
    open_edge_count: int
    patch_count: int
    triangle_count: int
    def __init__(self, triangle_count: _Optional[int] = ..., patch_count: _Optional[int] = ..., curve_count: _Optional[int] = ..., corner_count: _Optional[int] = ..., open_edge_count: _Optional[int] = ..., non_manifold_edge_count: _Optional[int] = ..., degenerate_triangle_count: _Optional[int] = ...) -> None: ...

class SurfaceDistance(_message.Message):
    __slots__ = ["largest", "mean"]
    LARGEST_FIELD_NUMBER: _ClassVar[int]
    MEAN_FIELD_NUMBER: _ClassVar[int]
    largest: float
    mean: float
    def __init__(self, largest: _Optional[float] = ..., mean: _Optional[float] = ...) -> None: ...

class SurfaceSpec(_message.Message):
    __slots__ = ["patches_present", "point_count", "triangle_count"]
    PATCHES_PRESENT_FIELD_NUMBER: _ClassVar[int]
    POINT_COUNT_FIELD_NUMBER: _ClassVar[int]
    TRIANGLE_COUNT_FIELD_NUMBER: _ClassVar[int]
    patches_present: bool
    point_count: int
    triangle_count: int
    def __init__(self, point_count: _Optional[int] = ..., triangle_count: _Optional[int] = ..., patches_present: bool = ...) -> None: ...

class TargetPart(_message.Message):
    __slots__ = ["curve", "distance", "node_count"]
    CURVE_FIELD_NUMBER: _ClassVar[int]
    DISTANCE_FIELD_NUMBER: _ClassVar[int]
    NODE_COUNT_FIELD_NUMBER: _ClassVar[int]
    curve: bool
    distance: SurfaceDistance
    node_count: int
    def __init__(self, curve: bool = ..., node_count: _Optional[int] = ..., distance: _Optional[_Union[SurfaceDistance, _Mapping]] = ...) -> None: ...

class Taubin(_message.Message):
    __slots__ = ["mu"]
    LAMBDA_FIELD_NUMBER: _ClassVar[int]
    MU_FIELD_NUMBER: _ClassVar[int]
    mu: float
    def __init__(self, mu: _Optional[float] = ..., **kwargs) -> None: ...

class Timings(_message.Message):
    __slots__ = ["download", "evaluate", "find_boundary", "find_neighbours", "iterate", "queue", "receive", "send", "upload"]
    DOWNLOAD_FIELD_NUMBER: _ClassVar[int]
    EVALUATE_FIELD_NUMBER: _ClassVar[int]
    FIND_BOUNDARY_FIELD_NUMBER: _ClassVar[int]
    FIND_NEIGHBOURS_FIELD_NUMBER: _ClassVar[int]
    ITERATE_FIELD_NUMBER: _ClassVar[int]
    QUEUE_FIELD_NUMBER: _ClassVar[int]
    RECEIVE_FIELD_NUMBER: _ClassVar[int]
    SEND_FIELD_NUMBER: _ClassVar[int]
    UPLOAD_FIELD_NUMBER: _ClassVar[int]
    download: _duration_pb2.Duration
    evaluate: _duration_pb2.Duration
    find_boundary: _duration_pb2.Duration
    find_neighbours: _duration_pb2.Duration
    iterate: _duration_pb2.Duration
    queue: _duration_pb2.Duration
    receive: _duration_pb2.Duration
    send: _duration_pb2.Duration
    upload: _duration_pb2.Duration
    def __init__(self, receive: _Optional[_Union[_duration_pb2.Duration, _Mapping]] = ..., queue: _Optional[_Union[_duration_pb2.Duration, _Mapping]] = ..., upload: _Optional[_Union[_duration_pb2.Duration, _Mapping]] = ..., find_neighbours: _Optional[_Union[_duration_pb2.Duration, _Mapping]] = ..., find_boundary: _Optional[_Union[_duration_pb2.Duration, _Mapping]] = ..., iterate: _Optional[_Union[_duration_pb2.Duration, _Mapping]] = ..., evaluate: _Optional[_Union[_duration_pb2.Duration, _Mapping]] = ..., download: _Optional[_Union[_duration_pb2.Duration, _Mapping]] = ..., send: _Optional[_Union[_duration_pb2.Duration, _Mapping]] = ...) -> None: ...

class Topology(_message.Message):
    __slots__ = ["boundary_node_count", "expire_time", "name", "resident_bytes", "spec"]
    BOUNDARY_NODE_COUNT_FIELD_NUMBER: _ClassVar[int]
    EXPIRE_TIME_FIELD_NUMBER: _ClassVar[int]
    NAME_FIELD_NUMBER: _ClassVar[int]
    RESIDENT_BYTES_FIELD_NUMBER: _ClassVar[int]
    SPEC_FIELD_NUMBER: _ClassVar[int]
    boundary_node_count: int
    expire_time: _timestamp_pb2.Timestamp
    name: str
    resident_bytes: int
    spec: _mesh_pb2.TopologySpec
    def __init__(self, name: _Optional[str] = ..., spec: _Optional[_Union[_mesh_pb2.TopologySpec, _Mapping]] = ..., expire_time: _Optional[_Union[_timestamp_pb2.Timestamp, _Mapping]] = ..., resident_bytes: _Optional[int] = ..., boundary_node_count: _Optional[int] = ...) -> None: ...

class WindowedSinc(_message.Message):
    __slots__ = ["pass_band", "window"]
    PASS_BAND_FIELD_NUMBER: _ClassVar[int]
    WINDOW_FIELD_NUMBER: _ClassVar[int]
    pass_band: float
    window: Window
    def __init__(self, window: _Optional[_Union[Window, str]] = ..., pass_band: _Optional[float] = ...) -> None: ...

class BackendKind(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = []

class Priority(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = []

class Form(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = []

class Weighting(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = []

class BoundaryPolicy(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = []

class TangledPolicy(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = []

class Window(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = []

class Goal(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = []

class Target(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = []

class Derivative(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = []

class Start(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = []

class QualityDetail(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = []

class Stage(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = []

class StopReason(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = []

class EndRule(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = []

class QualityMetric(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = []

class State(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = []
