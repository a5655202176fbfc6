"""The bytes of a program -> its motions, by a reader that shares nothing with the package under test."""

from __future__ import annotations

from pathlib import Path

from .cell import Cell
from .motion import Motion
from .reader_gcode import read_gcode
from .reader_krl import read_krl


def read(path: Path, cell: Cell) -> list[Motion]:
    return read_krl(path, cell) if path.suffix.lower() == ".src" else read_gcode(path, cell)
