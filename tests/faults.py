"""Runs that something happens to: each in a child of this process, so that none pays for starting up."""

from __future__ import annotations

import contextlib
import os
import re
import sys
import time
import traceback
from collections.abc import Callable
from pathlib import Path

import postproc.workflows.program  # noqa: F401  what a run loads is there before it is watched
from postproc.cli.main import run

KILLS = int(os.environ.get("POSTPROC_KILLS", "5"))
"""How often a run is killed at random; with more than five everything else happens at more places too."""

FORBIDDEN = frozenset(
    [
        *(
            "socket.connect",
            "socket.bind",
            "socket.getaddrinfo",
            "urllib.Request",
            "subprocess.Popen",
            "os.system",
        ),
        *("os.exec", "os.spawn", "os.posix_spawn", "pickle.find_class", "ctypes.dlopen"),
    ]
)
"""What no run on a program asks of the system."""

OWN_LIBRARY = ("ctypes.dlopen", (None,))
"""But for the C library that this process has already, which gives memory back."""

TEMPORARY = re.compile(r"\..*\.tmp(\.old)?|\.compensate\.lock")


class Child:
    """``compensate WORDS`` in a process of its own.

    ``happens``: called in it whenever it asks the system for something of ``watched`` (opens, renames, removes, lists,
    locks), with the number of the request from 1.  ``said``: what it said, and ``memory`` [bytes] the most that it had,
    once it has ended.
    """

    def __init__(
        self,
        words: list[object],
        watched: Path,
        happens: Callable[[int], None] = lambda number: None,
    ) -> None:
        self.said, self.memory = "", 0
        self._out, out = os.pipe()
        self.pid = os.fork()
        if self.pid == 0:
            sys.stdout = sys.stderr = os.fdopen(out, "w")
            self._work([str(word) for word in words], str(watched), happens)
        os.close(out)

    def _work(self, words: list[str], folder: str, happens: Callable[[int], None]) -> None:
        code: object = 99
        try:
            asked = 0

            def heard(event: str, arguments: tuple[object, ...]) -> None:
                nonlocal asked
                if event in FORBIDDEN and (event, arguments) != OWN_LIBRARY:
                    print(event, arguments, flush=True)
                    os._exit(97)
                if event == "fcntl.flock" or any(
                    isinstance(one, (str, bytes, os.PathLike)) and os.fsdecode(one).startswith(folder)
                    for one in arguments
                ):
                    asked += 1
                    happens(asked)

            sys.addaudithook(heard)
            sys.argv[1:] = words
            run()
        except SystemExit as end:
            code = end.code or 0
        except BaseException:
            traceback.print_exc()
        finally:
            with contextlib.suppress(BaseException):
                sys.stderr.flush()
            os._exit(code if isinstance(code, int) else 98)

    def end(self) -> int:
        """Its exit code; minus the signal that killed it."""
        with os.fdopen(self._out) as stream:
            self.said = stream.read()
        _, status, used = os.wait4(self.pid, 0)
        self.memory = 1024 * used.ru_maxrss
        return os.waitstatus_to_exitcode(status)


def once(at: int, act: Callable[[], None]) -> Callable[[int], None]:
    """Does ``act`` at the request number ``at``."""

    def happens(number: int) -> None:
        if number == at:
            act()

    return happens


def there(folder: Path) -> dict[str, bytes]:
    """The files of a folder that are no temporary ones."""
    if not folder.exists():
        return {}
    return {
        p.name: p.read_bytes() for p in folder.iterdir() if p.is_file() and not TEMPORARY.fullmatch(p.name)
    }


def stray(folder: Path) -> list[str]:
    return [path.name for path in folder.rglob("*") if TEMPORARY.fullmatch(path.name)]


def seconds(work: Callable[[], object]) -> float:
    began = time.monotonic()
    work()
    return time.monotonic() - began
