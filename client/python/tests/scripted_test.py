"""What both clients do when servers, proxies and networks misbehave."""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import Callable, Iterator
from typing import Any

import grpc
import numpy as np
import pytest
from local_server import eventually
from scripted_server import Call, MockServer, mock_server

import meshsmooth as ms
from meshsmooth import _wire

POINTS = np.arange(15, dtype=float).reshape(5, 3)
MESH = (POINTS, {"tetra": np.array([[0, 1, 2, 3], [1, 2, 3, 4]])})
RESULT = (POINTS + 0.5).tobytes()
Code = grpc.StatusCode

Smooth = Callable[..., Any]


@pytest.fixture
def mock() -> Iterator[MockServer]:
    with mock_server() as server:
        yield server


@pytest.fixture(params=["Client", "AsyncClient"])
def smooth(request: pytest.FixtureRequest, mock: MockServer) -> Iterator[Smooth]:
    """`smooth` of one of the two clients."""
    if request.param == "Client":
        with ms.Client(mock.address) as client:
            yield client.smooth
        return

    def smooth(mesh: Any, **keywords: Any) -> Any:
        async def run() -> Any:
            async with ms.AsyncClient(mock.address) as client:
                return await client.smooth(mesh, **keywords)

        return asyncio.run(run())

    yield smooth


def succeed(call: Call) -> None:
    call.read_spec()
    call.accept()
    call.read_upload()
    call.succeed(RESULT)


def test_upload_is_complete_and_in_order(mock: MockServer, smooth: Smooth) -> None:
    uploads = []

    def script(call: Call) -> None:
        spec = call.read_spec()
        call.accept()
        uploads.append((spec, call.read_upload()))
        call.succeed(RESULT)

    mock.scripts = [script]
    better = smooth(MESH, fixed=[1], regions=np.array([1, 2]))
    assert better[0].tobytes() == RESULT
    spec, arrays = uploads[0]
    assert list(arrays) == [1, 2, 3, 4]
    assert arrays[1] == MESH[1]["tetra"].astype("<i4").tobytes()
    assert arrays[2] == bytes([0, 1, 0, 0, 0])
    assert arrays[3] == np.array([0, 1], "<i4").tobytes()
    assert arrays[4] == POINTS.tobytes()
    assert spec.inline_topology.node_count == 5
    assert spec.options.SerializeToString() == b""
    assert not spec.HasField("progress_interval")


def test_large_mesh_waits_for_the_answer(mock: MockServer, smooth: Smooth) -> None:
    many = np.zeros((400_000, 3))
    early = []

    def refuse_now(call: Call) -> None:
        call.read_spec()
        size = 0
        while size < 64 << 10:
            message = call.read()
            assert message is not None
            size += len(message.chunk.data)
        early.append(size)
        call.stop_sending()
        assert call.read() is None  # half-closed without another chunk
        call.refuse(Code.INVALID_ARGUMENT, "MESH_EMPTY", "no")

    mock.scripts = [refuse_now]
    with pytest.raises(ms.InvalidMesh):
        smooth((many, {"tetra": MESH[1]["tetra"]}))
    assert early == [64 << 10]


def test_refusal_in_mid_upload(mock: MockServer, smooth: Smooth) -> None:
    many = np.zeros((2_000_000, 3), np.float32)
    seen = []

    def script(call: Call) -> None:
        call.read_spec()
        call.accept()
        call.read()
        call.stop_sending()
        seen.append(sum(len(message.chunk.data) for message in iter(call.read, None)))
        call.refuse(
            Code.INVALID_ARGUMENT, "INDEX_OUT_OF_RANGE", "element 1: …", element="1", node="77"
        )

    mock.scripts = [script]
    with pytest.raises(ms.InvalidMesh) as caught:
        smooth((many, MESH[1]))
    assert (caught.value.element, caught.value.node) == (1, 77)
    assert seen[0] < many.nbytes


def test_busy_server_is_asked_again_when_it_says(mock: MockServer, smooth: Smooth) -> None:
    ids = []

    def busy(call: Call) -> None:
        ids.append(call.read_spec().request_id)
        call.stop_sending()
        call.read_rest()
        call.refuse(Code.RESOURCE_EXHAUSTED, "QUEUE_FULL", "full", delay=0.05)

    mock.scripts = [busy, busy, succeed]
    assert smooth(MESH)[0].tobytes() == RESULT
    assert len(mock.calls) == 3
    assert ids[0] == ids[1]


def test_busy_error_says_when(mock: MockServer, smooth: Smooth) -> None:
    def busy(call: Call) -> None:
        call.read_spec()
        call.refuse(Code.RESOURCE_EXHAUSTED, "QUEUE_FULL", "full", delay=1.5)

    mock.scripts = [busy]
    with pytest.raises(ms.Busy, match=r"full \(QUEUE_FULL\); try again in 1.5 s") as caught:
        smooth(MESH, max_attempts=1)
    assert caught.value.retry_after == 1.5


def test_a_refusal_is_heard_while_chunks_are_sent(mock: MockServer, smooth: Smooth) -> None:
    def busy(call: Call) -> None:
        call.read_spec()
        call.refuse(Code.RESOURCE_EXHAUSTED, "QUEUE_FULL", "full", delay=1.5)

    mock.scripts = [busy]
    for _ in range(20):  # either end of the call may be the first
        with pytest.raises(ms.Busy):
            smooth(MESH, max_attempts=1)


def test_draining_server_is_left(mock: MockServer, smooth: Smooth) -> None:
    def drain(call: Call) -> None:
        call.read_spec()
        call.stop_sending()
        call.read_rest()
        call.refuse(Code.UNAVAILABLE, "DRAINING", "draining", delay=0)

    mock.scripts = [drain, succeed]
    assert smooth(MESH)[0].tobytes() == RESULT
    mock.scripts = [drain]
    with pytest.raises(ms.Unavailable) as caught:
        smooth(MESH, max_attempts=2)
    assert isinstance(caught.value, ConnectionError)
    assert caught.value.reason == "DRAINING"


@pytest.mark.parametrize(
    ("code", "message"),
    [
        (Code.UNAVAILABLE, "Socket closed"),
        (Code.UNKNOWN, "Stream removed"),
        (Code.UNKNOWN, "Stream removed (RST_STREAM (Received RST_STREAM with error code 2))"),
        (Code.CANCELLED, "Received RST_STREAM with error code 8"),
    ],
)
def test_broken_call_is_repeated(
    mock: MockServer, smooth: Smooth, code: grpc.StatusCode, message: str
) -> None:
    def broken(call: Call) -> None:
        call.read_spec()
        call.accept()
        call.read_upload()
        call.refuse(code, "", message)

    mock.scripts = [broken, succeed]
    assert smooth(MESH)[0].tobytes() == RESULT


def test_broken_download_leaves_the_input(mock: MockServer, smooth: Smooth) -> None:
    def broken(call: Call) -> None:
        call.read_spec()
        call.accept()
        call.read_upload()
        call.send_header(5, len(RESULT))
        call.send_chunk(0, RESULT[:48])
        call.refuse(Code.UNAVAILABLE, "", "Socket closed")

    mock.scripts = [broken]
    points = POINTS.copy()
    with pytest.raises(ms.Unavailable, match="the mesh here is unchanged"):
        smooth((points, MESH[1]), out=points, max_attempts=1)
    assert points.tobytes() == POINTS.tobytes()
    mock.scripts = [broken, succeed]
    smooth((points, MESH[1]), out=points)
    assert points.tobytes() == RESULT


def test_joined_job_sends_no_second_mesh(mock: MockServer, smooth: Smooth) -> None:
    def join(call: Call) -> None:
        call.read_spec()
        call.accept()
        call.stop_sending()
        call.read_upload()
        call.succeed(RESULT)

    mock.scripts = [join]
    assert smooth(MESH, request_id="4f2c9b1e-0000-4000-8000-000000000000")[0].tobytes() == RESULT


@pytest.mark.parametrize(
    ("answers", "what"),
    [
        (lambda call: call.send_summary(), "incomplete"),
        (lambda call: call.succeed(RESULT[:-24]), "4 nodes"),
        (lambda call: (call.send_header(5, len(RESULT)), call.send_chunk(8, RESULT)), "were due"),
        (
            lambda call: (
                call.send_header(5, len(RESULT)),
                call.send_chunk(0, RESULT + b"12345678"),
            ),
            "more result bytes",
        ),
        (lambda call: (call.send_header(5, 1), None), "1 bytes"),
        (lambda call: (call.send_header(5, 120), call.send_header(5, 120)), "twice"),
        (lambda call: call.accept(), "twice"),
        (
            lambda call: (call.send_header(5, 120), call.send_chunk(0, RESULT, crc32c=1)),
            "checksum",
        ),
        (lambda call: None, "without a summary"),
    ],
)
def test_broken_answers_are_errors(
    mock: MockServer, smooth: Smooth, answers: Any, what: str
) -> None:
    def script(call: Call) -> None:
        call.read_spec()
        call.accept()
        call.read_upload()
        answers(call)

    mock.scripts = [script]
    with pytest.raises(ms.ServerError, match=what):
        smooth(MESH)


def test_right_checksum_is_accepted(mock: MockServer, smooth: Smooth) -> None:
    def script(call: Call) -> None:
        call.read_spec()
        call.accept()
        call.read_upload()
        call.send_header(5, len(RESULT))
        call.send_chunk(0, RESULT, crc32c=_wire.crc32c(memoryview(RESULT)))
        call.send_summary()

    mock.scripts = [script]
    assert smooth(MESH)[0].tobytes() == RESULT


def test_metrics_of_an_older_server(mock: MockServer, smooth: Smooth) -> None:
    mock.scripts = [succeed]
    with pytest.raises(ms.InvalidOption) as caught:
        smooth(MESH, element_quality="mean_ratio", full=True)
    assert caught.value.reason == "OPTION_NOT_SUPPORTED"


ERRORS = [
    (Code.RESOURCE_EXHAUSTED, "MESH_TOO_LARGE", ms.TooLarge, ValueError, False),
    (Code.RESOURCE_EXHAUSTED, "HOST_MEMORY_EXHAUSTED", ms.ServerError, Exception, True),
    (Code.DEADLINE_EXCEEDED, "QUEUE_TIMEOUT", ms.DeadlineExceeded, TimeoutError, True),
    (Code.CANCELLED, "CANCELLED_BY_JOB_CALL", ms.Cancelled, ms.Error, True),
    (Code.UNAUTHENTICATED, "TOKEN_MISSING", ms.AccessDenied, PermissionError, True),
    (Code.INTERNAL, "INTERNAL", ms.ServerError, ms.Error, True),
    (Code.INVALID_ARGUMENT, "OPTION_OUT_OF_RANGE", ms.InvalidOption, ValueError, True),
    (Code.INVALID_ARGUMENT, "NON_FINITE_COORDINATE", ms.InvalidMesh, ValueError, True),
    (Code.UNIMPLEMENTED, "", ms.ServerError, ms.Error, True),
]


@pytest.mark.parametrize(("code", "reason", "kind", "base", "is_base"), ERRORS)
def test_errors_by_reason(
    mock: MockServer,
    smooth: Smooth,
    code: grpc.StatusCode,
    reason: str,
    kind: type[ms.Error],
    base: type[Exception],
    is_base: bool,
) -> None:
    def script(call: Call) -> None:
        call.read_spec()
        call.stop_sending()
        call.read_rest()
        call.refuse(
            code, reason, need_bytes="12", limit_bytes="7", space="host", incident="abc", node="3"
        )

    mock.scripts = [script]
    with pytest.raises(kind) as caught:
        smooth(MESH)
    error = caught.value
    assert type(error) is kind
    assert isinstance(error, base) is is_base
    assert error.reason == reason
    assert len(mock.calls) == 1
    if isinstance(error, ms.TooLarge):
        assert (error.need_bytes, error.limit_bytes, error.space) == (12, 7, "host")
    if reason == "INTERNAL":
        assert isinstance(error, ms.ServerError)
        assert error.incident == "abc"
    if isinstance(error, ms.InvalidMesh):
        assert error.node == 3
    if reason == "TOKEN_MISSING":
        assert "token" in error.hint


def test_callback_that_returns_false_cancels(mock: MockServer, smooth: Smooth) -> None:
    ended = []

    def script(call: Call) -> None:
        assert call.read_spec().HasField("progress_interval")
        call.accept()
        call.read_upload()
        call.send(progress={"state": 3, "stage": 3, "iteration": 4})
        gone = threading.Event()
        if call.context.add_callback(gone.set):
            gone.wait()
        ended.append(True)

    mock.scripts = [script]
    seen: list[ms.Progress] = []

    def progress(report: ms.Progress) -> bool:
        seen.append(report)
        return report.iteration == 0

    with pytest.raises(ms.Cancelled, match=r"^cancelled$"):
        smooth(MESH, progress=progress)
    accepted = ms.Progress(state="receiving")
    assert seen == [accepted, ms.Progress(state="running", stage="iterate", iteration=4)]


def test_deadline(mock: MockServer, smooth: Smooth) -> None:
    def script(call: Call) -> None:
        call.read_spec()
        call.accept()
        call.read_upload()
        gone = threading.Event()
        if call.context.add_callback(gone.set):
            gone.wait()

    mock.scripts = [script]
    with pytest.raises(TimeoutError, match=r"within its 0.2 s.*compute_budget"):
        smooth(MESH, timeout="200ms")


def test_deadline_ends_however_much_was_in_flight(mock: MockServer) -> None:
    def late(call: Call) -> None:
        call.read_spec()
        call.refuse(Code.DEADLINE_EXCEEDED, "", "Deadline Exceeded")  # as gRPC says it itself

    mock.scripts = [succeed, late]
    with ms.Client(mock.address) as client:
        client.smooth(MESH)  # accepted: the next may send much
        with pytest.raises(ms.DeadlineExceeded):
            client.smooth(MESH)
    assert len(mock.calls) == 2


def test_attach_continues_where_it_broke(mock: MockServer) -> None:
    def first(call: Call) -> None:
        call.send(progress={"state": 3})
        call.send_header(5, len(RESULT))
        call.send_chunk(0, RESULT[:48])
        call.refuse(Code.UNAVAILABLE, "", "Socket closed")

    def second(call: Call) -> None:
        call.send_header(5, len(RESULT))
        call.send_chunk(48, RESULT[48:])
        call.send_summary()

    mock.attach_scripts = [first, second]
    with ms.Client(mock.address) as client:
        assert client.attach("jobs/kept", MESH).result()[0].tobytes() == RESULT
    offsets = [request.result_offset_bytes for request in mock.attach_requests]
    assert offsets == [0, 48]
    assert mock.attach_requests[0].name == "jobs/kept"


def test_lost_topology_is_sent_again(mock: MockServer) -> None:
    specs = []

    def lost(call: Call) -> None:
        specs.append(call.read_spec())
        call.stop_sending()
        call.read_rest()
        call.refuse(Code.NOT_FOUND, "TOPOLOGY_NOT_FOUND", "gone")

    def inline(call: Call) -> None:
        specs.append(call.read_spec())
        call.accept()
        assert list(call.read_upload()) == [1, 4]
        call.succeed(RESULT)

    mock.scripts = [lost, inline]
    with ms.Client(mock.address) as client, client.session(MESH) as session:
        assert session.smooth(POINTS).tobytes() == RESULT
        name = session.topology_name
    assert specs[0].topology_name == name
    assert specs[1].topology_kept
    assert mock.calls[0].metadata["meshsmooth-topology"] == name.rpartition("-")[2]
    # Refused by the server itself: a proxy may choose another.
    assert name.startswith("topologies/sha256-")


def test_token_is_read_anew_for_each_call(mock: MockServer, tmp_path: Any) -> None:
    file = tmp_path / "token"
    file.write_text("first\n")
    mock.scripts = [succeed]
    with ms.Client(mock.address, token_file=file) as client:
        client.smooth(MESH)
        file.write_text("second\n")
        client.smooth(MESH)
        file.write_text("")  # while it is being written
        client.smooth(MESH)
    tokens = [call.metadata["authorization"] for call in mock.calls]
    assert tokens == ["Bearer first", "Bearer second", "Bearer second"]


def test_tokens_do_not_travel_in_clear() -> None:
    with pytest.raises(ms.InvalidOption, match="in clear") as caught:
        ms.Client("gpu.example.org:50051", token="secret")
    assert caught.value.reason == "CREDENTIALS_UNUSABLE"
    ms.Client("127.0.0.1:50051", token="secret")
    ms.Client("gpu.example.org:50051", token="secret", tls=True)


def test_map_waits_for_a_busy_server_however_often(mock: MockServer) -> None:
    def busy(call: Call) -> None:
        call.read_spec()
        call.refuse(Code.RESOURCE_EXHAUSTED, "QUEUE_FULL", "full", delay=0.001)

    mock.scripts = [busy] * 6 + [succeed]
    with ms.Client(mock.address) as client:
        results = list(client.map([MESH], max_in_flight=1, max_attempts=2))
    assert results[0][0].tobytes() == RESULT
    assert len(mock.calls) == 7


def test_map_runs_small_jobs_in_one_thread(mock: MockServer) -> None:
    names = set()

    def script(call: Call) -> None:
        names.update(thread.name for thread in threading.enumerate())
        succeed(call)

    mock.scripts = [script]
    with ms.Client(mock.address) as client:
        results = list(client.map([MESH] * 20))
    assert [better[0].tobytes() for better in results] == [RESULT] * 20
    assert "small-jobs" in names
    assert "meshsmooth-job" not in names


def test_map_sends_small_jobs_while_another_is_computed(mock: MockServer) -> None:
    all_sent = threading.Barrier(4)

    def script(call: Call) -> None:
        all_sent.wait(60)
        succeed(call)

    def slowly() -> Iterator[Any]:
        yield MESH
        yield MESH
        while len(mock.calls) < 2:  # both are sent before a third mesh is there
            time.sleep(0.001)
        yield MESH
        yield MESH

    mock.scripts = [script]
    with ms.Client(mock.address) as client:
        assert len(list(client.map(slowly()))) == 4


def test_an_abandoned_map_cancels_its_small_jobs(mock: MockServer) -> None:
    ended = threading.Semaphore(0)
    other = (np.concatenate([POINTS, POINTS[:1]]), MESH[1])

    def script(call: Call) -> None:  # they may arrive in any order
        try:
            if call.read_spec().inline_topology.node_count == len(POINTS):
                call.accept()
                call.read_upload()
                call.succeed(RESULT)
                return
            gone = threading.Event()
            if call.context.add_callback(gone.set):
                gone.wait()
        except grpc.RpcError:
            pass  # cancelled before it was read
        finally:
            ended.release()

    mock.scripts = [script]
    with ms.Client(mock.address) as client:
        results = client.map([MESH, other, other, other], max_in_flight=3)
        next(results)
        results.close()  # type: ignore[attr-defined]
        for _ in mock.calls:
            assert ended.acquire(timeout=60)
        assert eventually(lambda: all(t.name != "small-jobs" for t in threading.enumerate()))


def test_cancelling_ends_the_wait_for_another_attempt(mock: MockServer) -> None:
    def busy(call: Call) -> None:
        call.refuse(Code.RESOURCE_EXHAUSTED, "QUEUE_FULL", "full", delay=300)

    async def run() -> None:
        async with ms.AsyncClient(mock.address) as client:
            job = await client.submit(MESH)
            while not mock.calls:
                await asyncio.sleep(0.001)
            assert await job.cancel()
            await job

    mock.scripts = [busy]
    with pytest.raises(ms.Cancelled):
        asyncio.run(run())
    with ms.Client(mock.address) as client:
        seen = len(mock.calls)
        job = client.submit(MESH)
        assert eventually(lambda: len(mock.calls) > seen)
        assert job.cancel()
        with pytest.raises(ms.Cancelled):
            job.result(60)
