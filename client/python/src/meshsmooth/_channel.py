"""Connections: address, TLS, token, and what gRPC needs to know of them."""

from __future__ import annotations

import ipaddress
import json
import os
from dataclasses import dataclass
from typing import Any

from . import _rpc
from ._credentials import Tls, Token, TokenFile, channel_credentials, checked_token, unusable
from ._errors import SERVER_ENDED, Cancelled, Error, ServerError, Unavailable
from ._foreign_status import CallFacts
from ._machine import Ask, Begin

SERVER_VARIABLE = "MESHSMOOTH_SERVER"

Metadata = list[tuple[str, str]]

# Calls alternate between all servers that serve, each asked by health's Watch; what only asks is
# tried again elsewhere by gRPC, jobs by `Retry`.
_FLEET_CONFIG = json.dumps(
    {
        "loadBalancingConfig": [{"round_robin": {}}],
        "healthCheckConfig": {"serviceName": "meshsmooth.v1.SmoothingService"},
        "methodConfig": [
            {
                "name": [
                    {"service": "meshsmooth.v1.SmoothingService", "method": method}
                    for method in ("GetServerInfo", "ListJobs", "GetJob")
                ],
                "retryPolicy": {
                    "maxAttempts": 4,
                    "initialBackoff": "0.1s",
                    "maxBackoff": "2s",
                    "backoffMultiplier": 2,
                    "retryableStatusCodes": ["UNAVAILABLE"],
                },
            }
        ],
        "retryThrottling": {"maxTokens": 10, "tokenRatio": 0.1},
    }
)


def channel_options(address: str, tls: Tls | None) -> list[tuple[str, Any]]:
    """Returns the channel arguments, which are those of the C++ client."""
    options: list[tuple[str, Any]] = [
        # Finds out within a minute when a server has gone without a word. Servers allow a ping
        # every 15 s.
        ("grpc.keepalive_time_ms", 30_000),
        ("grpc.keepalive_timeout_ms", 20_000),
        ("grpc.http2.max_pings_without_data", 0),
        # As many connections as clients: else gRPC has all of a process share one.
        ("grpc.use_local_subchannel_pool", 1),
        # Calls of one message out poll by themselves: without it a thread of the channel does and
        # wakes the caller for each answer, which takes half as long again for a mesh of 5 nodes.
        ("SingleThreadedUnaryStream", 1),
    ]
    if address.startswith(("dns:", "ipv4:", "ipv6:")):
        options += [
            ("grpc.service_config", _FLEET_CONFIG),
            ("grpc.dns_min_time_between_resolutions_ms", 2_000),
        ]
    if tls is not None and tls.server_name:
        options.append(("grpc.ssl_target_name_override", tls.server_name))
    return options


def open_channel(api: Any, address: str, tls: Tls | None) -> Any:
    """Returns a channel to a server.

    Args:
        api: `grpc` or `grpc.aio`.
        address: of the server.
        tls: the certificates; None: in clear.

    Raises:
        InvalidOption: CREDENTIALS_UNUSABLE.
    """
    options = channel_options(address, tls)
    if tls is None:
        return api.insecure_channel(address, options)
    return api.secure_channel(address, channel_credentials(tls), options)


def ask(channel: Any, action: Ask, metadata: Metadata) -> Any:
    """Makes a call of one message each way; returns gRPC's answer, or what awaits it."""
    call = channel.unary_unary(
        action.method.path,
        request_serializer=_rpc.serialize,
        response_deserializer=action.method.response.FromString,
    )
    return call(action.request, timeout=action.timeout, metadata=metadata)


def begin(channel: Any, action: Begin, messages: Any, metadata: Metadata) -> Any:
    """Begins a call; `messages` are all of its messages if there are several."""
    kind = channel.unary_stream if action.upload is None else channel.stream_stream
    sent = action.first if action.upload is None else messages
    return kind(action.path)(sent, timeout=action.timeout, metadata=metadata + action.metadata)


def is_local(address: str) -> bool:
    """Whether calls to an address stay on this machine."""
    if address.startswith(("unix:", "unix-abstract:")):
        return True
    host = address.rpartition(":")[0]
    if host in ("localhost", "[::1]"):
        return True
    try:
        return ipaddress.IPv4Address(host).is_loopback
    except ValueError:
        return False


@dataclass(frozen=True)
class Endpoint:
    """A server and what it needs to know of its caller.

    Attributes:
        fixed_address: of the server; None: that of the local server of this process, which is
            another one after each end of a server.
        of_environment: its variables say all this.
    """

    fixed_address: str | None
    tls: Tls | None = None
    token: Token | None = None
    of_environment: bool = False

    @property
    def address(self) -> str:
        """The address of the server; starts the local one unless it runs.

        Raises:
            Unavailable: no local server can be started.
        """
        return _local_address() if self.fixed_address is None else self.fixed_address

    def portable(self) -> tuple[str | None, Tls | None, str | os.PathLike[str] | None]:
        """Returns address, TLS and file of the token, for another process.

        None of the address: as the other process's environment says, as it was here.

        Raises:
            TypeError: there is a token that is not in a file.
        """
        if self.of_environment:
            return None, None, None
        if self.token is None or isinstance(self.token, TokenFile):
            return self.fixed_address, self.tls, getattr(self.token, "path", None)
        raise TypeError(
            "a client with a token cannot be pickled, the token would travel with it; use "
            "token_file=… or $MESHSMOOTH_CLIENT_TOKEN"
        )

    def explain(self, error: Error, facts: CallFacts) -> Error:
        """Returns the error of a call; that of the server's end if a local server has ended."""
        broken = isinstance(error, Unavailable | ServerError | Cancelled) and not error.reason
        if not broken or facts.cancelled_by_caller or not is_local(facts.server):
            return error
        from ._local import failure_at  # not at the top, as in `_local_address`

        failure = failure_at(facts.server)
        if failure is None:
            return error
        another = self.fixed_address is None
        return Unavailable(
            failure,
            reason=SERVER_ENDED,
            code=error.code,
            hint="the next call starts another" if another else "",
            retry_delay=0.0 if another else None,
        )

    def metadata(self) -> Metadata:
        """Returns the token's metadata of one call."""
        if self.token is None:
            return []
        token = self.token if isinstance(self.token, str) else self.token()
        return [("authorization", f"Bearer {token}")]


def may_use_next_server(error: Error) -> bool:
    """Whether the same call may go to another local server in place of one that has ended."""
    return error.reason == SERVER_ENDED and error._retry_delay is not None


def make_endpoint(
    address: str | None,
    tls: Tls | bool | None,
    token: Token | None,
    token_file: str | os.PathLike[str] | None,
) -> Endpoint:
    """Returns the endpoint of a client; arguments that are None are read from the environment.

    Raises:
        InvalidOption: CREDENTIALS_UNUSABLE: a file cannot be read, or a token would travel in
            clear.
        Unavailable: no address is given and no local server can be started.
    """
    own_address = address is not None
    if address is None:
        address = os.environ.get(SERVER_VARIABLE) or None
    elif not isinstance(address, str):
        raise TypeError(f'an address is a text as in "127.0.0.1:50051", not {address!r}')
    if tls is not None and not isinstance(tls, Tls | bool):
        raise TypeError(f"tls is an ms.Tls or True, not {tls!r}; a file is ms.Tls(ca=…)")
    if not own_address and tls is None:
        tls = _tls_of_environment()
    if not own_address and token is None and token_file is None:
        token = os.environ.get("MESHSMOOTH_CLIENT_TOKEN") or None
        token_file = os.environ.get("MESHSMOOTH_CLIENT_TOKEN_FILE") or None
    if token is not None and token_file is not None:
        raise unusable("token_file", "there is a token already")
    if isinstance(token, str):
        checked_token(token)
    elif token_file is not None:
        token = TokenFile(token_file)
    secure = Tls() if tls is True else tls or None
    if secure is None and token is not None and address is not None and not is_local(address):
        raise unusable("token", f"the token would travel to {address} in clear; use TLS")
    return Endpoint(address, secure, token, of_environment=not own_address)


def _tls_of_environment() -> Tls | None:
    def variable(name: str) -> str | None:
        return os.environ.get(f"MESHSMOOTH_CLIENT_TLS_{name}") or None

    tls = Tls(
        ca=variable("CA"),
        cert=variable("CERT"),
        key=variable("KEY"),
        server_name=variable("SERVER_NAME"),
    )
    wanted = os.environ.get("MESHSMOOTH_CLIENT_TLS", "") not in ("", "0", "false")
    return tls if wanted or tls != Tls() else None


def _local_address() -> str:
    # Not at the top: whoever has a server elsewhere needs no local one.
    from ._local import default_server

    return str(default_server().address)
