"""Small batches for tests: programs of a few motions in one cell, and their results."""

from __future__ import annotations

from pathlib import Path

from conftest import CELL, LINES

from postproc.batching.job_file import Job
from postproc.workflows.preparation import Request

WRONG = [line.replace("LIN {X 100.000", "LIN {X 99999.000") for line in LINES]


def program(path: Path, number: int = 0, lines=LINES) -> Path:
    """A program of its own: its cut lies ``number`` mm elsewhere."""
    path.parent.mkdir(parents=True, exist_ok=True)
    text = (
        "\r\n".join(lines)
        .replace("X 200.000", f"X {200 + number}.000")
        .replace("DEF part", f"DEF {path.stem}")
    )
    path.write_text(text + "\r\n")
    return path


def four_programs(folder: Path) -> Path:
    """A folder of four programs in a cell."""
    for number in range(4):
        program(folder / f"p{number}.src", number)
    (folder / "cell.yaml").write_text(CELL)
    return folder


def contents(folder: Path) -> dict[str, bytes]:
    """Every result below a folder; not records, which say when what was read."""
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and ".compensate" not in path.parts
    }


def a_job(folder: Path, name: str, **options) -> Job:
    target = folder / "compensated" / name
    return Job(name, target, Request(program=folder / name, output=target, force="", **options))
