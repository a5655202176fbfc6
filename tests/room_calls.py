"""Rooms that one run of a command enters, and calls that lead up: ``python -m tests.room_calls WORD ...``.

    python -m tests.room_calls samples/kr270_milling/bracket.src --force --dry-run -q

Counts, in one thread, each call from a function of one room of the package (``ROOMS`` of ``test_design.py``) to one of
another, past what other packages do between; what runs at import is left out.  A call from a lower floor to a higher
one is a function, or a sequence, that the higher room gave: these are listed.
"""

from __future__ import annotations

import os
import sys
import threading
from collections import Counter
from pathlib import Path
from types import CodeType, FrameType
from typing import Any

os.environ["POSTPROC_THREADS"] = "1"
sys.path.insert(0, str(Path(__file__).resolve().parent))

import postproc

ROOT = str(Path(postproc.__file__).parent) + os.sep


class RoomCalls:
    """A profiler: calls between rooms, from -> to; files that were entered; calls up, by their functions."""

    def __init__(self, floors: dict[str, int]) -> None:
        self.floors = floors
        self.calls: Counter[tuple[str, str]] = Counter()
        self.up: Counter[tuple[str, str]] = Counter()
        self.files: set[str] = set()
        self._names: dict[CodeType, str] = {}

    def file_of(self, code: CodeType) -> str:
        """The file below the package; "" of other code."""
        if code not in self._names:
            inside = code.co_filename.startswith(ROOT)
            self._names[code] = code.co_filename.removeprefix(ROOT) if inside else ""
        return self._names[code]

    def __call__(self, frame: FrameType, event: str, value: Any) -> None:
        name = self.file_of(frame.f_code) if event == "call" else ""
        if not name or frame.f_code.co_name == "<module>":
            return
        caller = frame.f_back
        while caller is not None and not self.file_of(caller.f_code):
            caller = caller.f_back
        if caller is None or caller.f_code.co_name == "<module>":
            return
        source = self.file_of(caller.f_code)
        start, end = (file.split(os.sep)[0].removesuffix(".py") for file in (source, name))
        self.files.add(name)
        if start != end:
            self.calls[start, end] += 1
            if self.floors[end] > self.floors[start]:
                places = (f"{source} {caller.f_code.co_qualname}", f"{name} {frame.f_code.co_qualname}")
                self.up[places] += 1


def count_calls(words: list[str], floors: dict[str, int]) -> RoomCalls:
    """The calls of one run of the command line."""
    from postproc.cli.main import run

    counted = RoomCalls(floors)
    threading.setprofile(counted)
    sys.setprofile(counted)
    try:
        run(words)
    except SystemExit:
        pass
    finally:
        sys.setprofile(None)
        threading.setprofile(None)
    return counted


def main(words: list[str]) -> int:
    from test_design import ROOMS

    counted = count_calls(words, ROOMS)
    for (source, target), calls in counted.up.most_common():
        print(f"{calls:6} {source} -> {target}")
    rooms = {end for _, end in counted.calls}
    print(
        f"{len(rooms)} rooms, {len(counted.files)} files entered; {counted.calls.total()} calls from room to room;"
        f" {counted.up.total()} of them up, by {len(counted.up)} pairs of functions"
    )
    return 0


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
