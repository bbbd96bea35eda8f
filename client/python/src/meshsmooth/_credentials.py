"""What a server asks of its callers: certificates and tokens."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Callable
from dataclasses import dataclass

import grpc

from ._errors import InvalidOption

Token = str | Callable[[], str]


@dataclass(frozen=True, kw_only=True)
class Tls:
    """TLS of a connection; all files are PEM.

    Attributes:
        ca: file of the authorities that may sign the server's certificate [gRPC's own].
        cert: file of the client certificate, for servers that require one.
        key: file of the key of `cert`.
        server_name: name in the server's certificate [the host of the address].
    """

    ca: str | os.PathLike[str] | None = None
    cert: str | os.PathLike[str] | None = None
    key: str | os.PathLike[str] | None = None
    server_name: str | None = None


def channel_credentials(tls: Tls) -> grpc.ChannelCredentials:
    """Reads the files of a TLS connection.

    Raises:
        InvalidOption: CREDENTIALS_UNUSABLE.
    """
    if (tls.cert is None) != (tls.key is None):
        missing = "key" if tls.key is None else "cert"
        raise unusable(missing, "a certificate and its key belong together")
    return grpc.ssl_channel_credentials(
        _read("ca", tls.ca), _read("key", tls.key), _read("cert", tls.cert)
    )


def _read(field: str, path: str | os.PathLike[str] | None) -> bytes | None:
    if path is None:
        return None
    try:
        with open(path, "rb") as file:
            content = file.read()
    except OSError as error:
        raise unusable(field, f"cannot read {os.fspath(path)}: {error.strerror}") from None
    if not content:
        raise unusable(field, f"{os.fspath(path)} is empty")
    return content


def unusable(field: str, what: str) -> InvalidOption:
    """Returns the error of credentials that cannot be used."""
    return InvalidOption(
        f"{field}: {what}", reason="CREDENTIALS_UNUSABLE", details={"field": field}
    )


class TokenFile:
    """A token on the first line of a file, which is read anew for each call.

    While a new token is being written, the one before is shown.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path = path
        self._token = self._read_token()

    def __call__(self) -> str:
        with contextlib.suppress(InvalidOption):
            self._token = self._read_token()
        return self._token

    def _read_token(self) -> str:
        content = _read("token_file", self.path) or b""
        lines = content.decode("ascii", "replace").splitlines()
        return checked_token(lines[0] if lines else "", "token_file")


def checked_token(token: str, field: str = "token") -> str:
    """Returns the token, or raises InvalidOption if it cannot travel as metadata."""
    if not token or not all(0x20 < ord(letter) < 0x7F for letter in token):
        raise unusable(field, "a token is visible ASCII without spaces, alone on its line")
    return token
