"""The robot as a program sees it: modal state, frames, where the last motion has led, what was executed."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from . import motions as way
from .motions import NAN, End, Executed, Six
from .values import AXES, FRAME, STRUCTURES, UNDETERMINED, Cell, Stop, assign, content, is_set, new_cell

ZERO = dict.fromkeys(FRAME, 0.0)
SYSTEM = {
    "$BASE": "FRAME", "$TOOL": "FRAME", "$VEL": "CP", "$APO": "APO", "$ORI_TYPE": "word", "$CIRC_TYPE": "word",
    "$IPO_MODE": "word", "$ADVANCE": "INT", "FDAT_ACT": "FDAT", "LDAT_ACT": "LDAT", "PDAT_ACT": "PDAT", "$LOAD": "LOAD",
    "$OV_PRO": "INT",
}  # fmt: skip


@dataclass(frozen=True)
class Motion:
    """A motion statement, its expressions evaluated.  angle: CA, None without."""

    kind: str
    relative: bool
    point: dict
    aux: dict | None
    angle: float | None
    rounds: tuple[str, ...]
    in_tool: bool


class Robot:
    """``system``: its variables; ``shared``: those of the controller (BASE_DATA, TOOL_DATA, DEF_VEL_CP)."""

    def __init__(self, shared: dict[str, Cell]) -> None:
        self.shared = shared
        self.system = {name: new_cell(of, STRUCTURES) for name, of in SYSTEM.items()}
        self.executed: list[Executed] = []
        self.end = End()
        self.force = ""

    def bas(self, command: object, number: object) -> None:
        """KUKA's routine that sets what most programs begin with."""
        if command == "#INITMOV":
            self.frame("$BASE", 0)
            self.frame("$TOOL", 1)
            speed = self.shared.get("DEF_VEL_CP")
            assign(self.system["$VEL"], UNDETERMINED)
            assign(self.system["$APO"], {"CPTP": 50.0, "CDIS": 3.0, "CORI": 5.0, "CVEL": 100.0})
            if speed is not None and speed.value is not None:
                self.system["$VEL"].parts["CP"].value = speed.value
            assign(self.system["$ORI_TYPE"], "#VAR")
            assign(self.system["$CIRC_TYPE"], "#BASE")
            assign(self.system["$IPO_MODE"], "#BASE")
        elif command in ("#BASE", "#TOOL"):
            self.frame("$" + command[1:], number)
        elif command == "#VEL_CP":
            assign(self.system["$VEL"].parts["CP"], number)
        elif command in ("#FRAMES", "#CP_PARAMS", "#PTP_PARAMS"):
            record = self.system["FDAT_ACT"].parts
            self.frame("$TOOL", record["TOOL_NO"].value)
            self.frame("$BASE", record["BASE_NO"].value)
            if command == "#CP_PARAMS":
                self.take_record()
                assign(self.system["$VEL"].parts["CP"], number)
            elif command == "#PTP_PARAMS":
                self.take_jump_record()
        elif command == "#CP_DAT":
            self.take_record()
        elif command == "#PTP_DAT":
            self.take_jump_record()
        elif command not in ("#VEL_PTP", "#ACC_PTP", "#ACC_CP"):
            raise Stop(f"BAS({command})")

    def speed(self) -> float | None:
        """[m/s] that of the path, with the override that the program sets; 100 % are set from outside."""
        speed, override = _number(self.system["$VEL"].parts["CP"].value), self.system["$OV_PRO"]
        if not is_set(override) or speed is None:
            return speed
        share = _number(override.value)
        return None if share is None else speed * share / 100.0

    def frame(self, name: str, number: object) -> None:
        if isinstance(number, bool) or not isinstance(number, int):
            raise Stop("the number of a frame")
        value: object = dict(ZERO)
        if number:
            table = self.shared[{"$BASE": "BASE_DATA", "$TOOL": "TOOL_DATA"}[name]]
            if (number,) not in table.parts:
                raise Stop("no such frame")
            value = content(table.parts[number,])
        assign(self.system[name], value)

    def take_record(self) -> None:
        record = self.system["LDAT_ACT"].parts
        distance = record["APO_DIST"].value
        assign(self.system["$APO"].parts["CDIS"], UNDETERMINED if distance is None else distance)
        for of, name in (("ORI_TYP", "$ORI_TYPE"), ("CIRC_TYP", "$CIRC_TYPE")):
            if record[of].value is not None:
                assign(self.system[name], record[of].value)

    def take_jump_record(self) -> None:
        record, apo = self.system["PDAT_ACT"].parts, self.system["$APO"].parts
        if record["APO_MODE"].value == "#CDIS" and record["APO_DIST"].value is not None:
            assign(apo["CDIS"], record["APO_DIST"].value)
        elif record["APO_MODE"].value != "#CPTP":
            assign(apo["CDIS"], UNDETERMINED)

    def frame_in_force(self, name: str) -> Six | None:
        cell = self.system[name]
        if not is_set(cell):
            return None
        return tuple(NAN if p.value in (None, UNDETERMINED) else p.value for p in cell.parts.values())

    def move(self, line: int, motion: Motion) -> None:
        base, tool = self.frame_in_force("$BASE"), self.frame_in_force("$TOOL")
        if self.system["$IPO_MODE"].value == "#TCP":
            raise Stop("a stationary tool")
        before = self.end.seen_in(base, tool)
        if motion.kind == "PTP" and way.is_axes(motion.point):
            self.move_axes(line, motion, base, tool)
            return
        if way.is_axes(motion.point):
            raise Stop("a path to axis angles")
        own = way.numbers(motion.point, FRAME)
        target = way.plus(before, own, motion.in_tool) if motion.relative else way.fill(own, before)
        found_arc = None
        if motion.aux is not None:
            given = [*way.numbers(motion.aux, FRAME)[:3], None, None, None]
            through = way.plus(before, given, motion.in_tool) if motion.relative else way.fill(given, before)
            found_arc = way.arc(before, through, target, motion.angle)
            if motion.angle is not None:
                start = tuple(NAN if v is None else v for v in before)
                target = (*way.turned(start, *found_arc), *target[3:])
        origin = self.end.origin if None in target else None
        ori_type = self.system["$ORI_TYPE"].value
        self.executed.append(
            Executed(
                line, motion.kind, target, None, base, tool, origin,
                feed=self.speed(),
                approximation=self.distance(motion.rounds),
                ori_type=str(ori_type) if ori_type is not None else None, arc=found_arc, force=self.force,
            )
        )  # fmt: skip
        angles = target[3:]
        keeps = motion.kind != "PTP" and ori_type not in (None, "#VAR", "#JOINT")
        if keeps and angles != before[3:]:
            angles = (NAN,) * 3  # what a partial point inherits behind an orientation that was not reached
        self.end = End((*target[:3], *angles), (NAN,) * 6, origin, base, tool)

    def move_axes(self, line: int, motion: Motion, base: Six | None, tool: Six | None) -> None:
        own = way.numbers(motion.point, AXES)
        if motion.relative:
            axes = tuple(v + (o or 0.0) for v, o in zip(self.end.axes, own, strict=True))
        else:
            axes = way.fill(own, self.end.axes)
        self.executed.append(
            Executed(line, "AXIS", (None,) * 6, axes, base, tool, approximation=None, force=self.force)
        )
        known = not any(math.isnan(a) for a in axes)
        self.end = End((None if known else NAN,) * 6, axes, axes if known else None, base, tool)

    def end_exactly(self) -> None:
        """The last motion is not approximated."""
        if self.executed and self.executed[-1].approximation is not None:
            self.executed[-1] = replace(self.executed[-1], approximation=0.0)

    def distance(self, rounds: tuple[str, ...]) -> float | None:
        if not rounds:
            return 0.0
        if set(rounds) != {"C_DIS"}:
            return None
        found = _number(self.system["$APO"].parts["CDIS"].value)
        return NAN if found is None else found


def _number(value: object) -> float | None:
    return None if value is None or value is UNDETERMINED else float(value)
