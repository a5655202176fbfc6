"""What is told of a program besides the motions that are refused."""

from __future__ import annotations

import numpy as np

from postproc.arrays import Bools, Ints
from postproc.dialects.dialect import Settings
from postproc.dialects.gcode.blocks import AXES, SECOND, Blocks
from postproc.dialects.gcode.control import Group, Once
from postproc.dialects.gcode.flow import CALLS, Doubt
from postproc.dialects.gcode.judging import code_name
from postproc.dialects.gcode.refusals import HELP
from postproc.dialects.gcode.words import How, key
from postproc.document import Document
from postproc.findings import Finding


def told(
    document: Document, given: Blocks, rows: Ints, loaded: Ints, named: bool, settings: Settings
) -> list[Finding]:
    """Findings that belong to no motion; ``rows``: blocks of the motions; loaded (B,): number of the
    tool in force; ``named``: the program names one."""
    blocks, modal = given.source.blocks, given.modal
    findings: list[Finding] = []
    live = modal.flow.tape & (modal.flow.doubt != Doubt.ENDED)

    def tell(where: Bools, code: str, message: str) -> None:
        tell_at(np.flatnonzero(where), code, message)

    def tell_at(at: Ints, code: str, message: str) -> None:
        at = at[live[at]]
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
    text = given.noted("unknown") & ~motion
    if text.any():
        said = next(note.text for note in given.source.notes if note.kind == "unknown" and text[note.block])
        tell(text, "GCO001", f"not understood: {said[:60]!r}")
    strange = modal.strange.block[~motion[modal.strange.block] & live[modal.strange.block]]
    codes = np.nan_to_num(modal.strange.last(strange), nan=-1.0)
    for value in np.unique(codes)[:100].tolist():
        tell_at(strange[codes == value], "GCO001", f"{code_name(value)} is not known here")
    calls, m = none.copy(), given.words(key("M"))
    calls[m.block[np.isin(m.value, CALLS)]] = True
    tell(calls | modal.has(Once.CALL) | given.noted("call"), "GCO007", "calls code that was not read")
    setting = modal.has(Once.SETTING) & given.has(*AXES, key("L"), key("P"), key("R"))
    tell(setting, "GCO024", "the program writes offsets or tools")
    tell(
        given.noted("base"),
        "GCO024",
        "the program writes a work offset; the cell's base of its number is taken",
    )
    named_tools: dict[str, list[int]] = {}
    for note in given.source.notes:
        if note.kind == "tool":
            named_tools.setdefault(note.text, []).append(note.block)
    for name, at in named_tools.items():
        tell_at(np.unique(at), "SIN001", name)
    if not len(rows):
        return findings
    first = none.copy()
    first[rows[0]] = True
    if not (modal.units & modal.flow.tape).any():
        tell(first, "GCO020", "no code says mm or inch; mm is taken")
    if not named:
        tell(first, "GCO021", "the program names no tool; tool 1 of the cell is taken")
    if settings.integer_words == "um" and not given.control.increments:
        whole = none.copy()
        hows = np.stack([given.how(axis) for axis in AXES[:3]], axis=1) == How.INTEGER
        whole[rows] = hows[rows].any(axis=1)
        tell(whole, "GCO022", f"words without a decimal point are mm or inch in {given.control.name}")
    height = given.number(key("H"))
    other = (height > 0) & (modal.force[Group.LENGTH] == 1) & (height != loaded) & (loaded > 0)
    tell(other, "GCO023", "H is of another number than the tool; the length of the cell's tool is taken")
    if given.control.further:
        tell(
            _further(given),
            "GCO026",
            "axes beside X, Y, Z and the rotary axes move; they are taken as carrying nothing",
        )
    return findings


def _further(given: Blocks) -> Bools:
    """(B,) the first block in which an axis beside those that are read is not where it was first."""
    moving = np.zeros(len(given), np.bool_)
    for one, column in given.source.columns.items():
        named = one % 256 in _LETTERS and one < 1 << 14 and one not in given.columns and one >= 256
        if named or one in SECOND:
            away = column.block[column.value != column.value[0]]
            moving[away[:1]] = True
    return moving


_LETTERS = frozenset(key(one) for one in "XYZABCUVWEQ")
