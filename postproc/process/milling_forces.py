"""Milling forces by the linear edge-force model, in the feed frame.

A tooth at the angle phi, clockwise from +y seen from the spindle, cuts a chip of the thickness h = c sin(phi), c the
feed per tooth, over the height a: tangential, radial and axial force

    Ft = a (Ktc h + Kte),  Fr = a (Krc h + Kre),  Fa = a (Kac h + Kae)

and on the tool, x along the feed, y to its left, z from the tip back to the spindle (a spindle that turns clockwise):

    Fx = -Ft cos(phi) - Fr sin(phi),  Fy = Ft sin(phi) - Fr cos(phi),  Fz = -Fa.

The flutes of a right-hand helix (positive) pull the cutter out of its holder, a left-hand one pushes it in, straight
flutes do neither.  Source: Y. Altintas, Manufacturing Automation, mechanics of milling.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from postproc.base.arrays import Floats

DIRECTIONS = ("up", "down", "slot")


@dataclass(frozen=True)
class Coefficients:
    """Of a material: ``cutting`` Ktc, Krc, Kac [Pa] and ``edge`` Kte, Kre, Kae [N/m]."""

    cutting: tuple[float, float, float]
    edge: tuple[float, float, float]


@dataclass(frozen=True)
class Engagement:
    """A cutter in its material: ``diameter``, ``depth`` (axial) [m], ``helix`` [rad], and the angles [rad] at which a
    tooth enters and exits."""

    diameter: float
    teeth: int
    helix: float
    depth: float
    entry: float
    exit: float
    coefficients: Coefficients

    def on_the_other_side(self) -> Engagement:
        """The same cutter, turning the same, with the material at the other side of the feed: up is down milling."""
        return replace(self, entry=np.pi - self.exit, exit=np.pi - self.entry)


def engagement(direction: str, width: float, diameter: float) -> tuple[float, float]:
    """Entry and exit angle [rad] of a cutter that takes ``width`` of its ``diameter`` [m] at one side.

    Up milling starts with no chip, phi = 0, down (climb) milling ends with none, phi = pi; a slot goes over both.
    """
    angle = float(np.arccos(np.clip(1 - 2 * width / diameter, -1, 1)))
    return {"up": (0.0, angle), "down": (np.pi - angle, np.pi), "slot": (0.0, np.pi)}[direction]


def mean_force(cut: Engagement, feed: Floats) -> Floats:
    """(N, 3) [N] mean force over a tooth period for the feeds per tooth ``feed`` (N,) [m].

    Every height of a flute comes by the same angles, each a little later than the one below: the mean over a period
    does not know the helix.
    """
    turning, steady = _shares(cut)
    return np.asarray(feed[:, None] * turning + steady)


def mean_torque(cut: Engagement, feed: Floats) -> Floats:
    """(N,) [N m] mean moment about the spindle that turns the tool, for the feeds per tooth ``feed`` (N,) [m]: that of
    the tangential forces at the radius."""
    tangential = cut.coefficients.cutting[0] * feed * (np.cos(cut.entry) - np.cos(cut.exit))
    tangential = tangential + cut.coefficients.edge[0] * (cut.exit - cut.entry)
    return np.asarray(0.5 * cut.diameter * cut.teeth * cut.depth / (2 * np.pi) * tangential)


def force(cut: Engagement, feed: float, angle: Floats, discs: int = 200) -> Floats:
    """(K, 3) [N] the force with the first tooth's tip at ``angle`` (K,) [rad], its flutes cut into ``discs``.

    The tooth at the height z lags by 2 z tan(helix) / diameter after its tip.
    """
    height = cut.depth * (np.arange(discs) + 0.5) / discs
    lag = 2 * height * np.tan(cut.helix) / cut.diameter
    tooth = 2 * np.pi * np.arange(cut.teeth) / cut.teeth
    phi = np.mod(angle[:, None, None] + tooth[:, None] - lag, 2 * np.pi)
    inside = (phi >= cut.entry) & (phi <= cut.exit)
    sine, cosine = np.sin(phi), np.cos(phi)
    tangential, radial, axial = (
        np.where(inside, cutting * feed * sine + edge, 0.0)
        for cutting, edge in zip(cut.coefficients.cutting, cut.coefficients.edge, strict=True)
    )
    on_tool = (
        -tangential * cosine - radial * sine,
        tangential * sine - radial * cosine,
        -np.sign(cut.helix) * axial,
    )
    return np.stack([part.sum(axis=(1, 2)) for part in on_tool], axis=-1) * (cut.depth / discs)


def peak_share(cut: Engagement, feed: float) -> float:
    """The largest force within a tooth period as a multiple of the mean's size."""
    angle = np.linspace(0, 2 * np.pi / cut.teeth, 180, endpoint=False)
    mean = np.linalg.norm(mean_force(cut, np.array([feed]))[0])
    return float(np.linalg.norm(force(cut, feed, angle, 60), axis=1).max() / mean) if mean > 0 else 1.0


def _shares(cut: Engagement) -> tuple[Floats, Floats]:
    """The mean force (3,) for each metre of feed per tooth [N/m], and that of the edges [N]."""
    (ktc, krc, kac), (kte, kre, kae) = cut.coefficients.cutting, cut.coefficients.edge
    axial = -np.sign(cut.helix)

    def integrals(phi: float) -> tuple[Floats, Floats]:
        s, c, s2, c2 = np.sin(phi), np.cos(phi), np.sin(2 * phi), np.cos(2 * phi)
        cutting = [ktc * c2 - krc * (2 * phi - s2), ktc * (2 * phi - s2) + krc * c2, -4 * axial * kac * c]
        edge = [-kte * s + kre * c, -kte * c - kre * s, axial * kae * phi]
        return np.array(cutting) / 4, np.array(edge)

    (from_c, from_e), (to_c, to_e) = integrals(cut.entry), integrals(cut.exit)
    scale = cut.teeth * cut.depth / (2 * np.pi)
    return scale * (to_c - from_c), scale * (to_e - from_e)
