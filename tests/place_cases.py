"""Placements by other means than the package's search: brute force over a grid, moved by plain matrices."""

from __future__ import annotations

import re
from itertools import product
from pathlib import Path

import numpy as np
import yaml

from postproc.base.geometry import Poses
from postproc.robot.inverse import inverse
from postproc.workflows.preparation import Prepared, Request, prepare

ROOT = Path(__file__).resolve().parent.parent
SAMPLES = {
    "panel": ("kr270_panel/panel.src", (1250.0, 450.0, 800.0)),
    "pocket": ("kr270_pocket/pocket.ngc", (1450.0, -100.0, 600.0)),
    "milling": ("kr270_milling/bracket.src", (1250.0, 450.0, 800.0)),
}
"""Name -> program, and where its base is [mm]."""

LIMIT = SINGULAR = np.radians(5.0)
WIDTH = 400.0


def ranges_around(name: str, half: float = WIDTH) -> dict[str, tuple[float, float]]:
    """All freedoms: the base 400 mm to each side, the part by a quarter turn, the tool by half a turn."""
    place = dict(zip("xyz", SAMPLES[name][1], strict=True))
    return {
        **{axis: (at - half, at + half) for axis, at in place.items()},
        "turn": (-90.0, 90.0),
        "tool_turn": (-180.0, 180.0),
    }


def program_of(name: str) -> Path:
    return ROOT / "samples" / SAMPLES[name][0]


def about(axis: np.ndarray, angle: float) -> np.ndarray:
    """Rotation matrix (3, 3), by Rodrigues' formula."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


class Brute:
    """One program under placements (x, y, z [mm], turn, tool turn [deg]), motion by motion, at the ends of motions."""

    def __init__(self, program: Path) -> None:
        self.ready: Prepared = prepare(Request(program, force=""))
        task = self.task = self.ready.task
        path = task.toolpath
        self.rows = np.flatnonzero(path.known & ~path.on_axes & (task.track.branch >= 0))
        self.cuts = np.isin(self.rows, np.flatnonzero(task.carries))
        cell = yaml.safe_load(self.ready.cell.path.read_text())
        self.origin = np.array([cell["bases"][1][key] for key in "xyz"]) / 1e3
        self.pose = task.wanted[self.rows]
        self.tool = task.tool[0]
        self.wrench = np.array(task.wrench[self.rows])
        # the path leads from the place before; where that is an axis motion it starts elsewhere, and cuts nothing
        self.tangent = task.desired_path.tangent(self.rows, np.ones(len(self.rows)))

    def values(self, place: np.ndarray, some: np.ndarray) -> np.ndarray:
        """(2,) [m] the largest error across the feed, and the largest error, at motions ``some`` (K,) with the part at
        ``place`` (5,), infinite where one is not feasible."""
        lost = np.full(2, np.inf)
        turn = about(np.array([0.0, 0, 1]), np.radians(place[3]))
        spin = about(np.array([0.0, 0, 1]), np.radians(place[4]))
        position = (self.pose.position[some] - self.origin) @ turn.T + place[:3] / 1e3
        rotation = turn @ self.pose.rotation[some]
        tool = Poses(self.tool.rotation @ spin, self.tool.position)
        back = tool.inverse()
        flange = Poses(rotation @ back.rotation, position + rotation @ back.position)
        robot, task = self.ready.robot, self.task
        rows = self.rows[some]
        solution = inverse(robot.nominal, flange, task.track.branch[rows], task.track.q[rows])
        if not solution.reachable.all():
            return lost
        q = solution.q
        low, high = robot.limits.T
        arm = robot.nominal
        stretched = q[:, 2] + np.arctan2(-arm.a3, arm.d4)
        wrist = arm.a1 + arm.a2 * np.cos(q[:, 1]) + np.hypot(arm.d4, arm.a3) * np.cos(q[:, 1] + stretched)
        free = np.minimum(q - low, high - q)
        # A4 and A6 may be a turn away: the brute force is generous there
        fine = (free[:, [0, 1, 2, 4]] >= LIMIT).all()
        fine &= (np.abs(np.sin(q[:, 4])) >= np.sin(SINGULAR)).all()
        fine &= (np.abs(np.sin(stretched)) >= np.sin(SINGULAR)).all()
        fine &= (np.abs(wrist) >= 0.03 / 0.02 * np.sin(SINGULAR)).all()
        if not fine:
            return lost
        cut = np.flatnonzero(self.cuts[some])
        if not len(cut):
            return np.zeros(2)
        wrench = self.wrench[some][cut].reshape(-1, 2, 3) @ turn.T
        moved = task.model.linear_deflection(q[cut], wrench.reshape(-1, 6), tool)[:, :3]
        tangent = self.tangent[some][cut] @ turn.T
        across = moved - np.sum(moved * tangent, axis=1, keepdims=True) * tangent
        return np.linalg.norm([across, moved], axis=2).max(axis=1)

    def best_of_grid(
        self, ranges: dict[str, tuple[float, float]], steps: tuple[int, ...]
    ) -> tuple[dict[str, float], int]:
        """Objective -> the least [m] over all motions, of a grid with ``steps`` points along each range, and how many
        places that are.  Bound first: what few motions say is never more than what all say."""
        axes = [np.linspace(*ranges[key], count) for key, count in zip(ranges, steps, strict=True)]
        places = np.array(list(product(*axes)))
        count = len(self.rows)
        few = np.unique(np.linspace(0, count - 1, min(count, 12)).round().astype(int))
        bounds = np.array([self.values(place, few) for place in places])
        best = {}
        for k, objective in enumerate(("across", "max")):
            least = np.inf
            for at in np.argsort(bounds[:, k]):
                if bounds[at, k] >= least:
                    break
                least = min(least, self.values(places[at], np.arange(count))[k])
            best[objective] = float(least)
        return best, len(places)


def soft_wrist(folder: Path, joints: str = "5") -> Path:
    """The milling sample on a robot whose wrist ``joints`` give way 20 times as much: there the tool's turn matters."""
    for name in ("bracket.src", "milling.yaml"):
        (folder / name).write_bytes((ROOT / "samples" / "kr270_milling" / name).read_bytes())
    cell = (ROOT / "samples" / "kr270_milling" / "cell.yaml").read_text()
    (folder / "cell.yaml").write_text(cell.replace("robot: kuka_kr270", "robot: soft.yaml", 1))
    text = (ROOT / "robots" / "kuka_kr270.yaml").read_text()
    words = rf"(c[{joints}]: \{{value: )([\d.]+)e-6"
    soft = re.sub(words, lambda found: f"{found[1]}{20 * float(found[2]):.3f}e-6", text)
    assert soft != text
    (folder / "soft.yaml").write_text(re.sub(r", ci: [^,]*, ci_level: unstated", "", soft))
    return folder / "bracket.src"
