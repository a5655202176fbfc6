"""Where the robot stands and what a motion makes of it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from .values import AXES, FRAME, UNDETERMINED, Stop, rotation

NAN = math.nan
Six = tuple[float | None, ...]


@dataclass(frozen=True)
class Executed:
    """One motion as the controller runs it.

    kind: PTP, AXIS, LIN or CIRC.  target: X, Y, Z, A, B, C [mm, deg] in the base, None where it is what the axis angles
    ``origin`` of an earlier motion give, NaN where the language leaves it open; axes: of AXIS.  base, tool: X .. C,
    None where nothing has set them.  feed [m/s]: None where not set; approximation [mm]: 0 for none, NaN where not set,
    None where it is not by a distance; ori_type: None where not set.  arc: centre, normal, sweep [deg].  force: of the
    FORCE comment that was passed last, "" for none and for OFF.
    """

    line: int
    kind: str
    target: Six
    axes: Six | None
    base: Six | None
    tool: Six | None
    origin: Six | None = None
    feed: float | None = None
    approximation: float | None = 0.0
    ori_type: str | None = None
    arc: tuple[np.ndarray, np.ndarray, float] | None = None
    force: str = ""


@dataclass(frozen=True)
class End:
    """Where the last motion has led; all None before the first one is not the same as after an axis motion."""

    target: Six = (NAN,) * 6
    axes: Six = (NAN,) * 6
    origin: Six | None = None
    base: Six | None = None
    tool: Six | None = None

    def seen_in(self, base: Six | None, tool: Six | None) -> Six:
        """The components for a motion in such frames: what becomes of them in others is not documented."""
        if same(self.base, base) and same(self.tool, tool):
            return self.target
        return (NAN,) * 6


def same(one: Six | None, two: Six | None) -> bool:
    return one == two and (one is None or not any(v != v for v in one))


def numbers(values: dict, keys: tuple[str, ...]) -> list:
    """Numbers of the components, None where left out."""
    out = [values.get(key) for key in keys]
    for value in out:
        if isinstance(value, bool | str | dict):
            raise Stop("a component is no number")
    return [NAN if v is UNDETERMINED else v if v is None else float(v) for v in out]


def fill(own: list, before: Six) -> Six:
    return tuple(b if o is None else o for o, b in zip(own, before, strict=True))


def plus(start: Six, delta: list, in_tool: bool) -> Six:
    """A relative motion.  From a position that is not known in numbers nothing is known; a relative turn of a Cartesian
    motion is not documented well enough."""
    if any(v is not None and v != 0 for v in delta[3:]):
        return (NAN,) * 6
    moved = np.array([0.0 if v is None else v for v in delta[:3]])
    place = np.array([NAN if v is None else v for v in start[:3]])
    if in_tool:
        if None in start[3:]:
            return (NAN,) * 3 + start[3:]
        moved = rotation(*start[3:]) @ moved
    return (*map(float, place + moved), *start[3:])


def arc(start: Six, aux: Six, end: Six, angle: float | None) -> tuple[np.ndarray, np.ndarray, float]:
    """Centre, normal and sweep [deg] of the arc through three points, or so far as CA says."""
    p, q, r = (np.array([NAN if v is None else v for v in point[:3]]) for point in (start, aux, end))
    u, v = q - p, r - p
    normal = np.cross(u, v)
    size = float(normal @ normal)
    if math.isnan(size):
        return np.full(3, NAN), np.full(3, NAN), NAN
    if size < 1e-6:
        raise Stop("three points that are no circle")
    centre = p + np.cross(normal, (v @ v) * u - (u @ u) * v) / (2 * size)
    normal = normal / math.sqrt(size)
    a, b = p - centre, r - centre
    sweep = math.degrees(math.atan2(normal @ np.cross(a, b), a @ b)) % 360.0
    if angle is not None:
        if angle == 0:
            raise Stop("an arc of no angle")
        sweep, normal = abs(angle), normal * math.copysign(1.0, angle)
    return centre, normal, sweep


def turned(start: Six, centre: np.ndarray, normal: np.ndarray, sweep: float) -> list[float]:
    """Where an arc that begins at ``start`` ends."""
    a = np.array(start[:3], float) - centre
    c, s = math.cos(math.radians(sweep)), math.sin(math.radians(sweep))
    return [float(v) for v in centre + c * a + s * np.cross(normal, a) + (1 - c) * (normal @ a) * normal]


def is_axes(values: dict) -> bool:
    axes, frame = set(AXES) & set(values), set(FRAME) & set(values)
    if axes and frame:
        raise Stop("axes and components of a frame in one point")
    return bool(axes)
