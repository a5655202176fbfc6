"""On which side of a vertex the correction goes over, where the force steps inside of a cut.

The force steps there at once, the correction cannot.  Where it goes over before the vertex, the tool is meanwhile off
by the step d of the correction, at most; where it goes over after it, by -d.  What the tool leaves by being off to the
free side it cuts when it is at the vertex itself, with the right correction; what it digs into the part stays.
"""

from __future__ import annotations

import numpy as np

from postproc.base.arrays import Floats, Ints
from postproc.base.geometry import turned
from postproc.base.units import MM
from postproc.compensation.problem import CompensationProblem
from postproc.part.displacement import Displacements
from postproc.process.stock.cells import Stock, stock_distance
from postproc.process.stock.compiled import compiled
from postproc.process.stock.cutters import CUTTING, Cutter
from postproc.process.stock.distance import AXIS, TIP_POINT
from postproc.process.stock.simulation import StockRun

_ANGLES, _ALONG = 32, 24
_HIGHEST = 60 * MM  # of edges that are looked at
_LEAST = 1e-6  # m: less is no gouge


def find_early_shares(task: CompensationProblem, run: StockRun, rows: Ints, change: Floats) -> Floats:
    """(K,) of the steps ``change`` (K, 3) [m] of the correction, path axes, at the start of motions ``rows`` (K,), 1
    where the tool digs less into the part if they go over before it, else 0.

    Whole: two ramps for a step have their ends nearer to other points than the controller follows.
    """
    sweeps = run.sweeps
    to_stock = Displacements(task, sweeps.in_stock).to_stock(rows)
    change = turned(to_stock, change)
    first = np.searchsorted(sweeps.motion, rows)
    shares = np.zeros(len(rows))
    surfaces = [_cutting_surface(cutter) for cutter in sweeps.cutters]
    for k, at in enumerate(first.tolist()):
        if at == len(sweeps.motion) or sweeps.motion[at] != rows[k] or sweeps.share[at, 0] > 0.0:
            continue
        axis, tip = sweeps.rows[at, AXIS : AXIS + 3], sweeps.rows[at, TIP_POINT : TIP_POINT + 3]
        side = np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))])
        side /= np.linalg.norm(side)
        surface = tip + surfaces[sweeps.which[at]] @ np.stack([side, np.cross(axis, side), axis])
        early, late = (_deepest(run.engagement.stock, surface + sign * change[k]) for sign in (1.0, -1.0))
        shares[k] = float(late > early + _LEAST)
    return shares


def _cutting_surface(cutter: Cutter) -> Floats:
    """(P, 3) [m] points on the edges of a cutter with its tip at the origin and its spindle along z."""
    parts = []
    for part, round_, *ends, _ in cutter.profile().tolist():
        if part != CUTTING:
            continue
        share = np.linspace(0.0, 1.0, _ALONG)
        if round_:
            r, z, corner = ends[:3]
            parts.append(
                np.stack(
                    [r + corner * np.sin(0.5 * np.pi * share), z - corner * np.cos(0.5 * np.pi * share)],
                    axis=1,
                )
            )
        else:
            r0, z0, r1, z1 = ends[:4]
            high = min(z1, max(z0, _HIGHEST))
            parts.append(np.stack([r0 + share * (r1 - r0), z0 + share * (high - z0)], axis=1))
    across, height = np.concatenate(parts).T
    phi = np.arange(_ANGLES) * (2.0 * np.pi / _ANGLES)
    return np.stack(
        [
            np.outer(across, np.cos(phi)).ravel(),
            np.outer(across, np.sin(phi)).ravel(),
            np.repeat(height, _ANGLES),
        ],
        axis=1,
    )


@compiled
def _deepest(stock: Stock, points: Floats) -> float:
    """[m] how deep the deepest of the points (P, 3) is in what all sweeps leave."""
    most = 0.0
    for k in range(len(points)):
        most = max(most, stock_distance(stock, points[k, 0], points[k, 1], points[k, 2], len(stock.sweeps)))
    return most
