"""The calls to a server, each as the steps of a machine."""

from __future__ import annotations

import asyncio
import contextlib
from typing import Any, TypeVar

from . import _rpc
from ._call import ATTACH, SMOOTH, AttachCall, Attempts, SmoothCall
from ._channel import Endpoint, may_use_next_server
from ._control import Control
from ._errors import SERVER_ENDED, Error
from ._foreign_status import CallFacts
from ._machine import RECEIVE, Ask, Begin, Failed, Steps, Wait
from ._progress import Display, closing
from ._request import Request
from ._result import Finish
from ._retry import Retry
from ._service_error import to_error
from ._topology import TopologyUse
from ._transfer import Transport

R = TypeVar("R")


class Calls:
    """The calls to one server, or to several equal ones."""

    def __init__(self, endpoint: Endpoint, transport: Transport | None) -> None:
        """Makes no call yet.

        Args:
            endpoint: the server and what it needs to know of its caller.
            transport: to it; None: all arrays go in messages.
        """
        self._endpoint = endpoint
        self._transport = transport
        self._last_was_accepted = False

    def ask(
        self, method: _rpc.Unary[R], timeout: float = _rpc.SHORT_TIMEOUT, **fields: Any
    ) -> Steps[R]:
        """Returns what a call of one message each way returns; `fields` are its request's."""
        request = method.request(**fields)
        answer = yield Ask(method, request, timeout)
        if isinstance(answer, Failed):
            error = self._error_of(answer, timeout)
            if not may_use_next_server(error):
                raise error
            answer = yield Ask(method, request, timeout)
        if isinstance(answer, Failed):
            raise self._error_of(answer, timeout)
        return method.decode(answer)

    def jobs(self) -> Steps[list[_rpc.JobInfo]]:
        """Returns the caller's jobs, asked for page by page."""
        found: list[_rpc.JobInfo] = []
        page_token = ""
        while True:
            page, page_token = yield from self.ask(_rpc.LIST_JOBS, page_token=page_token)
            found += page
            if not page_token:
                return found

    def smooth(
        self,
        request: Request,
        finish: Finish,
        control: Control,
        display: Display | None,
        *,
        use: TopologyUse | None = None,
        patient: bool = False,
    ) -> Steps[Any]:
        """Runs a job in as many attempts as it may have; returns what `finish` makes of it."""
        attempts = Attempts(
            request,
            finish.memory,
            use,
            patient=patient,
            with_progress=display is not None,
            last_was_accepted=self._last_was_accepted,
            transport=self._transport,
            held=finish.held,
        )
        with closing(display):
            while True:
                control.check()
                call = attempts.begin()
                try:
                    with attempts.transferring(call):
                        upload = call.upload if call.transfer is None else None
                        left = attempts.retry.left()
                        yield Begin(SMOOTH, call.first(), upload, left, call.metadata)
                        yield from self._receive(call, request, control, display)
                        self._last_was_accepted = True
                        return finish(call.result, call.job_name)
                except Error as error:
                    self._last_was_accepted = False
                    delay = attempts.after(error, call)
                yield Wait(delay)

    def attach(
        self, name: str, request: Request, finish: Finish, control: Control, display: Display
    ) -> Steps[Any]:
        """Takes the result of a kept job; returns what `finish` makes of it."""
        retry = Retry(request.timeout, request.max_attempts)
        call = AttachCall(name, request, finish.memory)
        with closing(display):
            while True:
                control.check()
                before = call.result.received_bytes
                try:
                    yield Begin(ATTACH, call.first(), None, retry.left(), [])
                    yield from self._receive(call, request, control, display)
                    return finish(call.result, name)
                except Error as error:
                    if error.reason == SERVER_ENDED:
                        raise  # and the job with it
                    if call.result.received_bytes > before:
                        retry.succeeded_in_part()
                    delay = retry.delay_after(error)
                yield Wait(delay)

    def _receive(
        self,
        call: SmoothCall | AttachCall,
        request: Request,
        control: Control,
        display: Display | None,
    ) -> Steps[None]:
        """Takes all answers of a call; raises the error that it ends with."""
        try:
            while isinstance(answer := (yield RECEIVE), bytes):
                progress = call.receive(answer)
                control.job_name = call.job_name
                if progress is not None and display is not None and display(progress) is False:
                    control.cancel()
        except (KeyboardInterrupt, asyncio.CancelledError):
            if "result_ttl" in request.options and control.job_name:  # it would outlive its call
                with contextlib.suppress(Error):
                    yield from self.ask(_rpc.CANCEL_JOB, 1.0, name=control.job_name)
            raise
        if answer is not None:
            raise self._error_of(
                answer,
                request.timeout,
                cancelled_by_caller=control.cancelled,
                answered=bool(call.job_name),
            )
        control.check()  # cancelled, if the job has ended meanwhile too

    def _error_of(self, failed: Failed, timeout: float, **known: bool) -> Error:
        facts = CallFacts(failed.server, timeout, **known)
        return self._endpoint.explain(to_error(failed.status, facts), facts)
