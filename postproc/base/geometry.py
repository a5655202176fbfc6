"""Batched rigid-body geometry: rotations, KUKA's ABC angles, poses.

A rotation is a (..., 3, 3) array whose columns are the axes of the turned frame.  All functions take
any leading shape and work without a loop over it.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from postproc.base.arrays import Floats, Ints, is_shared, numbers


@dataclass(frozen=True)
class Poses:
    """Poses of a frame in another one: ``rotation`` (..., 3, 3), ``position`` (..., 3) [m]."""

    rotation: Floats
    position: Floats

    @staticmethod
    def identity() -> Poses:
        return Poses(np.eye(3), np.zeros(3))

    @staticmethod
    def from_abc(position: ArrayLike, abc: ArrayLike) -> Poses:
        """From a position (..., 3) [m] and KUKA angles A, B, C (..., 3) [rad]."""
        return Poses(rotation_from_abc(abc), np.asarray(position, dtype=float))

    def __matmul__(self, other: Poses) -> Poses:
        """``a_in_w @ b_in_a`` is b in w; leading shapes broadcast."""
        return Poses(
            product(self.rotation, other.rotation),
            self.position + turned(self.rotation, other.position),
        )

    def inverse(self) -> Poses:
        back = np.swapaxes(self.rotation, -1, -2)
        return Poses(back, -turned(back, self.position))

    def __getitem__(self, rows: Any) -> Poses:
        whole = self.rotation.flags.c_contiguous and self.position.flags.c_contiguous
        if (
            whole and isinstance(rows, np.ndarray) and rows.dtype.kind == "i"
        ):  # several times as fast as an index
            return Poses(self.rotation.take(rows, axis=0), self.position.take(rows, axis=0))
        return Poses(self.rotation[rows], self.position[rows])

    def __len__(self) -> int:
        return len(self.position)

    def shared(self, rows: Any) -> Poses:
        """``self[rows]``; one pose where all N are one that is broadcast."""
        same = len(self.position) and is_shared(self.position) and is_shared(self.rotation)
        return self[0] if same else self[rows]

    @staticmethod
    def joined(parts: Sequence[Poses]) -> Poses:
        """The poses of all parts (N_k), one part after another."""
        if len(parts) == 1:
            return parts[0]
        rotations, positions = [part.rotation for part in parts], [part.position for part in parts]
        return Poses(np.concatenate(rotations), np.concatenate(positions))

    def copy(self) -> Poses:
        """The same poses, to be changed."""
        return Poses(self.rotation.copy(), self.position.copy())

    def put(self, rows: Any, poses: Poses) -> None:
        """Sets ``rows`` to ``poses``."""
        self.rotation[rows], self.position[rows] = poses.rotation, poses.position

    def read_only(self) -> Poses:
        """The same poses; their arrays cannot be changed any more."""
        self.rotation.setflags(write=False)
        self.position.setflags(write=False)
        return self


STORED = 1 << 14
"""Poses that are stored rather than computed again."""

REMEMBERED = 1 << 16
"""Poses of a run that is remembered, at most."""

SMALL = 0.01
"""[rad] Angles up to which the first four terms of a series hold to rounding."""

UNKNOWN = Poses(np.full((3, 3), np.nan), np.full(3, np.nan))
"""No pose."""


@dataclass(frozen=True, eq=False)
class _Run:
    """The ``poses`` of rows in a row, from ``start`` to before ``stop``."""

    start: int
    stop: int
    poses: Poses

    def __getitem__(self, asked: tuple[Ints, int, int]) -> Poses:
        """Those of rows (K,), the least of them, and the one behind the largest."""
        rows, low, high = asked
        if high - low == len(rows) and bool((rows[1:] > rows[:-1]).all()):
            return self.poses[low - self.start : high - self.start]
        return self.poses[rows - self.start]


@dataclass(frozen=True, eq=False)
class PoseRows:
    """``count`` poses that are computed where they are asked for: ``build`` gives those of rows (K,).

    A pose takes 96 bytes; of a million motions few are needed at a time.
    """

    count: int
    build: Callable[[Ints], Poses]

    def __getitem__(self, rows: Any) -> Poses:
        """As of ``Poses``: by numbers of rows, a mask, or a slice."""
        return self.build(numbers(rows, self.count))

    def __len__(self) -> int:
        return self.count

    def remembered(self) -> PoseRows:
        """The same: few are computed at once and stored; of more, each thread remembers a run of rows, those that it
        asked for last with one before and one behind them, as those of a block and their neighbours are asked for
        again and again.  What is given may be read-only."""
        if self.count <= STORED:
            return PoseRows(self.count, self[:].read_only().__getitem__)
        last = threading.local()

        def build(rows: Ints) -> Poses:
            if not len(rows):
                return Poses(np.empty((0, 3, 3)), np.empty((0, 3)))
            low, high = int(rows.min()), int(rows.max()) + 1
            run = getattr(last, "run", _Run(0, 0, UNKNOWN))
            if low < run.start or high > run.stop:
                if low < 0 or high - low > min(REMEMBERED, 2 * len(rows)):
                    return self.build(rows)  # they are here and there
                run = last.run = self._run(max(low - 1, 0), min(high + 1, self.count), run)
            return run[rows, low, high]

        return PoseRows(self.count, build)

    def _run(self, start: int, stop: int, known: _Run) -> _Run:
        """Those from ``start`` to before ``stop``, some of which may be ``known``."""
        low, high = max(start, known.start), min(stop, known.stop)
        if low >= high:
            parts = [self._built(start, stop)]
        else:
            parts = [known.poses[low - known.start : high - known.start]]
            if start < low:
                parts.insert(0, self._built(start, low))
            if high < stop:
                parts.append(self._built(high, stop))
        return _Run(start, stop, Poses.joined(parts).read_only())

    def _built(self, start: int, stop: int) -> Poses:
        """Those from ``start`` to before ``stop``; at least two are computed, as one alone is rounded otherwise."""
        first = max(0, min(start, stop - 2))
        last = min(self.count, max(stop, first + 2))
        return self.build(np.arange(first, last))[start - first : stop - first]

    @property
    def position(self) -> Floats:
        """(N, 3) [m] of all."""
        return self[:].position

    @property
    def rotation(self) -> Floats:
        """(N, 3, 3) of all."""
        return self[:].rotation


Placed = Poses | PoseRows
"""Poses, by rows."""


def product(one: Floats, other: Floats) -> Floats:
    """one @ other (..., 3, 3) of rotations (..., 3, 3), (..., 3, 3): of many, component by component; a single product
    of matrices where one of them is the same for all."""
    if one.ndim == 3 == other.ndim and len(one) == len(other):
        a, b = _components(one), _components(other)
        rotations = a[:, 0, None] * b[None, 0]
        rotations += a[:, 1, None] * b[None, 1]
        rotations += a[:, 2, None] * b[None, 2]
        return _rows(rotations)
    if other.ndim == 2 < one.ndim:
        return (one.reshape(-1, 3) @ other).reshape(one.shape)
    if one.ndim == 2 and other.ndim == 3:
        return _rows((one @ _components(other).reshape(3, -1)).reshape(3, 3, -1))
    return np.asarray(one @ other)


def _components(rotation: Floats) -> Floats:
    """(3, 3, N) of rotations (N, 3, 3): each component in a row of its own."""
    return np.ascontiguousarray(rotation.transpose(1, 2, 0))


def _rows(components: Floats) -> Floats:
    """(N, 3, 3) of components (3, 3, N)."""
    return np.ascontiguousarray(components.transpose(2, 0, 1))


def lengths(vectors: Floats) -> Floats:
    """(N,) lengths of vectors (N, 3)."""
    return np.asarray(np.sqrt(np.einsum("ni,ni->n", vectors, vectors)))


def turned(rotation: Floats, vector: Floats) -> Floats:
    """Vectors (..., 3) turned by rotations (..., 3, 3); leading shapes broadcast."""
    if rotation.ndim == 2:
        return np.asarray(vector @ rotation.T)
    return np.asarray(np.einsum("...ij,...j->...i", rotation, vector))


def rotation_from_abc(abc: ArrayLike) -> Floats:
    """R = Rz(A) Ry(B) Rx(C) (..., 3, 3) from ``abc`` (..., 3) [rad]: A, B, C (KUKA's, intrinsic Z-Y'-X'')."""
    angles = np.asarray(abc, dtype=float)
    (sa, sb, sc), (ca, cb, cc) = np.moveaxis(np.sin(angles), -1, 0), np.moveaxis(np.cos(angles), -1, 0)
    rows = [
        [ca * cb, ca * sb * sc - sa * cc, ca * sb * cc + sa * sc],
        [sa * cb, sa * sb * sc + ca * cc, sa * sb * cc - ca * sc],
        [-sb, cb * sc, cb * cc],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def abc_from_rotation(rotation: ArrayLike, near: ArrayLike | None = None) -> Floats:
    """A, B, C (..., 3) [rad] of rotations (..., 3, 3), each angle in (-pi, pi].

    Of the two triples (A, B, C) and (A + pi, pi - B, C + pi) that give the same rotation, the one nearer
    to ``near`` (..., 3) is taken (without it, the one with |B| <= pi/2).  At B = +-pi/2 only A -+ C is
    defined: A is then that of ``near`` (0 without it).
    """
    r = np.asarray(rotation, dtype=float)
    cos_b = np.hypot(r[..., 0, 0], r[..., 1, 0])
    locked = cos_b < 1e-9
    wish = np.zeros(r.shape[:-1]) if near is None else np.broadcast_to(np.asarray(near, float), r.shape[:-1])
    b = np.arctan2(-r[..., 2, 0], cos_b)
    a = np.where(locked, wish[..., 0], np.arctan2(r[..., 1, 0], r[..., 0, 0]))
    # C from the rotation that A leaves over; this holds at the lock as well, where R[2, 1:] vanishes.
    sa, ca = np.sin(a), np.cos(a)
    c = np.arctan2(sa * r[..., 0, 2] - ca * r[..., 1, 2], ca * r[..., 1, 1] - sa * r[..., 0, 1])
    one = wrapped(np.stack([a, b, c], axis=-1))
    if near is None:
        return one
    two = wrapped(np.stack([a + np.pi, np.pi - b, c + np.pi], axis=-1))
    nearer = np.abs(wrapped(two - wish)).sum(-1) < np.abs(wrapped(one - wish)).sum(-1)
    return np.where((nearer & ~locked)[..., None], two, one)


def wrapped(angle: ArrayLike) -> Floats:
    """Angles (...) [rad] brought into (-pi, pi]; of ``angle`` (...) [rad]."""
    value = np.asarray(angle, dtype=float)
    # an angle a hair above -pi is rounded to a turn too many
    return np.minimum(value - 2 * np.pi * np.ceil((value - np.pi) / (2 * np.pi)), np.pi)


def rotation_from_vector(vector: ArrayLike) -> Floats:
    """Rotations (..., 3, 3): exp of rotation vectors (..., 3) [rad] (Rodrigues' formula)."""
    v = np.asarray(vector, dtype=float)
    x, y, z = own = np.ascontiguousarray(v.reshape(-1, 3).T)
    angle2 = x * x + y * y + z * z
    if angle2.max(initial=0.0) < SMALL**2:
        first = 1.0 - angle2 / 6 * (1.0 - angle2 / 20 * (1.0 - angle2 / 42))
        second = 0.5 - angle2 / 24 * (1.0 - angle2 / 30 * (1.0 - angle2 / 56))
    else:
        angle = np.sqrt(angle2)
        small = angle < 1e-4
        safe = np.where(small, 1.0, angle)
        first = np.where(small, 1 - angle2 / 6, np.sin(safe) / safe)
        second = np.where(small, 0.5 - angle2 / 24, (1 - np.cos(safe)) / (safe * safe))
    # 1 + first [v]x + second [v]x [v]x, and [v]x [v]x = v v^T - |v|^2
    rotations, rest = np.empty((3, 3, len(x))), 1 - second * angle2
    even, odd = second * own, first * own
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        np.add(rest, even[i] * own[i], out=rotations[i, i])
        both = even[i] * own[j]
        np.subtract(both, odd[k], out=rotations[i, j])
        np.add(both, odd[k], out=rotations[j, i])
    return _rows(rotations).reshape(*v.shape, 3)


def turn_between(start: Floats, end: Floats) -> Floats:
    """log(end start^T): rotation vectors (N, 3) [rad] that turn ``start`` (N, 3, 3) to ``end`` (N, 3, 3)."""
    a, b = _components(end), _components(start)
    odd, trace = np.empty((3, a.shape[2])), (a * b).sum(axis=(0, 1))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        np.subtract((a[k] * b[j]).sum(axis=0), (a[j] * b[k]).sum(axis=0), out=odd[i])
    odd *= 0.5
    sine2 = odd[0] ** 2 + odd[1] ** 2 + odd[2] ** 2
    if not (sine2.max(initial=0.0) < SMALL**2 and trace.min(initial=3.0) > 2.0):
        return vector_from_rotation(product(end, np.swapaxes(start, -1, -2)))
    # angle / sine
    odd *= 1.0 + sine2 / 6 * (1.0 + sine2 * 9 / 20 * (1.0 + sine2 * 25 / 42))
    return np.ascontiguousarray(odd.T)


def vector_from_rotation(rotation: ArrayLike) -> Floats:
    """log of rotations (..., 3, 3): rotation vectors (..., 3) [rad] with a length of at most pi.

    Near pi the axis is taken from the symmetric part, so that the result stays good to about 1e-8 there.
    """
    r = np.asarray(rotation, dtype=float)
    odd = np.empty(r.shape[:-1])
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        odd[..., i] = 0.5 * (r[..., k, j] - r[..., j, k])
    sine = np.sqrt(odd[..., 0] ** 2 + odd[..., 1] ** 2 + odd[..., 2] ** 2)
    cosine = 0.5 * (r[..., 0, 0] + r[..., 1, 1] + r[..., 2, 2] - 1.0)
    angle = np.arctan2(sine, cosine)
    small = sine < 1e-7
    factor = np.where(small, 1.0, angle / np.where(small, 1.0, sine))
    vector = factor[..., None] * odd
    turned = cosine < -0.99
    if np.any(turned):
        half = 0.5 * (r[turned] + np.swapaxes(r[turned], -1, -2))
        outer = half - cosine[turned][..., None, None] * np.eye(3)  # (1 - cos) n n^T
        column = np.argmax(np.diagonal(outer, axis1=-2, axis2=-1), axis=-1)
        axis = np.take_along_axis(outer, column[:, None, None], axis=-1)[..., 0]
        axis /= np.linalg.norm(axis, axis=-1, keepdims=True)
        sign = np.where(np.sum(axis * odd[turned], axis=-1) < 0, -1.0, 1.0)
        vector[turned] = (sign * angle[turned])[..., None] * axis
    return vector


def turn_beside(start: Floats, end: Floats, along: Floats) -> Floats:
    """Rotation vectors (K, 3) [rad] by which rotations turn from ``start`` (K, 3, 3) to ``end`` (K, 3, 3) besides
    turning by ``along`` (K, 3) with their path: log(exp(-along) end start^T)."""
    return turn_between(start, product(rotation_from_vector(-along), end))


def turning(start: Floats, turn: Floats, along: Floats, share: Floats) -> Floats:
    """R(t) = exp(t along) exp(t turn) R(0), R(0) = ``start`` (K, 3, 3): rotations (K, 3, 3) at the shares (K,) that
    turn evenly by ``turn`` (K, 3) [rad] in a frame that itself turns evenly by ``along`` (K, 3) about one axis."""
    own = product(rotation_from_vector(share[:, None] * turn), start)
    return product(rotation_from_vector(share[:, None] * along), own)


def skew(vector: ArrayLike) -> Floats:
    """The matrices [v]x (..., 3, 3) with [v]x u = v x u of ``vector`` (..., 3)."""
    v = np.asarray(vector, dtype=float)
    zero = np.zeros(v.shape[:-1])
    x, y, z = np.moveaxis(v, -1, 0)
    rows = [[zero, -z, y], [z, zero, -x], [-y, x, zero]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def on_arc(
    start: Floats, end: Floats, centre: Floats, normal: Floats, sweep: Floats, share: Floats
) -> Floats:
    """Points (K, 3) [m] at the shares (K,) of arcs from ``start`` to ``end`` (K, 3) [m] about ``centre`` (K, 3) [m].

    p(t) = c + R(n, t sweep) (s - c) + t (e - c - R(n, sweep) (s - c)): counter-clockwise about the unit vector n =
    ``normal`` (K, 3) by ``sweep`` (K,) [rad], with what remains to the end (the advance of a helix, radii that differ
    in the last digit) in proportion.
    """
    radius = start - centre
    along = np.sum(radius * normal, axis=1)[:, None] * normal
    across, side = radius - along, np.cross(normal, radius)

    def turn(angle: Floats) -> Floats:
        return np.asarray(np.cos(angle)[:, None] * across + np.sin(angle)[:, None] * side + along)

    return np.asarray(centre + turn(share * sweep) + share[:, None] * (end - centre - turn(sweep)))


def arc_through(start: Floats, via: Floats, end: Floats) -> tuple[Floats, Floats, Floats]:
    """Centre (K, 3) [m], normal (K, 3) and sweep (K,) in (0, 2 pi) [rad] of the circles through three points (K, 3)
    each.

    NaN where the three lie on a line: the sine of the angle at ``via`` is below 1e-9.
    """
    first, second = via - start, end - via
    across = np.cross(first, second)
    size = np.linalg.norm(across, axis=-1)
    scale = np.linalg.norm(first, axis=-1) * np.linalg.norm(second, axis=-1)
    with np.errstate(invalid="ignore", divide="ignore"):
        normal = np.where((size > 1e-9 * scale)[:, None], across / size[:, None], np.nan)
    return arc_in_plane(start, via, end, normal)


def arc_in_plane(start: Floats, via: Floats, end: Floats, normal: Floats) -> tuple[Floats, Floats, Floats]:
    """Centre (K, 3) [m], normal (K, 3) and sweep (K,) [rad] as of ``arc_through``, through ``start``, ``via``, ``end``
    (K, 3) [m], of arcs counter-clockwise about ``normal`` (K, 3): the circle of the points as they are seen along it;
    the centre lies at the height of ``start``.  NaN where the points lie on a line or run clockwise."""
    first, second = via - start, end - start
    first = first - np.sum(first * normal, axis=-1, keepdims=True) * normal
    second = second - np.sum(second * normal, axis=-1, keepdims=True) * normal
    area = np.sum(np.cross(first, second) * normal, axis=-1)
    a2, b2 = np.sum(first**2, axis=-1), np.sum(second**2, axis=-1)
    with np.errstate(invalid="ignore", divide="ignore"):
        offset = np.cross(a2[:, None] * second - b2[:, None] * first, normal) / (2 * area[:, None])
        turns = area > 1e-12 * np.sqrt(a2 * b2)
        centre = np.where(turns[:, None], start + offset, np.nan)
        from_centre, end_from_centre = start - centre, start + second - centre
        angle = np.arctan2(
            np.sum(np.cross(from_centre, end_from_centre) * normal, axis=-1),
            np.sum(from_centre * end_from_centre, axis=-1),
        )
    return centre, np.where(turns[:, None], normal, np.nan), np.mod(angle, 2 * np.pi)
