"""Motions whose rotary axes do not say where the tool is: which axes, since when, and what the cell may state."""

from __future__ import annotations

import numpy as np

from postproc.base.arrays import Bools, Ints
from postproc.languages.gcode.blocks import AXES, BlockWords, Reasons, What
from postproc.languages.gcode.cell_options import AT_TIP, ROTARY_WORDS, SWITCHED, TIP_ON_M, TURN_PART
from postproc.languages.gcode.control import Group
from postproc.languages.gcode.motions import GcodeMotions
from postproc.languages.gcode.positions import Positions
from postproc.languages.gcode.refusals import RefusalCollector, RefusalReason
from postproc.languages.gcode.words import key

AWAY = RefusalReason(
    "GCO013",
    "a rotary axis is not at 0, and no TCP mode is active",
    "away",
    f"state in the cell what A, B, C do: dialect: {{{ROTARY_WORDS}: {TURN_PART}}} if they turn the part and X, Y, Z do"
    f" not turn with it, {{{ROTARY_WORDS}: {AT_TIP}}} if X, Y, Z are the tool's tip",
)
BY_CODE = AWAY._replace(
    help=f"if M{TIP_ON_M} makes X, Y, Z the tool's tip and M{TIP_ON_M + 1} ends that, state it in the cell: dialect:"
    f" {{{ROTARY_WORDS}: {SWITCHED}}}"
)
OTHERS = RefusalReason(
    "GCO013", "the orientation is stated by words that only a TCP mode reads, and none is active", "others"
)
LEFT = RefusalReason(
    "GCO013",
    "the tool is along a plane that has ended, and no rotary axis states that it is back",
    "plane",
    "write the words of the rotary axes after the plane (G0 A0 C0)",
)
TILTED = RefusalReason(
    "GCO013",
    "the tool keeps the last direction of the TCP mode, and no rotary axis states where it is",
    "tilted",
    "state a direction along Z before the mode ends (A3=0 B3=0 C3=1), or write the words of the rotary axes after it",
)
UNKNOWN = RefusalReason("GCO013", "what states the orientation of the tool is not known", "unknown")


_KNOWN = -2
"""In place of the block that left an axis unknown."""


def refuse_rotary(
    words: BlockWords, moves: GcodeMotions, where: Positions, reasons: Reasons, collector: RefusalCollector
) -> None:
    """Refuses the motions of a part of the program that ``moves.tool_orientation`` calls wrong; reasons: of
    ``frame_events``."""
    wrong = moves.tool_orientation.wrong
    some = np.flatnonzero((wrong > 0) & (collector.why < 0))
    if not len(some):
        return
    rows = moves.block[some]
    used = np.array([len(words.source.column(one)) > 0 for one in AXES[3:]])
    lost = np.isnan(moves.end[some, 3:]) & used
    tcp = words.modal.force[Group.TCP][rows] == 1
    causes = np.where(lost, where.source[rows, 3:], _KNOWN)
    state = np.stack([tcp, ~tcp & _away(moves, some, used), wrong[some] == 3, wrong[some] == 4], axis=1)
    kinds, which = np.unique(np.concatenate([causes, state], axis=1), axis=0, return_inverse=True)
    messages = []
    away = BY_CODE if (words.source.column(key("M")).value == TIP_ON_M).any() else AWAY
    for *lost_at, in_tcp, is_away, left, tilted in kinds.tolist():
        if left or tilted:
            messages.append(LEFT if left else TILTED)
        elif max(lost_at) > _KNOWN:
            messages.append(_lost(words, reasons, lost_at, bool(in_tcp)))
        else:
            messages.append(UNKNOWN if in_tcp else away if is_away else OTHERS)
    collector.refuse_each(some, messages, which.reshape(-1))


def _away(moves: GcodeMotions, some: Ints, used: Bools) -> Bools:
    """(K,) motions ``some`` (K,) with a used (3,) axis that is known and not at 0, at their start or end."""
    angles = np.concatenate([moves.start[some, 3:], moves.end[some, 3:]], axis=1)
    return np.asarray((np.abs(np.nan_to_num(angles)) > 0)[:, np.tile(used, 2)].any(axis=1))


def _lost(words: BlockWords, reasons: Reasons, causes: list[int], in_tcp: bool) -> RefusalReason:
    """That axes are not known, and what the cell may state of them; causes (3,): the blocks that left A, B, C so, -1
    for none, _KNOWN where an axis is known."""
    since, advice, kinds = [], [], []
    for cause in sorted({one for one in causes if one > _KNOWN}, reverse=True):
        names = [name for name, one in zip("ABC", causes, strict=True) if one == cause]
        said, text, help_ = ", ".join(names), "", ""
        if cause < 0:
            since.append(f"{said}: never set before")
            help_ = f"state {said} under program_start: in the cell, or write {said} before it"
        else:
            number = reasons.of[cause]
            text = reasons.texts[number] if number >= 0 else ""
            codes = words.source.column(key("G")).part(cause, cause + 1).value
            leading = codes[np.isin(codes, (28.0, 30.0))]
            if len(leading):
                code = f"G{leading[-1]:.0f}"
                stated = ", ".join(f"{name}: 0" for name in names)
                help_ = f"state where {code} leads rotary axes in the cell: symbols: {{{code}: {{{stated}}}}}"
                text = f"{What.REFERENCE}, {code}"
            line = words.source.blocks.line[cause]
            since.append(f"{said}: not known since line {line}{f' ({text})' if text else ''}")
        kinds.append(f"{said} {text}")
        advice += [help_] if help_ else []
    rest = "so the tool's orientation is not known" if in_tcp else "and no TCP mode is active"
    return RefusalReason("GCO013", f"{'; '.join(since)}, {rest}", "; ".join(kinds), "; ".join(advice))
