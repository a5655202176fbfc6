"""Names and values of options, and those that they had before: still taken, for one version, by command line, job files
and Python."""

from __future__ import annotations

import functools
import warnings
from collections.abc import Callable, Mapping
from typing import ParamSpec, TypeVar

_Parameters = ParamSpec("_Parameters")
_Result = TypeVar("_Result")

SHARED_POINTS = ("copy-inline", "copy-dat", "keep")
"""What becomes of a named point that several motions use."""

FORMER_OPTIONS: Mapping[str, str] = {
    "keep_points": "no_insert",
    "own_points": "shared_points",
    "force_offset": "tare",
    "again": "allow_compensated",
    "force_rerun": "rerun",
}
"""Former name -> present name, as a field of a ``Request``; on the command line with ``--`` and hyphens."""

FORMER_VALUES: Mapping[str, Mapping[str, str]] = {
    "shared_points": dict(zip(("inline", "dat", "refuse"), SHARED_POINTS, strict=True))
}
"""Present name of an option -> its former values -> the present ones."""


def former_names_of(option: str) -> tuple[str, ...]:
    """The former names of an ``option``."""
    return tuple(former for former, present in FORMER_OPTIONS.items() if present == option)


def present_value(option: str, value: object) -> object:
    """The present value of ``option`` for one that may be a former one."""
    return FORMER_VALUES.get(option, {}).get(value, value) if isinstance(value, str) else value


def accept_former_names(function: Callable[_Parameters, _Result]) -> Callable[_Parameters, _Result]:
    """``function``, whose keyword arguments may also have their former names and values, with a DeprecationWarning."""

    @functools.wraps(function)
    def call(*arguments: _Parameters.args, **options: _Parameters.kwargs) -> _Result:
        for former in [name for name in options if name in FORMER_OPTIONS]:
            present = FORMER_OPTIONS[former]
            if present in options:
                raise TypeError(
                    f"{function.__name__}() got {former!r} and {present!r}: {former!r} is its former name"
                )
            warnings.warn(f"{former!r} is now called {present!r}", DeprecationWarning, stacklevel=2)
            options[present] = options.pop(former)
        for name, value in options.items():
            now = present_value(name, value)
            if now is not value:
                warnings.warn(f"{name}={value!r} is now called {now!r}", DeprecationWarning, stacklevel=2)
                options[name] = now
        return function(*arguments, **options)

    return call
