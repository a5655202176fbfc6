"""What a file of readings may have been meant to be: exchanged columns, another sign, another unit."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import combinations

import numpy as np

from postproc.base.arrays import Floats
from postproc.identification.campaign import Campaign
from postproc.measurements import Readings


def changed_readings(readings: Readings, campaign: Campaign) -> Iterator[tuple[str, Readings]]:
    """Each change in words, and the changed readings."""
    letters = ("DX", "DY", "DZ") if readings.deflection else ("X", "Y", "Z")
    for a, b in combinations(range(readings.q.shape[1]), 2):
        if readings.joints[a][1] == readings.joints[b][1]:
            names = f"the columns of {readings.joints[a][0]} and {readings.joints[b][0]}"
            yield f"{names} exchanged", replace(readings, q=_exchanged(readings.q, a, b), direction=None)
    for k, (name, _) in enumerate(readings.joints):
        q = readings.q.copy()
        q[:, k] *= -1.0
        yield f"the opposite sign of {name}", replace(readings, q=q, direction=None)
    if campaign.tracked:
        # a tracker may be anyhow: which two it is does not show
        value = _exchanged(readings.value, 0, 1)
        yield "two of X, Y, Z exchanged, or one of them with the other sign", replace(readings, value=value)
    for a, b in combinations(range(3), 2) if not campaign.tracked else ():
        value = _exchanged(readings.value, a, b)
        yield f"{letters[a]} and {letters[b]} exchanged", replace(readings, value=value)
    stated = [name for name in readings.targets if name in readings.places]
    for name in stated if len(stated) > 1 and campaign.tracked else ():
        places = {other: place for other, place in readings.places.items() if other != name}
        yield f"another place of target {name} than the stated one", replace(readings, places=places)
    for one, other in combinations(stated, 2):
        places = {**readings.places, one: readings.places[other], other: readings.places[one]}
        yield f"the targets {one} and {other} exchanged", replace(readings, places=places)
    if readings.deflection:
        value = -readings.value
        yield "the opposite sign of all deflections (unloaded minus loaded)", replace(readings, value=value)
        for a, b in combinations(range(3), 2):
            names = f"F{'XYZ'[a]} and F{'XYZ'[b]}"
            yield f"{names} exchanged", replace(readings, wrench=_exchanged(readings.wrench, a, b))
    else:
        for word, factor in (("metres", 1e3), ("inches", 25.4), ("micrometres", 1e-3)):
            yield f"positions in {word}", replace(readings, value=readings.value * factor)
    if not campaign.tracked:
        for k in range(3):
            value = readings.value.copy()
            value[:, k] *= -1.0
            yield f"the opposite sign of {letters[k]}", replace(readings, value=value)
        for shift in (1, 2):
            value = np.roll(readings.value, shift, axis=1)
            order = ", ".join(np.roll(letters, -shift))
            yield f"the columns named {order}", replace(readings, value=value)


def _exchanged(values: Floats, a: int, b: int) -> Floats:
    changed = values.copy()
    changed[:, [a, b]] = changed[:, [b, a]]
    return changed
