"""The result of a batch: one outcome per program, and the worst of them."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import Any

from postproc.base.dataclass import dataclass
from postproc.base.findings import SEVERITIES, Finding
from postproc.report.result import Columns, Result, columns_of
from postproc.report.result_keys import complete_result

DONE, UNCHANGED, FAILED, NOT_RUN = "done", "unchanged", "failed", "not run"
STATES = (DONE, UNCHANGED, FAILED, NOT_RUN)
"""``unchanged``: done by an earlier run, and nothing of it has changed since; ``not run``: the batch was stopped."""

RANKS = (0, 3, 1)
"""Exit codes from the best to the worst."""

WORDS_OF_SUMMARY = (
    "program",
    "dialect",
    "robot",
    "motions",
    "corrected",
    "inserted",
    "uncorrected",
    "force",
    "error_before_mm",
    "error_after_mm",
    "correction_mm",
    "gain",
    "tolerance_mm",
    "verdict",
    "findings",
    "outputs",
    "exit",
)
"""Keys of a program's own result that the summary repeats; all others are in its report."""


@dataclass(frozen=True)
class Outcome:
    """One program of a batch.  ``result``: its machine-readable result; ``seconds``: what it took here, this time."""

    name: str
    state: str
    result: Mapping[str, Any]
    seconds: float = 0.0

    @property
    def exit(self) -> int:
        return int(self.result["exit"])

    @property
    def outputs(self) -> tuple[Path, ...]:
        return tuple(Path(path) for path in self.result["outputs"])

    @cached_property
    def findings(self) -> tuple[Finding, ...]:
        return tuple(
            Finding(**{key: value for key, value in one.items() if key != "severity"})
            for one in self.result["findings"]
        )

    @property
    def gravest(self) -> Finding | None:
        """The first finding of the gravest severity, of those that need review."""
        order = [finding for finding in self.findings if finding.severity != SEVERITIES[0]]
        return max(order, key=lambda one: SEVERITIES.index(one.severity), default=None)

    def figure(self, key: str, of: str = "max") -> float | None:
        """A figure of ``error_before_mm`` and its like; None where there is none."""
        spread = self.result.get(key)
        return spread.get(of) if spread else None

    def number(self, key: str) -> str:
        """A number of the result as it was stated; ``-`` where nothing was written."""
        value = self.result.get(key)
        return "-" if value is None else f"{value:g}"

    @property
    def verdict(self) -> str:
        """The verdict in words; ``-`` where nothing was written."""
        return str(self.result.get("verdict") or "-").replace("_", " ")

    def output_ending(self, *endings: str) -> Path | None:
        """The output with the first of ``endings`` that there is."""
        for ending in endings:
            for path in self.outputs:
                if path.name.endswith(ending):
                    return path
        return None

    def as_json(self) -> dict[str, object]:
        return {
            "name": self.name,
            "state": self.state,
            **{key: self.result[key] for key in WORDS_OF_SUMMARY if key in self.result},
        }


@dataclass(frozen=True, repr=False)
class Batched(Result):
    """A batch.  ``root``: the folder of its results; ``outputs``: the files of its summary; ``skipped_files``:
    that match and are no programs; ``seconds``: of the run."""

    headline = ("done", "unchanged", "failed", "not_run", "exit")

    root: Path
    outcomes: tuple[Outcome, ...]
    outputs: tuple[str, ...] = ()
    skipped_files: tuple[str, ...] = ()
    seconds: float = 0.0

    @property
    def exit(self) -> int:
        """As for the worst of its programs: 1 over 3 over 0."""
        return max((outcome.exit for outcome in self.outcomes), key=RANKS.index, default=0)

    @property
    def counts(self) -> dict[str, int]:
        """State -> programs, of all states."""
        by_state = Counter(outcome.state for outcome in self.outcomes)
        return {state: by_state[state] for state in STATES}

    def table(self) -> Columns:
        """One row a program: name, state, figures [mm], verdict, exit."""
        rows = []
        for outcome in self.outcomes:
            figures = {
                f"{key.removesuffix('_mm')}_max_mm": outcome.figure(key)
                for key in ("error_before_mm", "error_after_mm", "correction_mm")
            }
            plain = {
                key: outcome.result.get(key) for key in ("motions", "corrected", "uncorrected", "verdict")
            }
            rows.append(
                {"name": outcome.name, "state": outcome.state, **plain, **figures, "exit": outcome.exit}
            )
        return columns_of(rows)

    def as_json(self) -> dict[str, object]:
        """The machine-readable result; the keys are public.  It states no times: the same run gives the same result."""
        counts = {state.replace(" ", "_"): count for state, count in self.counts.items()}
        result = {
            **counts,
            "programs": [outcome.as_json() for outcome in self.outcomes],
            "skipped_files": list(self.skipped_files),
            "outputs": list(self.outputs),
            "exit": self.exit,
        }
        return complete_result("batch", result)


def not_run(name: str, program: str) -> Outcome:
    """The outcome of a program that was not started or not completed."""
    return Outcome(name, NOT_RUN, {"program": program, "findings": [], "outputs": [], "exit": 1})


def summary_json(batched: Batched) -> bytes:
    return (json.dumps(batched.as_json(), indent=2, allow_nan=False) + "\n").encode()
