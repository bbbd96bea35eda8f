"""Jobs in pools of processes: results and errors arrive whole."""

from __future__ import annotations

import concurrent.futures
import contextlib
import multiprocessing
import pickle
import warnings
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from conftest import cube

import meshsmooth as ms

MESH = cube(4)


def smooth(address: str, mesh: Any) -> Any:
    """What a worker does; at the top of a module, so that it can be pickled."""
    return ms.Client(address).smooth(mesh, full=True)


Pool = Callable[[str, Any], Any]


@contextlib.contextmanager
def of_multiprocessing() -> Iterator[Pool]:
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        yield lambda *arguments: pool.apply(smooth, arguments)


@contextlib.contextmanager
def of_futures() -> Iterator[Pool]:
    context = multiprocessing.get_context("spawn")
    with concurrent.futures.ProcessPoolExecutor(1, mp_context=context) as pool:
        yield lambda *arguments: pool.submit(smooth, *arguments).result()


@contextlib.contextmanager
def of_joblib() -> Iterator[Pool]:
    joblib: Any = pytest.importorskip("joblib", reason="missing package: joblib")
    yield lambda *arguments: joblib.Parallel(2)([joblib.delayed(smooth)(*arguments)])[0]


@contextlib.contextmanager
def of_dask() -> Iterator[Pool]:
    distributed: Any = pytest.importorskip("distributed", reason="missing package: distributed")
    with (
        distributed.LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=None) as some,
        distributed.Client(some) as pool,
    ):
        yield lambda *arguments: pool.submit(smooth, *arguments).result()


@contextlib.contextmanager
def of_dask_threads() -> Iterator[Pool]:
    distributed: Any = pytest.importorskip("distributed", reason="missing package: distributed")
    with distributed.Client(processes=False, n_workers=1, dashboard_address=None) as pool:
        yield lambda *arguments: pool.submit(smooth, *arguments).result()


@contextlib.contextmanager
def of_ray() -> Iterator[Pool]:
    ray: Any = pytest.importorskip("ray", reason="missing package: ray")
    ray.init(num_cpus=1, include_dashboard=False)
    try:
        yield lambda *arguments: ray.get(ray.remote(smooth).remote(*arguments))
    finally:
        ray.shutdown()


@pytest.mark.parametrize(
    "kind", [of_multiprocessing, of_futures, of_joblib, of_dask, of_dask_threads, of_ray]
)
def test_results_and_errors_arrive_whole(
    server: str, kind: Callable[[], contextlib.AbstractContextManager[Pool]]
) -> None:
    points, cells = MESH
    twice = cells["tetra"].copy()
    twice[7, 1] = twice[7, 0]
    expected = smooth(server, MESH)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of the pools
        with kind() as run:
            result = run(server, MESH)
            assert result.points.tobytes() == expected.points.tobytes()
            assert result.summary.stop_reason == expected.summary.stop_reason
            with pytest.raises(ms.InvalidMesh) as caught:
                run(server, (points, {"tetra": twice}))
    assert caught.value.reason == "REPEATED_NODE"
    assert (caught.value.element, caught.value.node) == (7, twice[7, 0])
    assert "element 7 (tetrahedron)" in str(caught.value)


def errors() -> list[ms.Error]:
    kinds = [kind for kind in vars(ms).values() if isinstance(kind, type)]
    made = [
        kind("what", reason="WHY", code="CODE", details={"element": "3"}, hint="do", retry_delay=2)
        for kind in kinds
        if issubclass(kind, ms.Error)
    ]
    for error in made:
        if isinstance(error, ms.TooLarge):
            error.need_bytes, error.limit_bytes, error.space = 3, 2, "device"
        if isinstance(error, ms.InvalidMesh):
            error.element, error.node = 3, 4
        if isinstance(error, ms.ServerError):
            error.incident = "i-1"
    return made


@pytest.mark.parametrize("error", errors(), ids=lambda error: type(error).__name__)
def test_every_error_is_whole_in_one_that_carries_it(error: ms.Error) -> None:
    """As ray makes them: also of the class of the error, which is asked for what is missing."""

    class Carrier(type(error)):  # type: ignore[misc]
        def __init__(self, cause: ms.Error) -> None:
            self.cause = cause
            self.args = (cause,)

        def __getattr__(self, name: str) -> Any:
            return getattr(self.cause, name)

    carried = Carrier(error)
    for name, value in vars(error).items():
        assert getattr(carried, name) == value
    assert str(carried) == str(error)


@pytest.mark.parametrize("error", errors(), ids=lambda error: type(error).__name__)
def test_every_error_can_be_pickled(error: ms.Error) -> None:
    copy = pickle.loads(pickle.dumps(error))
    assert type(copy) is type(error)
    assert (str(copy), vars(copy)) == (str(error), vars(error))
    if isinstance(copy, ms.Busy):
        assert copy.retry_after == 2
