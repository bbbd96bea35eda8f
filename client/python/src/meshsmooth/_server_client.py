"""The part of the blocking client that needs no mesh."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any, TypeVar

from . import _rpc
from ._channel import make_endpoint
from ._connection import Connection
from ._credentials import Tls, Token

if TYPE_CHECKING:
    from typing_extensions import Self

R = TypeVar("R")


class ServerClient:
    """A connection to one server, or to several equal ones."""

    def __init__(
        self,
        address: str | None = None,
        *,
        tls: Tls | bool | None = None,
        token: Token | None = None,
        token_file: str | os.PathLike[str] | None = None,
    ) -> None:
        """Does not connect yet.

        Args:
            address: HOST:PORT or unix:PATH, or several servers, used alternately:
                dns:///NAME:PORT or ipv4:A:PORT,B:PORT. None: `$MESHSMOOTH_SERVER`, with
                `$MESHSMOOTH_CLIENT_TLS_CA`, `_TLS_CERT`, `_TLS_KEY`, `_TLS_SERVER_NAME`, `_TOKEN`
                and `_TOKEN_FILE`; without that variable a server of this process.
            tls: certificates; True for TLS with gRPC's own authorities.
            token: the caller's bearer token, or a function that returns it for each call.
            token_file: a file with the token on its first line, read anew for each call.

        Raises:
            InvalidOption: CREDENTIALS_UNUSABLE: a file cannot be read, or a token would travel in
                clear.
            Unavailable: no local server can be started.
        """
        self._connection = Connection(make_endpoint(address, tls, token, token_file))

    @property
    def address(self) -> str:
        """The address of the server."""
        return self._connection.endpoint.address

    def close(self) -> None:
        """Closes the connection; calls under way end with `Cancelled`."""
        self._connection.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def info(self) -> _rpc.ServerInfo:
        """Describes the server: version, methods, features, limits, backends."""
        return self._ask(_rpc.GET_SERVER_INFO)

    def jobs(self) -> list[_rpc.JobInfo]:
        """Lists the caller's jobs, running and ended, newest first."""
        return self._connection.run(self._connection.calls.jobs())

    def job(self, name: str) -> _rpc.JobInfo:
        """Returns what the server knows of a job; raises NotFound."""
        return self._ask(_rpc.GET_JOB, name=name)

    def cancel(self, name: str, *, keep_result: bool = False) -> _rpc.JobInfo:
        """Cancels a job; with `keep_result` its callers receive the positions reached so far."""
        return self._ask(_rpc.CANCEL_JOB, name=name, result_kept=keep_result)

    def delete_job(self, name: str) -> None:
        """Deletes a job that has ended, and its result."""
        self._ask(_rpc.DELETE_JOB, name=name)

    def topology(self, name: str) -> _rpc.TopologyInfo:
        """Returns what the server knows of a topology that it keeps; raises NotFound."""
        return self._ask(_rpc.GET_TOPOLOGY, name=name)

    def delete_topology(self, name: str) -> None:
        """Makes the server drop a topology; jobs that use it continue. Raises NotFound."""
        self._ask(_rpc.DELETE_TOPOLOGY, name=name)

    def health(self, timeout: float = 5.0) -> bool:
        """Returns whether the server serves, as grpc.health.v1 reports."""
        return self._ask(_rpc.HEALTH, timeout)

    def _ask(self, method: _rpc.Unary[R], timeout: float = _rpc.SHORT_TIMEOUT, **fields: Any) -> R:
        return self._connection.run(self._connection.calls.ask(method, timeout, **fields))
