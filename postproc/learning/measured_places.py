"""Measured places beside the nominal ones: on which side of the surface they lie shows what a positive DEV means."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from postproc.base.arrays import Floats, Ints
from postproc.base.findings import Refusal
from postproc.base.tables import CsvTable

PLACES = ("mx", "my", "mz")

ROUNDED, ALIKE = 2e-3, 0.2
"""[mm] by which a place may differ from its deviation, or this share of the deviations where that is more."""

FEWEST = 8
"""Points with a measured place, more than an alignment has freedoms."""


def sign_shown(
    table: CsvTable, nominal: tuple[Floats, Floats], deviation: Floats, rows: Ints, freedoms: Sequence[str]
) -> bool:
    """Whether the measured places of a file show the sign of the deviations (K,) [mm], positive where material is left:
    n . (m - x) = DEV, but for the ``freedoms`` of the alignment; nominal: x (K, 3) [mm] and n (K, 3); rows (J,): those
    that have a deviation.  Raises Refusal LRN001 where they show the other sign, or belong to other deviations."""
    if not any(name in table for name in PLACES):
        return False
    for name in PLACES:
        if name not in table:
            raise table.header_error(
                f"column {name.upper()!r} is missing",
                "write MX, MY and MZ, the measured place, or none of them",
            )
    place = np.stack([table.numbers_or_nan(name) for name in PLACES], axis=1)
    own = rows[np.isfinite(place[rows]).all(axis=1)]
    if len(own) < FEWEST:
        return False
    point, normal = nominal[0][own], nominal[1][own]
    off = np.sum((place[own] - point) * normal, axis=1)
    middle = point - point.mean(axis=0)
    rigid = np.concatenate([normal, np.cross(middle, normal)], axis=1)
    free = rigid[:, ["xyzabc".index(one) for one in freedoms]]
    stated, turned = (_apart(off - sign * deviation[own], free) for sign in (1, -1))
    enough = max(ROUNDED, ALIKE * float(np.median(np.abs(deviation[own]))))
    if stated <= enough:
        return turned > enough
    far = int(own[np.argmax(np.abs(deviation[own]))])
    if turned <= enough:
        raise _refused(
            table, far, "DEV contradicts its measured place, which is on the other side of the surface"
        )
    raise _refused(table, far, "its measured place does not lie off the nominal one by DEV")


def _apart(values: Floats, free: Floats) -> float:
    """Median size of (K,) values after the best alignment by the columns ``free`` (K, A)."""
    best = np.linalg.lstsq(free, values, rcond=None)[0]
    return float(np.median(np.abs(values - free @ best)))


def _refused(table: CsvTable, row: int, message: str) -> Refusal:
    help = (
        "MX, MY, MZ are the measured point of the surface in mm, not the centre of the probe; `# positive:` states what"
        " a positive DEV is"
    )
    return table.error(row, "MX", message, help)
