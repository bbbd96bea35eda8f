"""What a call costs from Python: chunks over TCP and over a Unix socket, and shared memory.

    PYTHONPATH=client/python/src python3 tests/bench/shared_memory.py build/ci/tests/bench/server_bench

The ways take turns; medians. The server's smoother does nothing. "inside": the arrays were built in a
segment, where the result stays; no client offers that yet, so the call is made by hand.
"""

from __future__ import annotations

import argparse
import contextlib
import functools
import json
import statistics
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

import meshsmooth as ms
from meshsmooth import _call, _rpc
from meshsmooth._adapters import read_mesh
from meshsmooth._shared_memory import Segment
from meshsmooth._request import Request
from meshsmooth._topology import TopologyUse
from meshsmooth.v1 import smoothing_pb2 as pb

OPTIONS: ms.JobOptions = {"method": "laplacian", "iterations": 0, "quality": "brief"}


def cube(megabytes: float) -> tuple[Any, dict[str, Any]]:
    """A cube of tetrahedra of about so many bytes, with 32-bit indices."""
    count = 2
    while 24 * count**3 + 96 * (count - 1) ** 3 < megabytes * 1e6:
        count += 1
    points = np.stack(np.meshgrid(*[np.arange(count)] * 3, indexing="ij"), -1).reshape(-1, 3)
    cell = points[(points < count - 1).all(axis=1)]
    corner = [
        np.ravel_multi_index((cell + np.unravel_index(i, (2, 2, 2))).T, (count,) * 3)
        for i in range(8)
    ]
    paths = [(0, 4, 6, 7), (0, 6, 2, 7), (0, 2, 3, 7), (0, 3, 1, 7), (0, 1, 5, 7), (0, 5, 4, 7)]
    tetra = np.concatenate([np.stack([corner[i] for i in path], axis=1) for path in paths])
    return points.astype(float), {"tetra": tetra.astype(np.int32)}


@contextlib.contextmanager
def server(program: str, listen: str) -> Iterator[str]:
    """A server that ends with the block; yields its address."""
    process = subprocess.Popen(
        [program, "transport", "--serve", listen],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert process.stdin is not None
    assert process.stdout is not None
    try:
        port = process.stdout.readline().strip()
        yield listen if listen.startswith("unix:") else f"127.0.0.1:{port}"
    finally:
        process.stdin.close()
        process.wait()


def inside(client: ms.Client, mesh: Any) -> tuple[Callable[[], None], Segment]:
    """A call of a mesh whose arrays lie in a segment; and that segment, which it needs."""
    connection = client._connection
    call = _call.SmoothCall(
        Request(read_mesh(mesh), OPTIONS), TopologyUse(), 0, None, with_progress=False
    )
    size = call.transfer_bytes
    segment = Segment(client._ask(_rpc.LEASE_SHARED_MEMORY, size_bytes=size))
    call.use(segment)
    message = pb.SmoothRequest.FromString(call.first())
    message.spec.request_id = ""  # another job each time

    def run() -> None:
        first = message.SerializeToString()
        stream = connection.open_channel()[0].unary_stream(_call.SMOOTH)(first, timeout=60)
        answers = [pb.SmoothResponse.FromString(answer) for answer in stream]
        assert any(answer.result.in_place for answer in answers)

    return run, segment


def main() -> None:
    """Measures and prints a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("program")
    parser.add_argument("--megabytes", type=float, nargs="+", default=[1.3, 14.3, 198])
    parser.add_argument("--rounds", type=int, default=15)
    parser.add_argument("--json")
    arguments = parser.parse_args()
    figures = []
    with contextlib.ExitStack() as stack:
        folder = stack.enter_context(tempfile.TemporaryDirectory())
        tcp = ms.Client(stack.enter_context(server(arguments.program, "127.0.0.1:0")))
        local = stack.enter_context(server(arguments.program, f"unix:{folder}/socket"))
        chunks, shared = ms.Client(local), ms.Client(local)
        chunks._connection.calls._transport = None
        for megabytes in arguments.megabytes:
            mesh = cube(megabytes)
            own, segment = inside(shared, mesh)
            ways: dict[str, Callable[[], Any]] = {
                "tcp": functools.partial(tcp.smooth, mesh, **OPTIONS),
                "unix": functools.partial(chunks.smooth, mesh, **OPTIONS),
                "copied": functools.partial(shared.smooth, mesh, **OPTIONS),
                "inside": own,
            }
            for _ in range(3):  # while the segment of `shared` is made
                for way in ways.values():
                    way()
                time.sleep(0.5)
            times: dict[str, list[float]] = {name: [] for name in ways}
            for _ in range(arguments.rounds * (10 if megabytes < 20 else 1)):
                for name, way in ways.items():
                    begin = time.perf_counter()
                    way()
                    times[name].append(1e3 * (time.perf_counter() - begin))
            assert shared._connection._transport._idle, "it went in chunks"
            segment.close()
            medians = {name: statistics.median(of) for name, of in times.items()}
            figures.append({"megabytes": megabytes} | {f"{n}_ms": t for n, t in medians.items()})
            shares = [f"{n} {t:.2f} ms ({t / medians['tcp']:.2f})" for n, t in medians.items()]
            print(f"{megabytes:6.1f} MB: {', '.join(shares)}", flush=True)
    if arguments.json:
        with open(arguments.json, "w") as file:
            json.dump({"rounds": arguments.rounds, "sizes": figures}, file, indent=1)


main()
