"""Signatures and docstrings that list every option, made of their declarations."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Collection
from typing import Any, TypeVar

from ._job_options import OPTIONS, Declared, type_text
from ._option import Option

F = TypeVar("F", bound=Callable[..., Any])


class _Words(str):
    """A text that `help` shows without quotation marks."""

    __slots__ = ()

    def __repr__(self) -> str:
        return str(self)


def with_options(options: Declared = OPTIONS, *, without: Collection[str] = ()) -> Callable[[F], F]:
    """Has `help`, `inspect.signature` and completion show options in place of `**options`.

    Args:
        options: that the function takes.
        without: names of some that it does not take.
    """
    chosen = {name: declared for name, declared in options.items() if name not in without}

    def decorate(function: F) -> F:
        signature = inspect.signature(function)
        own = [p for p in signature.parameters.values() if p.kind is not p.VAR_KEYWORD]
        function.__signature__ = signature.replace(  # type: ignore[attr-defined]
            parameters=own + [_parameter(name, *declared) for name, declared in chosen.items()]
        )
        if function.__doc__ is not None:  # there is none with -OO
            lines = "\n".join(f"    {_describe(name, *chosen[name])}" for name in chosen)
            function.__doc__ = f"{inspect.cleandoc(function.__doc__)}\n\nOptions:\n{lines}\n"
        return function

    return decorate


def _parameter(name: str, kind: Any, option: Option) -> inspect.Parameter:
    return inspect.Parameter(
        name,
        inspect.Parameter.KEYWORD_ONLY,
        default=_Words(option.default) if option.default else None,
        annotation=_Words(type_text(kind, option)),
    )


def _describe(name: str, kind: Any, option: Option) -> str:
    unit = f"; {option.unit}" if option.unit else ""
    default = f" [{option.default}]" if option.default else ""
    return f"{name} ({type_text(kind, option)}{unit}): {option.meaning}{default}"
