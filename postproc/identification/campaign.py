"""What the readings of a campaign see of a model, and what is between the two: tracker and targets.

A reading sees one point of the robot at one state: a target on the flange, or without targets the TCP.  A target on the
base goes with the base alone: p, R are then the base's own place and turn, which only what moves the base changes.

    absolute     T_s (1 + e) (p + R c)                     T_s: the robot base in the tracker's frame of session s
    deflection   (p + R c) loaded - (p + R c) unloaded     with the same motors, robot base axes

p, R: place and rotation of the tool at the equilibrium, c the target in tool axes.  T_s, and c where it is not stated,
are nuisances: found with every fit, and credited to no effect.  So is e, the scale of the tracker's lengths over the
robot's: a tracker, or an arm that is warm, is off by some 1e-4.
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass, replace

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.geometry import Poses, rotation_from_vector, skew, vector_from_rotation
from postproc.effects import Conditions
from postproc.measurements import Readings
from postproc.model import StiffnessModel, approach
from postproc.robot.chain import jacobian

ONE_POSE = 1e-6
"""[rad, m] Motors that differ by less are in one pose."""


REST = 1e-14
"""[rad, m] What may remain of the displacement to an equilibrium: differences of two loads are taken."""

SCALE_NAME = "scale of the tracker"

SCALE = 5e-5
"""Standard deviation of the scale of a tracker's lengths over those of a robot: 5 K of steel are 6e-5."""

LARGEST_SCALE = 5e-4
"""No tracker and no temperature makes more: the rest is the arm."""


def sense_of(readings: Readings) -> Floats:
    """(R, n) sense of approach as it is stated, else in the order of the rows of each file: how the robot came to the
    first pose of a file is not known."""
    if readings.direction is not None:
        return readings.direction
    starts = np.flatnonzero(np.append(True, np.diff(readings.file) != 0))
    return np.concatenate([approach(rows) for rows in np.split(readings.q, starts[1:])])


@dataclass(frozen=True)
class PredictedReadings:
    """The tool at every state of a campaign: ``rotation`` (S, 3, 3); ``body`` (S, 3) [m], the place of the TCP without
    what the spindle gives, ``tip`` (S, 3) with it; ``displacement`` (S, m), to start a model nearby with; ``converged``
    (S,); ``base`` (S): where the robot base is, None where it stays at its place."""

    rotation: Floats
    body: Floats
    tip: Floats
    displacement: Floats
    converged: Bools
    base: Poses | None = None


@dataclass(frozen=True)
class Nuisances:
    """Where tracker and targets are: ``frames`` (M) of the robot base in the tracker's frame, one a session; ``places``
    (K, 3) [m] of the targets in tool axes from the TCP; ``turns`` (K, 3, 3) of their frames in it; ``scale``: what the
    tracker reads of a length of the robot, over that, less 1."""

    frames: Poses
    places: Floats
    turns: Floats
    scale: float = 0.0


class Campaign:
    """Readings as a model sees them.

    q (S, n), wrench (S, 6), conditions (S): the states that differ.  at (R,): the state of each reading, of a
    deflection the loaded one, still (R,) its unloaded one.  pose (R,): readings with the motors in one place share a
    number, of ``poses``.  tracked: the tracker's frame is not known; posed: rotations are measured too.  targets (K,):
    names, place_known, turn_known (K,) what is stated of them.
    """

    def __init__(self, readings: Readings, tool: Poses | None = None) -> None:
        """``tool``: TCP on the flange where the readings do not state one."""
        self.readings = readings
        self.stated_tool = stated = tool if readings.tool is None else readings.tool
        self.tool = Poses.identity() if stated is None else stated
        self.tracked = not (readings.deflection or readings.in_robot_frame)
        self.posed = readings.rotation is not None
        self._find_states()
        named = readings.targets
        self.at_tip = not named
        self.targets = named or ("",)
        free = stated is None and self.tracked
        self.place_known: Bools = np.array([name in readings.places for name in named] or [not free])
        # of a target the place is stated, of a tool the axes too
        self.turn_known: Bools = np.array([False for _ in named] or [not free])
        # started on the flange where nothing is stated
        on_flange = [readings.places.get(name, np.zeros(3)) for name in named] or [self.tool.position]
        into_tool = self.tool.inverse()
        self.on_base: Bools = np.array([name in readings.on_base for name in self.targets])
        self.stated_places = np.array(
            [
                place if base else into_tool.rotation @ place + into_tool.position
                for place, base in zip(on_flange, self.on_base, strict=True)
            ]
        )
        self.stated_turns = np.tile(np.eye(3), (len(self.targets), 1, 1))
        self.known_scale: float | None = None
        self.expected_scale = 0.0
        self.nuisance_names = tuple(self._nuisance_names())

    def __len__(self) -> int:
        return len(self.readings)

    def knowing(self, other: Campaign, nuisances: Nuisances) -> Campaign:
        """The campaign with the targets that ``other`` found, by their names, as stated ones."""
        new = copy(self)
        new.place_known, new.turn_known = self.place_known.copy(), self.turn_known.copy()
        new.stated_places, new.stated_turns = self.stated_places.copy(), self.stated_turns.copy()
        for k, name in enumerate(self.targets):
            if name in other.targets:
                at = other.targets.index(name)
                new.stated_places[k], new.stated_turns[k] = nuisances.places[at], nuisances.turns[at]
                new.place_known[k] = new.turn_known[k] = True
        new.known_scale = nuisances.scale
        new.nuisance_names = tuple(new._nuisance_names())
        return new

    def seen_in(self, rows: Ints) -> Campaign:
        """The campaign with the readings ``rows`` (K,) only; its states stay, and so does what is predicted of them."""
        new = copy(self)
        new.readings = self.readings.part(rows)
        new.at, new.pose = self.at[rows], self.pose[rows]
        new.still = None if self.still is None else self.still[rows]
        return new

    def shifted(self, by: Floats) -> Campaign:
        """The campaign with its measured positions and rotations moved by ``by`` (R, 3 or 6) [m, rad]."""
        new = copy(self)
        rotation = self.readings.rotation
        if rotation is not None:
            rotation = rotation_from_vector(by[:, 3:]) @ rotation
        new.readings = replace(self.readings, value=self.readings.value + by[:, :3], rotation=rotation)
        return new

    def _find_states(self) -> None:
        readings, count = self.readings, len(self.readings)
        sense = sense_of(readings)
        warmth, time = readings.warmth, readings.elapsed
        parts = [readings.q, readings.wrench, sense, warmth, time]
        key = np.column_stack([part for part in parts if part is not None])
        if readings.deflection:
            unloaded = key.copy()
            unloaded[:, readings.q.shape[1] : readings.q.shape[1] + 6] = 0.0
            key = np.concatenate([key, unloaded])
        _, first, of = np.unique(key, axis=0, return_index=True, return_inverse=True)
        of, row = of.reshape(-1), first % count
        self.q = readings.q[row]
        self.wrench = np.where((first < count)[:, None], readings.wrench[row], 0.0)
        given = Conditions(direction=sense, temperature=warmth, time=time)
        self.conditions = given.part(row)
        self.at: Ints = of[:count]
        self.still: Ints | None = of[count:] if readings.deflection else None
        _, pose = np.unique(np.round(readings.q / ONE_POSE), axis=0, return_inverse=True)
        self.pose: Ints = pose.reshape(-1)
        self.poses = int(self.pose.max()) + 1

    def predicted(
        self, model: StiffnessModel, start: Floats | None = None, tolerance: float = REST
    ) -> PredictedReadings:
        """All states at rest under ``model``; ``start`` (S, m): displacement of a model nearby; ``tolerance`` as of the
        equilibrium."""
        rest = model.equilibrium(self.q, self.wrench, self.tool, self.conditions, start, tolerance)
        moves = self.on_base.any() and model.chain.names[0].startswith("base.")
        base = model.chain.base(rest.coordinates.T) if moves else None
        return PredictedReadings(
            rest.pose.rotation, rest.mount, rest.pose.position, rest.displacement, rest.converged, base
        )

    def turned(self, predicted: PredictedReadings, at: Ints) -> Floats:
        """(R, 3, 3) turn of what each reading's target is fixed to, in states ``at`` (R,)."""
        rotation = predicted.rotation[at]
        based = self.readings.based
        if based.any():
            rotation = rotation.copy()
            rotation[based] = np.eye(3) if predicted.base is None else predicted.base.rotation[at][based]
        return rotation

    def points(self, predicted: PredictedReadings, places: Floats, at: Ints) -> Floats:
        """(R, 3) [m] what each reading would see in states ``at`` (R,), robot base, with the targets at ``places`` (T,
        3) [m] on the flange."""
        origin = (predicted.tip if self.at_tip else predicted.body)[at]
        based = self.readings.based
        if based.any():
            origin = origin.copy()
            origin[based] = 0.0 if predicted.base is None else predicted.base.position[at][based]
        place = places[self.readings.target]
        return np.asarray(origin + (self.turned(predicted, at) @ place[:, :, None])[:, :, 0])

    def expected(self, predicted: PredictedReadings, nuisances: Nuisances) -> tuple[Floats, Floats | None]:
        """(R, 3) [m], and rotations (R, 3, 3) where they are measured, in the axes of the readings; NaN where the model
        has no rest."""
        points = self.points(predicted, nuisances.places, self.at)
        lost = ~predicted.converged[self.at]
        rotation = self.turned(predicted, self.at)
        if self.still is not None:
            points = points - self.points(predicted, nuisances.places, self.still)
            lost = lost | ~predicted.converged[self.still]
            rotation = rotation @ np.swapaxes(self.turned(predicted, self.still), 1, 2)
        else:
            rotation = rotation @ nuisances.turns[self.readings.target]
        points = np.where(lost[:, None], np.nan, points)
        if self.tracked:
            frame = nuisances.frames[self.readings.session]
            points = points * (1.0 + nuisances.scale)
            points = (frame.rotation @ points[:, :, None])[:, :, 0] + frame.position
            rotation = frame.rotation @ rotation
        return points, rotation if self.posed else None

    def residual(self, predicted: PredictedReadings, nuisances: Nuisances) -> Floats:
        """(R, 3) [m], or (R, 6) [m, rad] where rotations are measured: measured minus expected, in the axes of the
        readings; NaN where nothing was measured or the model has no rest."""
        position, rotation = self.expected(predicted, nuisances)
        difference = self.readings.value - position
        if rotation is None or self.readings.rotation is None:
            return difference
        away = np.full_like(difference, np.nan)
        known = np.isfinite(self.readings.rotation).all(axis=(1, 2)) & np.isfinite(position).all(axis=1)
        away[known] = vector_from_rotation(self.readings.rotation[known] @ np.swapaxes(rotation[known], 1, 2))
        return np.concatenate([difference, away], axis=1)

    def in_base(self, residual: Floats, nuisances: Nuisances) -> Floats:
        """(R, 3 or 6) [m, rad] of a ``residual`` (R, 3 or 6) in axes of the robot base.  A coordinate that was not
        measured counts as zero; a place or turn of which nothing is known stays NaN."""
        if not self.tracked:
            return residual
        back = np.swapaxes(nuisances.frames.rotation, 1, 2)[self.readings.session]
        halves = []
        for half in (residual[:, k : k + 3] for k in range(0, residual.shape[1], 3)):
            turned = (back @ np.nan_to_num(half)[:, :, None])[:, :, 0]
            known = np.isfinite(half).any(axis=1, keepdims=True)
            halves.append(np.where(known, turned, np.nan))
        return np.concatenate(halves, axis=1)

    # Nuisances as columns of a fit.

    def start(self) -> Nuisances:
        """Tracker in the robot base, targets at their stated places or on the flange."""
        sessions = len(self.readings.sessions)
        frames = Poses(np.tile(np.eye(3), (sessions, 1, 1)), np.zeros((sessions, 3)))
        return Nuisances(frames, self.stated_places, self.stated_turns, self.known_scale or 0.0)

    @property
    def scaled(self) -> bool:
        """Whether the scale of the tracker is an unknown, the last of the nuisances."""
        return self.tracked and self.known_scale is None

    def nuisance_prior(self, nuisances: Nuisances) -> tuple[Floats, Floats]:
        """(k, U) rows and (k,) values, in standard deviations, of what is known of the nuisances besides readings."""
        rows = np.zeros((int(self.scaled), len(self.nuisance_names)))
        rows[:, -1:] = 1.0 / SCALE
        return rows, np.full(len(rows), (self.expected_scale - nuisances.scale) / SCALE)

    def _blocks(self) -> list[tuple[str, int]]:
        """What is not known, three columns each, and of which session or target it is; the scale is not among them."""
        blocks = []
        if self.tracked:
            for k in range(len(self.readings.sessions)):
                blocks += [("shift", k), ("turn", k)]
        for k in range(len(self.targets)):
            if not self.place_known[k]:
                blocks.append(("place", k))
            if self.posed and self.still is None and not self.turn_known[k]:
                blocks.append(("axes", k))
        return blocks

    def _nuisance_names(self) -> list[str]:
        names = []
        for kind, k in self._blocks():
            of = self.readings.sessions[k] if kind in ("shift", "turn") else self.targets[k]
            what = "registration" if kind in ("shift", "turn") else "target"
            axes = ("x", "y", "z") if kind in ("shift", "place") else ("rx", "ry", "rz")
            names += [f"{what}{f' {of}' if of else ''}.{axis}" for axis in axes]
        return [*names, SCALE_NAME] if self.scaled else names

    def nuisance_columns(self, predicted: PredictedReadings, nuisances: Nuisances) -> Floats:
        """(R, 3 or 6, U) derivative of ``expected`` by the steps of ``moved``."""
        derivatives = np.zeros((len(self), 6, len(self.nuisance_names)))
        points = self.points(predicted, nuisances.places, self.at)
        axes = nuisances.frames.rotation[self.readings.session]
        if self.scaled:
            derivatives[:, :3, -1] = (axes @ points[:, :, None])[:, :, 0]
        for block, (kind, k) in enumerate(self._blocks()):
            columns = slice(3 * block, 3 * block + 3)
            if kind in ("shift", "turn"):
                of = self.readings.session == k
                if kind == "shift":
                    derivatives[of, :3, columns] = axes[of]
                else:
                    derivatives[of, :3, columns] = -axes[of] @ skew(points[of])
                    derivatives[of, 3:, columns] = axes[of]
                continue
            of = self.readings.target == k
            rotation = self.turned(predicted, self.at)[of]
            if self.still is not None:
                rotation = rotation - self.turned(predicted, self.still)[of]
            rows = slice(0, 3) if kind == "place" else slice(3, 6)
            derivatives[of, rows, columns] = axes[of] @ rotation if self.tracked else rotation
        return derivatives if self.posed else derivatives[:, :3]

    def columns(
        self, model: StiffnessModel, predicted: PredictedReadings, nuisances: Nuisances, moved: Floats
    ) -> Floats:
        """(R, 3 or 6, P) what moves in ``expected`` where the coordinates of the states move by ``moved`` (S, m, P);
        NaN where the model has no rest."""
        state = model.state(self.q, self.wrench, self.tool, self.conditions, predicted.displacement)
        chain = model.chain
        # a target is on the body, which does not move with what the spindle gives
        on = np.array([self.at_tip or not name.startswith("spindle.") for name in chain.names])
        j = jacobian(state.swept)
        derivatives = np.zeros((len(self), 6 if self.posed else 3, moved.shape[2]))
        of_base = np.array([name.startswith("base.") for name in chain.names])
        moves = [((j[:, :3] * on) @ moved, j[:, 3:] @ moved)]
        if self.on_base.any():
            moves.append(((j[:, :3] * of_base) @ moved, (j[:, 3:] * of_base) @ moved))

        def at(states: Ints) -> None:
            points, sign = (
                self.points(predicted, nuisances.places, states),
                1.0 if states is self.at else -1.0,
            )
            for target in range(len(self.targets)):
                rows = np.flatnonzero(self.readings.target == target)
                own = states[rows]
                tip, turn = (half[own] for half in moves[int(self.on_base[target])])
                lever = points[rows] - predicted.tip[own]
                derivatives[rows, :3] += sign * (tip - np.cross(lever[:, :, None], turn, axis=1))
                if self.posed:
                    derivatives[rows, 3:] += sign * (turn if sign > 0 else relative[rows] @ turn)

        relative = np.empty(0)
        if self.still is not None:
            back = np.swapaxes(self.turned(predicted, self.still), 1, 2)
            relative = self.turned(predicted, self.at) @ back
        at(self.at)
        if self.still is not None:
            at(self.still)
        if self.tracked:
            axes = nuisances.frames.rotation[self.readings.session]
            for half in range(0, derivatives.shape[1], 3):
                derivatives[:, half : half + 3] = axes @ derivatives[:, half : half + 3]
        lost = ~predicted.converged[self.at]
        if self.still is not None:
            lost |= ~predicted.converged[self.still]
        derivatives[lost] = np.nan
        return derivatives

    def moved(self, nuisances: Nuisances, step: Floats) -> Nuisances:
        """The nuisances after a step (U,) [m, rad, 1]: frames T (exp(turn) p + shift), targets c + place and
        exp(axes) turn, the scale plus its step."""
        rotation, position = nuisances.frames.rotation.copy(), nuisances.frames.position.copy()
        places, turns = nuisances.places.copy(), nuisances.turns.copy()
        for block, (kind, k) in enumerate(self._blocks()):
            part = step[3 * block : 3 * block + 3]
            if kind == "shift":
                position[k] += rotation[k] @ part
            elif kind == "turn":
                rotation[k] = rotation[k] @ rotation_from_vector(part)
            elif kind == "place":
                places[k] += part
            else:
                turns[k] = rotation_from_vector(part) @ turns[k]
        scale = nuisances.scale + float(step[-1]) if self.scaled else nuisances.scale
        return Nuisances(Poses(rotation, position), places, turns, scale)
