"""Programs in a stock with tools that are displaced as a test states, and the error of what they leave."""

from __future__ import annotations

import numpy as np
import stock_cases
from stock_cases import MM

from postproc.part.deflected_sweeps import deflect
from postproc.part.surface import find_surface
from postproc.part.surface_error import find_errors
from postproc.process.stock.cell_lists import build_stock

LEVER = 40 * MM


def sweeps_of(path, blank, *cutters):
    """The sweeps of a toolpath, and its stock."""
    sweeps, _ = stock_cases.sweeps_of(path, blank, *cutters)
    stock, _ = build_stock(blank, sweeps.rows, np.array([cutter.numbers for cutter in sweeps.cutters]))
    return sweeps, stock


def errors_of(path, blank, displacement, *cutters, count=20_000):
    """Points, normals (K, 3) and errors (K,) in mm of the surface that the path makes.

    displacement: of (motion, share) -> shift (K, 3) and turn (K, 3) in mm and rad.
    """
    sweeps, stock = sweeps_of(path, blank, *cutters)
    surface = find_surface(stock, count)
    own = surface.sweep >= 0
    largest = 0.0

    def moved(motion, share):
        nonlocal largest
        shift, turn = displacement(motion, share)
        size = np.linalg.norm(shift, axis=1) * MM + LEVER * np.linalg.norm(turn, axis=1)
        largest = max(largest, size.max())
        return shift * MM, turn

    rows, _, _ = deflect(sweeps.rows, sweeps.motion, sweeps.share, LEVER, moved)
    points, normals = surface.points[own], surface.normals[own]
    found = find_errors(stock, rows, 1.05 * largest, points, normals)
    return points / MM, normals, found.error / MM


def constant(shift=(0.0, 0.0, 0.0), turn=(0.0, 0.0, 0.0)):
    """The same displacement everywhere, in mm and rad."""

    def displacement(motion, share):
        return tuple(np.tile(np.array(value, float), (len(motion), 1)) for value in (shift, turn))

    return displacement
