"""What is told of a program besides the motions that are refused."""

from __future__ import annotations

import numpy as np

from postproc.arrays import Bools, Ints
from postproc.dialects.dialect import Settings
from postproc.dialects.gcode.blocks import AXES, Blocks
from postproc.dialects.gcode.control import Group, Once
from postproc.dialects.gcode.flow import CALLS, Doubt
from postproc.dialects.gcode.judging import code_name
from postproc.dialects.gcode.refusals import HELP
from postproc.dialects.gcode.words import How, key
from postproc.document import Document
from postproc.findings import Finding


def told(
    document: Document, given: Blocks, noted: dict[str, Bools], rows: Ints, named: bool, settings: Settings
) -> list[Finding]:
    """Findings that belong to no motion; ``rows``: blocks of the motions; ``named``: the program names a tool."""
    blocks, modal, words = given.text.blocks, given.modal, given.text.words
    findings: list[Finding] = []
    live = modal.flow.tape & (modal.flow.doubt != Doubt.ENDED)

    def tell(where: Bools, code: str, message: str) -> None:
        at = np.flatnonzero(where & live)
        if len(at):
            many = (
                f"; {len(at)} blocks, lines {blocks.line[at[0]]} to {blocks.line[at[-1]]}"
                if len(at) > 1
                else ""
            )
            findings.append(
                Finding(code, message + many, str(document.path), int(blocks.line[at[0]]), 1, HELP[code])
            )

    none = np.zeros(len(given), np.bool_)
    motion = given.motion
    text = noted.get("unknown", none) & ~motion
    if text.any():
        said = next(note.text for note in given.text.notes if note.kind == "unknown" and text[note.block])
        tell(text, "GCO001", f"not understood: {said!r}")
    strange = np.flatnonzero((modal.unknown >= 0) & ~motion & live)
    for value in np.unique(np.nan_to_num(words.value[modal.unknown[strange]], nan=-1.0))[:100].tolist():
        same = none.copy()
        same[strange] = np.nan_to_num(words.value[modal.unknown[strange]], nan=-1.0) == value
        tell(same, "GCO001", f"{code_name(value)} is not known here")
    calls = none.copy()
    calls[words.block[np.flatnonzero((words.key == key("M")) & np.isin(words.value, CALLS))]] = True
    tell(calls | modal.has(Once.CALL) | noted.get("call", none), "GCO007", "calls code that was not read")
    setting = modal.has(Once.SETTING) & given.has(*AXES, key("L"), key("P"), key("R"))
    tell(setting, "GCO024", "the program writes offsets or tools")
    if not len(rows):
        return findings
    units = np.isin(words.value, (20, 21, 70, 71, 700, 710)) & (words.key == key("G"))
    first = none.copy()
    first[rows[0]] = True
    if not units.any():
        tell(first, "GCO020", "no code says mm or inch; mm is taken")
    if not named:
        tell(first, "GCO021", "the program names no tool; tool 1 of the cell is taken")
    if settings.integer_words == "um" and not given.control.increments:
        whole = none.copy()
        hows = np.stack([given.how(axis) for axis in AXES[:3]], axis=1) == How.INTEGER
        whole[rows] = hows[rows].any(axis=1)
        tell(whole, "GCO022", f"words without a decimal point are mm or inch in {given.control.name}")
    height, tool = given.number(key("H")), given.number(key("T"))
    at = np.maximum.accumulate(np.where(given.of(key("T")) >= 0, np.arange(len(given)), -1))
    loaded = np.where(at >= 0, tool[np.maximum(at, 0)], np.nan)
    other = (height > 0) & (modal.force[Group.LENGTH] == 1) & (height != loaded) & np.isfinite(loaded)
    tell(other, "GCO023", "H is of another number than the tool; the length of the cell's tool is taken")
    return findings
