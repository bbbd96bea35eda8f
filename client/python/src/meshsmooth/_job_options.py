"""The options of a job by name: what signatures, docstrings, checks at run time, the messages and
the table in docs/python.md are made of.
"""

from __future__ import annotations

import typing
from collections.abc import Mapping
from typing import Any, Literal

from ._declared_options import JobOptions as JobOptions
from ._declared_options import MoveOptions as MoveOptions
from ._methods import Move
from ._option import Duration as Duration
from ._option import Option


def _declared(options: type) -> Mapping[str, tuple[Any, Option]]:
    hints = typing.get_type_hints(options, include_extras=True)
    return {name: typing.get_args(hint)[:2] for name, hint in hints.items()}


Declared = Mapping[str, tuple[Any, Option]]

OPTIONS: Declared = _declared(JobOptions)  # type and option by name
# Those of `move`, how it moves first; its method is another.
MOVE_OPTIONS: Declared = {
    **dict(list(_declared(MoveOptions).items())[len(OPTIONS) :]),
    **OPTIONS,
    "method": (Move, Option("how the mesh moves", "ms.Move()", takes="ms.Move(…)")),
}
TOPOLOGY_OPTIONS = tuple(name for name, (_, option) in OPTIONS.items() if option.topology)


def type_text(kind: Any, option: Option) -> str:
    """Returns what an option takes, in words."""
    choices = " | ".join(map(repr, choices_of(kind)))
    if option.takes:
        return option.takes.format(choices=choices)
    return choices or " | ".join(part.__name__ for part in typing.get_args(kind) or (kind,))


def choices_of(kind: Any) -> tuple[str, ...]:
    """Returns the values of a Literal, also of one or a sequence of it; () of other types."""
    if typing.get_origin(kind) is Literal:
        return typing.get_args(kind)
    return next(filter(None, map(choices_of, typing.get_args(kind))), ())
