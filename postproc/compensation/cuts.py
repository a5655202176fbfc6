"""Cuts: the runs of motions between two air moves.  They are corrected whole or not at all."""

from __future__ import annotations

import re
from collections.abc import Mapping

import numpy as np

from postproc.base.arrays import Bools, Ints
from postproc.base.findings import Finding
from postproc.toolpath import Toolpath
from postproc.toolpath.meant_comments import meant_as_switch

_SWITCH = re.compile(r"COMPENSATE\s+(ON|OFF)(?![A-Z0-9_])", re.IGNORECASE)


def number_cuts(in_scope: Bools, continues: Bools | None = None) -> Ints:
    """(N,) number of the cut that a motion belongs to, from 0; -1 for motions outside of any.

    ``in_scope`` (N,): the motion carries force.  ``continues`` (N,): as of a Toolpath; a motion without starts a cut.
    """
    starts = in_scope & ~np.concatenate([[False], in_scope[:-1]])
    if continues is not None:
        starts |= in_scope & ~continues
    return np.where(in_scope, np.cumsum(starts, dtype=np.int32) - 1, -1)


def spread_over_cuts(blocked: Bools, cut: Ints) -> Bools:
    """(N,) motions whose cut holds a ``blocked`` (N,) motion; ``cut`` (N,) the number of the cut, -1 in none."""
    return np.isin(cut, cut[blocked & (cut >= 0)])


def feed_motions(toolpath: Toolpath) -> Bools:
    """(N,) what ``COMPENSATE OFF`` / ``COMPENSATE ON`` comments state; a motion before the first of them is on."""
    on = np.ones(len(toolpath), bool)
    for note in toolpath.annotations:
        if match := _SWITCH.match(note.text.strip()):
            on[note.row :] = match[1].upper() == "ON"
    return on


def switch_findings(file: str, toolpath: Toolpath) -> list[Finding]:
    """The comments that start with COMPENSATE, or a misspelling of it, and switch nothing."""
    notes = [
        *(note for note in toolpath.annotations if note.text.strip().upper().startswith("COMPENSATE")),
        *(note for note in toolpath.comments if meant_as_switch(note.text)),
    ]
    return [
        Finding(
            "COR011",
            f"{note.text.strip()[:60]!r} is neither COMPENSATE OFF nor COMPENSATE ON; it is ignored",
            file,
            note.line,
        )
        for note in notes
        if not _SWITCH.match(note.text.strip())
    ]


def uncorrected_findings(
    file: str, toolpath: Toolpath, cut: Ints, why: Mapping[int, Finding]
) -> list[Finding]:
    """One finding for every cut (``cut`` (N,), -1 in none) that is not changed, with the first reason in it."""
    findings = []
    inside, reason_rows = np.flatnonzero(cut >= 0), np.array(sorted(why), int)
    reason_rows = reason_rows[cut[reason_rows] >= 0]
    reason_rows = reason_rows[np.unique(cut[reason_rows], return_index=True)[1]]  # the first of each cut
    start, stop = (np.searchsorted(cut[inside], cut[reason_rows], side) for side in ("left", "right"))
    for row, first, last, count in zip(
        reason_rows.tolist(), inside[start], inside[stop - 1], stop - start, strict=True
    ):
        reason = why[row]
        place = f"line {toolpath.line[row]}: " if toolpath.line[row] else ""
        findings.append(
            Finding(
                "COR003",
                f"the cut of lines {toolpath.line[first]} to {toolpath.line[last]} ({count} motions)"
                f" is not corrected; {place}{reason.code} {reason.message}",
                file,
                int(toolpath.line[first]),
                help=reason.advice,
            )
        )
    return findings
