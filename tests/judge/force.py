"""The wrench at each place of the original's path.

A force belongs to the place where the material is.  Stated in @base, @world, @tool or @feed, it is turned into the
axes of the base where the tool stands on the original's path: in the feed frame z is the spindle axis from the tip
back to the spindle, x the feed across it, y = z x x; within 1 deg of z, and where only the orientation turns, the
last x stays.

At a vertex inside a cut that turns by less than 30 deg, and where the force does not jump, the wrench is the mean of
both sides; along a motion it is linear, on an arc linear in the frame that turns with it.  At any other vertex it
changes linearly over a ramp of total length r, half of it on each side (at most half of each motion), through the
mean of both sides at the vertex.  A cut begins and ends with steps.

That is the rule CENTRED.  By the rule AFTER the motion before a vertex keeps its force up to it, and the change goes
over along r behind it.  What remains of the change there turns with the frame in which the force behind the vertex is
stated, up to the next such vertex or another kind of frame, and stays behind: exactly on an arc; at other motions' ends
the mean of both sides, as the wrench is, and straight in between, or by that at the last vertex where r ends there.

By the rule STRETCHED, which the package states of its output and which is judged by, along r = max(ramp, d / 0.9)
behind it: d is by how much the target that brings the tool to the vertex goes back along the feed there, from the force
that ends to the force that begins.  A ramp of the stated length alone would ask for a program that goes back into the
material, and for a tool that jumps: with d > r the tool is at two places of the path with the force of either.  So what
is written can only be right for a force that changes over r, and is judged under that one.  At 0.9 the place answers
ten times to what the ramp is off (1 / (1 - 0.9)): d has to be exact, and is solved for."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from .path import Path

SMOOTH = np.radians(30.0)
JUMP, JUMP_OF_LARGEST = 2 * np.sin(SMOOTH / 2), 0.05
NO_DIRECTION = np.radians(1.0)
CENTRED, AFTER, STRETCHED = "centred", "after", "stretched"
RULE = STRETCHED
"""The rule that the package has."""
STEEPEST = 0.9


class Field:
    """The wrench (6,) in base axes along one cut, motions ``low`` to ``high`` of the original's path."""

    def __init__(
        self,
        path: Path,
        low: int,
        high: int,
        ramp: float,
        largest: float,
        rule: str = CENTRED,
        correct: Callable[[int, np.ndarray], np.ndarray] | None = None,
    ) -> None:
        """``low``, ``high``: first and last motion; largest [N]: of the program; correct: by how much (3,) [m]
        a target is moved where a motion begins under a wrench (6,), for the rule STRETCHED."""
        self.path, self.low, self.high = path, low, high
        self.rows = np.arange(low, high + 1)
        motions = path.motions[low : high + 1]
        self.frames = np.array([m.force[1] for m in motions])
        self.stated = np.array([m.force[0] for m in motions]).reshape(-1, 2, 3)
        self.kept = np.full((len(self.rows), 3), np.nan)
        self.kept = self._kept_x()
        begin, end = (self._turned(self.rows, np.full(len(self.rows), s)) for s in (0.0, 1.0))
        smooth = self._smooth(begin, end, largest)
        mean = 0.5 * (end[:-1] + begin[1:])
        end[:-1][smooth], begin[1:][smooth] = mean[smooth], mean[smooth]
        self.begin, self.end = begin, end
        # ramps at the vertices that are left: their half, and the wrench in their middle
        step = np.flatnonzero(~smooth)
        self.after: list[tuple[float, float, int, np.ndarray, np.ndarray]] = []
        if rule != CENTRED:
            for k, following in zip(step, [*step[1:], len(end) - 1], strict=False):
                reach, change = ramp, begin[k + 1] - end[k]
                if rule == STRETCHED and correct is not None:
                    moved = correct(low + k + 1, end[k]) - correct(low + k + 1, begin[k + 1])
                    feed = path.tangent(np.array([low + k + 1]), np.zeros(1))[0]
                    reach = max(ramp, moved @ feed / STEEPEST)
                first, until = int(k) + 1, int(following) + 1
                kinds = self.frames[first:until]
                if np.any(other := kinds != kinds[0]):
                    until = first + int(np.argmax(other))
                self.after.append((path.start[low + first], reach, first, *self._apart(change, first, until)))
            step = step[:0]
        lengths = path.length[self.rows]
        self.ramp = np.zeros((2, len(self.rows)))  # at the begin and at the end of each motion
        self.ramp[0, step + 1] = np.minimum(ramp / 2, lengths[step + 1] / 2)
        self.ramp[1, step] = np.minimum(ramp / 2, lengths[step] / 2)
        self.middle = np.zeros((2, len(self.rows), 6))
        self.middle[0, step + 1] = self.middle[1, step] = mean[step]
        self.steps = len(step)

    def _z(self, i: np.ndarray, share: np.ndarray) -> np.ndarray:
        _, rotation, _ = self.path.on_motion(i, share)
        spindle = np.array([m.spindle for m in self.path.motions])[i]
        return -np.einsum("kij,kj->ki", rotation, spindle)

    def _x(self, i: np.ndarray, share: np.ndarray) -> np.ndarray:
        """(K, 3) the feed across the spindle, NaN where it has no direction."""
        z, along = self._z(i, share), self.path.tangent(i, share)
        across = along - (along * z).sum(1, keepdims=True) * z
        size = np.linalg.norm(across, axis=1)
        none = (size < np.sin(NO_DIRECTION)) | (self.path.length[i] < 1e-6)
        return np.where(none[:, None], np.nan, across / np.maximum(size, 1e-15)[:, None])

    def _kept_x(self) -> np.ndarray:
        """(n, 3) for motions without a direction: that at the end of the last one that has one, else the next."""
        ends = self._x(self.rows, np.ones(len(self.rows)))
        begins = self._x(self.rows, np.zeros(len(self.rows)))
        kept, last = np.full_like(ends, np.nan), np.full(3, np.nan)
        for k in range(len(ends)):
            kept[k] = last
            if not np.isnan(ends[k, 0]):
                last = ends[k]
        following = np.full(3, np.nan)
        for k in range(len(ends))[::-1]:
            if np.isnan(kept[k, 0]):
                kept[k] = following
            if not np.isnan(begins[k, 0]):
                following = begins[k]
        return kept

    def _axes(self, i: np.ndarray, share: np.ndarray) -> np.ndarray:
        """(K, 3, 3) columns: the axes, in the base, of the frame in which the force is stated."""
        found = np.broadcast_to(np.eye(3), (len(i), 3, 3)).copy()
        which = self.frames[i - self.low]
        if (rows := np.flatnonzero(which == "world")).size:
            found[rows] = np.array([self.path.motions[k].base[0].T for k in i[rows]])
        if (rows := np.flatnonzero(which == "tool")).size:
            found[rows] = self.path.on_motion(i[rows], share[rows])[1]
        if (rows := np.flatnonzero(which == "feed")).size:
            z, x = self._z(i[rows], share[rows]), self._x(i[rows], share[rows])
            kept = self.kept[i[rows] - self.low]
            kept = kept - (kept * z).sum(1, keepdims=True) * z
            kept /= np.linalg.norm(kept, axis=1, keepdims=True)
            x = np.where(np.isnan(x), kept, x)
            found[rows] = np.stack([x, np.cross(z, x), z], axis=2)
        return found

    def _turned(self, i: np.ndarray, share: np.ndarray) -> np.ndarray:
        """(K, 6) what is stated for motions, in base axes at the shares."""
        pairs = np.einsum("kij,kpj->kpi", self._axes(i, share), self.stated[i - self.low])
        return pairs.reshape(-1, 6)

    def _smooth(self, begin: np.ndarray, end: np.ndarray, largest: float) -> np.ndarray:
        """(n - 1,) vertices at which the wrench goes over."""
        before, after = self.rows[:-1], self.rows[1:]
        one = self.path.tangent(before, np.ones(len(before)))
        two = self.path.tangent(after, np.zeros(len(after)))
        cosine = np.clip((one * two).sum(1), -1, 1)
        size = np.maximum(np.linalg.norm(end[:-1, :3], axis=1), np.linalg.norm(begin[1:, :3], axis=1))
        change = np.linalg.norm(begin[1:, :3] - end[:-1, :3], axis=1)
        jumps = change > np.maximum(JUMP * size, JUMP_OF_LARGEST * largest)
        return (cosine > np.cos(SMOOTH)) & ~jumps

    def _apart(self, change: np.ndarray, first: int, until: int) -> tuple[np.ndarray, np.ndarray]:
        """(until - first, 6) what a change (6,) where motion ``first`` begins is where motions begin and end."""
        i = self.low + np.arange(first, until)
        sides = [self._axes(i, np.full(len(i), t)) for t in (0.0, 1.0)]
        if self.frames[first] in ("base", "world"):
            sides = [np.broadcast_to(np.eye(3), (len(i), 3, 3))] * 2
        own = change.reshape(2, 3) @ sides[0][0]
        begin, end = (np.einsum("kij,pj->kpi", side, own).reshape(-1, 6) for side in sides)
        begin[1:] = end[:-1] = 0.5 * (begin[1:] + end[:-1])
        return begin, end

    def _plain(
        self, i: np.ndarray, share: np.ndarray, own: tuple[np.ndarray, np.ndarray] | None = None
    ) -> np.ndarray:
        """(K, 6) along motions, as if no vertex had a ramp; ``own``: other wrenches (n, 6) than those at their ends."""
        k, t = i - self.low, share[:, None]
        ends = (self.begin, self.end) if own is None else own
        wrench = (1 - t) * ends[0][k] + t * ends[1][k]
        rows = np.flatnonzero(self.path.arc[i] & np.isin(self.frames[k], ("feed", "tool")))
        if len(rows):
            zero, one = np.zeros(len(rows)), np.ones(len(rows))
            first, here, last = (self._axes(i[rows], s) for s in (zero, share[rows], one))
            own = (1 - t[rows])[..., None] * np.einsum(
                "kji,kpj->kpi", first, ends[0][k[rows]].reshape(-1, 2, 3)
            )
            own += t[rows][..., None] * np.einsum("kji,kpj->kpi", last, ends[1][k[rows]].reshape(-1, 2, 3))
            wrench[rows] = np.einsum("kij,kpj->kpi", here, own).reshape(-1, 6)
        return wrench

    def at(self, label: np.ndarray) -> np.ndarray:
        """(K, 6) the wrench at labels of the original's path."""
        i, share = self.path.find(label, self.low, self.high)
        wrench = self._plain(i, share)
        k, length = i - self.low, self.path.length[i]
        for side, away in ((0, share * length), (1, (1 - share) * length)):
            half = self.ramp[side, k]
            rows = np.flatnonzero(away < half)
            if len(rows):
                own = self.begin if side == 0 else self.end
                change = self.middle[side, k[rows]] - own[k[rows]]
                wrench[rows] += (1 - away[rows] / half[rows])[:, None] * change
        for place, reach, first, begin, end in self.after:
            behind = label - place
            on = np.flatnonzero((behind >= 0) & (behind < reach))
            for m in np.unique(k[on]):
                rows = on[k[on] == m]
                part, t = (1 - behind[rows] / reach)[:, None], share[rows, None]
                at = m + self.low
                if m - first >= len(begin):
                    wrench[rows] -= part * end[-1]
                elif self.path.arc[at] and self.frames[m] in ("feed", "tool"):
                    sides = np.zeros((2, len(self.rows), 6))
                    sides[:, m] = begin[m - first], end[m - first]
                    wrench[rows] -= part * self._plain(i[rows], share[rows], (sides[0], sides[1]))
                else:
                    since, until = (
                        1 - (self.path.start[at] - place + x) / reach for x in (0.0, self.path.length[at])
                    )
                    straight = (1 - t) * since * begin[m - first] + t * until * end[m - first]
                    wrench[rows] -= straight if until > 0 else part * begin[m - first]
        return wrench
