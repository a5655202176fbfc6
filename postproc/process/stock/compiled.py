"""Functions compiled by numba, which is loaded only where a stock is simulated."""

from __future__ import annotations

import hashlib
import importlib
import importlib.util
import os
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, TypeVar, cast

from postproc.base.findings import Finding, Refusal

Function = TypeVar("Function", bound=Callable[..., Any])


def compiled(function: Function) -> Function:
    """``function`` as machine code that lets other threads run.

    It is stored between runs, and compiled at its first call where no folder can be written.
    """
    numba: Any = importlib.import_module("numba")
    config, njit = numba.config, numba.njit
    options = {"nogil": True, "error_model": "numpy"}
    before = config.CACHE_DIR
    config.CACHE_DIR = str(_folder(Path(function.__code__.co_filename).parent))
    try:
        return cast(Function, njit(function, cache=True, **options))
    except (RuntimeError, OSError):
        return cast(Function, njit(function, **options))
    finally:
        config.CACHE_DIR = before


@cache
def _folder(room: Path) -> Path:
    """Of the user, one for each state of the sources of this folder and of ``room``: numba compares the file of a
    function, not of those it calls."""
    digest = hashlib.sha256()
    for source in sorted({*Path(__file__).parent.glob("*.py"), *room.glob("*.py")}):
        digest.update(source.read_bytes())
    home = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(home) / "postproc" / f"compiled-{digest.hexdigest()[:16]}"


def check_compiler(file: str = "") -> None:
    """Refusal STK001 where numba is not installed."""
    if importlib.util.find_spec("numba") is None:
        raise Refusal(Finding("STK001", "the simulation of the stock needs numba", file))
