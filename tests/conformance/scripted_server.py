"""A service whose answers a test writes itself, as tests/client/mock_service.hpp does for C++."""

from __future__ import annotations

import contextlib
import functools
import threading
from collections.abc import Callable, Iterator
from concurrent import futures
from typing import Any

import grpc

from meshsmooth.v1 import error_details_pb2, mesh_pb2
from meshsmooth.v1 import smoothing_pb2 as pb

Script = Callable[["Call"], None]


class Call:
    """One call of Smooth or AttachJob, from the server's side."""

    def __init__(self, requests: Any, context: Any, server: Any = None) -> None:
        self._requests = requests
        self.context = context
        self.server = server  # gRPC's, of those that share the scripts the one that was called
        self.answers: list[pb.SmoothResponse] = []
        self._ready = threading.Condition()
        self._ended = False
        self.metadata = dict(context.invocation_metadata())

    def read(self) -> pb.SmoothRequest | None:
        """The next message; None after the half-close."""
        return next(self._requests, None)

    def read_spec(self) -> pb.JobSpec:
        message = self.read()
        assert message is not None
        return message.spec

    def read_upload(self) -> dict[int, bytes]:
        """All data until the half-close, by array."""
        arrays: dict[int, bytes] = {}
        while (message := self.read()) is not None:
            chunk = message.chunk
            assert chunk.offset_bytes == len(arrays.get(chunk.array_id, b""))
            arrays[chunk.array_id] = arrays.get(chunk.array_id, b"") + chunk.data
        return arrays

    def read_rest(self) -> None:
        """Reads until the half-close: a refusal before it may overtake its own details."""
        while self.read() is not None:
            pass

    def send(self, **field: Any) -> None:
        self.send_message(pb.SmoothResponse(**field))

    def send_message(self, message: pb.SmoothResponse) -> None:
        with self._ready:
            self.answers.append(message)
            self._ready.notify_all()

    def accept(self, name: str = "jobs/mock") -> None:
        self.send(accepted=pb.Accepted(job=pb.Job(name=name)))

    def stop_sending(self) -> None:
        self.send(stop_sending=pb.StopSending())

    def send_header(self, node_count: int, size_bytes: int) -> None:
        self.send(
            result=pb.ResultHeader(
                node_count=node_count,
                coordinate_type=mesh_pb2.SCALAR_TYPE_FLOAT64,
                size_bytes=size_bytes,
            )
        )

    def send_chunk(self, offset_bytes: int, data: bytes, crc32c: int | None = None) -> None:
        chunk = mesh_pb2.Chunk(
            array_id=mesh_pb2.ARRAY_ID_COORDINATES, offset_bytes=offset_bytes, data=data
        )
        if crc32c is not None:
            chunk.crc32c = crc32c
        self.send(chunk=chunk)

    def send_summary(self, **fields: Any) -> None:
        self.send(summary=pb.Summary(stop_reason=pb.STOP_REASON_CONVERGED, **fields))

    def succeed(self, points: bytes) -> None:
        """Answers with these positions in float64."""
        self.send_header(len(points) // 24, len(points))
        self.send_chunk(0, points)
        self.send_summary()

    def refuse(
        self,
        code: grpc.StatusCode,
        reason: str = "",
        message: str = "refused",
        delay: float | None = None,
        **metadata: str,
    ) -> None:
        """Ends the call with a status, as a server does; without a reason, as a proxy does."""
        if reason:
            status = error_details_pb2.Status(code=code.value[0], message=message)
            info = error_details_pb2.ErrorInfo(
                reason=reason, domain="meshsmooth.dev", metadata=metadata
            )
            url = "type.googleapis.com/google.rpc."
            status.details.add(type_url=url + "ErrorInfo", value=info.SerializeToString())
            if delay is not None:
                retry = error_details_pb2.RetryInfo()
                retry.retry_delay.FromNanoseconds(int(delay * 1e9))
                status.details.add(type_url=url + "RetryInfo", value=retry.SerializeToString())
            self.context.set_trailing_metadata(
                [("grpc-status-details-bin", status.SerializeToString())]
            )
        self.context.set_code(code)
        self.context.set_details(message)

    def run(self, script: Script) -> Iterator[pb.SmoothResponse]:
        """Plays the script in a thread, so that it may read and write as it likes."""

        def play() -> None:
            try:
                script(self)
            finally:
                with self._ready:
                    self._ended = True
                    self._ready.notify_all()

        threading.Thread(target=play, daemon=True).start()
        while True:
            with self._ready:
                self._ready.wait_for(lambda: self.answers or self._ended)
                if not self.answers:
                    return
                answer = self.answers.pop(0)
            yield answer


class MockServer:
    """Plays one script for each call, in their order; the last one for all further calls.

    Several servers may share the scripts, as a fleet at one address.
    """

    def __init__(self) -> None:
        self.address = ""
        self.scripts: list[Script] = []
        self.attach_scripts: list[Script] = []
        self.calls: list[Call] = []
        self.attach_requests: list[pb.AttachJobRequest] = []
        self.unary: list[Any] = []

    def smooth(self, server: Any, requests: Any, context: Any) -> Iterator[pb.SmoothResponse]:
        call = Call(requests, context, server)
        self.calls.append(call)
        script = self.scripts.pop(0) if len(self.scripts) > 1 else self.scripts[0]
        yield from call.run(script)

    def attach(
        self, server: Any, request: pb.AttachJobRequest, context: Any
    ) -> Iterator[pb.AttachJobResponse]:
        self.attach_requests.append(request)
        call = Call(iter((request,)), context, server)
        for answer in call.run(self.attach_scripts.pop(0)):
            kind = answer.WhichOneof("message")
            assert kind is not None
            yield pb.AttachJobResponse(**{kind: getattr(answer, kind)})

    def cancel(self, request: pb.CancelJobRequest, _: Any) -> pb.CancelJobResponse:
        self.unary.append(request)
        return pb.CancelJobResponse(job=pb.Job(name=request.name, state=pb.STATE_CANCELLED))


def _start(mock: MockServer) -> tuple[Any, int]:
    """A server of the mock's on a free port of the loopback device."""
    server = grpc.server(futures.ThreadPoolExecutor(8), options=[("grpc.so_reuseport", 0)])
    port = server.add_insecure_port("127.0.0.1:0")
    handlers: dict[str, Any] = {
        "Smooth": grpc.stream_stream_rpc_method_handler(
            functools.partial(mock.smooth, server),
            pb.SmoothRequest.FromString,
            pb.SmoothResponse.SerializeToString,
        ),
        "AttachJob": grpc.unary_stream_rpc_method_handler(
            functools.partial(mock.attach, server),
            pb.AttachJobRequest.FromString,
            pb.AttachJobResponse.SerializeToString,
        ),
        "CancelJob": grpc.unary_unary_rpc_method_handler(
            mock.cancel, pb.CancelJobRequest.FromString, pb.CancelJobResponse.SerializeToString
        ),
    }
    name = "meshsmooth.v1.SmoothingService"
    server.add_generic_rpc_handlers((grpc.method_handlers_generic_handler(name, handlers),))
    server.start()
    return server, port


@contextlib.contextmanager
def mock_server(count: int = 1) -> Iterator[MockServer]:
    """A mock at an address of so many servers."""
    mock = MockServer()
    servers = [_start(mock) for _ in range(count)]
    addresses = ",".join(f"127.0.0.1:{port}" for _, port in servers)
    mock.address = addresses if count == 1 else f"ipv4:{addresses}"
    try:
        yield mock
    finally:
        for server, _ in servers:
            server.stop(None)
