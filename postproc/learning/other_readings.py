"""Whether a file that is read otherwise than it states is far likelier: with the other sign, or of another program.

The errors that a compensated program leaves are S x, with causes x as likely as -x: their first order has no sign.  It
shows by shares, which are not linear (an error that is half as large again needs a force times compliance of 1.5, its
negative one of 0.5), and by gaps, loops and compliances, which have no negative values.  So both readings are explained
as well as they can be, with the effects that each of them asks for, and compared.  Where robot and forces are as usual
the ratio is about one (``python -m tests.blind_parts.bad_files``): then only measured places show the sign.

From a ratio of exp(3) = 20 on a file is refused.  Where one file in twenty has a wrong sign, it is then as likely wrong
as right, and the ratio exceeds 20 for at most 5 % of the right ones: its mean over these is one (Markov's inequality).
Between 1/20 and 20 the file is learnt from with a warning.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from postproc.base.arrays import Bools, Floats
from postproc.base.findings import Finding
from postproc.learning.attribution import Attribution, attribute, evidence_of
from postproc.learning.candidates import Circumstances
from postproc.learning.causes import CausePrediction
from postproc.learning.plausible import EXCHANGED, LIKELIER, wrong_program, wrong_sign

HOPELESS = 100.0
"""Logarithm: a reading that is so much less likely by the known causes gets no effects of its own."""


@dataclass(frozen=True, eq=False)
class StatedPart:
    """A part as its ``file`` states it: its ``points`` (K,) among those of all parts; ``original``: the uncompensated
    program cut it; ``sign_seen``: measured places show its sign."""

    points: Bools
    original: bool
    file: str
    sign_seen: bool


def check_readings(
    known: CausePrediction, result: Attribution, around: Circumstances, parts: Sequence[StatedPart]
) -> list[Finding]:
    """Whether the other sign of one of the ``parts``, or for the original program a compensated one, explains all
    points of an attribution far better, an error each; or, as a warning, whether the points do not show the sign."""
    alone, deviation, present = len(parts) == 1, result.deviation, result.evidence
    turned = -np.inf
    for part in parts:
        if not part.sign_seen:
            other = np.where(part.points, -deviation, deviation)
            turned = _likeliest(known, result, around, other, search=alone) - present
            if turned > (LIKELIER if alone else EXCHANGED):
                return [wrong_sign(turned, part.file)]
        if part.original:
            uncorrected = np.where(part.points, known.errors(known.before[0]), 0.0)
            # with effects of their own the two readings become alike: a loop may act as the correction does
            stated = evidence_of(known, deviation, result.layout)
            compensated = evidence_of(known, deviation + uncorrected, result.layout) - stated
            if compensated > (LIKELIER if alone else EXCHANGED):
                return [wrong_program(compensated, part.file)]
    unseen = [part for part in parts if not part.sign_seen]
    if unseen and not alone:
        # one mistake in the template of a shop is in all its files
        every = np.any([part.points for part in unseen], axis=0)
        turned = _likeliest(known, result, around, np.where(every, -deviation, deviation)) - present
    return [_unseen_sign(turned, unseen[0].file)] if unseen and turned > -LIKELIER else []


def _likeliest(
    known: CausePrediction,
    result: Attribution,
    around: Circumstances,
    deviation: Floats,
    search: bool = False,
) -> float:
    """Logarithm of the probability of deviations (K,) [m] by the known causes or, with ``search`` and where these are
    not hopeless, by effects that they ask for."""
    best = evidence_of(known, deviation, result.layout)
    if search and best > result.evidence - HOPELESS:
        try:
            best = max(best, attribute(known, deviation, result.layout, around).evidence)
        except np.linalg.LinAlgError:
            return best
    return best


def _unseen_sign(gain: float, file: str) -> Finding:
    """That nothing but a comment states the sign; gain: logarithm of how much likelier the other one is."""
    message = (
        f"the points do not show the sign of DEV (exp({gain:.1f}) times as likely with the other one): only"
        " `# positive:` states it, and a wrong one doubles the error of the next part"
    )
    help = "add the measured places of the report as columns MX, MY, MZ, or probe one with more material than nominal"
    return Finding("LRN019", message, file, help=help)
