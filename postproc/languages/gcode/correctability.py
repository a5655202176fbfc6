"""Which motions cannot be corrected, and why; and whose end points those build on."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from postproc.base.arrays import Bools, Ints
from postproc.base.byte_search import occurrences
from postproc.base.document import Document
from postproc.languages.gcode.block_arcs import unevenly_scaled
from postproc.languages.gcode.blocks import AXES, FRAMED, BlockWords, Reasons, What, framed
from postproc.languages.gcode.control import FIRST_NAME, UNKNOWN, Feed, Group, Move, Once
from postproc.languages.gcode.drill_cycles import refuse_cycles
from postproc.languages.gcode.execution import Execution
from postproc.languages.gcode.execution_flow import FlowReason
from postproc.languages.gcode.feeds import feeds_before_units
from postproc.languages.gcode.modal import decode_g_codes
from postproc.languages.gcode.motions import GcodeMotions
from postproc.languages.gcode.numbered import TOOL_CHANGE
from postproc.languages.gcode.positions import Positions
from postproc.languages.gcode.refusals import RefusalCollector, RefusalReason, Refusals
from postproc.languages.gcode.rotary_refusals import refuse_rotary
from postproc.languages.gcode.words import How, key
from postproc.toolpath import Kind

FLOW_MESSAGES = {
    FlowReason.DELETED: (
        "GCO006",
        "the block runs only sometimes: it starts with a slash, or with a condition",
    ),
    FlowReason.FLOW: (
        "GCO006",
        "the motion is in a loop, branch or subprogram: it may run many times or never",
    ),
    FlowReason.PROGRAM: (
        "GCO006",
        "the motion is in a subprogram of the file: it runs where that is called",
    ),
    FlowReason.SKIPPED: ("GCO025", "the flow of the program passes the motion: it does not run"),
    FlowReason.ENDED: ("GCO025", "the motion follows the end of the program and does not run"),
    FlowReason.COMPUTED: ("GCO005", "a G or M code before it is computed: what is active is not known"),
}
ARCS = {
    2: "the arc has no centre in its plane: I J K of the plane or R",
    3: "the radii of the arc at its start and at its end differ",
    4: "R of the arc is too short, or its end is its start",
    5: "the plane of the arc is not known",
    6: "the three points of the arc are on one line",
}
UNUSED = "a word I, J, K, L, P, Q or R belongs to no code of the block"
POSITION = re.compile(rb"#[ \t]*+(?:(?:50[0-6]\d|542\d)(?!\d)|<_(?:abs_)?[xyzabcuvw]>|#|\[)", re.I)


@dataclass(frozen=True, eq=False)
class Built:
    """Of N motions, what others build on: block (N,); kind (N,) Kind; sets, lost (N, 3): the block states X, Y, Z, or
    leaves them unknown; turned (N,): it states the orientation in force, if one is."""

    block: Ints
    kind: Ints
    sets: Bools
    lost: Bools
    turned: Bools


_WRITE = "write them in the first motion"
_LOADED = (
    "if tool {0} is loaded where the program starts, state it in the cell: program_start: {{tool: {0}}}; or write {1}"
    " in the first motion after the change"
)
NUMBERS = (*AXES, *(key(letter) for letter in "IJKR"))


def check_correctability(
    words: BlockWords,
    moves: GcodeMotions,
    where: Positions,
    base: Ints,
    tool: Ints,
    reasons: Reasons,
    unbound: str,
    collector: RefusalCollector,
) -> None:
    """Refuses motions of a part of the program.

    base, tool (N,): numbers, -1 where unknown; reasons: of ``frame_events``; unbound: what to do about names whose
    values are not known.
    """
    rows = moves.block
    refuse, modal = collector.refuse, words.modal
    force = {group: values[rows] for group, values in modal.force.items()}
    for uncertainty, (code, message) in FLOW_MESSAGES.items():
        refuse(modal.flow.reason[rows] == uncertainty, code, message)
    refuse(
        modal.flow.repeated[rows],
        "GCO006",
        "the motion runs several times: one number cannot state the targets of all",
    )
    refuse(
        np.abs(force[Group.MACRO]) == 1, "GCO007", "every block calls a macro or a cycle here (G66, MCALL)"
    )
    refuse(modal.has(Once.HOME)[rows], "GCO004", "the block leads to the reference point")
    refuse(modal.has(Once.MACHINE)[rows], "GCO004", "the block uses machine coordinates")
    refuse(modal.has(Once.PROBE)[rows], "GCO011", "the block is a probing move: its end is not known")
    _codes(words, rows, collector)
    refuse(modal.unused[rows], "GCO001", UNUSED)
    refuse(words.twice[rows], "GCO017", "a word occurs twice in the block")
    refuse(modal.twice[rows], "GCO017", "two codes of the block select different motions")
    for kind, code, message in (
        ("unknown", "GCO001", "the block is not understood"),
        ("corner", "GCO016", "the control rounds or chamfers this corner"),
        ("assign", "GCO005", "the block sets a variable"),
        ("axis", "GCO004", "the block names axes of the machine"),
        ("polar", "GCO010", "the target is stated by an angle or in polar coordinates (AP, RP, AR, ANG)"),
    ):
        refuse(words.noted(kind)[rows], code, message)
    refuse(
        np.any(words.beside[rows], axis=1) & (not words.control.further),
        "GCO016",
        "the block has U, V or W: they are further axes, or steps of a lathe",
    )
    refuse(
        words.ambiguous[rows],
        "GCO022",
        "a length without a decimal point is mm or an increment: the program has both kinds of words",
    )
    unread = np.zeros(len(words), np.bool_)
    for one in NUMBERS:
        column = words.words(one)
        unread[column.block[column.how == How.UNREAD]] = True
    turns = words.words(words.control.turns[0])
    unread[turns.block[(turns.how == How.UNREAD) & _is_arc(words.move[turns.block])]] = True
    refuse(
        unread[rows],
        "GCO005",
        "a word is an expression, a variable, a number with an exponent or far beyond the size of any machine",
        unbound,
    )
    quiet = np.isin(moves.move, (-1, Move.NOTHING))
    refuse(quiet, "GCO018", "the block has axis words, but no motion code is active")
    refuse_cycles(moves, collector)
    refuse(
        np.isin(moves.move, (Move.SPLINE, Move.THREAD, Move.OTHER)),
        "GCO016",
        "the block is a spline, a thread or another motion of the control",
    )
    refuse(
        force[Group.RADIUS] == UNKNOWN,
        "GCO009",
        "it is not known whether tool radius compensation is active, in which the contour is not the tool's path",
    )
    refuse(
        force[Group.RADIUS] != 0,
        "GCO009",
        "tool radius compensation is active: the contour is not the tool's path",
    )
    refuse(force[Group.ROUNDING] != 0, "GCO016", "RNDM is active, so the control rounds every corner")
    refuse(force[Group.SPLINE] != 0, "GCO016", "a spline leads through the targets or near them")
    refuse(force[Group.AXIAL] != 0, "GCO016", "the axes move to the target independently (PTP)")
    for group, message in FRAMED.items():
        refuse(framed(force[group]), "GCO010", f"the coordinates are {message}")
    _skewed(words, moves, where, collector)
    air = moves.kind == Kind.PTP
    refuse(
        air & (base < 0),
        "GCO003",
        "the work offset of this rapid is not known, or the program itself writes it",
    )
    refuse(air & (tool < 0), "GCO003", "this rapid has no tool, or its number or length is not known")
    _offsets_lost(words, rows[(base < 0) & ~air], np.flatnonzero((base < 0) & ~air), collector)
    refuse(base < 0, "GCO014", "the work offset is not known, or the program itself writes it")
    refuse(tool < 0, "GCO015", "no tool is loaded, or its number or length is not known")
    refuse(force[Group.UNITS] < 0, "GCO002", "mm or inch is not known")
    _positions(words, moves, where, tool, collector, reasons)
    for wrong, message in ARCS.items():
        refuse(moves.arcs.wrong == wrong, "GCO012", message)
    refuse(moves.arcs.wrong == 1, "GCO012", "the start of the arc is not known")
    centred = _is_arc(moves.move) & words.has(*(key(letter) for letter in "IJK"))[rows]
    refuse(
        centred & (force[Group.ARCS] < 0),
        "GCO012",
        "it is not known whether I J K are coordinates or differences",
    )
    refuse_rotary(words, moves, where, reasons, collector)


def _skewed(words: BlockWords, moves: GcodeMotions, where: Positions, collector: RefusalCollector) -> None:
    """Refuses motions in scaled or mirrored coordinates that need more than their places."""
    rigid = np.array([frame.rigid for frame in where.frames])
    if rigid.all():
        return
    rows, skewed = moves.block, ~rigid[where.frame[moves.block]]
    turned = (words.modal.force[Group.TCP][rows] == 1) | (moves.tool_orientation.orient >= 0)
    collector.refuse(
        skewed & ((moves.move == Move.CYCLE) | words.has(*AXES[3:])[rows] | turned),
        "GCO010",
        "the coordinates are scaled or mirrored; what that makes of a cycle or of rotary axes is not read",
    )
    collector.refuse(
        _is_arc(moves.move) & unevenly_scaled(words, rows, moves.plane, where),
        "GCO010",
        "the axes of the arc are scaled by different factors",
    )


def _offsets_lost(words: BlockWords, blocks: Ints, rows: Ints, collector: RefusalCollector) -> None:
    """Refuses motions ``rows`` (K,) in ``blocks`` (K,) whose work offset is not known since a call that is not read."""
    calls = np.flatnonzero(words.modal.flow.forget)
    at = np.searchsorted(calls, blocks, side="right") - 1
    if not (at >= 0).any():
        return
    known = np.where(words.modal.force[Group.OFFSET] >= 0, np.arange(len(words)), -1)
    some = (at >= 0) & (np.maximum.accumulate(known)[blocks] < calls[at])
    lines = words.source.blocks.line
    if not some.any():
        return
    which, number = np.unique(at[some], return_inverse=True)
    reasons = []
    for call in calls[which].tolist():
        line = lines[words.start + call - 1]
        message = f"the work offset is not known since line {line}, which calls code that is not read"
        help_ = (
            f"put the file that line {line} calls beside the program, or one with M99 alone if it moves and changes"
            " nothing; or select the offset again after it (G54)"
        )
        reasons.append(RefusalReason("GCO014", message, f"call {line}", help_))
    collector.refuse_each(rows[some], reasons, number.reshape(-1))


def _is_arc(move: Ints) -> Bools:
    return np.isin(move, (Move.CLOCKWISE, Move.COUNTER, Move.THROUGH))


def _codes(words: BlockWords, rows: Ints, collector: RefusalCollector) -> None:
    """Refuses motions in blocks with a code that is not known, by that code."""
    some = np.flatnonzero(words.modal.unknown[rows])
    if len(some):
        codes = words.modal.unknown_codes.last(rows[some], absent=-1.0)
        values, which = np.unique(np.nan_to_num(codes, nan=-1.0), return_inverse=True)
        messages = [(named := code_name(value), f"{named} is not known here") for value in values.tolist()]
        collector.refuse_each(
            some, [RefusalReason("GCO001", message, name) for name, message in messages], which
        )


def code_name(value: float) -> str:
    return f"G{value:.6g}" if value >= 0 else "the G code"


def _positions(
    words: BlockWords,
    moves: GcodeMotions,
    where: Positions,
    tool: Ints,
    collector: RefusalCollector,
    reasons: Reasons,
) -> None:
    """Refuses motions whose end is not known, by what left it unknown; tool (N,): numbers."""
    rows = moves.block
    lost = np.isnan(moves.end[:, :3])
    frame = np.isnan(moves.place) & ~lost
    some = np.flatnonzero(lost.any(axis=1) & (collector.why < 0))
    if len(some):
        # The latest of the causes: before it, the coordinate may have been known.
        causes = np.where(lost[some], where.source[rows[some], :3], -1).max(axis=1)
        missing = (lost[some] * np.array([4, 2, 1])).sum(axis=1)
        air = moves.kind[some] == Kind.PTP
        keys = np.stack([causes, missing, air], axis=1)
        kinds, which = np.unique(keys, axis=0, return_inverse=True)
        messages = []
        changes = words.source.column(key("M"))
        loading = changes.block[changes.value == TOOL_CHANGE][:1]
        first_change = int(loading[0]) if len(loading) and words.control.keeps_length else -1
        for kind, (cause, bits, rapid) in enumerate(kinds.tolist()):
            names = ", ".join(name for name, bit in (("X", 4), ("Y", 2), ("Z", 1)) if bits & bit)
            why = (
                "is never set before"
                if cause < 0
                else f"not known since line {words.source.blocks.line[cause]}"
            )
            what = "" if cause < 0 or reasons.of[cause] < 0 else reasons.texts[reasons.of[cause]]
            if cause >= 0 and not what:
                what = _unsaid(words, cause)
            message = f"{names}: {why}{f' ({what})' if what else ''}"
            help_ = f"state {names} under program_start: in the cell, or {_WRITE}" if cause < 0 else ""
            if what == What.LENGTH and cause == first_change:
                loaded = int(tool[some[which.reshape(-1) == kind][0]])
                help_ = _LOADED.format(loaded, names) if loaded > 0 else ""
            messages.append(RefusalReason("GCO003" if rapid else "GCO002", message, what, help_))
        collector.refuse_each(some, messages, which.reshape(-1))
    collector.refuse(
        np.any(frame, axis=1),
        "GCO019",
        "the origin of the coordinates is not known: what moves it is not read, or the position is not known there",
    )


def _unsaid(words: BlockWords, block: int) -> str:
    """What left a coordinate unknown in a block of the program that says nothing of that by itself."""
    codes = words.source.column(key("G")).part(block, block + 1).value
    if not (decode_g_codes(codes, words.control)[2] == Group.ONCE).any():
        return What.INCREMENT if words.control.increments_by_setting else What.ORIGIN
    return What.FRAME if (codes >= FIRST_NAME).any() else What.ORIGIN


def bind_names(execution: Execution) -> str:
    """What to do about names whose values were wanted and are not known."""
    names = [
        name for name in execution.unknown if len(name) > 1 and not name.startswith(("#<_", "$"))
    ]  # an axis is an index: $AA_IM[X]
    if not names:
        return ""
    shown = ", ".join([*names[:5], *(["..."] if len(names) > 5 else [])])
    return f"bind {shown} under symbols: in the cell, or let the post-processor write numbers"


def locked_rows(
    document: Document,
    words: BlockWords,
    built: Built,
    collector: RefusalCollector,
    execution: Execution,
    levels: Ints,
) -> Refusals:
    """Motions whose end a refused motion, an origin or other code builds on; ``words``: the whole program; levels (K,):
    blocks to whose level a drill cycle goes back."""
    rows, n = built.block, len(built.block)
    pins = RefusalCollector(n)
    modal = words.modal
    refused = collector.why >= 0
    if refused.any():
        partial = ~built.sets.all(axis=1)
        # Orientation words are inherited as well; an arc starts there, and its centre depends on where it starts.
        partial |= ~built.turned | ~np.isin(built.kind, (Kind.LIN, Kind.PTP))
        reaching = modal.has(Once.HOME, Once.MACHINE)[rows]
        building = np.flatnonzero(refused & partial & ~reaching)
        building = building[building > 0]
        building = building[~refused[building - 1]] - 1
        pins.refuse(
            _mask(n, np.concatenate([building, _through(built, refused, refused & ~reaching)])),
            "GCO002",
            "the motion after it depends on this end point and is not corrected",
        )
    shifting = modal.has(Once.SHIFT) & words.has(*AXES)
    for at, message in (
        (np.flatnonzero(shifting), "G92 sets the origin at this end point"),
        (levels, "the drill cycle after it goes back to the level of this end point"),
        (np.flatnonzero(modal.flow.calls), "code that is not read may depend on this end point"),
        (_reading(document, execution) - 1, "a variable after it reads the end position of this motion"),
        (
            np.flatnonzero(words.noted("unknown")),
            "a block that is not understood may depend on this end point",
        ),
    ):
        before = np.searchsorted(rows, at, side="right") - 1
        before = before[before >= 0]
        pins.refuse(_mask(n, before) & (collector.why < 0), "GCO002", message)
    blocks = words.source.blocks
    return pins.done(document, blocks.line[rows], blocks.start[rows], blocks.start[rows])


_WAY = tuple(key(letter, index) for letter in "ABCIJK" for index in (1, 2, 3))
"""Words of the way itself: the point between, orientations."""


def no_insert_before(words: BlockWords, rows: Ints, in_other_file: Bools) -> dict[int, str]:
    """Motions, in the blocks ``rows`` (N,), before which nothing may be inserted, because their block says more than
    the motion, or is in another file (``in_other_file`` (B,))."""
    modal = words.modal
    more = modal.more | words.noted("assign", "corner", "axis", "polar")
    others = (one for one in words.control.columns if one not in _WAY)
    more |= words.has(*(key(letter) for letter in "ESTHDLQUVWM"), *others)
    word, usual = words.control.turns
    if word in words.columns:
        more |= words.number(word) > usual
    # Machine axes: what is inserted has no words for them.
    more |= words.has(*(key(letter) for letter in "ABC")) & (modal.force[Group.TCP] != 1)
    inverse_time = modal.force[Group.FEED] == Feed.INVERSE_TIME
    found: dict[int, str] = {}
    after = np.flatnonzero(words.noted("corner")[rows]) + 1
    found.update(dict.fromkeys(after[after < len(rows)].tolist(), "the control rounds the corner before it"))
    for mask, why in (
        (inverse_time, "F is the time of the whole block (G93)"),
        (in_other_file, "its block is in another file"),
        (more, "its block contains more than the motion"),
        (modal.flow.entered, "a jump leads to its block"),
        (modal.force[Group.POLAR] != 0, "its words are polar coordinates (G16)"),
        (feeds_before_units(words), "its F is in the unit from before it"),
        (words.noted("feed"), "its FB states the feed of one block"),
    ):
        found.update(dict.fromkeys(np.flatnonzero(mask[rows]).tolist(), why))
    return found


def _through(built: Built, refused: Bools, building: Bools) -> Ints:
    """Motions from which ``building`` (N,) ones inherit a coordinate or the orientation through ``refused`` ones."""
    n = len(built.block)
    columns = ((built.sets[:, axis], built.lost[:, axis]) for axis in range(3))
    found = []
    for says, ends in (*columns, (built.turned, np.zeros(n, np.bool_))):
        last = np.maximum.accumulate(np.where(~refused | says | ends, np.arange(n), -1))
        before = np.append(-1, last)[:n]
        source = before[building & ~says & (before >= 0)]
        found.append(source[~refused[source]])
    return np.concatenate(found)


def _reading(document: Document, execution: Execution) -> Ints:
    """Blocks with a variable that holds a position (#5001 to #5069, #5420 to #5428, #<_x>), or is itself computed."""
    places = list(occurrences(POSITION, document.raw))
    starts, order = execution.text.blocks.start, execution.order
    blocks = np.unique(np.searchsorted(starts, places, side="right") - 1).astype(np.int64)
    return blocks if order is None else np.flatnonzero(np.isin(order, blocks))


def _mask(n: int, rows: Ints) -> Bools:
    mask = np.zeros(n, np.bool_)
    mask[rows] = True
    return mask
