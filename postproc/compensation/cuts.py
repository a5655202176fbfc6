"""Cuts: the runs of motions between two air moves.  They are corrected whole or not at all."""

from __future__ import annotations

import re
from collections.abc import Mapping

import numpy as np

from postproc.arrays import Bools, Ints
from postproc.findings import Finding
from postproc.toolpath import Toolpath

_SWITCH = re.compile(r"COMPENSATE\s+(ON|OFF)(?![A-Z0-9_])", re.IGNORECASE)


def cuts_of(in_scope: Bools, runs: Bools | None = None) -> Ints:
    """(N,) number of the cut that a motion belongs to, from 0; -1 for motions outside of any.

    ``in_scope`` (N,): the motion carries force.  ``runs`` (N,): as of a Toolpath; where it changes another cut begins.
    """
    begins = in_scope & ~np.concatenate([[False], in_scope[:-1]])
    if runs is not None:
        begins[1:] |= in_scope[1:] & (runs[1:] != runs[:-1])
    return np.where(in_scope, np.cumsum(begins, dtype=np.int32) - 1, -1)


def spread(blocked: Bools, cut: Ints) -> Bools:
    """(N,) motions whose cut holds a blocked motion."""
    if not blocked.any():
        return np.zeros_like(blocked)
    struck = np.zeros(cut.max(initial=-1) + 2, bool)
    struck[cut[blocked]] = True
    struck[-1] = False  # the entry that -1 points to
    return struck[cut]


def switched_on(toolpath: Toolpath) -> Bools:
    """(N,) what ``COMPENSATE OFF`` / ``COMPENSATE ON`` comments say; a motion before the first of them is on."""
    on = np.ones(len(toolpath), bool)
    for note in toolpath.annotations:
        if found := _SWITCH.match(note.text.strip()):
            on[note.row :] = found[1].upper() == "ON"
    return on


def switch_findings(file: str, toolpath: Toolpath) -> list[Finding]:
    """The comments that begin with COMPENSATE and switch nothing."""
    return [
        Finding(
            "COR011",
            f"{note.text.strip()[:60]!r} is neither COMPENSATE OFF nor COMPENSATE ON; it was not used",
            file,
            note.line,
        )
        for note in toolpath.annotations
        if note.text.strip().upper().startswith("COMPENSATE") and not _SWITCH.match(note.text.strip())
    ]


def left_findings(file: str, toolpath: Toolpath, cut: Ints, why: Mapping[int, Finding]) -> list[Finding]:
    """One finding for every cut that is left as it was, with the first reason in it."""
    findings = []
    inside = np.flatnonzero(cut >= 0)
    bounds = np.searchsorted(cut[inside], np.arange(cut.max(initial=-1) + 2))
    told = -1
    for row in sorted(why):
        if cut[row] <= told:  # of another cut it would be a larger number
            continue
        told = int(cut[row])
        first, last = inside[bounds[told]], inside[bounds[told + 1] - 1]
        reason = why[row]
        place = f"line {toolpath.line[row]}: " if toolpath.line[row] else ""
        findings.append(
            Finding(
                "COR003",
                f"the cut of lines {toolpath.line[first]} to {toolpath.line[last]}"
                f" ({bounds[told + 1] - bounds[told]} motions)"
                f" is left as it was; {place}{reason.code} {reason.message}",
                file,
                int(toolpath.line[first]),
                help=reason.help,
            )
        )
    return findings
