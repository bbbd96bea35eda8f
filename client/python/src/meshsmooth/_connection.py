"""The blocking calls of one server."""

from __future__ import annotations

import contextlib
import functools
import os
import threading
import weakref
from collections.abc import Callable, Iterator
from typing import Any, cast

import grpc

from . import _call, _channel, _rpc
from ._errors import SERVER_ENDED, Error, Unavailable
from ._fork_guard import fork_guard
from ._job import Control
from ._progress import Display, Progress, closing
from ._region import Lease, RegionPool
from ._request import Request, TopologyUse
from ._result import Finish
from ._retry import Retry
from ._service_error import CallFacts, to_error
from .v1 import smoothing_pb2 as pb


def _leasing(connection: weakref.ref[Connection]) -> Lease:
    """The call LeaseRegion, which does not keep its connection alive."""

    def lease(size: int) -> pb.LeaseRegionResponse:
        alive = connection()
        if alive is None:
            raise OSError("the connection is gone")
        return cast(
            pb.LeaseRegionResponse,
            alive.unary(_rpc.LEASE_REGION, pb.LeaseRegionRequest(size_bytes=size), 5.0),
        )

    return lease


class Connection:
    """A channel to a server, opened by the first call, and the calls on it. Thread-safe."""

    def __init__(self, endpoint: _channel.Endpoint) -> None:
        self._endpoint = endpoint
        self._lock = threading.Lock()
        self._channel: Any = None
        self._channel_address = ""
        self._pid = 0  # of the process that the channel belongs to
        self._closed = False
        self._last_was_accepted = False
        self._regions: RegionPool | None = None
        if RegionPool.possible(endpoint.address):
            self._regions = RegionPool(_leasing(weakref.ref(self)))
            weakref.finalize(self, self._regions.close)

    @property
    def endpoint(self) -> _channel.Endpoint:
        """The server and what it needs to know of its caller."""
        return self._endpoint

    @property
    def address(self) -> str:
        """The address of the server."""
        return self._endpoint.address

    def close(self) -> None:
        """Closes the channel; calls under way end with `Cancelled`."""
        if self._regions is not None:
            self._regions.close()
        with self._lock:
            self._closed = True
            channel, self._channel = self._channel, None
            if channel is not None and self._pid == os.getpid():
                channel.close()

    def _own_channel(self) -> Any:
        fork_guard.check()
        with self._lock:
            if self._closed:
                raise ValueError("the client is closed")
            endpoint = self._endpoint
            address = endpoint.address
            own = self._pid == os.getpid()
            # The channel to a local server that has ended is dropped, not closed: its calls end
            # with their own errors.
            if self._channel is None or not own or address != self._channel_address:
                options = _channel.channel_options(address, endpoint.tls)
                self._channel = (
                    grpc.insecure_channel(address, options)
                    if endpoint.tls is None
                    else grpc.secure_channel(
                        address, _channel.channel_credentials(endpoint.tls), options
                    )
                )
                self._channel_address, self._pid = address, os.getpid()
            return self._channel

    def _error_of(self, failed: grpc.RpcError, facts: CallFacts) -> Error:
        return self._endpoint.explain(to_error(failed, facts), facts)  # type: ignore[arg-type]

    def unary(self, method: _rpc.Unary, request: Any, timeout: float = _rpc.SHORT_TIMEOUT) -> Any:
        try:
            return self._unary(method, request, timeout)
        except Unavailable as error:
            if not _channel.may_use_next_server(error):
                raise
        return self._unary(method, request, timeout)

    def _unary(self, method: _rpc.Unary, request: Any, timeout: float) -> Any:
        call = self._own_channel().unary_unary(
            method.path,
            request_serializer=_rpc.serialize,
            response_deserializer=method.response.FromString,
        )
        try:
            return call(request, timeout=timeout, metadata=self._endpoint.metadata())
        except grpc.RpcError as failed:
            error = self._error_of(failed, CallFacts(self._channel_address, timeout))
        raise error  # here, without gRPC's as its context, which cannot be pickled

    def smooth(
        self,
        request: Request,
        finish: Finish,
        control: Control,
        display: Display | None,
        *,
        use: TopologyUse | None = None,
        patient: bool = False,
    ) -> Any:
        """Runs a job in as many attempts as it may have."""
        attempts = _call.Attempts(
            request,
            finish.memory,
            use,
            patient=patient,
            with_progress=display is not None,
            last_was_accepted=self._last_was_accepted,
            held=finish.held,
        )
        with closing(display):
            while True:
                control.check()
                call = attempts.begin()
                try:
                    with attempts.sharing(call, self._regions):
                        self._run_smooth(call, request, control, display, attempts.retry.left())
                        self._last_was_accepted = True
                        return finish(call.result, call.job_name)
                except Error as error:
                    self._last_was_accepted = False
                    control.wait(attempts.after(error, call))

    def _run_smooth(
        self,
        call: _call.SmoothCall,
        request: Request,
        control: Control,
        display: Display | None,
        left: float,
    ) -> None:
        try:
            if call.region is not None:  # its only message goes at once
                stream = self._own_channel().unary_stream(_call.SMOOTH)(
                    call.first, timeout=left, metadata=self._endpoint.metadata() + call.metadata
                )
                wake = threading.Event()
            else:
                stream, wake = self._send_chunks(call, left)
            facts = functools.partial(CallFacts, self._channel_address, request.timeout)

            def receive(message: bytes) -> Progress | None:
                progress = call.receive(message)
                control.job_name = call.job_name
                wake.set()
                return progress

            self._drain(stream, receive, control, display, facts, lambda: bool(call.job_name))
        except KeyboardInterrupt:
            self._interrupted(control, request)
            raise

    def _send_chunks(self, call: _call.SmoothCall, left: float) -> tuple[Any, threading.Event]:
        """Begins a call; the event has its upload continue."""
        upload = call.upload
        wake = threading.Event()  # the upload may continue, or the call has ended
        ended = False

        def messages() -> Iterator[bytes]:
            yield call.first
            while not ended:
                yield from upload.chunks()
                if upload.complete:
                    return
                wake.wait()
                wake.clear()

        def end() -> None:
            nonlocal ended
            ended = True
            wake.set()

        stream = self._own_channel().stream_stream(_call.SMOOTH)(
            messages(), timeout=left, metadata=self._endpoint.metadata() + call.metadata
        )
        if not stream.add_callback(end):
            end()
        return stream, wake

    def attach(
        self, name: str, request: Request, finish: Finish, control: Control, display: Display
    ) -> Any:
        retry = Retry(request.timeout, request.max_attempts)
        call = _call.AttachCall(name, request, finish.memory)
        with closing(display):
            while True:
                control.check()
                before = call.result.received_bytes
                try:
                    stream = self._own_channel().unary_stream(_call.ATTACH)(
                        call.first(), timeout=retry.left(), metadata=self._endpoint.metadata()
                    )
                    facts = functools.partial(CallFacts, self._channel_address, request.timeout)
                    self._drain(stream, call.receive, control, display, facts, lambda: True)
                    return finish(call.result, name)
                except Error as error:
                    if error.reason == SERVER_ENDED:
                        raise  # and the job with it
                    if call.result.received_bytes > before:
                        retry.succeeded_in_part()
                    control.wait(retry.delay_after(error))

    def _drain(
        self,
        stream: Any,
        receive: Callable[[bytes], Progress | None],
        control: Control,
        display: Display | None,
        facts: Callable[..., CallFacts],
        answered: Callable[[], bool],
    ) -> None:
        """Takes all answers of a call; raises the error that it ends with."""
        control.begin(stream.cancel)
        try:
            for message in stream:
                progress = receive(message)
                if progress is not None and display is not None and display(progress) is False:
                    control.cancel()
            control.check()  # cancelled, if the job has ended meanwhile too
            return
        except grpc.RpcError as failed:
            error = self._error_of(
                failed, facts(cancelled_by_caller=control.cancelled, answered=answered())
            )
        except BaseException:
            stream.cancel()
            raise
        finally:
            control.end()
        raise error  # as in `unary`

    def _interrupted(self, control: Control, request: Request) -> None:
        """Ends a job that would outlive its call."""
        if "result_ttl" in request.options and control.job_name:
            with contextlib.suppress(Error):
                self.unary(_rpc.CANCEL_JOB, pb.CancelJobRequest(name=control.job_name), 1.0)
