"""The summary of a batch as a page: one row a program, with a link to its report."""

from __future__ import annotations

import os
from pathlib import Path
from urllib.parse import quote

from postproc.base.system import relative_path
from postproc.report.batched import DONE, FAILED, NOT_RUN, UNCHANGED, Batched, Outcome
from postproc.report.formatting import count, in_decimals
from postproc.report.page import FINDINGS, finding_rows, rendered
from postproc.report.page_words import printed

_SIGNS = {
    DONE: ("", "✓", "done"),
    UNCHANGED: ("", "=", "unchanged"),
    FAILED: ("error", "x", "failed"),
    NOT_RUN: ("warning", "–", "not run"),
}


def batch_page(batched: Batched) -> bytes:
    """The page of a batch, in its root folder.  It states no times: the same run gives the same bytes."""
    failures = [finding for outcome in batched.outcomes if outcome.exit == 1 for finding in outcome.findings]
    return rendered(
        "batch.html.j2",
        title=printed("/".join(batched.root.parts[-2:])),
        what="batch",
        verdict=_verdict(batched),
        badge=_badge(batched),
        rows=[_row(outcome, batched.root) for outcome in batched.outcomes],
        findings=finding_rows(failures),
        more_findings=max(0, len(failures) - FINDINGS),
        goes=False,
        skipped_files=[printed(path) for path in batched.skipped_files],
        links=[("result (JSON)", "summary.json", "./summary.json")],
    )


def _badge(batched: Batched) -> tuple[str, str, str]:
    if batched.exit == 1:
        return "bad", "✗", "not all programs done"
    return ("look", "!", "needs review") if batched.exit else ("good", "✓", "done")


def _verdict(batched: Batched) -> str:
    """One sentence: how many, how they ended, the worst before and after."""
    counts = batched.counts
    whole = count(len(batched.outcomes), "program")
    well = counts[DONE] + counts[UNCHANGED]
    written = "is" if len(batched.outcomes) == 1 else "are"
    words = (
        f"{whole} {written} written" if well == len(batched.outcomes) else f"{well} of {whole} are written"
    )
    parts = [
        f"{counts[state]} {word}"
        for state, word in ((FAILED, "failed"), (NOT_RUN, "not run"))
        if counts[state]
    ]
    look = sum(outcome.exit == 3 for outcome in batched.outcomes)
    if look:
        parts.append(f"{look} need{'s' if look == 1 else ''} review")
    text = "; ".join([words, *parts]) + "."
    if counts[UNCHANGED]:
        text += f" {counts[UNCHANGED]} of them by an earlier run, unchanged since."
    before, after = (
        max(
            (value for outcome in batched.outcomes if (value := outcome.figure(key)) is not None),
            default=None,
        )
        for key in ("error_before_mm", "error_after_mm")
    )
    if before is not None and after is not None:
        text += f" The largest predicted error of all programs is {before:.3f} mm before and {after:.4f} mm after."
    return text


def _row(outcome: Outcome, root: Path) -> dict[str, object]:
    gravest = outcome.gravest
    state = _SIGNS[outcome.state]
    if outcome.exit == 3:
        state = ("warning", "!", f"{state[2]}, needs review")
    report = outcome.output_ending(".report.html", ".report.json")
    diff = outcome.output_ending(".diff")
    return {
        "name": printed(outcome.name),
        "state": state,
        "report": _address(report, root),
        "diff": _address(diff, root),
        **{key: outcome.result.get(key, "–") for key in ("motions", "corrected", "uncorrected")},
        "before": in_decimals(outcome.figure("error_before_mm"), 3, "–"),
        "after": in_decimals(outcome.figure("error_after_mm"), 4, "–"),
        "tolerance": outcome.number("tolerance_mm"),
        "gain": outcome.number("gain"),
        "correction": in_decimals(outcome.figure("correction_mm"), 3, "–"),
        "verdict": outcome.verdict,
        "finding": "" if gravest is None else f"{gravest.code} {printed(gravest.message)}",
    }


def _address(path: Path | None, root: Path) -> str:
    """A relative address; a colon or a percent sign in a name is no part of it."""
    if path is None:
        return ""
    seen = Path(relative_path(path, root))
    return seen.as_uri() if seen.is_absolute() else "./" + quote(os.fsencode(seen.as_posix()))
