"""The result of ``compensate check``."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from typing import Any

import numpy as np

from postproc.base.dataclass import dataclass
from postproc.base.findings import CODES, Finding
from postproc.base.geometry import abc_from_rotation
from postproc.base.units import DEG, MM
from postproc.languages.dialect import Program
from postproc.report.report import exit_code, in_order_of_place
from postproc.report.result import Columns, Result
from postproc.report.result_keys import complete_result
from postproc.toolpath import Kind, Toolpath


@dataclass(frozen=True, repr=False)
class Checked(Result):
    """A program that was read."""

    headline = ("program", "dialect", "motions", "exit")

    program: Program

    @property
    def toolpath(self) -> Toolpath:
        return self.program.toolpath

    @property
    def findings(self) -> tuple[Finding, ...]:
        return in_order_of_place(self.program.findings)

    @property
    def exit(self) -> int:
        return 3 if exit_code(self.findings) else 0

    @property
    def kinds(self) -> dict[str, int]:
        return {
            Kind(kind).name: count for kind, count in sorted(Counter(self.toolpath.kind.tolist()).items())
        }

    @property
    def refused(self) -> dict[str, int]:
        """Code -> number of motions that cannot be corrected for this reason."""
        return dict(
            sorted(Counter(finding.code for finding in self.toolpath.constraints.refused.values()).items())
        )

    def summary(self) -> Iterator[str]:
        total, refused = len(self.toolpath), sum(self.refused.values())
        kinds = ", ".join(f"{count} {name}" for name, count in self.kinds.items())
        yield f"{total} motions{f' ({kinds})' if kinds else ''}: {total - refused} can be corrected, {refused} not"
        for code, count in self.refused.items():
            yield f"  {count} x {code} {CODES[code].title}"

    def table(self) -> Columns:
        """One row a motion: line, kind, x_mm y_mm z_mm, a_deg b_deg c_deg (KUKA's A, B, C), feed_mm_min; NaN where it
        is not known."""
        path = self.toolpath
        columns: dict[str, Any] = {
            "line": path.line.copy(),
            "kind": np.array([kind.name for kind in Kind])[path.kind],
        }
        for names, values in (("xyz", path.position / MM), ("abc", abc_from_rotation(path.rotation) / DEG)):
            unit = "mm" if names == "xyz" else "deg"
            columns |= {f"{name}_{unit}": column for name, column in zip(names, values.T, strict=True)}
        return {**columns, "feed_mm_min": path.feed / MM * 60.0}

    def as_json(self) -> dict[str, object]:
        result = {
            "program": str(self.program.documents[0].path),
            "dialect": self.program.dialect,
            "files": [str(document.path) for document in self.program.documents],
            "motions": len(self.toolpath),
            "kinds": self.kinds,
            "refused": self.refused,
            "findings": [finding.as_json() for finding in self.findings],
            "exit": self.exit,
        }
        return complete_result("check", result)
