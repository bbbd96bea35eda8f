"""What reports have in common."""

from __future__ import annotations

import dataclasses
import functools
import json
from typing import Any


@functools.singledispatch
def to_text(report: object) -> str:
    """Returns a report as text."""
    raise NotImplementedError(type(report))


@functools.singledispatch
def to_html(report: object) -> str:
    """Returns a report as a fragment of HTML."""
    raise NotImplementedError(type(report))


class Reported:
    """A dataclass that is shown as text and as HTML, and written as JSON."""

    def to_dict(self) -> dict[str, Any]:
        """Returns plain dicts, lists and numbers."""
        return dict(_plain(self))

    def to_json(self, indent: int | None = None) -> str:
        """Returns `to_dict()` as JSON."""
        return json.dumps(self.to_dict(), indent=indent)

    def __str__(self) -> str:
        return to_text(self)

    def _repr_html_(self) -> str:
        return to_html(self)


def _plain(value: Any) -> Any:
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {f.name: _plain(getattr(value, f.name)) for f in dataclasses.fields(value)}
    if isinstance(value, tuple):
        return [_plain(item) for item in value]
    return value
