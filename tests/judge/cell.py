"""The cell file of a case, as far as the judge needs it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import yaml

from .motion import DEG, MM, from_abc

Frame = tuple[np.ndarray, np.ndarray]
DEFAULT_RAMP = 5 * MM


def frame(values: dict) -> Frame:
    """Rotation and position [m] of {x, y, z, a, b, c} in mm and deg."""
    get = {name: float(values.get(name, 0.0)) for name in "xyzabc"}
    return from_abc(get["a"], get["b"], get["c"]), np.array([get["x"], get["y"], get["z"]]) * MM


@dataclass
class Cell:
    """Frames as (rotation, position); start (6,) [rad]; start_external (6,): E1 .. E6 [mm, deg]; tolerance, ramp [m];
    tolerance_angle [rad]."""

    robot: str
    robot_base: Frame
    tools: dict[int, Frame]
    spindles: dict[int, np.ndarray]
    bases: dict[int, Frame]
    start: np.ndarray
    start_external: np.ndarray
    external: list[ExternalAxis]
    orientation: np.ndarray
    tolerance: float
    tolerance_angle: float
    ramp: float
    folder: Path

    @classmethod
    def load(cls, path: Path, ramp: float | None = None) -> Cell:
        """``ramp`` [m] over which a force changes, where the file does not say it."""
        said = yaml.safe_load(path.read_text())
        zero = {"x": 0}
        tools = said.get("tools", {})
        start = [float(v) for v in said.get("start", [0, -90, 90, 0, 90, 0])]
        external = np.zeros(6)
        if len(start) == 7:
            external[0], start = start[0], start[1:]
        for name, axis in said.get("external_axes", {}).items():
            external[int(name[1]) - 1] = float(axis.get("start", 0.0))
        angles = said.get("orientation", {})
        stated = said.get("force_ramp")
        if stated is None and ramp is None:
            widths = [float(tool["diameter"]) / 2 for tool in tools.values() if "diameter" in tool]
            stated = widths[0] if widths else None
        return cls(
            robot=str(said["robot"]),
            robot_base=frame(said.get("robot_base", zero)),
            tools={int(n): frame(tool) for n, tool in tools.items()},
            spindles={int(n): _axis(tool.get("axis", "+z")) for n, tool in tools.items()},
            bases={int(n): frame(base) for n, base in said.get("bases", {}).items()},
            start=np.array(start) * DEG,
            start_external=external,
            external=_external(said.get("external_axes", {})),
            orientation=from_abc(*(float(angles.get(k, 0.0)) for k in "abc")),
            tolerance=float(said.get("tolerance", 0.02)) * MM,
            tolerance_angle=float(said.get("tolerance_deg", 0.01)) * DEG,
            ramp=stated * MM if stated is not None else DEFAULT_RAMP if ramp is None else ramp,
            folder=path.parent,
        )


@dataclass
class ExternalAxis:
    """A track that carries the robot along ``direction``, or a positioner that turns the part about the line through
    ``point`` [m] along it; in $WORLD."""

    column: int
    kind: str
    direction: np.ndarray
    point: np.ndarray


def _external(said: dict) -> list[ExternalAxis]:
    return [
        ExternalAxis(
            int(name[1]) - 1,
            axis["kind"],
            _axis(axis.get("direction", axis.get("axis", "+z"))),
            np.array(axis.get("point", [0, 0, 0]), float) * MM,
        )
        for name, axis in said.items()
    ]


def _axis(word: str | list[float]) -> np.ndarray:
    if isinstance(word, str):
        return np.eye(3)["xyz".index(word[1].lower())] * (-1.0 if word[0] == "-" else 1.0)
    return np.array(word, float) / np.linalg.norm(word)
