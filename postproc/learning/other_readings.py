"""Whether a file that is read otherwise than it states is far likelier: with the other sign, or of another program.

A deviation d and -d are equally likely to causes that act linearly.  Shares are not linear: an error that is half as
large again needs a force times compliance of 1.5, its negative one of 0.5, which is much farther from what is known.
So a file is compared by the causes that explain it best, each about their own values.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from postproc.base.arrays import Bools
from postproc.base.findings import Finding
from postproc.learning.attribution import Attribution, evidence_of
from postproc.learning.causes import CausePrediction
from postproc.learning.plausible import EXCHANGED, LIKELIER, wrong_program, wrong_sign

STRAINED = 1.5
"""Standard deviations before the measurement from which on a cause may have an easier explanation."""


def check_readings(
    known: CausePrediction, result: Attribution, parts: Sequence[tuple[Bools, bool, str]]
) -> list[Finding]:
    """Whether the other sign of one of the ``parts``, or for the original program a compensated one, explains all
    points of an attribution far better by the ``known`` causes; of each part its points (K,), whether the original cut
    it as its file states, and the name of that file."""
    strained = any(
        cause.is_share() and abs(x) > STRAINED * cause.deviation
        for cause, x in zip(known.causes, result.x.tolist(), strict=False)
    )
    if not strained and len(parts) == 1 and not parts[0][1]:
        return []
    # parts that differ a little contradict each other a little, whatever their signs
    enough = LIKELIER if len(parts) == 1 else EXCHANGED
    present = evidence_of(known, result.deviation, result.layout)
    for own, original, file in parts:
        other = np.where(own, -result.deviation, result.deviation)
        turned = evidence_of(known, other, result.layout) - present
        if turned > enough:
            return [wrong_sign(turned, file)]
        if not original:
            continue
        uncorrected = np.where(own, known.errors(known.before[0]), 0.0)
        compensated = evidence_of(known, result.deviation + uncorrected, result.layout) - present
        if compensated > enough:
            return [wrong_program(compensated, file)]
    return []
