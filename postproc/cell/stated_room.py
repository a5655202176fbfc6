"""What the cell states of where a part may lie: ``room``."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from postproc.base.arrays import Floats, frozen
from postproc.base.units import MM, WHOLE_TURN
from postproc.base.yaml_section import YamlSection

RANGES = {"x": "mm", "y": "mm", "z": "mm", "turn": "deg", "tool_turn": "deg", "track": "mm"}
"""The keys of ranges, and their units."""

NEAR = 1e-6
"""[m] Corners that are nearer to each other, or to a side, touch."""


@dataclass(frozen=True, eq=False)
class StatedRoom:
    """ranges: key -> (from, to) [mm or deg, as written]; polygon (V, 2) [m]: corners of the area in $WORLD that the
    origin of the base is confined to, None without one."""

    ranges: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    polygon: Floats | None = None


def read_room(top: YamlSection) -> StatedRoom | None:
    """The key ``room``; None where it is absent.  Refusal YML003, YML004."""
    if "room" not in top:
        return None
    section = top.section("room")
    section.only(*RANGES, "polygon")
    ranges = {}
    for key, unit in RANGES.items():
        if key in section:
            low, high = section.numbers(key, 2, unit=unit)
            if not low < high:
                help = f"write {key}: [from, to] with from < to, or leave it out where it stays as it is"
                raise section.error(
                    "YML004", f"{low:g} is not below {high:g}: the range has no width", key, help
                )
            if unit == "deg" and max(-low, high) > WHOLE_TURN:
                raise section.error("YML004", f"exceeds a whole turn of {WHOLE_TURN:g} deg", key)
            ranges[key] = (low, high)
    polygon = None
    if "polygon" in section:
        polygon = np.array(section.rows("polygon", 2, unit="mm")) * MM
        problem = polygon_problem(polygon)
        if problem:
            raise section.error("YML004", problem, "polygon", "name the corners in order, round the area")
        polygon = frozen(polygon, (-1, 2))
    if not ranges and polygon is None:
        raise section.error(
            "YML003", "states nothing", help="write for example {x: [850, 1650], y: [50, 850]}"
        )
    return StatedRoom(ranges, polygon)


def polygon_problem(corners: Floats) -> str:
    """What is wrong with a polygon of ``corners`` (V, 2) [m]; "" where nothing is."""
    count = len(corners)
    if count < 3:
        return f"has {count} corners where at least 3 are needed"
    following = np.roll(corners, -1, axis=0)
    for one in range(count):
        for other in range(count):
            if other > one and np.allclose(corners[one], corners[other], atol=NEAR, rtol=0.0):
                return f"corners {one + 1} and {other + 1} are the same place"
            ends = (other, (other + 1) % count)
            if one not in ends and _distance(corners[one], corners[other], following[other]) < NEAR:
                return f"touches itself: corner {one + 1} is on the side from corner {other + 1}"
        for other in range(one + 2, count - (one == 0)):
            if _cross(corners[one], following[one], corners[other], following[other]):
                return f"crosses itself: the side from corner {one + 1} meets that from corner {other + 1}"
    return ""


def _distance(point: Floats, start: Floats, end: Floats) -> float:
    side = end - start
    share = np.clip(float((point - start) @ side) / max(float(side @ side), 1e-30), 0.0, 1.0)
    return float(np.linalg.norm(point - start - share * side))


def _cross(a: Floats, b: Floats, c: Floats, d: Floats) -> bool:
    """Whether the sides a b and c d have a point in common."""

    def turn(p: Floats, q: Floats, r: Floats) -> float:
        return float((q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]))

    one, two, three, four = turn(a, b, c), turn(a, b, d), turn(c, d, a), turn(c, d, b)
    return (one > 0) != (two > 0) and (three > 0) != (four > 0)
