"""Cutters: their shapes as the process file states them, and the profiles that cut, clear and collide."""

from __future__ import annotations

import numpy as np

from postproc.base.arrays import Floats
from postproc.base.dataclass import dataclass

SHAPES = ("flat", "ball", "bull", "cone", "drill")
UNLIMITED = 1.0
"""m: length of the edges of a cutter for which none is stated."""

CUTTING, SHANK, HOLDER = range(3)


@dataclass(frozen=True)
class Cutter:
    """One tool, its tip at the tool centre point.  Lengths [m], angles [rad].

    length: of the cutting edges, from the tip; None where not stated.  corner: radius of a bull nose, of a ball its own
    radius.  tip: radius of the flat end of a cone.  taper: half of the angle of a cone or of a drill's point, None
    without.  shank: radius; holder: radius and height above the tip where it starts.  teeth, helix: None where not
    stated.  line: in the process file.
    """

    number: int
    shape: str
    radius: float
    length: float | None = None
    corner: float = 0.0
    tip: float = 0.0
    taper: float | None = None
    shank: float | None = None
    holder: tuple[float, float] | None = None
    teeth: int | None = None
    helix: float | None = None
    line: int = 0

    @property
    def edge_length(self) -> float:
        """[m] of the cutting edges along the axis."""
        return UNLIMITED if self.length is None else self.length

    @property
    def numbers(self) -> Floats:
        """(6,) as a row of ``Sweeps.cutters``."""
        tangent, cosine = (-1.0, 1.0) if self.taper is None else (np.tan(self.taper), np.cos(self.taper))
        return np.array([self.radius, self.corner, self.edge_length, self.tip, tangent, cosine])

    def profile(self) -> Floats:
        """(E, 8) the elements of the profile from the tip up, as pairs of radius and height.

        Columns: part (CUTTING, SHANK, HOLDER); 0 for a line or 1 for an arc; of a line its ends r0, z0, r1, z1 [m]; of
        an arc the radius and height of its centre and its own radius [m], from the tip to the side; length [m].
        """
        elements: list[tuple[float, ...]] = []
        radius, height = 0.0, 0.0

        def line(part: int, r: float, z: float) -> None:
            nonlocal radius, height
            long = float(np.hypot(r - radius, z - height))
            if long > 1e-9:
                elements.append((part, 0, radius, height, r, z, 0.0, long))
            radius, height = r, z

        if self.taper is not None:
            line(CUTTING, self.tip, 0.0)
            rise = min((self.radius - self.tip) / float(np.tan(self.taper)), self.edge_length)
            line(CUTTING, self.tip + rise * float(np.tan(self.taper)), rise)
        else:
            flat = self.radius - self.corner
            line(CUTTING, flat, 0.0)
            if self.corner > 0:
                elements.append(
                    (CUTTING, 1, flat, self.corner, self.corner, 0.0, 0.0, 0.5 * np.pi * self.corner)
                )
                radius, height = self.radius, self.corner
        line(CUTTING, radius, self.edge_length)
        top = self.edge_length if self.holder is None else self.holder[1]
        if self.shank is not None and self.length is not None:
            line(SHANK, self.shank, self.edge_length)
            line(SHANK, self.shank, top if self.holder else top + 2 * UNLIMITED)
        if self.holder is not None:
            height = self.holder[1]
            line(HOLDER, self.holder[0], height)
            line(HOLDER, self.holder[0], height + UNLIMITED)
        return np.array(elements)
