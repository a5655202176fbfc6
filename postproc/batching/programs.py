"""Which programs a word names: a file, a folder, or a pattern with * ? [ ] **."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

from postproc.base.findings import Finding
from postproc.cell import NAME as CELL
from postproc.languages import DIALECTS

HEAD = 1 << 16
"""Bytes of a file by which its language is looked for."""

RESULTS = "compensated"
"""Folders of this name hold results of the main job; a pattern enters them only where it names them."""

_MAGIC = frozenset("*?[")


@dataclass(frozen=True)
class ProgramMatches:
    """What a word names.  ``anchor``: the folder below which it was looked for; ``passed_over``: files that match and
    are of no known language, nor belong to a program.  Paths are absolute and in order."""

    anchor: Path
    programs: tuple[Path, ...]
    passed_over: tuple[Path, ...] = ()

    def nothing(self, word: str) -> Finding:
        """Why there is no program."""
        if self.passed_over:
            known = ", ".join(DIALECTS)
            message = f"{word!r}: {len(self.passed_over)} files match, but none is a program ({known})"
        else:
            message = f"{word!r} matches nothing in {self.anchor}"
        return Finding(
            "BAT001", message, help="`**/` in a pattern includes the folders below; a folder alone does not"
        )


def is_inside(path: Path, folder: Path) -> bool:
    """Whether ``path`` lies in ``folder`` or below, links followed."""
    return Path(os.path.realpath(path)).is_relative_to(os.path.realpath(folder))


def find_programs(word: str, folder: Path) -> ProgramMatches:
    """The programs that ``word`` names, relative to ``folder``.

    A file counts whatever it holds; of a folder or a pattern those that a dialect claims.
    """
    path = Path(os.path.abspath(folder / word))
    if os.path.isfile(path):
        return ProgramMatches(path.parent, (path,))
    if os.path.isdir(path):
        return _claimed(path, [entry for entry in path.iterdir() if not entry.name.startswith(".")])
    fixed = next((i for i, part in enumerate(path.parts) if _MAGIC & set(part)), len(path.parts) - 1)
    anchor, pattern = Path(*path.parts[:fixed]), path.parts[fixed:]
    try:
        matches = list(anchor.glob("/".join(pattern))) if os.path.isdir(anchor) else []
    except (ValueError, OSError):  # ** beside other characters, a name that is too long
        matches = []
    return _claimed(anchor, [match for match in matches if not _hidden(match.relative_to(anchor), pattern)])


def _hidden(match: Path, pattern: tuple[str, ...]) -> bool:
    """Whether a match lies in a folder that has to be named to be meant."""
    parts = set(match.parts[:-1]) - set(pattern)
    return any(part.startswith(".") or part == RESULTS for part in parts) or match.name.startswith(".")


def _claimed(anchor: Path, paths: list[Path]) -> ProgramMatches:
    programs: list[Path] = []
    others: list[Path] = []
    for path in sorted(paths):
        if os.path.isfile(path):
            (programs if is_program(path) else others).append(path)
    known = {path.with_suffix("") for path in programs}
    return ProgramMatches(
        anchor, tuple(programs), tuple(path for path in others if not _belongs(path, known))
    )


def _belongs(path: Path, programs: set[Path]) -> bool:
    """Whether a file is no program because it belongs to one, as a force CSV does, or is the cell."""
    return path.name == CELL or path.with_name(path.name.partition(".")[0]) in programs


NO_PROGRAMS = frozenset(
    f".{suffix}"
    for suffix in ("py", "md", "html", "json", "yaml", "yml", "csv", "diff", "svg", "png", "pdf", "log")
)
"""Suffixes of files that may quote a program and are none."""


def is_program(path: Path) -> bool:
    """Whether a dialect claims a file; one that cannot be read counts: whoever compensates it states what is wrong."""
    if path.suffix.lower() in NO_PROGRAMS:
        return False
    try:
        with path.open("rb") as stream:
            head = stream.read(HEAD)
    except OSError:
        return True  # whoever compensates it states what is wrong
    return any(dialect.claims(path, head) for dialect in DIALECTS.values())
