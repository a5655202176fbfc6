"""What a process file states of a tool and of what it cuts, against the cell, and against what tools, materials and
robots are.

A length in inches, centimetres or metres, a radius for a diameter, a coefficient in another unit: each goes through
every check of a file for itself, and the forces and the correction are wrong by as much.  Nothing is guessed and
nothing changed: every contradiction is a warning that names both sides.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from postproc.base.arrays import Floats, Ints
from postproc.base.findings import Finding
from postproc.base.units import DEG, MM
from postproc.process.materials import Material
from postproc.toolpath import Toolpath

SAME_DIAMETER = 0.01
THINNEST, THICKEST = 1.0 * MM, 200.0 * MM
"""Diameters of the cutters of robots."""
DEEPEST_SLOT, DEEPEST = 4.0, 12.0
"""Diameters: of a cut that is at least half as wide as the tool, and of any, but for drills."""
_WIDE = 0.5
LEAST_HELIX = 2.0 * DEG
FASTEST = 5000.0 / 60
"""[m/s] of the edges: nothing is cut faster."""
FASTEST_TURN, TURNS_FAST = 60000 * 2 * np.pi / 60, 10.0 * MM
"""[rad/s] of a spindle that takes cutters above that diameter."""
FINEST_PITCH = 0.25 * MM
"""From tooth to tooth around the tool."""
LARGEST_FORCE, LARGEST_POWER = 10e3, 200e3
"""[N], [W]: no robot and no spindle has more."""
SOFTEST, HARDEST, SHARPEST, BLUNTEST = 1e6, 2e10, 1e6, 1.0 * MM
"""[Pa] of Ktc: foam and superalloys; [N/m] of Kte; and of Kte over Ktc, which is of the size of the edges' radius."""
LEAST_ASIDE, MOST_ASIDE = 0.005, 10.0
"""Of the tangential coefficient: the radial one, and any other."""

_RATIOS = {
    25.4: "one of them is in inches",
    1000.0: "one of them is in metres",
    10.0: "one of them is in centimetres",
    2.0: "one of them is a radius",
}


class CheckCodes(NamedTuple):
    """The codes under which the source of the forces reports what is wrong."""

    comment: str
    speed: str
    stopped: str
    chip: str
    size: str
    force: str


@dataclass(frozen=True, eq=False)
class CheckedCut:
    """A tool as a process file states it in ``line``, and the K motions of a program that it cuts.

    name: of the tool or the operation, for messages; numbers: of its tools in the program; diameter [m], helix [rad],
    speed [rad/s], None where not stated.  rows (K,): the motions; depth (axial), width (across the feed) (K,) [m];
    force [N] and power [W]: the largest.
    """

    name: str
    numbers: tuple[int, ...]
    diameter: float
    teeth: int | None
    helix: float | None
    speed: float | None
    material: Material | None
    file: str
    line: int
    rows: Ints
    depth: Floats
    width: Floats
    force: float
    power: float
    drills: bool = False

    def turning(self, toolpath: Toolpath) -> Floats:
        """(K,) [rad/s] the speed of the spindle in either direction: as stated, else that of the program; NaN where
        neither is known."""
        if self.speed is not None:
            return np.full(len(self.rows), self.speed)
        program = np.abs(toolpath.spindle[self.rows])
        return np.where(np.isfinite(program) & (program > 0), program, np.nan)

    def chips(self, toolpath: Toolpath) -> Floats:
        """(K,) [m] the feeds per tooth; NaN where feed, speed or teeth are not known."""
        feed = toolpath.feed[self.rows]
        chip = feed * 2 * np.pi / (self.turning(toolpath) * (self.teeth or np.nan))
        return np.where(chip > 0, chip, np.nan)


def wrong_sizes(
    cut: CheckedCut, of_cell: Mapping[int, float], toolpath: Toolpath, code: str
) -> list[Finding]:
    """What of the tool contradicts the cell, what it cuts, or what tools are.  of_cell: diameters of the cell's tools
    by number [m]."""
    turning = float(np.nan_to_num(cut.turning(toolpath)).max(initial=0.0))
    found = (*_diameters(cut, of_cell), *_depths(cut, toolpath), *_helix(cut), *_edges(cut, turning))
    return [Finding(code, message, cut.file, cut.line, help=help) for message, help in found]


def wrong_forces(cut: CheckedCut, code: str) -> list[Finding]:
    """Coefficients of no material, forces and powers of no robot."""
    found = (*_coefficients(cut), *_loads(cut))
    return [Finding(code, message, cut.file, cut.line, help=help) for message, help in found]


def _diameters(cut: CheckedCut, of_cell: Mapping[int, float]) -> Iterator[tuple[str, str]]:
    """Message and help of each contradiction of the diameter to the cell, and to cutters of robots."""
    wide, name = cut.diameter, cut.name
    for number in cut.numbers:
        other = of_cell.get(number)
        if other is None or abs(wide - other) <= SAME_DIAMETER * other:
            continue
        which = "" if len(cut.numbers) == 1 else f" for tool {number}"
        message = (
            f"{name} has the diameter {wide / MM:.6g} mm here, which is used, and {other / MM:.6g} mm in the"
            f" cell{which}"
        )
        yield message, _reason(max(wide / other, other / wide))
    if wide < THINNEST:
        inches = wide * 25.4
        message = f"{name} has a diameter of {wide / MM:.6g} mm: no robot mills with a cutter below 1 mm"
        yield message, f"is it in inches? they would be {inches / MM:.6g} mm; state mm"
    if wide > THICKEST:
        yield f"{name} has a diameter of {wide / MM:.6g} mm, above 200 mm", "state mm"


def _reason(ratio: float) -> str:
    for known, words in _RATIOS.items():
        if abs(ratio - known) < 0.03 * known:
            return f"{ratio:.4g} times: {words}? state diameters in mm"
    return "state the diameter in mm in both files"


def _depths(cut: CheckedCut, toolpath: Toolpath) -> Iterator[tuple[str, str]]:
    """A cut that is too deep for the diameter."""
    if cut.drills:
        return
    wide = cut.diameter
    for depths, most, what in (
        (
            np.where(cut.width >= _WIDE * wide, cut.depth, 0.0),
            DEEPEST_SLOT,
            "at half of its width or more",
        ),
        (cut.depth, DEEPEST, "somewhere"),
    ):
        at = int(np.argmax(depths))
        if depths[at] > most * wide:
            message = (
                f"{cut.name} with the diameter {wide / MM:.6g} mm cuts {depths[at] / MM:.4g} mm deep {what} (line"
                f" {toolpath.line[cut.rows[at]]}): {depths[at] / wide:.3g} times its diameter"
            )
            yield (
                message,
                "compare the diameter, its unit (mm), and axial_depth or the top of the blank with the program",
            )
            return


def _helix(cut: CheckedCut) -> Iterator[tuple[str, str]]:
    if cut.helix is not None and 0.0 < abs(cut.helix) < LEAST_HELIX:
        angle = cut.helix / DEG
        message = f"{cut.name} has a helix of {angle:.4g} deg, less than any cutter that is not straight"
        yield message, f"is it in rad? it would be {angle / DEG:.4g} deg; state deg, or 0 for straight edges"


def _edges(cut: CheckedCut, turning: float) -> Iterator[tuple[str, str]]:
    """turning [rad/s]: the largest speed of the spindle."""
    wide, fast = cut.diameter / MM, 0.5 * turning * cut.diameter
    if turning > FASTEST_TURN and cut.diameter > TURNS_FAST:
        message = f"{cut.name}, diameter {wide:.6g} mm, turns at {turning * 30 / np.pi:.6g} 1/min"
        yield message, "no spindle turns a cutter above 10 mm so fast; state spindle in 1/min"
    if fast > FASTEST:
        message = f"the edges of {cut.name}, diameter {wide:.6g} mm, move at {fast * 60:.5g} m/min"
        yield message, "compare diameter (mm) and spindle (1/min): nothing is cut faster than 5000 m/min"
    pitch = np.pi * cut.diameter / max(cut.teeth or 1, 1)
    if pitch < FINEST_PITCH:
        message = (
            f"{cut.name} has {cut.teeth} teeth on a diameter of {wide:.6g} mm, {pitch / MM:.3g} mm from one to the"
            " next"
        )
        yield message, "compare diameter (mm) and teeth"


def _coefficients(cut: CheckedCut) -> Iterator[tuple[str, str]]:
    if cut.material is None:
        return
    cutting, edge = cut.material.coefficients.cutting, cut.material.coefficients.edge
    name, ktc, kte = cut.name, cutting[0], edge[0]
    if not SOFTEST <= ktc <= HARDEST:
        message = f"{name}: ktc of {ktc / 1e6:.4g} N/mm2 is that of no material"
        yield message, "1 N/mm2 is foam, 5000 N/mm2 a superalloy; state ktc, krc, kac in N/mm2"
    if kte > SHARPEST or kte > BLUNTEST * ktc > 0:
        message = f"{name}: kte of {kte / 1e3:.4g} N/mm belongs to no edge for ktc of {ktc / 1e6:.4g} N/mm2"
        yield message, "usual are some N/mm, 0.01 to 0.1 mm times ktc; state kte, kre, kae in N/mm"
    for names, values, unit, scale in (
        (("krc", "kac"), cutting, "N/mm2", 1e6),
        (("kre", "kae"), edge, "N/mm", 1e3),
    ):
        for other, value in zip(names, values[1:], strict=True):
            # the axial one may be as small as it likes
            if value > MOST_ASIDE * values[0] > 0 or (
                other[1] == "r" and 0 < value < LEAST_ASIDE * values[0]
            ):
                message = (
                    f"{name}: {other} of {value / scale:.4g} {unit} does not belong to kt{other[2]} of"
                    f" {values[0] / scale:.4g} {unit}"
                )
                yield message, f"usual is 0.1 to 1 times as much; state both in {unit}"


def _loads(cut: CheckedCut) -> Iterator[tuple[str, str]]:
    if cut.force > LARGEST_FORCE or cut.power > LARGEST_POWER:
        message = (
            f"{cut.name} has a mean force of up to {cut.force:.4g} N and a power of up to {cut.power / 1e3:.4g} kW: no"
            " robot mills with that"
        )
        yield message, "compare coefficients (N/mm2, N/mm), depth of cut and feed with the machine"
