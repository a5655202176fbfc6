"""Whether a file that is read otherwise than it states is far likelier: with the other sign, or of another program.

The errors that a compensated program leaves are S x, with causes x as likely as -x: their first order has no sign.  It
shows by shares, which are not linear (an error that is half as large again needs a force times compliance of 1.5, its
negative one of 0.5), and by gaps, loops and compliances, which have no negative values.  So both readings are explained
as well as they can be, with the effects that each of them asks for, and compared.  Where robot and forces are as usual
the ratio is about one (``python -m tests.blind_parts.bad_files``): no computation shows the sign then, and none avoids
the question.  With the errors e of the part and a correction c, the next part has e - c as stated, -e - c with the
other sign, and

    |e - c|^2 + |-e - c|^2 = 2 |e|^2 + 2 |c|^2:

both are no worse than before only for c = 0.  So a second statement is asked for (``checked_place``,
``measured_places``), unless the next part is no worse either way.

From a ratio of exp(3) = 20 on the other sign is called probable.  Where one file in twenty has a wrong sign, it is then
as likely wrong as right, and the ratio exceeds 20 for at most 5 % of the right ones: its mean over these is one
(Markov's inequality).  By the same inequality at most one wrong file in a thousand is ``SURE`` to be right.
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
from postproc.learning.promise import aligned, alignment_basis

EVEN = 2.0
"""Odds below it are reported as even."""

HOPELESS = 100.0
"""Logarithm: a reading that is so much less likely by the known causes gets no effects of its own."""

SURE = float(np.log(1000.0))
"""Logarithm: how much likelier the deviations are as stated where nothing but `# positive:` states their sign."""

WORSE = 1.0
"""Times the scatter of the probe: less is no worse.  Errors that could grow by more leave deviations of four times the
scatter, which a second look can tell."""


@dataclass(frozen=True, eq=False)
class StatedPart:
    """A part as its ``file`` states it: its ``points`` (K,) among those of all parts; ``original``: the uncompensated
    program cut it; ``sign_seen``: the part itself shows its sign; ``sign_repeated``: the user stated it again;
    ``largest``: X Y Z [mm] of its largest deviation, in words."""

    points: Bools
    original: bool
    file: str
    sign_seen: bool
    sign_repeated: bool = False
    largest: str = "X Y Z"


def check_readings(
    known: CausePrediction,
    result: Attribution,
    around: Circumstances,
    parts: Sequence[StatedPart],
    gain: float = 1.0,
) -> list[Finding]:
    """Whether the other sign of one of the ``parts``, or of all, or for the original program a compensated one,
    explains all points of an attribution far better, or whether the points do not show the sign: an error each, or a
    warning where the sign is stated twice, or the next part, with ``gain`` of what was learnt, is no worse either
    way."""
    alone, deviation, present = len(parts) == 1, result.deviation, result.evidence
    alternatives: list[tuple[float, Floats, StatedPart]] = []
    for part in parts:
        if not part.sign_seen:
            other = np.where(part.points, -deviation, deviation)
            turned = _likeliest(known, result, around, other, search=alone) - present
            if turned > (LIKELIER if alone and not part.sign_repeated else EXCHANGED):
                return [wrong_sign(turned, part.file)]
            alternatives.append((turned, other, part))
        if part.original:
            uncorrected = np.where(part.points, known.errors(known.before[0]), 0.0)
            # with effects of their own the two readings become alike: a loop may act as the correction does
            stated = evidence_of(known, deviation, result.layout)
            compensated = evidence_of(known, deviation + uncorrected, result.layout) - stated
            if compensated > (LIKELIER if alone else EXCHANGED):
                return [wrong_program(compensated, part.file)]
    if len(alternatives) > 1:
        # one mistake in the template of a shop is in all its files
        every = np.any([part.points for _, _, part in alternatives], axis=0)
        other = np.where(every, -deviation, deviation)
        alternatives.append((_likeliest(known, result, around, other) - present, other, alternatives[0][2]))
    undecided = [one for one in alternatives if one[0] > -SURE]
    if not undecided:
        return []
    for turned, other, part in undecided:
        if not part.sign_repeated and _is_worse(result, other, parts[-1].points, gain):
            return [_unseen_sign("LRN020", turned, part)]
    return [_unseen_sign("LRN019", undecided[0][0], undecided[0][2])]


def _is_worse(result: Attribution, other: Floats, last: Bools, gain: float) -> bool:
    """Whether the next part exceeds the part that was cut last, at the points ``last`` (K,), if its deviations are
    ``other`` (K,) [m] and the correction is that of the deviations as stated."""
    own = np.flatnonzero(last & result.kept)
    if not len(own):
        return True
    basis = alignment_basis(result.layout.free[own])
    before, correction = aligned(other[own], basis), aligned((result.by_causes + result.by_field)[own], basis)
    sizes = [float(np.sqrt(np.mean(one**2))) for one in (before, before - gain * correction)]
    return sizes[1] - sizes[0] > WORSE * float(np.sqrt(np.mean(result.layout.sigma[own] ** 2)))


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


def _unseen_sign(code: str, gain: float, part: StatedPart) -> Finding:
    """That nothing but a comment states the sign; gain: logarithm of how much likelier the other one is."""
    message = (
        f"the points do not show the sign of DEV (the other one is {_odds(gain)}): only `# positive:` states it, and a"
        " wrong one doubles the error of the next part"
    )
    help = (
        f"look at the part again at {part.largest}, and add what is found there as `# checked: {part.largest}"
        " material_left` or `... material_missing`; or add the measured places as columns MX, MY, MZ; `--positive` only"
        " states the sign again"
    )
    return Finding(code, message, part.file, help=help)


def _odds(gain: float) -> str:
    """Of a logarithm, in words."""
    ratio = float(np.exp(min(abs(gain), HOPELESS)))
    if ratio < EVEN:
        return "about as likely"
    return f"{ratio:.{0 if ratio >= 10 else 1}f} times {'likelier' if gain > 0 else 'less likely'}"
