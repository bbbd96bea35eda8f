"""The calls that carry no mesh."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from google.protobuf import empty_pb2, json_format, wrappers_pb2

from ._job_options import JobOptions
from ._progress import Progress, decode_progress, enum_name
from .v1 import smoothing_pb2 as pb

SHORT_TIMEOUT = 30.0  # seconds

R = TypeVar("R")


@dataclass(frozen=True)
class Unary(Generic[R]):
    """A call of one message each way, and what it returns of the answer."""

    path: str
    request: Any
    response: Any
    decode: Callable[[Any], R]


def serialize(message: Any) -> bytes:
    """Returns a message as it travels."""
    return bytes(message.SerializeToString())


@dataclass(frozen=True, kw_only=True)
class ServerInfo:
    """What a server is and has; `raw` is the whole GetServerInfoResponse."""

    version: str
    build_commit: str
    methods: tuple[str, ...]
    features: tuple[str, ...]
    draining: bool
    raw: dict[str, Any]


@dataclass(frozen=True, kw_only=True)
class JobInfo:
    """A job as the server knows it; `error` is "REASON: message" of a failed one."""

    name: str
    request_id: str
    state: str
    node_count: int
    element_count: int
    queue_position: int
    progress: Progress | None
    error: str
    raw: dict[str, Any]


@dataclass(frozen=True, kw_only=True)
class TopologyInfo:
    """A topology that the server keeps for the caller."""

    name: str
    node_count: int
    element_count: int
    boundary_node_count: int
    resident_bytes: int


def decode_info(message: pb.GetServerInfoResponse) -> ServerInfo:
    """Returns a server's description."""
    return ServerInfo(
        version=message.server_version,
        build_commit=message.build_commit,
        methods=tuple(message.methods),
        features=tuple(message.features),
        draining=message.draining,
        raw=_raw(message),
    )


def decode_job(message: pb.Job) -> JobInfo:
    """Returns a job's description."""
    error = message.error
    return JobInfo(
        name=message.name,
        request_id=message.request_id,
        state=enum_name(pb.State, "STATE_", message.state),
        node_count=message.node_count,
        element_count=message.element_count,
        queue_position=message.queue_position,
        progress=(
            decode_progress(message.last_progress) if message.HasField("last_progress") else None
        ),
        error=f"{error.reason}: {error.message}" if message.HasField("error") else "",
        raw=_raw(message),
    )


def decode_topology(message: pb.Topology) -> TopologyInfo:
    """Returns a topology's description."""
    return TopologyInfo(
        name=message.name,
        node_count=message.spec.node_count,
        element_count=sum(block.element_count for block in message.spec.element_blocks),
        boundary_node_count=message.boundary_node_count,
        resident_bytes=message.resident_bytes,
    )


def _raw(message: Any) -> dict[str, Any]:
    return dict(json_format.MessageToDict(message, preserving_proto_field_name=True))


def evaluate_only(options: JobOptions) -> JobOptions:
    """Returns the options of a job that moves no node."""
    return {**options, "iterations": 0}


def _unary(name: str, decode: Callable[[Any], R]) -> Unary[R]:
    request, response = getattr(pb, f"{name}Request"), getattr(pb, f"{name}Response")
    return Unary(f"/meshsmooth.v1.SmoothingService/{name}", request, response, decode)


def _as_it_is(answer: pb.LeaseSharedMemoryResponse) -> pb.LeaseSharedMemoryResponse:
    return answer


def _nothing(_: Any) -> None:
    return None


GET_SERVER_INFO = _unary("GetServerInfo", decode_info)
LIST_JOBS = _unary(
    "ListJobs", lambda answer: ([*map(decode_job, answer.jobs)], str(answer.next_page_token))
)
GET_JOB = _unary("GetJob", lambda answer: decode_job(answer.job))
CANCEL_JOB = _unary("CancelJob", lambda answer: decode_job(answer.job))
DELETE_JOB = _unary("DeleteJob", _nothing)
GET_TOPOLOGY = _unary("GetTopology", lambda answer: decode_topology(answer.topology))
DELETE_TOPOLOGY = _unary("DeleteTopology", _nothing)
LEASE_SHARED_MEMORY = _unary("LeaseSharedMemory", _as_it_is)
# The messages of grpc.health.v1, which gRPC's packages do not ship, look on the wire like these: a
# request for the whole server is empty, the answer's only field is number 1, an enum.
HEALTH = Unary(
    "/grpc.health.v1.Health/Check",
    empty_pb2.Empty,
    wrappers_pb2.Int32Value,
    lambda answer: bool(answer.value == 1),  # SERVING
)
