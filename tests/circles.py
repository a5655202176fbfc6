"""A circle as a machine with gaps in its axes draws it (ISO 230-4): programs in KRL, and the machine that runs them.

The machine is the MuJoCo arm of ``plant``; its motors follow the program's text sample by sample in the order of time,
by a Newton iteration on MuJoCo's own kinematics, and each joint lags behind its motor by a gap of its own.  Of the
package only the description of the arm is used.
"""

import re

import mujoco
import numpy as np
from plant import Plant

from postproc.base.geometry import Poses

BASE = np.array([1500.0, -200.0, 600.0])
TOOL, TOOL_B = np.array([120.0, 0.0, 250.0]), np.radians(30.0)
START = np.radians([0.0, -90.0, 110.0, 0.0, 40.0, 0.0])
CENTRE, RADIUS = np.array([250.0, 350.0]), 100.0
LEAD = np.radians(90.0)
"""Of the circle before the full one that counts."""

POSE = "A 0.000,B 0.000,C 180.000"
NUMBER = r"(-?\d+(?:\.\d+)?)"


def point(angle):
    x, y = CENTRE + RADIUS * np.array([np.cos(angle), np.sin(angle)])
    return f"{{X {x:.3f},Y {y:.3f},Z 0.000,{POSE}}}"


def circle(chord=1.0, arcs=0, force="1 0 1 @base"):
    """Lines of a program: down to the circle and once and a quarter around it, in chords [mm] or in ``arcs`` CIRCs."""
    whole, (x, y) = 2 * np.pi + LEAD, CENTRE + np.array([RADIUS, 0.0])
    if arcs:
        ends = whole * np.arange(1, arcs + 1) / arcs
        ways = [f"CIRC {point(end - 0.5 * whole / arcs)},{point(end)}" for end in ends]
    else:
        count = round(whole * RADIUS / chord)
        ways = [f"LIN {point(whole * (i + 1) / count)}" for i in range(count)]
    return [
        "DEF part()",
        "BAS(#INITMOV,0)",
        "$BASE=BASE_DATA[1]",
        "$TOOL=TOOL_DATA[1]",
        "PTP {A1 0,A2 -90,A3 110,A4 0,A5 40,A6 0}",
        "$VEL.CP=0.05",
        f"LIN {{X {x - 30:.3f},Y {y - 40:.3f},Z 50.000,{POSE}}}",
        f"LIN {{X {x:.3f},Y {y - 40:.3f},Z 0.000,{POSE}}}",
        f"LIN {{X {x:.3f},Y {y:.3f},Z 0.000,{POSE}}}",
        f";FORCE {force}",
        *ways,
        ";FORCE OFF",
        f"LIN {{X {x:.3f},Y {y:.3f},Z 50.000,{POSE}}}",
        "END",
    ]


def turned(a, b, c):
    """Rotation about z, y, x by KUKA's angles [deg]."""
    (ca, cb, cc), (sa, sb, sc) = np.cos(np.radians([a, b, c])), np.sin(np.radians([a, b, c]))
    z = np.array([[ca, -sa, 0], [sa, ca, 0], [0, 0, 1]])
    y = np.array([[cb, 0, sb], [0, 1, 0], [-sb, 0, cb]])
    return z @ y @ np.array([[1, 0, 0], [0, cc, -sc], [0, sc, cc]])


def commanded(text, step=0.5):
    """Places (S, 3) [mm], angles (S, 3) [deg] in the base and whether a force acts (S,), every ``step`` [mm]."""
    samples, here, loaded = [], None, False
    for line in text.splitlines():
        if line.startswith(";FORCE"):
            loaded = "OFF" not in line
        if not line.startswith(("LIN", "CIRC")):
            continue
        points = []
        for words in re.findall(r"\{([^}]*)\}", line):
            said = {name: float(value) for name, value in re.findall(rf"([XYZABC]) {NUMBER}", words)}
            known = dict(zip("XYZABC", here if here is not None else np.full(6, np.nan), strict=True))
            points.append(np.array([(known | said)[name] for name in "XYZABC"]))
        end = points[-1]
        if here is None:
            samples.append((end, loaded))
        else:
            turn = (end[3:] - here[3:] + 180.0) % 360.0 - 180.0
            way = straight(here, end) if line.startswith("LIN") else around(here, *points)
            count = max(2, int(np.ceil(way(None) / step)))
            for share in np.arange(1, count + 1) / count:
                samples.append((np.append(way(share), here[3:] + share * turn), loaded))
        here = end
    where = np.array([sample for sample, _ in samples])
    return where[:, :3], where[:, 3:], np.array([loaded for _, loaded in samples])


def straight(begin, end):
    """The place at a share of the way; its length for None."""
    step = end[:3] - begin[:3]
    return lambda share: np.linalg.norm(step) if share is None else begin[:3] + share * step


def around(begin, via, end):
    """As ``straight``, on the circle through three points."""
    a, b, c = begin[:3], via[:3], end[:3]
    u, v = b - a, c - a
    normal = np.cross(u, v)
    centre = a + np.cross((u @ u) * v - (v @ v) * u, normal) / (2 * normal @ normal)
    normal /= np.linalg.norm(normal)
    out = a - centre
    side, away = np.cross(normal, out), c - centre
    sweep = np.arctan2(away @ side, away @ out) % (2 * np.pi)

    def way(share):
        if share is None:
            return sweep * np.linalg.norm(out)
        return centre + np.cos(share * sweep) * out + np.sin(share * sweep) * side

    return way


class Machine:
    """``gap`` (6,) [rad] between each motor and its joint; it starts at ``START`` in the middle of them."""

    def __init__(self, model, gap):
        self.plant, self.gap = Plant.of(model), np.asarray(gap, float)
        self.tool = Poses(turned(0, np.degrees(TOOL_B), 0), TOOL / 1000)
        self.plant.set_tip(self.tool, np.array([0.0, 0.0, 1.0]))

    def motors(self, place, rotation, near):
        """(6,) [rad] that bring the rigid arm's TCP there."""
        plant, q = self.plant, near.copy()
        linear, angular = np.zeros((3, plant.size)), np.zeros((3, plant.size))
        for _ in range(20):
            plant.place(plant.coordinates_of(q), plant.coordinates_of(q))
            here, turn = plant.tcp()
            off = rotation @ turn.T
            axis = 0.5 * np.array([off[2, 1] - off[1, 2], off[0, 2] - off[2, 0], off[1, 0] - off[0, 1]])
            error = np.concatenate([place - here, axis])
            if np.abs(error).max() < 1e-12:
                return q
            mujoco.mj_jac(plant.model, plant.data, linear, angular, here, plant.tip_body)
            q = q + np.linalg.solve(np.vstack([linear, angular])[:, plant.motor_rows], error)
        raise ArithmeticError("no motors found")

    def drawn(self, text, wrench):
        """Places of the tool (S, 3) [mm] in the base, and (S,) whether the force acted, under ``wrench`` (6,) then."""
        places, angles, loaded = commanded(text)
        rotations = [turned(*angle) for angle in angles]
        return self.followed((places + BASE) / 1000, rotations, loaded, wrench), loaded

    def followed(self, places, rotations, loaded, wrench):
        """The same along places (S, 3) [m] in the robot and rotations (S, 3, 3); loaded (S,): the force acts."""
        # to the first target all axes go at once, as in a jump
        motor = self.motors(places[0], rotations[0], START)
        joint = np.minimum(np.maximum(START, motor - self.gap / 2), motor + self.gap / 2)
        found = []
        for place, rotation, force in zip(places, rotations, loaded, strict=True):
            motor = self.motors(place, rotation, motor)
            joint = np.minimum(np.maximum(joint, motor - self.gap / 2), motor + self.gap / 2)
            found.append(self.plant.rest(joint, wrench * force, self.tool).position)
        return np.array(found) * 1000 - BASE


def form(places):
    """[mm] the circular form error G: largest less smallest radius about the centre of least squares (ISO 230-4)."""
    x, y = places[:, 0], places[:, 1]
    matrix = np.column_stack([2 * x, 2 * y, np.ones(len(x))])
    centre = np.linalg.lstsq(matrix, x * x + y * y, rcond=None)[0][:2]
    radius = np.hypot(x - centre[0], y - centre[1])
    return float(np.ptp(radius))
