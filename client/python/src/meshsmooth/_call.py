"""The protocol of a job without its input and output, for the blocking and the asyncio client."""

from __future__ import annotations

import contextlib
import logging
from collections.abc import Iterator
from typing import Any

from google.protobuf.message import DecodeError
from numpy.typing import NDArray

from . import _wire
from ._channel import may_use_next_server
from ._errors import SERVER_ENDED, DeadlineExceeded, Error
from ._options import name_option
from ._progress import Progress, decode_job_state, decode_progress
from ._received import Result
from ._request import Request
from ._retry import Retry
from ._service_error import broken_answer, place_in_input
from ._topology import TopologyUse
from ._transfer import ALIGNMENT, Held, Transfer, Transport
from .v1 import smoothing_pb2

_log = logging.getLogger("meshsmooth")  # attempts that failed, and how

SMOOTH = "/meshsmooth.v1.SmoothingService/Smooth"
ATTACH = "/meshsmooth.v1.SmoothingService/AttachJob"

# What is sent before it is known whether the server accepts the job: of a large mesh little is in
# vain, and a proxy can be heard that refuses at once, which it cannot be while more is under way.
FEW_EARLY_BYTES = _wire.SMALL_BYTES
# The same where the last job was accepted: a mesh of this size does not wait for the answer.
MANY_EARLY_BYTES = 2 << 20


class SmoothCall:
    """One attempt at a job, from spec to summary."""

    def __init__(
        self,
        request: Request,
        use: TopologyUse,
        early_bytes: int,
        memory: NDArray[Any] | None,
        *,
        with_progress: bool,
    ) -> None:
        self._message = request.spec(use, with_progress=with_progress)
        self.metadata = request.metadata(use)
        self._parts = request.parts(use)
        self.upload = _wire.Upload(self._parts, early_bytes)
        self._result_bytes = request.result_bytes
        self.transfer: Transfer | None = None  # by which the arrays travel; None: in chunks
        self.result = Result(request, memory)
        self.job_name = ""

    @property
    def transfer_bytes(self) -> int:
        """What the arrays of the job and of its result take in a transfer."""
        return self._result_bytes + sum(part.data.nbytes + ALIGNMENT for part in self._parts)

    def use(self, transfer: Transfer) -> bool:
        """Has the arrays travel that way, if there is room."""
        if not transfer.upload(self._parts, self._result_bytes, self._message.spec):
            return False
        self.transfer = transfer
        return True

    def first(self) -> bytes:
        """Returns the first message, or the only one if no chunks follow."""
        return bytes(self._message.SerializeToString())

    @property
    def answered(self) -> bool:
        """Whether the server has accepted the job, or refused it itself."""
        return self.upload.answered or self.upload.stopped

    def receive(self, message: bytes) -> Progress | None:
        """Takes an answer; returns the progress if it is one.

        Raises:
            Error: the answer breaks the protocol.
        """
        if (chunk := _find_chunk(message, _wire.SMOOTH_RESPONSE_CHUNK)) is not None:
            self.result.add(chunk)
            return None
        response = _parse(smoothing_pb2.SmoothResponse, message)
        kind = response.WhichOneof("message")
        if kind == "accepted":
            if self.upload.answered:
                raise broken_answer("the server accepted the job twice")
            self.job_name = response.accepted.job.name
            self.upload.answered = True
            return decode_job_state(response.accepted.job)  # so that each job reports once
        if kind == "stop_sending":
            self.upload.stopped = True
        elif kind == "progress":
            return decode_progress(response.progress)
        elif kind == "result":
            self.result.begin(response.result)
            if self.result.in_place and self.transfer is None:
                raise broken_answer(
                    "the server announced no chunks of the result of a job sent in chunks"
                )
        elif kind == "summary":
            if self.result.in_place and self.transfer is not None:
                self.result.find(self.transfer.download())
            self.result.summary = response.summary
        return None  # also of what a newer server adds


class AttachCall:
    """Attempts at the result of a kept job; each continues where the last one ended."""

    def __init__(self, name: str, request: Request, memory: NDArray[Any] | None) -> None:
        self.job_name = name
        self.result = Result(request, memory, attached=True)

    def first(self) -> bytes:
        """Returns the request of the next attempt."""
        message = smoothing_pb2.AttachJobRequest(
            name=self.job_name, result_offset_bytes=self.result.received_bytes
        )
        return message.SerializeToString()

    def receive(self, message: bytes) -> Progress | None:
        """Takes an answer; returns the progress if it is one."""
        if (chunk := _find_chunk(message, _wire.ATTACH_RESPONSE_CHUNK)) is not None:
            self.result.add(chunk)
            return None
        response = _parse(smoothing_pb2.AttachJobResponse, message)
        kind = response.WhichOneof("message")
        if kind == "progress":
            return decode_progress(response.progress)
        if kind == "result" and not self.result.begun:
            self.result.begin(response.result)
        elif kind == "summary":
            self.result.summary = response.summary
        return None


def _find_chunk(message: bytes, field: int) -> _wire.Chunk | None:
    try:
        return _wire.find_chunk(message, field)
    except _wire.Malformed as error:
        raise broken_answer(f"cannot parse the server's chunk: {error}") from None


def _parse(kind: Any, message: bytes) -> Any:
    try:
        return kind.FromString(message)
    except DecodeError:
        raise broken_answer(f"cannot parse the server's {kind.DESCRIPTOR.name}") from None


class Attempts:
    """The attempts at one job, with the rules of the C++ client for what is sent again and how.

    Attributes:
        retry: how often and how long the job is tried.
    """

    def __init__(
        self,
        request: Request,
        memory: NDArray[Any] | None,
        use: TopologyUse | None,
        *,
        patient: bool,
        with_progress: bool,
        last_was_accepted: bool,
        transport: Transport | None,
        held: Held | None = None,
    ) -> None:
        self.retry = Retry(request.timeout, request.max_attempts, patient=patient)
        self._request = request
        self._memory = memory
        self._use = use or TopologyUse()  # how the next attempt names or sends the topology
        self._with_progress = with_progress
        self._transport = transport
        self._may_transfer = True
        self._server_ended = False
        self._held = held
        self._early_bytes = MANY_EARLY_BYTES if last_was_accepted else FEW_EARLY_BYTES

    def begin(self) -> SmoothCall:
        """Returns the call of the next attempt."""
        return SmoothCall(
            self._request,
            self._use,
            self._early_bytes,
            self._memory,
            with_progress=self._with_progress,
        )

    @contextlib.contextmanager
    def transferring(self, call: SmoothCall) -> Iterator[None]:
        """Has the call use a transfer if there is one, and keeps that if the call ends well."""
        transport, transfer = self._transport, None
        if transport is not None and self._may_transfer:
            transfer = self._find_transfer(call, transport)
        held = self._held
        if transport is None or transfer is None:
            yield
            if held is not None:
                held.close()  # the positions lie elsewhere now
            return
        try:
            yield
        except BaseException:
            transfer.close()  # the server may still write to it
            raise
        if held is None:
            transport.give_back(transfer)
        else:
            transfer.hold(self._request.points.nbytes)
            held.transfer = transfer

    def _find_transfer(self, call: SmoothCall, transport: Transport) -> Transfer | None:
        held = self._held
        if held is not None and held.transfer is not None:
            if not held.transfer.ended() and call.use(held.transfer):
                return held.transfer
            held.close()
        opened = transport.open(call.transfer_bytes)
        if opened is not None:
            try:
                call.use(opened)
            except BaseException:
                opened.close()
                raise
        return opened

    def after(self, error: Error, call: SmoothCall) -> float:
        """Returns the seconds to wait before the next attempt.

        Raises the error, placed in the caller's mesh, if there is none.
        """
        request = self._request
        place_in_input(error, request.topology.element_count, len(request.points), request.mesh)
        name_option(error)
        if error.reason == "INDEX_OUT_OF_RANGE" and request.topology.counts_from_one():
            error.hint = "the cells seem to count their nodes from 1; subtract 1"
        _log.info("%s: %s", self._request.request_id, error)
        if error.reason == SERVER_ENDED:
            # Once, on the next server: a job may be what ends them.
            if not may_use_next_server(error) or self._server_ended:
                raise error
            self._server_ended = True
            return 0.0
        if call.transfer is not None and self._transport is not None:
            self._may_transfer = False  # retry with chunks, whatever failed
            if self._transport.refused(error):
                return 0.0
        if error.reason == "TOPOLOGY_NOT_FOUND" and self._use.named:
            self._use = TopologyUse(kept=True, routed=self._use.routed)
            return 0.0
        # The server itself refused: a proxy may choose another.
        if error.reason:
            self._use = self._use._replace(routed=False)
        # Cut off with much data in flight, which may hide a proxy's answer: try with less. Not at
        # the deadline, which gRPC may find a moment before it is here.
        many = self._early_bytes == MANY_EARLY_BYTES
        self._early_bytes = FEW_EARLY_BYTES
        unheard = many and not call.answered and not isinstance(error, DeadlineExceeded)
        if unheard and not error.reason and self.retry.left() > 0:
            return 0.0
        return self.retry.delay_after(error)
