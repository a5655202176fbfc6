"""The play of a gear: its output is at rest until the motor has crossed the gap, in the order of the path.

    y_k = min(max(y_{k-1}, x_k - g/2), x_k + g/2)          motor x, output y, gap g

the play operator (backlash operator; M. A. Krasnosel'skii, A. V. Pokrovskii: Systems with Hysteresis, Springer 1989,
ch. 1), of which Prandtl-Ishlinskii models of hysteresis are sums (M. Brokate, J. Sprekels: Hysteresis and Phase
Transitions, Springer 1996, ch. 2).  Gaps in series are one gap of their sum.
"""

from __future__ import annotations

import numpy as np

from postproc.base.arrays import Bools, Floats


def play_output(motor: Floats, gap: Floats, restart: Bools) -> Floats:
    """(S, n) [rad, m] output of n gears whose motors go through ``motor`` (S, n) in order, each monotone in between.

    ``gap`` (n,) or (S, n) > 0, the whole of it.  ``restart`` (S,): nothing is known of how the motors came there, and
    the output is in the middle of the gap; so does the first one.

    A clip followed by a clip is a clip, and so is a whole block of them.  The clip of every block, then the output
    where each one starts, then that inside of all blocks at once: 3 sqrt(S) steps instead of S.
    """
    count, joints = motor.shape
    if not count:
        return motor.copy()
    half = np.where(restart[:, None], 0.0, 0.5 * gap)
    half[0] = 0.0
    rows = int(np.ceil(np.sqrt(count)))
    blocks = -(-count // rows)
    shape, pad = (blocks, rows, joints), ((0, blocks * rows - count), (0, 0))
    low, high = (np.pad(motor + sign * half, pad, "edge").reshape(shape) for sign in (-1.0, 1.0))
    least, most = np.full((blocks, joints), -np.inf), np.full((blocks, joints), np.inf)
    for i in range(rows):
        least, most = _clipped(least, low[:, i], high[:, i]), _clipped(most, low[:, i], high[:, i])
    here = np.zeros((blocks, joints))
    for block in range(1, blocks):
        here[block] = _clipped(here[block - 1], least[block - 1], most[block - 1])
    output = np.empty(shape)
    for i in range(rows):
        here = output[:, i] = _clipped(here, low[:, i], high[:, i])
    return output.reshape(-1, joints)[:count]


def share(motor: Floats, output: Floats, gap: Floats) -> Floats:
    """(S, n) -1..1 how far ``motor`` (S, n) [rad, m] is ahead of its ``output`` (S, n) [rad, m], as a share of half the
    ``gap`` (n,) or (S, n): 1 after a motion upwards."""
    return np.asarray(np.clip((motor - output) / (0.5 * gap), -1.0, 1.0))


def _clipped(value: Floats, low: Floats, high: Floats) -> Floats:
    return np.minimum(np.maximum(value, low), high)
