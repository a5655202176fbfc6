"""Measured points that lie beside the surface which a program leaves: the mistake of the file that puts them right."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import permutations

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.findings import Finding
from postproc.base.geometry import turned
from postproc.base.units import MM
from postproc.learning.measured_part import MeasuredPart
from postproc.learning.plausible import ALIKE, FEW_BESIDE, check_contacts, check_nominal, find_shift
from postproc.part.contact import Contacts, CuttingMotions, find_contacts

WIDE = (2 * MM, 10 * MM)
"""Distances at which points are still compared with the surface: whether they are measured places, or shifted."""

OTHER = np.cos(np.radians(20.0))
"""Cosine between a normal and another one that is tried in its place, at most."""


@dataclass(frozen=True, eq=False)
class PlacedPart:
    """A measured part in the robot base: ``point`` (K, 3) [m], ``normal`` (K, 3); rotation (3, 3): of the base; only:
    number of a point -> rows (J,) that may have cut it; contacts: what touches the points as they are."""

    motions: CuttingMotions
    part: MeasuredPart
    point: Floats
    normal: Floats
    rotation: Floats
    only: Mapping[int, Ints]
    contacts: Contacts

    def touched(self, rows: Ints, point: Floats, normal: Floats) -> Bools:
        """(J,) whether some tool touches the points ``rows`` (J,) if they lie at ``point`` (J, 3) with ``normal``
        (J, 3)."""
        only = {i: self.only[row] for i, row in enumerate(rows.tolist()) if row in self.only}
        return find_contacts(self.motions, point, normal, only).touched

    def beside(self, distance: float) -> Floats:
        """(K,) [m] how far the points lie outside of the surface, up to ``distance`` [m]; NaN beyond."""
        found = find_contacts(self.motions, self.point, self.normal, self.only, distance)
        return np.where(found.touched, -found.last.distance, np.nan)


def misplaced_findings(placed: PlacedPart) -> list[Finding]:
    """LRN003, LRN004: X, Y, Z are measured places; all points are shifted; normals are not those of the surface; or
    most points are on no surface."""
    part, touched = placed.part, placed.contacts.touched
    lost = np.flatnonzero(~touched)
    if len(lost) < FEW_BESIDE:
        return check_nominal(part, np.where(touched, -placed.contacts.last.distance, np.nan))
    return (
        check_nominal(part, placed.beside(WIDE[0]))
        or _shifted(placed, lost)
        or _other_normals(placed, lost)
        or check_contacts(part, touched)
    )


def _shifted(placed: PlacedPart, lost: Ints) -> list[Finding]:
    """All points lie beside the surface by one shift: moved back by it, tools touch those that are ``lost`` (J,)."""
    part, every = placed.part, np.arange(len(placed.part))
    for distance, rows in [(one, rows) for one in WIDE for rows in (every, lost)]:
        beside = placed.beside(distance)[rows]
        known = np.isfinite(beside)
        shift = find_shift(part.normal[rows[known]], beside[known])
        if shift is None:
            continue
        touched = placed.touched(every, placed.point - placed.rotation @ shift, placed.normal)
        if touched.mean() < ALIKE or touched[lost].mean() < ALIKE:
            continue
        words = ", ".join(f"{axis} {one / MM:+.2f}" for axis, one in zip("XYZ", shift.tolist(), strict=True))
        message = f"all points are shifted against the surface of this program by {words} mm"
        help = "measure in the axes of the program's $BASE, or move the points: their origin is another one"
        return [Finding("LRN003", message, str(part.file), help=help)]
    return []


def _other_normals(placed: PlacedPart, lost: Ints) -> list[Finding]:
    """Points ``lost`` (J,) that tools touch if their normals are others."""
    part = placed.part
    own = part.normal[lost]
    named = {words: change(own) for words, change in _MISTAKES.items()}
    right = {words: _right(placed, lost, own, normal) for words, normal in named.items()}
    any_right = np.any(list(right.values()), axis=0)
    for axis in np.vstack([np.eye(3), -np.eye(3)]):
        any_right |= _right(placed, lost, own, np.tile(axis, (len(lost), 1)))
    count = int(any_right.sum())
    if count < max(FEW_BESIDE, 0.5 * len(lost)):
        return []
    words = max(right, key=lambda one: int(right[one].sum()))
    message = (
        f"{count} of {len(part)} points lie on the surface that the tools leave, but their normals do not"
    )
    if right[words].sum() >= max(FEW_BESIDE, 0.5 * count):
        message += f"; they would if {words}"
    help = "NX, NY, NZ lead out of the material, in the axes of the program's $BASE"
    return [Finding("LRN003", message, str(part.file), int(part.line[lost[any_right]][0]), help=help)]


def _right(placed: PlacedPart, rows: Ints, own: Floats, normal: Floats) -> Bools:
    """(J,) whether tools touch the points ``rows`` (J,) with another ``normal`` (J, 3) than their ``own``."""
    other = np.sum(own * normal, axis=1) < OTHER
    rotation = np.broadcast_to(placed.rotation, (len(rows), 3, 3))
    return np.asarray(other & placed.touched(rows, placed.point[rows], turned(rotation, normal)))


def _exchanged(order: tuple[int, ...]) -> Callable[[Floats], Floats]:
    return lambda normal: normal[:, order]


def _against(axis: int) -> Callable[[Floats], Floats]:
    return lambda normal: normal * np.where(np.arange(3) == axis, -1.0, 1.0)


_MISTAKES: dict[str, Callable[[Floats], Floats]] = {
    "all had the other sign: they lead into the material": lambda normal: -normal,
    **{
        f"their columns were in the order {', '.join(['NX', 'NY', 'NZ'][i] for i in order)}": _exchanged(
            order
        )
        for order in permutations(range(3))
        if order != (0, 1, 2)
    },
    **{f"N{axis} had the other sign": _against(i) for i, axis in enumerate("XYZ")},
}
