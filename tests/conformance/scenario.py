"""Scenarios: what a scripted server does call by call, expects to receive, and what its user sees.

README.md describes the files.
"""

from __future__ import annotations

import json
import pathlib
import threading
from typing import Any

import grpc
import numpy as np

from meshsmooth.v1 import mesh_pb2
from meshsmooth.v1 import smoothing_pb2 as pb
from scripted_server import Call, MockServer

FOLDER = pathlib.Path(__file__).resolve().parent
NAMES = sorted(path.stem for path in FOLDER.glob("*.json"))
TETRA = np.array([[0, 1, 2, 3], [1, 2, 3, 4]])

Points = Any  # float64 [nodes, 3]


def expected_result(points: Points) -> Points:
    """What the scripted server makes of positions, or of the reference of a motion."""
    return points + 0.5


def expected_motion(points: Points) -> Points:
    """Where the scenarios of `move` prescribe the nodes, all of which lie on the boundary."""
    return points + 1


class Scenario:
    """A file, played to one client."""

    def __init__(self, name: str, folder: pathlib.Path) -> None:
        """Reads the scenario; `folder` is the test's own."""
        content = json.loads((FOLDER / f"{name}.json").read_text(encoding="utf-8"))
        self.client: dict[str, Any] = content["client"]
        self.calls: list[list[Any]] = content["calls"]
        self.outcome: dict[str, Any] = content["outcome"]
        self.xfail: dict[str, str] = content.get("xfail", {})
        self.server_count: int = content.get("servers", 1)
        self.last_call_repeats: bool = content.get("last_call_repeats", False)
        self.own_mesh = False  # the client brings a mesh of its own
        nodes = np.arange(self.client.get("nodes", 5), dtype=float)
        # On a curve that leaves every plane, so that the two tetrahedra are not flat.
        self.points: Points = np.stack([nodes, nodes**2, nodes**3], axis=1)
        self.reference: Points = self.points  # of the client's own mesh, once it was sent
        self.options: dict[str, Any] = self.client.get("options", {})
        self.token_file: pathlib.Path | None = None
        if "token" in self.client:
            self.token_file = folder / "token"
            self.token_file.write_text(self.client["token"] + "\n")
        self.failures: list[str] = []
        self.played = 0
        self._request_ids: list[str] = []
        self._servers: list[Any] = []
        self._lock = threading.Lock()

    def install(self, mock: MockServer) -> None:
        """Makes the mock play the calls; the last one repeats if the file says so."""
        scripts = [self._script(steps) for steps in self.calls]
        if not self.last_call_repeats:
            scripts.append(self._unexpected)
        if self.client["call"] == "attach":
            mock.attach_scripts = scripts
        else:
            mock.scripts = scripts

    def check(self) -> None:
        """Fails with what the server did not receive as it should."""
        assert not self.failures, "\n".join(self.failures)
        assert self.played >= len(self.calls), f"{self.played} calls of {len(self.calls)} came"

    def _unexpected(self, call: Call) -> None:
        self.failures.append(f"a call came after the {len(self.calls)} of the scenario")
        call.refuse(grpc.StatusCode.FAILED_PRECONDITION, "UNEXPECTED_CALL")

    def _script(self, steps: list[Any]) -> Any:
        def play(call: Call) -> None:
            with self._lock:
                self.played += 1
                number = self.played
                self._servers.append(call.server)
            player = _CallPlayer(self, call)
            for step in steps:
                name, argument = (step, None) if isinstance(step, str) else next(iter(step.items()))
                try:
                    getattr(player, name)(**argument if argument else {})
                except Exception as error:
                    self.failures.append(f"call {number}, {name}: {type(error).__name__}: {error}")
                    call.refuse(grpc.StatusCode.FAILED_PRECONDITION, "SCENARIO_FAILED", str(error))
                    return

        return play


class _CallPlayer:
    """The steps of one call; each method is a step of the files."""

    def __init__(self, scenario: Scenario, call: Call) -> None:
        self._scenario = scenario
        self._call = call
        # A step of a motion sends none: those of the reference stay with the topology.
        self._positions = scenario.reference
        self._offset = 0  # of the next result byte
        self._received_bytes = 0

    # --- what the server expects ---

    def read_spec(
        self,
        topology: str = "inline",
        kept: bool = False,
        same_request: bool = False,
        result_ttl: float | None = None,
        method: str | None = None,
    ) -> None:
        """The spec names or brings the topology; with `same_request`, it is the first one's."""
        spec = self._call.read_spec()
        if method is not None:
            _expect("method", spec.options.WhichOneof("method"), method)
            _expect("prescribed_node_count", spec.prescribed_node_count > 0, method == "move")
        kind = "named" if spec.WhichOneof("topology") == "topology_name" else "inline"
        _expect("topology", kind, topology)
        _expect("topology_kept", spec.topology_kept, kept)
        if result_ttl is not None:
            _expect("result_ttl", spec.result_ttl.seconds, result_ttl)
        if same_request:
            _expect("request_id", spec.request_id, self._scenario._request_ids[0])
        self._scenario._request_ids.append(spec.request_id)

    def read_early_data(self, bytes: int) -> None:
        """So much data, which is all that the client sends before an answer."""
        self.read_data(bytes)
        _expect("bytes", self._received_bytes, bytes)

    def read_data(self, at_least: int) -> None:
        """So much data, or more."""
        while self._received_bytes < at_least:
            message = self._call.read()
            assert message is not None, f"half-closed after {self._received_bytes} bytes"
            self._received_bytes += len(message.chunk.data)

    def read_all(self, arrays: list[str], progress_per_chunk: bool = False) -> None:
        """All data until the half-close: these arrays in this order, and the scenario's bytes."""
        upload: dict[int, bytearray] = {}
        while (message := self._call.read()) is not None:
            chunk = message.chunk
            own = upload.setdefault(chunk.array_id, bytearray())
            _expect("offset_bytes", chunk.offset_bytes, len(own))
            own += chunk.data
            if progress_per_chunk:
                self._call.send(progress={"state": pb.STATE_RECEIVING})
        names = [mesh_pb2.ArrayId.Name(array).removeprefix("ARRAY_ID_") for array in upload]
        _expect("arrays", names, arrays)
        if not self._scenario.own_mesh:
            self._expect_content(upload)
        reference = upload.get(mesh_pb2.ARRAY_ID_REFERENCE_COORDINATES)
        sent = upload.get(mesh_pb2.ARRAY_ID_COORDINATES, reference)
        if sent is not None:
            self._positions = np.frombuffer(bytes(sent)).reshape(-1, 3)
        if reference is not None:
            self._scenario.reference = self._positions

    def _expect_content(self, upload: dict[int, bytearray]) -> None:
        points = self._scenario.points
        wanted = {
            mesh_pb2.ARRAY_ID_ELEMENTS: TETRA.astype("<i4"),
            mesh_pb2.ARRAY_ID_COORDINATES: points,
            mesh_pb2.ARRAY_ID_REFERENCE_COORDINATES: points,
            mesh_pb2.ARRAY_ID_PRESCRIBED_NODES: np.arange(len(points), dtype="<i4"),
            mesh_pb2.ARRAY_ID_PRESCRIBED_COORDINATES: expected_motion(points),
        }
        for array, sent in upload.items():
            name = mesh_pb2.ArrayId.Name(array).removeprefix("ARRAY_ID_")
            _expect(name, sent == wanted[array].tobytes(), True)

    def read_rest(self, incomplete: bool = False) -> None:
        """The data until the half-close; `incomplete`: the client stopped before its last byte."""
        while (message := self._call.read()) is not None:
            self._received_bytes += len(message.chunk.data)
        if incomplete:
            all_bytes = self._scenario.points.nbytes + TETRA.size * 4
            assert self._received_bytes < all_bytes, "the client sent everything"

    def read_attach(self, offset_bytes: int) -> None:
        """The request of AttachJob continues at this byte."""
        request: Any = self._call.read()
        _expect("name", request.name, self._scenario.client["job"])
        _expect("result_offset_bytes", request.result_offset_bytes, offset_bytes)
        self._offset = offset_bytes

    def metadata(self, **expected: str | bool) -> None:
        """The call carries these metadata; true: any value, false: none."""
        for key, value in expected.items():
            found = self._call.metadata.get(key)
            _expect(key, found is not None if isinstance(value, bool) else found, value)

    def on_another_server(self) -> None:
        """The call reached another server of the fleet than the call before."""
        before, now = self._scenario._servers[-2:]
        assert before is not now, "the call reached the same server"

    def wait_until_gone(self) -> None:
        """The client ends the call."""
        gone = threading.Event()
        if self._call.context.add_callback(gone.set):
            gone.wait()

    # --- what the server does ---

    def accept(self) -> None:
        self._call.accept()

    def stop_sending(self) -> None:
        self._call.stop_sending()

    def progress(self, iteration: int) -> None:
        self._call.send(
            progress={"state": pb.STATE_RUNNING, "stage": pb.STAGE_ITERATE, "iteration": iteration}
        )

    def send_unknown(self) -> None:
        """A message that only a newer version of the protocol has: field 15, no bytes."""
        self._call.send_message(pb.SmoothResponse.FromString(b"\x7a\x00"))

    def header(self, size_bytes: int | None = None) -> None:
        size = len(self._positions) * 24 if size_bytes is None else size_bytes
        self._call.send_header(len(self._positions), size)

    def result(self, up_to: int | None = None, crc32c: int | None = None) -> None:
        """The result's bytes, from where the last step or the client's offset is."""
        data = expected_result(self._positions).tobytes()[self._offset : up_to]
        for first in range(0, len(data), 1 << 20):
            self._call.send_chunk(self._offset, data[first : first + (1 << 20)], crc32c)
            self._offset += len(data[first : first + (1 << 20)])

    def summary(self, **motion: Any) -> None:
        """The summary; with `reached` and other fields of MotionStats, that of a motion."""
        self._call.send_summary(**({"motion": pb.MotionStats(**motion)} if motion else {}))

    def refuse(
        self,
        code: str,
        reason: str = "",
        message: str = "refused",
        retry_after: float | None = None,
        **details: str,
    ) -> None:
        """Ends the call with a status; without a reason, as gRPC or a proxy does."""
        self._call.refuse(grpc.StatusCode[code], reason, message, retry_after, **details)

    def write_token(self, token: str) -> None:
        """Replaces the client's token."""
        assert self._scenario.token_file is not None
        self._scenario.token_file.write_text(token and f"{token}\n")

    def go_away(self) -> None:
        """The server takes no new calls on its connections, which it says by GOAWAY."""
        self._call.server.stop(grace=3600)

    def die(self) -> None:
        """The server ends all calls and connections."""
        self._call.server.stop(grace=None)


def _expect(what: str, found: object, wanted: object) -> None:
    assert found == wanted, f"{what} is {found!r}, expected {wanted!r}"
