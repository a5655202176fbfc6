"""The arm of a robot file: a MuJoCo model, and the same chain in numpy for many states at once.

Axes A1 -z, A2 +y, A3 +y, A4 -x, A5 +y, A6 -x, stretched forward at zero; the flange's z points out along the forearm.
Each joint is a spring of compliance c_i between motor and link; the gravity compensator is a spring from P0 on the
carousel to P1 on the upper arm, whose torque is cancelled where no force acts.  The numpy chain is held against MuJoCo
in ``check_on_mujoco``, where nothing acts and at the equilibrium.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np
import yaml

AXES = ((2, -1.0), (1, 1.0), (1, 1.0), (0, -1.0), (1, 1.0), (0, -1.0))
FLANGE = np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]])
FOLDER = Path(__file__).parents[2] / "robots"
_LENGTH = {"mm": 1e-3, "m": 1.0}


@dataclass
class Spring:
    """The gravity compensator across A2: P0 at (-a_x, -a_y) from axis 2, P1 at L along the upper arm; SI."""

    stiffness: float
    free: float
    along: float
    a_x: float
    a_y: float

    def torque(self, angle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Torque [N m] about A2 and its slope [N m/rad], from the distance of the two points."""
        p1 = self.along * np.stack([np.cos(angle), -np.sin(angle)])  # A2 turns about +y: x -> -z
        d1 = self.along * np.stack([-np.sin(angle), -np.cos(angle)])
        gap = p1 - np.array([-self.a_x, -self.a_y]).reshape(2, *[1] * np.ndim(angle))
        length = np.sqrt((gap**2).sum(0))
        rate = (gap * d1).sum(0) / length
        bend = ((d1**2).sum(0) - (gap * p1).sum(0) - rate**2) / length
        pull = self.stiffness * (length - self.free)
        return -pull * rate, -self.stiffness * rate**2 - pull * bend


class Robot:
    """A KUKA-type arm with the elasticity of its file."""

    def __init__(self, path: Path) -> None:
        said = yaml.safe_load(path.read_text())
        lengths = said["geometry"]["kuka"]
        unit = _LENGTH[lengths["unit"]]
        d1, a1, a2, a3, d4, self.d6 = (float(lengths[k]) * unit for k in ("d1", "a1", "a2", "a3", "d4", "d6"))
        self.offsets = np.array([[0, 0, 0], [a1, 0, d1], [a2, 0, 0], [d4, 0, a3], [0, 0, 0], [0, 0, 0]])
        self.d4, self.a3 = d4, a3
        self.compliance, self.spring = np.zeros(6), None
        for effect in said.get("effects", []):
            values = effect["parameters"]
            if effect["effect"] == "joint_compliance":
                first = 2 if "rail" in said["geometry"] else 1  # the track is joint 1, and rigid here
                self.compliance = np.array([float(values[f"c{i + first}"]["value"]) for i in range(6)])
            elif effect["effect"] == "gravity_compensator":
                self.spring = _spring(values, effect["options"])
            else:
                raise ValueError(f"the judge does not know {effect['effect']}")
        joints = said["joints"]
        rail = said["geometry"].get("rail")
        self.rail = np.zeros(3)
        if rail:
            self.rail["xyz".index(rail[1])] = -1.0 if rail[0] == "-" else 1.0
        self.limits = np.radians([joints[f"A{i}"] for i in range(1, 7)])
        self.model = mujoco.MjModel.from_xml_string(self._xml())
        self.data = mujoco.MjData(self.model)
        self._tip = self.model.body("link6").id

    @classmethod
    def find(cls, name: str, folder: Path) -> Robot:
        """A robot by name, or by its file relative to the cell."""
        return cls(folder / name if name.endswith((".yaml", ".yml")) else FOLDER / f"{name}.yaml")

    # MuJoCo

    def _xml(self) -> str:
        body = ""
        for i in range(6, 0, -1):
            axis = [0.0, 0, 0]
            axis[AXES[i - 1][0]] = AXES[i - 1][1]
            stiff = 1 / self.compliance[i - 1] if self.compliance[i - 1] else 0.0
            sites = ""
            if self.spring is not None and i == 2:
                sites = f'<site name="P1" pos="{self.spring.along!r} 0 0"/>'
            if self.spring is not None and i == 1:
                x, _, z = self.offsets[1] - [self.spring.a_x, 0, self.spring.a_y]
                sites = f'<site name="P0" pos="{float(x)!r} 0 {float(z)!r}"/>'
            body = (
                f'<body name="link{i}" pos="{_words(self.offsets[i - 1])}">'
                f'<joint name="A{i}" type="hinge" axis="{_words(axis)}" stiffness="{float(stiff)!r}"/>'
                '<inertial pos="0 0 0" mass="1e-9" diaginertia="1e-9 1e-9 1e-9"/>'
                f"{sites}{body}</body>"
            )
        tendon = ""
        if self.spring is not None:
            stiff, free = self.spring.stiffness, self.spring.free
            tendon = (
                f'<tendon><spatial name="spring" stiffness="{stiff!r}" springlength="{free!r} {free!r}">'
                '<site site="P0"/><site site="P1"/></spatial></tendon>'
            )
        return (
            '<mujoco><compiler angle="radian" autolimits="false"/><option gravity="0 0 0"><flag contact="disable"/>'
            f"</option><worldbody>{body}</worldbody>{tendon}</mujoco>"
        )

    def mujoco_tcp(self, q: np.ndarray, tool: tuple) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Position, rotation and Jacobian (6, 6) of the TCP at joint angles (6,), by MuJoCo."""
        self.data.qpos[:] = q
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_comPos(self.model, self.data)
        link = self.data.xmat[self._tip].reshape(3, 3)
        place = self.data.xpos[self._tip] + link @ ([self.d6, 0, 0] + FLANGE @ tool[1])
        jacobian = np.zeros((6, 6))
        mujoco.mj_jac(self.model, self.data, jacobian[:3], jacobian[3:], place, self._tip)
        return place, link @ FLANGE @ tool[0], jacobian

    def follow(
        self, position: np.ndarray, rotation: np.ndarray, tool: tuple, guess: np.ndarray
    ) -> np.ndarray:
        """(6,) joint angles that bring the TCP to a pose, by damped Newton steps from ``guess``, by MuJoCo."""
        q = guess.copy()
        for _ in range(80):
            place, turned, jacobian = self.mujoco_tcp(q, tool)
            left = np.concatenate([position - place, rotation_vector(rotation @ turned.T)])
            size = np.abs(left).max()
            damping = 1e-4 * min(size, 1.0) ** 2 + 1e-16
            step = np.linalg.solve(jacobian.T @ jacobian + damping * np.eye(6), jacobian.T @ left)
            largest = np.abs(step).max()
            q += step * min(1.0, 0.3 / max(largest, 1e-300))
            if size < 1e-11:
                return q
        raise ArithmeticError("the inverse kinematics of the judge does not arrive")

    def rest_on_mujoco(self, q: np.ndarray, wrench: np.ndarray, tool: tuple) -> tuple[np.ndarray, np.ndarray]:
        """Position (3,) and rotation (3, 3) of the loaded TCP: equilibrium by Newton's method on MuJoCo's forces."""
        free = self.compliance > 0
        held = -self._passive(q, q)

        def left(x: np.ndarray) -> np.ndarray:
            passive = self._passive(x, q)
            _, _, jacobian = self.mujoco_tcp(x, tool)
            return (passive + held + jacobian.T @ wrench)[free]

        x = q.copy()
        for _ in range(30):
            slope = np.empty((6, 6))
            for k in range(6):
                h = np.zeros(6)
                h[k] = 1e-6
                slope[:, k] = (left(x + h) - left(x - h)) / 2e-6
            step = np.linalg.solve(slope, -left(x))
            x[free] += step
            if np.abs(step).max() < 1e-13:
                place, turned, _ = self.mujoco_tcp(x, tool)
                return place.copy(), turned.copy()
        raise ArithmeticError("no equilibrium on MuJoCo")

    def _passive(self, x: np.ndarray, motors: np.ndarray) -> np.ndarray:
        self.model.qpos_spring[:] = motors
        self.data.qpos[:] = x
        self.data.qvel[:] = 0
        mujoco.mj_fwdPosition(self.model, self.data)
        mujoco.mj_fwdVelocity(self.model, self.data)
        return self.data.qfrc_passive.copy()

    # The same chain in numpy, for many states

    def chain(self, q: np.ndarray, tool: tuple) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(N, 3) positions, (N, 3, 3) rotations and (N, 6, 6) Jacobians of the TCP at (N, 6) joint angles."""
        n = len(q)
        turned = np.broadcast_to(np.eye(3), (n, 3, 3)).copy()
        place = np.zeros((n, 3))
        origins, axes = np.empty((6, n, 3)), np.empty((6, n, 3))
        for i, (k, sign) in enumerate(AXES):
            place = place + turned @ self.offsets[i]
            origins[i], axes[i] = place, sign * turned[:, :, k]
            c, s = np.cos(q[:, i])[:, None], sign * np.sin(q[:, i])[:, None]
            a, b = (k + 1) % 3, (k + 2) % 3
            one, two = turned[:, :, a].copy(), turned[:, :, b].copy()
            turned[:, :, a], turned[:, :, b] = c * one + s * two, c * two - s * one
        place = place + turned @ (np.array([self.d6, 0, 0]) + FLANGE @ tool[1])
        jacobian = np.concatenate([np.cross(axes, place - origins), axes], axis=2)
        return place, turned @ (FLANGE @ tool[0]), np.moveaxis(jacobian, 0, 2)

    def settle(
        self, position: np.ndarray, rotation: np.ndarray, tool: tuple, guess: np.ndarray
    ) -> np.ndarray:
        """(N, 6) joint angles at (N) poses of the TCP, by Newton's method from near ``guess`` (N, 6)."""
        q = guess.copy()
        for _ in range(30):
            place, turned, jacobian = self.chain(q, tool)
            left = np.concatenate(
                [position - place, rotation_vectors(rotation @ turned.swapaxes(1, 2))], axis=1
            )
            if np.abs(left).max(initial=0.0) < 1e-12:
                break
            back = jacobian.swapaxes(1, 2)
            square = back @ jacobian + 1e-16 * np.eye(6)
            q = q + np.linalg.solve(square, back @ left[..., None])[..., 0]
        if np.abs(left).max(initial=0.0) > 1e-9:
            raise ArithmeticError("the inverse kinematics of the judge does not arrive")
        return q

    def rest(
        self, q: np.ndarray, wrench: np.ndarray, tool: tuple
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Loaded TCP of motors at (N, 6) under wrenches (N, 6): positions, rotations, compliance (N, 6, 6) there."""
        x = q.copy()
        for _ in range(60):
            place, turned, jacobian = self.chain(x, tool)
            torque = np.einsum("nij,ni->nj", jacobian, wrench)
            soft = np.broadcast_to(self.compliance, x.shape).copy()
            if self.spring is not None:
                more, slope = self.spring.torque(x[:, 1])
                torque[:, 1] += more - self.spring.torque(q[:, 1])[0]
                soft[:, 1] = self.compliance[1] / (1 - self.compliance[1] * slope)
                torque[:, 1] -= (x[:, 1] - q[:, 1]) * slope
            new = q + soft * torque
            change, x = np.abs(new - x).max(initial=0.0), new
            if change < 1e-13:
                break
        else:
            raise ArithmeticError("no equilibrium")
        place, turned, jacobian = self.chain(x, tool)
        return place, turned, (jacobian * soft[:, None, :]) @ jacobian.swapaxes(1, 2)

    # Branches

    def status(self, q: np.ndarray) -> tuple[int, int]:
        """KUKA's S and T of joint angles (6,)."""
        arm = self.offsets[1][0] + self.offsets[2][0] * np.cos(q[1])
        wrist = arm + np.hypot(self.d4, self.a3) * np.cos(q[1] + q[2] - np.arctan2(self.a3, self.d4))
        elbow = q[2] > np.arctan2(self.a3, self.d4)
        s = int(wrist < 0) | int(elbow) << 1 | int(q[4] < 0) << 2
        return s, sum(1 << i for i in range(6) if q[i] < 0)

    def reach(
        self,
        position: np.ndarray,
        rotation: np.ndarray,
        tool: tuple,
        near: np.ndarray,
        s: int | None,
        t: int | None,
    ) -> np.ndarray:
        """(6,) joint angles of a pose of the TCP in the branch S, T; without them that of ``near``, nearest to it."""
        wanted = self.status(near)[0] if s is None else s
        seeds = [near, *self._seeds(position, near)]
        best, cost = None, np.inf
        for seed in seeds:
            try:
                q = self.follow(position, rotation, tool, seed)
            except (ArithmeticError, np.linalg.LinAlgError):
                continue
            q = near + (q - near + np.pi) % (2 * np.pi) - np.pi
            if t is not None:
                for i in range(6):  # each axis on the side of zero that T says
                    if (q[i] < 0) != bool(t >> i & 1):
                        q[i] += 2 * np.pi if q[i] < 0 else -2 * np.pi
            if self.status(q)[0] != wanted or ((q < self.limits[:, 0]) | (q > self.limits[:, 1])).any():
                continue
            if (away := np.abs(q - near).max()) < cost:
                best, cost = q, away
        if best is None:
            raise ArithmeticError("no branch reaches the pose")
        return best

    def _seeds(self, position: np.ndarray, near: np.ndarray) -> list[np.ndarray]:
        yaw = -np.arctan2(position[1], position[0])
        rng = np.random.default_rng(1)
        some = [np.concatenate([[yaw], v]) for v in ([-1.4, 1.8, 0, 0.8, 0], [-1.4, 1.8, 1, -0.9, 0])]
        for _ in range(60):
            q = rng.uniform(np.maximum(self.limits[:, 0], -np.pi), np.minimum(self.limits[:, 1], np.pi))
            q[0] = yaw + rng.uniform(-0.3, 0.3)
            some.append(q)
        return some


def check_on_mujoco(robot: Robot, q: np.ndarray, wrench: np.ndarray, tool: tuple) -> float:
    """[m] the largest difference of the two chains at (N, 6) motors under (N, 6) wrenches, unloaded and loaded."""
    free, turned, jacobian = robot.chain(q, tool)
    loaded, bent, _ = robot.rest(q, wrench, tool)
    worst = 0.0
    for i in range(len(q)):
        place, rotation, slope = robot.mujoco_tcp(q[i], tool)
        there, tilted = robot.rest_on_mujoco(q[i], wrench[i], tool)
        for one, two in ((free[i], place), (turned[i], rotation), (jacobian[i], slope), (loaded[i], there)):
            worst = max(worst, float(np.abs(one - two).max()))
        worst = max(worst, float(np.abs(bent[i] - tilted).max()))
    return worst


def _spring(values: dict, options: dict) -> Spring | None:
    if (
        options.get("preload", "balanced") != "balanced"
        or options.get("zero_deg", 0)
        or options["joint"] != "A2"
    ):
        raise ValueError("the judge knows the balanced compensator across A2 alone")
    if any(values[k]["value"] is None for k in ("K_c", "s0", "L", "a_x", "a_y")):
        return None
    get = {
        k: float(values[k]["value"]) * _LENGTH.get(values[k]["unit"], 1.0)
        for k in ("K_c", "s0", "L", "a_x", "a_y")
    }
    return Spring(get["K_c"], get["s0"], get["L"], get["a_x"], get["a_y"])


def _words(numbers: object) -> str:
    return " ".join(repr(float(n)) for n in numbers)  # type: ignore[attr-defined]


# Rotations


def rotation_vectors(matrices: np.ndarray) -> np.ndarray:
    """(N, 3) rotation vectors of (N, 3, 3), angles below half a turn by quaternions."""
    m = matrices
    trace = m[:, 0, 0] + m[:, 1, 1] + m[:, 2, 2]
    # the largest of the four squares decides how a quaternion is taken out
    squares = np.stack([1 + trace, *(1 + 2 * m[:, i, i] - trace for i in range(3))], axis=1)
    which = squares.argmax(1)
    quaternion = np.empty((len(m), 4))
    for k in range(4):
        rows = np.flatnonzero(which == k)
        if not len(rows):
            continue
        r, s = m[rows], squares[rows, k]
        skew = np.stack([r[:, 2, 1] - r[:, 1, 2], r[:, 0, 2] - r[:, 2, 0], r[:, 1, 0] - r[:, 0, 1]], axis=1)
        if k == 0:
            quaternion[rows] = np.concatenate([s[:, None], skew], axis=1)
        else:
            vector = r[:, :, k - 1] + r[:, k - 1, :]
            vector[:, k - 1] = s
            quaternion[rows] = np.concatenate([skew[:, [k - 1]], vector], axis=1)
    quaternion /= np.linalg.norm(quaternion, axis=1, keepdims=True)
    quaternion[quaternion[:, 0] < 0] *= -1
    sine = np.linalg.norm(quaternion[:, 1:], axis=1)
    angle = 2 * np.arctan2(sine, quaternion[:, 0])
    scale = np.where(sine > 1e-12, angle / np.maximum(sine, 1e-300), 2.0)
    return quaternion[:, 1:] * scale[:, None]


def rotation_vector(matrix: np.ndarray) -> np.ndarray:
    return rotation_vectors(matrix[None])[0]


def rotations(vectors: np.ndarray) -> np.ndarray:
    """(N, 3, 3) of rotation vectors (N, 3), by Rodrigues."""
    angle = np.linalg.norm(vectors, axis=1)
    x, y, z = (vectors / np.maximum(angle, 1e-300)[:, None]).T
    zero = np.zeros_like(x)
    cross = np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=1).reshape(-1, 3, 3)
    s, c = np.sin(angle)[:, None, None], (1 - np.cos(angle))[:, None, None]
    return np.eye(3) + s * cross + c * (cross @ cross)
