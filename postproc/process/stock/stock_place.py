"""Where the stock lies: in the base that is stated, else where it was cut before, else in that of the first cut."""

from __future__ import annotations

import numpy as np

from postproc.base.findings import Finding, Refusal
from postproc.base.geometry import Poses
from postproc.cell import MotionFrames
from postproc.process.stock.stock_section import StockProcess
from postproc.toolpath import Kind, Toolpath

NO_NUMBER = -1
"""In the place of the number of a base that has none."""

_SAME = 1e-9  # m, and of unit vectors
_MOST = 8


def stock_places(
    toolpath: Toolpath, frames: MotionFrames, process: StockProcess, cut_in: int, program: str
) -> list[tuple[int, Poses]]:
    """Numbers of bases, and poses (1,) in the robot base, in which the stock may lie: one where that is stated, else
    those of motions on paths, in their order.  cut_in: base in which an earlier program cut it, or ``NO_NUMBER``.

    Refusal STK007: no motion has a base; STK010: no base of that number; STK036: it was cut in another base.
    """
    usable = toolpath.known & np.isfinite(frames.base_in_robot.position[:, 0])
    if not usable.any():
        raise Refusal(Finding("STK007", "no motion has a known target and base", program))
    numbers = np.array(
        [NO_NUMBER if frame.number is None else frame.number for frame in toolpath.frames] + [NO_NUMBER]
    )[toolpath.base]
    if process.base is not None:
        own = np.flatnonzero(usable & (numbers == process.base))
        if len(own):
            return [(process.base, frames.base_in_robot[own[:1]])]
        if process.base in frames.bases:
            return [(process.base, frames.bases[process.base])]
        message = f"base {process.base} of the stock is used by no motion, and the cell does not state it"
        raise Refusal(Finding("STK010", message, str(process.path), process.line))
    on_path = usable & np.isin(toolpath.kind, (Kind.LIN, Kind.CIRC, Kind.SPL))
    rows = np.flatnonzero(on_path if on_path.any() else usable)
    if cut_in != NO_NUMBER:
        own = rows[numbers[rows] == cut_in]
        if len(own):
            return [(cut_in, frames.base_in_robot[own[:1]])]
        message = f"the stock file is in the axes of base {cut_in}, in which no motion of this program cuts"
        help = f"state base: in stock: {cut_in} if it still lies there"
        first = int(numbers[rows[0]])
        if first != NO_NUMBER:
            help += f", or {first} if it lies in that base as it lay in base {cut_in}"
        raise Refusal(Finding("STK036", message, str(process.path), process.line, help=help))
    found: list[tuple[int, Poses]] = []
    _, first_of = np.unique(toolpath.base[rows], return_index=True)
    for row in rows[np.sort(first_of)].tolist():
        pose = frames.base_in_robot[row : row + 1]
        if len(found) < _MOST and not any(is_same_place(pose, other) for _, other in found):
            found.append((int(numbers[row]), pose))
    return found


def is_same_place(one: Poses, other: Poses) -> bool:
    """Whether two poses (1,) are one."""
    away = np.abs(one.position - other.position).max()
    return bool(away < _SAME and np.abs(one.rotation - other.rotation).max() < _SAME)


def uncertain_base(process: StockProcess, numbers: list[int]) -> Refusal:
    """STK036: in none of the bases ``numbers`` the first cut of the stock is one in that base."""
    names = ", ".join(str(number) for number in numbers if number != NO_NUMBER) or "those of the program"
    message = f"in whichever of the bases {names} the blank is placed, the first motion that cuts is in another base"
    help = "state base: in stock, the number of the base whose axes the blank is stated in"
    return Refusal(Finding("STK036", message, str(process.path), process.line, help=help))
