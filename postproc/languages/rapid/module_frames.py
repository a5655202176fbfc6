"""Tools and work objects of motions as frames."""

from __future__ import annotations

from collections.abc import Mapping, Set
from difflib import get_close_matches

import numpy as np

from postproc.base.geometry import Poses
from postproc.base.units import DEG, MM
from postproc.languages.core.frame_table import FrameTable
from postproc.languages.rapid.motion_facts import FrameUse, Problem, item_of, reason_of
from postproc.languages.rapid.quaternions import rotation_from_quaternion
from postproc.languages.rapid.values import Leaf, UnknownData, Value, number_of, numbers_of, truth_of
from postproc.toolpath import FrameRef
from postproc.toolpath.initial_state import Symbol

Load = tuple[float, float, float, float]

_KEYS = ("X", "Y", "Z", "A", "B", "C")


class ModuleFrames(FrameTable):
    """The frames that motions use, each once.  ``symbols``: what the cell states of names that the file does not
    declare: the number of a tool or base of the cell, or a pose; ``written``: names that the program assigns."""

    def __init__(
        self, symbols: Mapping[str, Symbol], lines: Mapping[bytes, int], written: Set[bytes] = frozenset()
    ) -> None:
        super().__init__()
        self._written = written
        self._symbols, self._lines = symbols, lines

    def tool(self, use: FrameUse, line: int) -> int | Problem:
        """Index of a tool, or why it is not known."""
        if self._name(use) == b"TOOL0":
            return self.index(("tool", 0), lambda: FrameRef(0, None, line))
        bound = self._bound("tool", use, line)
        if bound is not None:
            return bound
        held = truth_of(item_of(use.value, 0))
        if held is False:
            return "RAP013", "its tool is fixed in the cell (robhold is FALSE)"
        pose = _pose(item_of(use.value, 1))
        if held is None or pose is None:
            return "RAP005", f"its tool is not known: {self._reason(use)}"
        return self._posed("tool", pose, self._lines.get(use.name, line), _load(item_of(use.value, 2)))

    def base(self, use: FrameUse, line: int) -> int | Problem:
        """Index of a work object: user frame x object frame; or why it is not known."""
        if self._name(use) == b"WOBJ0":
            return self.index(("base", 0), lambda: FrameRef(0, None, line))
        bound = self._bound("base", use, line)
        if bound is not None:
            return bound
        held, fixed = (truth_of(item_of(use.value, at)) for at in (0, 1))
        unit = item_of(use.value, 2)
        if held:
            return "RAP013", "its work object is on the robot (robhold is TRUE)"
        if fixed is False or (isinstance(unit, Leaf) and unit.value != b""):
            return "RAP011", "its work object moves with a mechanical unit"
        user, within = (_pose(item_of(use.value, at)) for at in (3, 4))
        if held is None or fixed is None or not isinstance(unit, Leaf) or user is None or within is None:
            return "RAP005", f"its work object is not known: {self._reason(use)}"
        return self._posed("base", user @ within, self._lines.get(use.name, line))

    def _bound(self, kind: str, use: FrameUse, line: int) -> int | Problem | None:
        """The frame that the cell states for a name that the file does not declare."""
        name = self._name(use)
        symbol = self._symbols.get(name.decode("latin-1")) if name and name not in self._lines else None
        if symbol is None:
            return None
        if name in self._written:
            return "RAP005", f"the program itself assigns {_shown(name)}, which it does not declare"
        if not isinstance(symbol, Mapping):
            if symbol != int(symbol) or symbol < 0:
                return (
                    "RAP005",
                    f"the cell states {symbol:g} for {_shown(name)}, which is no number of a frame",
                )
            return self.index((kind, int(symbol)), lambda: FrameRef(int(symbol), None, line))
        if set(symbol) != set(_KEYS):
            return "RAP005", f"the cell does not state X, Y, Z, A, B, C of {_shown(name)}"
        values = np.array([symbol[key] for key in _KEYS])
        return self._posed(kind, Poses.from_abc(values[:3] * MM, values[3:] * DEG), 0)

    def _name(self, use: FrameUse) -> bytes:
        """The name under which the cell may know a frame, whatever the routine of the motion calls it; that in the
        motion where the file declares it."""
        if isinstance(use.value, UnknownData):
            return use.value.name
        return use.name if use.name in self._lines else b""

    def _reason(self, use: FrameUse) -> str:
        """Why a frame is not known, with the name in the cell that may have been meant."""
        reason = reason_of(use.value, "its declaration is not understood")
        name = self._name(use)
        if name and name not in self._lines:
            close = get_close_matches(name.decode("latin-1"), self._symbols, 1)
            return reason + "".join(f"; the cell has the symbol {name}" for name in close)
        return reason

    def _posed(self, kind: str, pose: Poses, line: int, load: Load | None = None) -> int:
        key = (kind, load, *pose.position.tolist(), *pose.rotation.ravel().tolist())
        return self.index(key, lambda: FrameRef(None, pose, line, load=load))


def _load(value: Value) -> Load | None:
    """Mass [kg] and centre [m] of the load data of a tool; None where they are not known."""
    mass, centre = number_of(item_of(value, 0)), numbers_of(item_of(value, 1), 3)
    if mass is None or centre is None:
        return None
    x, y, z = centre
    return float(mass), x * MM, y * MM, z * MM


def _pose(value: Value) -> Poses | None:
    """A pose in m; None where it is not known, or its quaternion is not of length 1."""
    position, quaternion = numbers_of(item_of(value, 0), 3), numbers_of(item_of(value, 1), 4)
    if position is None or quaternion is None:
        return None
    rotation = rotation_from_quaternion(np.array([quaternion]))[0]
    if np.isnan(rotation).any():
        return None
    return Poses(rotation, np.array(position) * MM)


def _shown(name: bytes) -> str:
    return name.decode("latin-1")[:40]
