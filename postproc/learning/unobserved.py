"""What one part does not determine: causes that keep what was known before, and products of which only one is seen."""

from __future__ import annotations

import numpy as np

from postproc.learning.attribution import Attribution

KEPT = 0.9
"""Share of the variance before that is left where a part says next to nothing."""

TWINS = 0.5
"""Share of the standard deviation before to which a sum or difference has to fall, where neither of two does."""


def unobserved(result: Attribution) -> tuple[str, ...]:
    """Names of the causes that keep their interval."""
    left = (result.deviations / result.prediction.deviations) ** 2
    return tuple(c.name for c, one in zip(result.causes, left.tolist(), strict=True) if one >= KEPT)


def products(result: Attribution) -> tuple[tuple[str, str, float], ...]:
    """Pairs of shares of which the product is known far better than each: two names and the 95 % half width of the
    logarithm of the product."""
    shares = [
        i for i, cause in enumerate(result.causes) if cause.is_share() and cause.group in ("robot", "force")
    ]
    prior, found = result.prediction.deviations, []
    for a, i in enumerate(shares):
        for j in shares[a + 1 :]:
            one, other = result.deviations[i], result.deviations[j]
            together = float(np.sqrt(max(float(one**2 + other**2 + 2 * result.covariance[i, j]), 0.0)))
            if (
                together < TWINS * float(np.hypot(one, other))
                and min(one / prior[i], other / prior[j]) > TWINS
            ):
                found.append((result.causes[i].name, result.causes[j].name, 1.96 * together))
    return tuple(sorted(found, key=lambda pair: pair[2]))


def common_scale(result: Attribution) -> tuple[float, float] | None:
    """Standard deviations of the logarithm of the common force and of force times all compliances of the joints, each
    weighted alike; None without both."""
    names = [cause.name for cause in result.causes]
    joints = [i for i, name in enumerate(names) if name.startswith("joint_compliance.")]
    if "force" not in names or not joints:
        return None
    force = names.index("force")
    pick = np.zeros(len(names))
    pick[force] = 1.0
    pick[joints] = 1.0 / len(joints)
    together = float(np.sqrt(max(float(pick @ result.covariance @ pick), 0.0)))
    return float(result.deviations[force]), together


def indistinct(result: Attribution) -> str:
    """What this part does not determine, in words; "" where it determines everything."""
    words = []
    both = common_scale(result)
    if both is not None and both[1] < TWINS * both[0]:
        words.append(
            f"the common force is known to {196 * both[0]:.0f} %, its product with the compliances of the joints to"
            f" {196 * both[1]:.0f} %"
        )
    pairs = products(result)
    if pairs:
        one, other, width = pairs[0]
        words.append(f"of {one} and {other} the product is known to {100 * width:.0f} %")
    kept = unobserved(result)
    if kept:
        shown = ", ".join(kept[:4]) + (f" and {len(kept) - 4} more" if len(kept) > 4 else "")
        words.append(f"{len(kept)} of {len(result.causes)} causes keep what was known before: {shown}")
    return "; ".join(words)
