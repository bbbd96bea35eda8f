"""Jobs on a real server: futures, cancelling, kept results, sessions, forks, credentials."""

from __future__ import annotations

import asyncio
import contextlib
import multiprocessing
import os
import pathlib
import pickle
import signal
import subprocess
import sys
import textwrap
import threading
import time
from collections.abc import Callable, Iterator
from typing import Any

import grpc
import numpy as np
import pytest
from conftest import LONG, cube, program, running_server

import meshsmooth as ms
from meshsmooth import _aio, _client

MESH = cube()
LARGE = cube(14)


def wait_until(holds: Callable[[], object], what: str) -> None:
    """Waits for a state that another process reaches; the limit only ends a broken test."""
    deadline = time.monotonic() + 60
    while not holds():
        assert time.monotonic() < deadline, what
        time.sleep(0.001)


def states(client: ms.Client) -> list[str]:
    return [job.state for job in client.jobs()]


@pytest.mark.usefixtures("server")
def test_functions_use_the_server_of_the_environment() -> None:
    better = ms.smooth(MESH)
    assert isinstance(better, tuple)
    assert ms.default_client().address == os.environ["MESHSMOOTH_SERVER"]
    assert ms.quality(better).inverted_element_count == 0


def test_full_result(client: ms.Client) -> None:
    result = client.smooth(MESH, full=True, history=True, element_quality="mean_ratio")
    summary = result.summary
    assert result.job_name.startswith("jobs/")
    assert result.mesh[0] is result.points
    assert summary.stop_reason == "converged"
    assert summary.nodes.total == len(MESH[0])
    assert len(summary.convergence.energies) == summary.convergence.iteration_count
    assert summary.options["optimize"]["goal"] == "GOAL_BALANCED"
    assert summary.execution.backend_kind == "cpu"
    values = result.element_quality["mean_ratio"]
    after = summary.quality_after.metric("mean_ratio")
    assert after is not None
    assert values.dtype == np.float32
    assert np.isclose(values.min(), after.min)
    worst = summary.quality_after.worst_elements[0]
    assert np.isclose(values[worst.element], worst.mean_ratio)


def test_submitted_job_is_a_future(client: ms.Client) -> None:
    called = threading.Event()
    job = client.submit(MESH, full=True)
    job.add_done_callback(lambda done: called.set() if done is job else None)
    assert job.result(60).points.shape == MESH[0].shape
    assert job.done()
    assert job.exception() is None
    assert job.name.startswith("jobs/")
    assert called.wait(60)
    assert not job.cancel()


def test_job_reports_progress_and_cancels(client: ms.Client) -> None:
    iterating = threading.Event()

    def progress(report: ms.Progress) -> None:
        if report.iteration > 0:
            iterating.set()

    job = client.submit(LARGE, progress=progress, **LONG)
    assert iterating.wait(60)
    with pytest.raises(TimeoutError):
        job.result(0)
    assert job.progress is not None
    assert job.progress.stage == "iterate"
    assert job.cancel()
    with pytest.raises(ms.Cancelled):
        job.result(60)
    wait_until(lambda: client.job(job.name).state == "cancelled", "the server still computes")


def test_cancel_keeps_the_result(client: ms.Client) -> None:
    iterating = threading.Event()
    job = client.submit(
        LARGE, full=True, progress=lambda p: iterating.set() if p.iteration else None, **LONG
    )
    assert iterating.wait(60)
    job.cancel(keep_result=True)
    assert job.result(60).summary.stop_reason == "cancelled_with_result"


def test_kept_job_outlives_its_call(client: ms.Client) -> None:
    job = client.submit(MESH, result_ttl="10min", full=True)
    expected = job.result(60)
    with ms.Client(client.address) as other:
        again = other.attach(job.name, MESH).result(60)
        assert again[0].tobytes() == expected.points.tobytes()
        assert other.job(job.name).state == "succeeded"
        other.delete_job(job.name)
        with pytest.raises(ms.NotFound) as caught:
            other.attach(job.name, MESH).result(60)
    assert caught.value.reason in ("JOB_NOT_FOUND", "RESULT_NOT_KEPT")
    assert isinstance(caught.value, LookupError)


def test_map_is_ordered_and_bounded(client: ms.Client) -> None:
    meshes = [cube(4, seed=seed) for seed in range(12)]
    taken = 0

    def each() -> Iterator[Any]:
        nonlocal taken
        for mesh in meshes:
            taken += 1
            yield mesh

    for done, better in enumerate(client.map(each(), max_in_flight=3)):
        assert taken <= done + 4
        assert better[0].tobytes() == client.smooth(meshes[done])[0].tobytes()
    assert taken == len(meshes)


def test_error_ends_a_map_and_its_jobs(client: ms.Client) -> None:
    bad = (MESH[0], {"tetra": MESH[1]["tetra"] + 10**6})
    before = states(client).count("cancelled")
    results = client.map([bad, LARGE], **LONG)
    with pytest.raises(ms.InvalidMesh):
        next(results)
    wait_until(
        lambda: "running" not in states(client) and "receiving" not in states(client),
        "the other job still runs",
    )
    assert states(client).count("cancelled") >= before


def test_session_sends_positions_only(client: ms.Client) -> None:
    fixed = [0, 100]
    full = client.smooth(MESH, full=True, fixed=fixed)
    for dtype in (np.float64, np.float32):
        with client.session(MESH, fixed=fixed) as session:
            points = MESH[0].astype(dtype)
            first = session.smooth(points, full=True)
            second = session.smooth(points, full=True, quality="brief")
            assert second.summary.execution.topology_reused
            assert second.points.tobytes() == first.points.tobytes()
            assert session.smooth(points, out=points) is points
            assert points.tobytes() == first.points.tobytes()
            if dtype is np.float64:
                assert points.tobytes() == full.points.tobytes()
            assert client.topology(session.topology_name).element_count == 750
            client.delete_topology(session.topology_name)
            session.smooth(points)  # sends it again
            with pytest.raises(ms.InvalidOption, match="session"):
                session.smooth(points, boundary="free")
            with pytest.raises(ms.InvalidMesh):
                session.smooth(points[:-1])


def test_small_calls(client: ms.Client) -> None:
    info = client.info()
    assert "optimize" in info.methods
    assert info.raw["limits"]["max_chunk_bytes"]
    assert client.health()
    client.smooth(MESH)
    job = client.jobs()[0]
    assert (job.state, job.node_count, job.error) == ("succeeded", len(MESH[0]), "")


def test_quality_without_a_job_that_moves(client: ms.Client) -> None:
    stats = client.quality(MESH)
    assert stats.element_count == len(MESH[1]["tetra"])
    edges, counts = stats.histogram("scaled_jacobian")
    assert len(edges) == len(counts) + 1
    assert (edges[0], edges[-1]) == (-1, 1)
    assert sum(counts) == stats.element_count
    with pytest.raises(KeyError):
        stats.histogram("min_angle")


def test_no_server_answers() -> None:
    with pytest.raises(ms.Unavailable, match="no server answers there") as caught:
        ms.Client("unix:/nowhere/socket").smooth(MESH)
    assert isinstance(caught.value, ConnectionError)
    copy = pickle.loads(pickle.dumps(caught.value))
    assert str(copy) == str(caught.value)


@pytest.mark.parametrize("stop", ["SIGINT", "SIGKILL"])
def test_interrupted_program_frees_the_lane(
    client: ms.Client, tmp_path: pathlib.Path, stop: str
) -> None:
    script = tmp_path / "script.py"
    script.write_text(
        textwrap.dedent(f"""
            import os, sys
            sys.path[:0] = {[str(pathlib.Path(__file__).parent), *sys.path]!r}
            from conftest import LONG, cube
            import meshsmooth as ms
            def progress(report):
                if report.iteration:
                    print("iterating", flush=True)
            try:
                ms.Client({client.address!r}).smooth(cube(14), progress=progress, **LONG)
            except KeyboardInterrupt:
                print("interrupted", flush=True)
        """)
    )
    process = subprocess.Popen([sys.executable, str(script)], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    with process:
        assert process.stdout.readline() == "iterating\n"
        process.send_signal(getattr(signal, stop))
        rest = process.stdout.read()
        assert ("interrupted" in rest) == (stop == "SIGINT")
    wait_until(lambda: "running" not in states(client), "the server still computes")


def smooth_in_child(address: str, results: Any) -> None:
    results.put(ms.Client(address).smooth(MESH)[0].tobytes())


def run_script(folder: pathlib.Path, text: str) -> subprocess.CompletedProcess[str]:
    """Runs a program that can import what the tests can."""
    script = folder / "script.py"
    paths = [str(pathlib.Path(__file__).parent), *sys.path]
    script.write_text(f"import sys\nsys.path[:0] = {paths!r}\n" + textwrap.dedent(text))
    return subprocess.run(
        [sys.executable, str(script)], capture_output=True, text=True, timeout=60, check=False
    )


def test_forked_workers_before_the_first_call(server: str, tmp_path: pathlib.Path) -> None:
    """A fresh process, because this one has used gRPC already."""
    done = run_script(
        tmp_path,
        f"""
            import multiprocessing
            from conftest import cube
            import meshsmooth as ms
            client = ms.Client({server!r})
            def work(seed):
                return client.smooth(cube(seed=seed))[0].tobytes()
            with multiprocessing.get_context("fork").Pool(4) as pool:
                forked = pool.map(work, range(8))
            assert forked == [work(seed) for seed in range(8)]
            print("same")
        """,
    )
    assert done.stdout == "same\n", done.stderr


@pytest.mark.skipif(
    grpc.__version__.startswith("1.51.") and sys.version_info >= (3, 12),
    reason="Debian 13's gRPC 1.51 waits for ever inside fork() itself",
)
def test_fork_after_the_first_call_is_refused_by_name(server: str, tmp_path: pathlib.Path) -> None:
    done = run_script(
        tmp_path,
        f"""
            import multiprocessing
            from conftest import cube
            import meshsmooth as ms
            client = ms.Client({server!r})
            client.smooth(cube())
            def work(results):
                try:
                    client.smooth(cube())
                except ms.Error as error:
                    results.put(str(error))
            context = multiprocessing.get_context("fork")
            results = context.SimpleQueue()
            child = context.Process(target=work, args=(results,))
            child.start()
            child.join()
            print(results.get())
        """,
    )
    assert "(FORKED)" in done.stdout, done.stderr
    assert "spawn" in done.stdout


def test_spawned_worker(client: ms.Client) -> None:
    client.smooth(MESH)
    context = multiprocessing.get_context("spawn")
    results = context.SimpleQueue()
    child = context.Process(target=smooth_in_child, args=(client.address, results))
    child.start()
    assert results.get() == client.smooth(MESH)[0].tobytes()
    child.join(60)


@pytest.mark.parametrize("kind", ["blocking", "asyncio"])
def test_errors_arrive_whole_through_dask(client: ms.Client, kind: str) -> None:
    """Its tblib pickles what an error has as context too, which gRPC's errors do not survive."""
    tblib = pytest.importorskip("tblib.pickling_support", reason="missing package: tblib")

    async def smooth(mesh: Any) -> None:
        async with ms.AsyncClient(client.address) as other:
            await other.smooth(mesh)

    points, cells = MESH
    twice = cells["tetra"].copy()
    twice[7, 1] = twice[7, 0]
    bad = (points, {"tetra": twice})
    run = {"blocking": client.smooth, "asyncio": lambda mesh: asyncio.run(smooth(mesh))}[kind]
    with pytest.raises(ms.InvalidMesh) as refused:
        run(bad)
    assert refused.value.__context__ is None
    tblib.install(refused.value)
    copy = pickle.loads(pickle.dumps(refused.value))
    assert type(copy) is ms.InvalidMesh
    assert (copy.reason, copy.element) == ("REPEATED_NODE", 7)
    with pytest.raises(ms.NotFound) as caught:
        client.job("jobs/none")
    assert caught.value.__context__ is None


def test_clients_travel(client: ms.Client, tmp_path: pathlib.Path) -> None:
    copy = pickle.loads(pickle.dumps(client))
    assert copy.address == client.address
    assert copy.smooth(MESH)[0].tobytes() == client.smooth(MESH)[0].tobytes()
    token = tmp_path / "token"
    token.write_text("open-sesame")
    with_file = pickle.loads(pickle.dumps(ms.Client(client.address, token_file=token)))
    assert with_file.health()
    with pytest.raises(TypeError, match="token_file"):
        pickle.dumps(ms.Client(client.address, token="secret"))


def test_what_is_closed_stays_closed(server: str) -> None:
    client = ms.Client(server)
    with client.session(MESH) as session:
        session.smooth()
    with pytest.raises(ValueError, match="session is closed"):
        session.smooth()
    client.close()
    with pytest.raises(ValueError, match="client is closed"):
        client.smooth(MESH)

    async def closed() -> None:
        async with ms.AsyncClient(server) as other:
            await other.health()
        await other.health()

    with pytest.raises(ValueError, match="client is closed"):
        asyncio.run(closed())


class Shown:
    """A display that notes whether it was closed."""

    closed = False

    def __call__(self, _: ms.Progress) -> None: ...

    def close(self) -> None:
        self.closed = True


def test_a_closed_client_leaves_no_display(server: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def run_blocking() -> None:
        client = ms.Client(server)
        client.close()
        client.smooth(MESH, progress=True)

    async def run() -> None:
        client = ms.AsyncClient(server)
        await client.close()
        await client.smooth(MESH, progress=True)

    for module, call in ((_client, run_blocking), (_aio, lambda: asyncio.run(run()))):
        shown = Shown()
        monkeypatch.setattr(module, "make_display", lambda *_, shown=shown, **__: shown)
        with pytest.raises(ValueError, match="closed"):
            call()
        assert shown.closed


def test_failed_attempts_are_logged(client: ms.Client, caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level("INFO", "meshsmooth"), pytest.raises(ms.InvalidOption):
        client.smooth(MESH, iterations=-1)
    assert "iterations is -1" in caplog.text


def test_an_interrupted_map_leaves_no_job_running(
    client: ms.Client, tmp_path: pathlib.Path
) -> None:
    script = tmp_path / "script.py"
    script.write_text(
        textwrap.dedent(f"""
            import sys
            sys.path[:0] = {[str(pathlib.Path(__file__).parent), *sys.path]!r}
            from conftest import LONG, cube
            import meshsmooth as ms
            def progress(report):
                if report.iteration:
                    print("iterating", flush=True)
            try:
                client = ms.Client({client.address!r})
                for _ in client.map([cube(14)] * 6, max_in_flight=3, progress=progress, **LONG):
                    pass
            except KeyboardInterrupt:
                print("interrupted", flush=True)
                sys.stdin.read()  # alive: its end would cancel the jobs too
        """)
    )
    with subprocess.Popen(
        [sys.executable, str(script)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        assert process.stdout.readline() == "iterating\n"
        process.send_signal(signal.SIGINT)
        while process.stdout.readline() != "interrupted\n":
            pass
        wait_until(
            lambda: not {"running", "queued"} & set(states(client)), "the server still computes"
        )
        process.stdin.close()


@pytest.fixture(scope="module")
def certificates(tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    openssl = "openssl"
    folder = tmp_path_factory.mktemp("certificates")
    with contextlib.suppress(FileNotFoundError):
        subprocess.run(
            [
                *(openssl, "req", "-x509", "-newkey", "ec", "-pkeyopt"),
                *("ec_paramgen_curve:prime256v1", "-nodes", "-days", "1"),
                *("-subj", "/CN=localhost", "-addext", "subjectAltName=DNS:localhost,IP:127.0.0.1"),
                *("-keyout", str(folder / "key.pem"), "-out", str(folder / "cert.pem")),
            ],
            check=True,
            capture_output=True,
        )
        (folder / "tokens").write_text("me:open-sesame\n")
        (folder / "tokens").chmod(0o600)
        return folder
    pytest.skip("missing program: openssl")


def test_same_bits_over_tls_with_a_token(
    client: ms.Client, certificates: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    program("MESHSMOOTH_SERVER_BINARY")
    cert = certificates / "cert.pem"
    with running_server(
        *("--tls-cert", str(cert), "--tls-key", str(certificates / "key.pem")),
        *("--token-file", str(certificates / "tokens")),
        listen="127.0.0.1:0",
    ) as address:
        expected = client.smooth(MESH)[0].tobytes()
        monkeypatch.setenv("MESHSMOOTH_SERVER", address)
        monkeypatch.setenv("MESHSMOOTH_CLIENT_TLS_CA", str(cert))
        monkeypatch.setenv("MESHSMOOTH_CLIENT_TOKEN", "open-sesame")
        assert ms.smooth(MESH)[0].tobytes() == expected
        tls = ms.Tls(ca=cert)
        with (
            pytest.raises(ms.AccessDenied, match="TOKEN_UNKNOWN"),
            ms.Client(address, tls=tls, token="guess") as other,
        ):
            other.smooth(MESH)
        with (
            pytest.raises(ms.Unavailable, match="Tls"),
            ms.Client(address) as other,
        ):
            other.smooth(MESH)
    with pytest.raises(ms.InvalidOption, match=r"ca: cannot read"):
        ms.Client(address, tls=ms.Tls(ca="nowhere.pem")).health()
    with pytest.raises(ms.InvalidOption, match="belong together"):
        ms.Client(address, tls=ms.Tls(cert=cert)).health()
