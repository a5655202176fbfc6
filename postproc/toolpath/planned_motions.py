"""The motions that an output has to make."""

from __future__ import annotations

from dataclasses import field
from enum import IntEnum

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints, LazyRows, frozen
from postproc.base.dataclass import dataclass
from postproc.toolpath.toolpath import Toolpath


class Role(IntEnum):
    """What a motion of the output is to the motion of the input that it stems from."""

    ORIGINAL = 0  # the last of them: it ends where that motion ends, and takes its text
    INTERMEDIATE = 1  # an earlier part of its path, inserted before it
    TRANSITION = 2  # a straight line to where its path starts, inserted before it


@dataclass(frozen=True, eq=False)
class Plan:
    """The motions that an output has to make, M >= N, all in the programmed base of their source.

    source (M,): row of the input, ascending; each has one ORIGINAL, last of its group.  role (M,) Role.
    position (M, 3) [m], rotation (M, 3, 3): targets, NaN where the input's is not known; a dialect asks for those of
    some rows at a time.
    centre [m], normal (M, 3), sweep (M,) [rad]: path of arcs, see ``Arcs``; NaN for all others.
    flows (M,): inserted motions at whose end the controller must not come to rest; without it those of INTERMEDIATE.
    share (M,): of the source's path, where the motion ends; 1 for all where none is given.
    external (M, 6) [mm or deg]: E1..E6, as in a Toolpath; None where they do not move.
    """

    source: Ints
    role: Ints
    position: Floats | LazyRows
    rotation: Floats | LazyRows
    centre: Floats
    normal: Floats
    sweep: Floats
    flows: Bools = field(default_factory=lambda: np.empty(0, np.bool_))
    share: Floats = field(default_factory=lambda: np.empty(0))
    external: Floats | LazyRows | None = None

    def __post_init__(self) -> None:
        m = len(self.source)
        shapes = {
            "position": (m, 3),
            "rotation": (m, 3, 3),
            "centre": (m, 3),
            "normal": (m, 3),
            "sweep": (m,),
        }
        for name, shape in shapes.items():
            values = getattr(self, name)
            if not isinstance(values, LazyRows):
                object.__setattr__(self, name, frozen(values, shape))
        share = self.share if len(self.share) else np.broadcast_to(1.0, m)
        object.__setattr__(self, "share", frozen(share, (m,)))
        for name, dtype in (("source", np.int32), ("role", np.int8)):
            object.__setattr__(self, name, frozen(getattr(self, name), (m,), dtype))
        flows = self.flows if len(self.flows) else self.role == Role.INTERMEDIATE
        object.__setattr__(self, "flows", frozen(flows, (m,), np.bool_))

    def __len__(self) -> int:
        return len(self.source)

    @property
    def own(self) -> Bools:
        """(M,) the motions that take the text of their source."""
        return np.asarray(self.role == Role.ORIGINAL)

    @staticmethod
    def of(path: Toolpath) -> Plan:
        """The plan that changes nothing."""
        n = len(path)
        return Plan(
            np.arange(n),
            np.zeros(n, np.int64),
            path.position,
            path.rotation,
            path.arcs.centre,
            path.arcs.normal,
            path.arcs.sweep,
            external=path.external if path.external.strides[0] else None,
        )
