"""python -m tests.understood [--codes] [--cell CELL] [--config-dat FILE] PATH ...: which share of the feed motions of
G-code and KRL programs is understood.

A feed motion is understood where its target, its work offset and its tool are known, and its path if it is an arc; it
is correctable where no finding refuses it besides.  Prints a line a file and, with ``--codes``, why the others are
not; then the share of all motions and the mean over the files.  Without a path: the programs of ``posted_programs``.
A cell says what only the controller knows (``symbols:``, ``program_start:``), of KRL too.
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from postproc.base.document import Document
from postproc.cell import Cell, load_cell
from postproc.languages.dialect import ReadingSettings
from postproc.languages.gcode import DIALECTS
from postproc.languages.krl import KrlDialect
from postproc.toolpath import Kind
from postproc.workflows.preparation import read_program

from .posted_programs import posted_programs


@dataclass(frozen=True)
class Understood:
    """Counts of the feed motions of a program; reasons: "code message" -> count of those that are not understood."""

    name: str
    motions: int
    understood: int
    correctable: int
    reasons: Counter[str]

    @property
    def share(self) -> float:
        return self.understood / self.motions


def count_understood(
    path: Path, raw: bytes, cell: Cell | None = None, config_dat: Path | None = None
) -> Understood | None:
    """The counts of a program; None where neither G-code nor KRL claims it, or it has no feed motion."""
    dialect = next((one for one in (*DIALECTS, KrlDialect()) if one.claims(path, raw)), None)
    if dialect is None or path.suffix.lower() == ".dat":
        return None
    if cell is not None or dialect.name == "krl":
        toolpath = read_program(path, cell, config_dat)[1].toolpath
    else:
        toolpath = dialect.read((Document(path, raw),), ReadingSettings(orientation=np.zeros(3))).toolpath
    feed = np.flatnonzero(~np.isin(toolpath.kind, (Kind.PTP, Kind.AXIS)))
    if not len(feed):
        return None
    # what a partial point inherits from an axis motion is where that leads
    inherits = toolpath.partial_targets.inherits_from_row >= 0
    known = toolpath.known | (inherits & (toolpath.base >= 0) & (toolpath.tool >= 0))
    refused = toolpath.constraints.refused
    reasons: Counter[str] = Counter()
    correctable = 0
    for row in feed.tolist():
        if not known[row]:
            finding = refused.get(row)
            text = "no finding" if finding is None else f"{finding.code} {finding.message}"
            reasons[text] += 1
        correctable += bool(known[row]) and row not in refused
    return Understood(path.name, len(feed), int(known[feed].sum()), correctable, reasons)


def files(paths: list[Path]) -> Iterator[tuple[Path, bytes]]:
    for path in paths:
        for file in sorted(path.rglob("*")) if path.is_dir() else [path]:
            if file.is_file():
                yield file, file.read_bytes()


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m tests.understood", description=__doc__)
    parser.add_argument("paths", nargs="*", type=Path)
    parser.add_argument("--codes", action="store_true", help="why motions are not understood, a file")
    parser.add_argument("--cell", type=Path, help="a cell file that binds names and states the start")
    parser.add_argument("--config-dat", type=Path, help="the controller's $config.dat")
    options = parser.parse_args()
    cell = None if options.cell is None else load_cell(options.cell)
    programs = files(options.paths) if options.paths else posted_programs()
    read = ((path, count_understood(path, raw, cell, options.config_dat)) for path, raw in programs)
    counts = [one for _, one in read if one is not None]
    for one in counts:
        correctable = one.correctable / one.motions
        print(
            f"{one.share:6.1%} understood {correctable:6.1%} correctable {one.motions:7d} motions  {one.name}"
        )
        for reason, many in one.reasons.most_common(6 if options.codes else 0):
            print(f"        {many:6d}  {reason}")
    if counts:
        motions = sum(one.motions for one in counts)
        understood, correctable = (
            sum(getattr(one, name) for one in counts) for name in ("understood", "correctable")
        )
        print(
            f"{len(counts)} programs, {motions} feed motions: {understood / motions:.1%} understood,"
            f" {correctable / motions:.1%} correctable; mean over the programs"
            f" {np.mean([one.share for one in counts]):.1%}"
        )


if __name__ == "__main__":
    main()
