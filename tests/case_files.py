"""Case files of a language: programs beside their dumps, and bad ones whose first line states their findings."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from postproc.base.document import Document
from postproc.languages import DIALECTS
from postproc.languages.dialect import Dialect, Program, ReadingSettings


@dataclass(frozen=True)
class CaseFiles:
    """Those of a language whose programs are one file.  codes: the letters of its finding codes; ``without``: codes
    that no case can have, which only a writer gives, or a program that is too long for a case; ``least``: how many
    cases there are; ``unclaimed``: the name of one that no language claims."""

    name: str
    suffix: str
    codes: str
    without: frozenset[str]
    least: int
    unclaimed: str = ""

    @property
    def dialect(self) -> Dialect:
        return DIALECTS[self.name]

    @property
    def folder(self) -> Path:
        return Path(__file__).parent / "programs" / self.name

    @property
    def good(self) -> list[Path]:
        return sorted(self.folder.glob(f"*{self.suffix}"))

    @property
    def bad(self) -> list[Path]:
        return sorted((self.folder / "bad").glob(f"*{self.suffix}"))

    def read(self, raw: bytes | str, settings: ReadingSettings | None = None) -> Program:
        raw = raw if isinstance(raw, bytes) else raw.encode("latin-1")
        document = Document(Path(f"part{self.suffix}"), raw)
        return self.dialect.read((document,), settings or ReadingSettings())

    def expected(self, path: Path) -> list[str]:
        """The finding codes that a bad case states."""
        return path.read_text("latin-1").splitlines()[0].removeprefix("! ").split()


RAPID_CASES = CaseFiles("rapid", ".mod", "RAP", frozenset(["RAP015", "RAP017"]), 60)
TP_CASES = CaseFiles("tp", ".ls", "FTP", frozenset(["FTP015", "FTP021"]), 70, "no_main")


def refusals(program: Program) -> dict[int, str]:
    """Row -> code of why it is not corrected."""
    return {row: finding.code for row, finding in program.toolpath.constraints.refused.items()}
