"""What is reported of a program besides the motions that are refused."""

from __future__ import annotations

import numpy as np

from postproc.base.arrays import Bools, Ints
from postproc.base.document import Document
from postproc.base.findings import Finding
from postproc.languages.dialect import ReadingSettings
from postproc.languages.gcode.blocks import AXES, BlockWords
from postproc.languages.gcode.cell_options import INTEGER_WORDS
from postproc.languages.gcode.control import Group, Move, Once
from postproc.languages.gcode.correctability import UNUSED, code_name
from postproc.languages.gcode.execution_flow import CALLS, FlowReason
from postproc.languages.gcode.numbered import outdated_lengths, written_lengths
from postproc.languages.gcode.words import How, key

KNOWN_M = (
    *range(12),
    13,
    14,
    17,
    19,
    29,
    30,
    40,
    41,
    42,
    43,
    44,
    45,
    *range(48, 54),
    *range(60, 74),
    97,
    98,
    99,
)
"""Codes of programs, spindles, tools, coolants, overrides, inputs and calls, which no machine's builder defines."""


def diagnostics(
    document: Document, words: BlockWords, rows: Ints, loaded: Ints, named: bool, settings: ReadingSettings
) -> list[Finding]:
    """Findings that belong to no motion; ``rows``: blocks of the motions; loaded (B,): number of the
    tool in force; ``named``: the program names one."""
    blocks, modal = words.source.blocks, words.modal
    findings: list[Finding] = []
    live = modal.flow.tape & (modal.flow.reason != FlowReason.ENDED)

    def add(where: Bools, code: str, message: str) -> None:
        add_at(np.flatnonzero(where), code, message)

    def add_at(at: Ints, code: str, message: str) -> None:
        at = at[live[at]]
        # subprograms are after what calls them, wherever they are in the file
        at = at[np.argsort(blocks.line[at], kind="stable")]
        if len(at):
            many = (
                f"; {len(at)} blocks, lines {blocks.line[at[0]]} to {blocks.line[at[-1]]}"
                if len(at) > 1
                else ""
            )
            findings.append(Finding(code, message + many, str(document.path), int(blocks.line[at[0]]), 1))

    none = np.zeros(len(words), np.bool_)
    motion = words.motion
    text = words.noted("unknown") & ~motion
    if text.any():
        said = next(note.text for note in words.source.notes if note.kind == "unknown" and text[note.block])
        add(text, "GCO001", f"{said[:60]!r} is not understood")
    strange = modal.unknown_codes.block[~motion[modal.unknown_codes.block] & live[modal.unknown_codes.block]]
    codes = np.nan_to_num(modal.unknown_codes.last(strange), nan=-1.0)
    for value in np.unique(codes)[:100].tolist():
        add_at(strange[codes == value], "GCO001", f"{code_name(value)} is not known here")
    add(modal.unused & ~motion, "GCO001", UNUSED)
    probing = modal.has(Once.PROBE) & ~motion
    add(probing, "GCO001", "the block is a probing move without axes")
    hidden = modal.states & (words.move == Move.OTHER) & ~motion & ~probing & words.control.iso
    add(hidden, "GCO016", "the block may be a motion of the control without words of axes")
    calls, m = none.copy(), words.words(key("M"))
    calls[m.block[np.isin(m.value, CALLS[1:] if words.control.saves_modes else CALLS)]] = True
    calls |= modal.has(Once.CALL) | words.noted("call") | words.has(*words.control.calls)
    add(calls & ~modal.flow.called, "GCO007", "the block calls code that is not read")
    restored = np.flatnonzero(modal.flow.restored) - 1
    add_at(restored[restored >= 0], "GCO007", "modes come back here that are not known (M72, M73)")
    add(words.noted("cycle"), "GCO008", "the block calls a cycle of the control")
    strange_m = ~np.isin(m.value, KNOWN_M) & live[m.block]
    if strange_m.any():
        names = [f"M{value:g}" for value in np.unique(m.value[strange_m & np.isfinite(m.value)]).tolist()]
        shown = ", ".join([*names[:8], *(["..."] if len(names) > 8 else [])]) or "an M code that is computed"
        verb = "is" if len(names) < 2 else "are"
        add_at(
            np.unique(m.block[strange_m])[:1],
            "GCO028",
            f"{shown} {verb} not known here; it is assumed that no axis moves",
        )
    setting = modal.has(Once.SETTING) & words.has(*AXES, key("L"), key("P"), key("R"))
    add(setting, "GCO024", "the program writes offsets or tools")
    add(
        words.noted("base"),
        "GCO024",
        "the program writes a work offset: it is where the program states it, whatever the cell states of its number,"
        " and not known without numbers or before the program selects it again",
    )
    data = words.noted("tool data")
    data[[block for block, _ in written_lengths(words)]] = True
    add(
        data,
        "GCO024",
        "the program writes data of tools: the cell's tool of the same number is used, but for one used before it",
    )
    named_tools: dict[str, list[int]] = {}
    for note in words.source.notes:
        if note.kind == "tool":
            named_tools.setdefault(note.text, []).append(note.block)
    for name, at in named_tools.items():
        add_at(np.unique(at), "SIN001", name)
    if not len(rows):
        return findings
    uncertain = np.isin(modal.flow.reason, (FlowReason.DELETED, FlowReason.FLOW))
    ends = m.block[np.isin(m.value, [*words.control.endings]) & uncertain[m.block]]
    after = rows[(rows > ends[0]) & (modal.flow.reason[rows] == FlowReason.NONE)] if len(ends) else ends
    if len(after):
        lines = f"lines {blocks.line[after[0]]} to {blocks.line[after[-1]]}"
        add_at(ends[:1], "GCO030", f"the program may end here: the motions in {lines} may not run")
    first = none.copy()
    first[rows[0]] = True
    if not (modal.units & modal.flow.tape).any():
        add(first, "GCO020", "no code selects mm or inch; mm is assumed")
    if not named:
        add(first, "GCO021", "the program names no tool; tool 1 of the cell is assumed")
    if words.integers.message:
        whole = none.copy()
        for letter in "XYZIJKR":
            column = words.words(key(letter))
            whole[column.block[(column.how == How.INTEGER) & (column.value != 0)]] = True
        whole &= motion | modal.has(Once.CALL)
        add(whole, "GCO027", words.integers.message)
    if settings.options.get(INTEGER_WORDS) == "um" and not words.control.increments:
        whole = none.copy()
        hows = np.stack([words.how(axis) for axis in AXES[:3]], axis=1) == How.INTEGER
        whole[rows] = hows[rows].any(axis=1)
        add(whole, "GCO022", f"words without a decimal point are mm or inch in {words.control.name}")
    height = words.number(key("H"))
    other = (height > 0) & (modal.force[Group.LENGTH] == 1) & (height != loaded) & (loaded > 0)
    if words.control.offsets is not None:
        edges = words.number(words.control.offsets) > 1
        add(edges, "GCO023", "D is not the first edge of the tool; the length of the cell's tool is used")
    add(other, "GCO023", "H has another number than the tool; the length of the cell's tool is used")
    cutting = motion & ~np.isin(words.move, (Move.RAPID, Move.NOTHING)) & ~other
    message = "no G43 follows the tool change: the length of another tool is active; that of the cell's tool is used"
    add(cutting & outdated_lengths(words, loaded), "GCO023", message)
    return findings
