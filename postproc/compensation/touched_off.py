"""What touching off a base with the robot itself measures: a rigid motion of the part, and nothing of what remains.

A probe that the robot brings to places p_k of the part touches them where the robot really is, p_k + e_k, while the
controller reads p_k; e_k is the error of the unloaded robot there.  The base that is set from these readings therefore
lies beside the part by the rigid motion M that fits p_k -> p_k + e_k best, and the tool is to be at M x where the
program states x.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.geometry import Poses, rotation_from_vector
from postproc.compensation.load_case import LoadCase
from postproc.compensation.mirror import Prediction, predict
from postproc.effects import Conditions
from postproc.model import StiffnessModel
from postproc.robot.axis_track import AxisTrack

STEP = 1e-6
"""[m] Step of touched places in differences."""


def rigid_motion(before: Floats, after: Floats) -> Poses:
    """The rigid motion that brings places ``before`` (K, 3) to ``after`` (K, 3) [m] with the least sum of squares.

    Of one place a shift, of two a shift with the least turn that aligns them, of more that are not on a line all six
    degrees of freedom (Kabsch 1976, doi:10.1107/S0567739476001873).
    """
    middle, there = before.mean(axis=0), after.mean(axis=0)
    one, other = before - middle, after - there
    rotation = np.eye(3)
    if len(before) == 2:
        rotation = _least_turn(one[1], other[1])
    elif len(before) > 2:
        u, _, vt = np.linalg.svd(one.T @ other)
        mirrored = np.linalg.det(vt.T @ u.T) < 0
        rotation = vt.T @ np.diag([1.0, 1.0, -1.0 if mirrored else 1.0]) @ u.T
    return Poses(rotation, there - rotation @ middle)


def _least_turn(start: Floats, end: Floats) -> Floats:
    """The smallest rotation (3, 3) that brings the direction of ``start`` (3,) to that of ``end`` (3,)."""
    across = np.cross(start, end)
    sine, cosine = np.linalg.norm(across), start @ end
    if sine == 0.0:
        return np.eye(3)
    return rotation_from_vector(np.arctan2(sine, cosine) / sine * across)


@dataclass(frozen=True)
class TouchedOff:
    """What touching saw of the F frames of a toolpath.

    motion (F): of the part against the programmed base, in the robot base, nothing where a frame was not touched off;
    known (F,): it was.  Of all T touches: frame (T,), row (T,) the motion whose tool, orientation and configuration it
    has, wanted (T) commanded poses, real (T) where the unloaded tool is, conditions (T).
    """

    motion: Poses
    known: Bools
    frame: Ints
    row: Ints
    wanted: Poses
    tool: Poses
    real: Prediction
    conditions: Conditions

    @staticmethod
    def of(
        model: StiffnessModel,
        track: AxisTrack,
        conditions: Conditions,
        frame: Ints,
        row: Ints,
        wanted: Poses,
        tool: Poses,
        frames: int,
    ) -> TouchedOff:
        """Of ``frames`` frames, touched as the class describes: place k (K,) is in ``frame`` (K,) and is the target of
        motion ``row`` (K,).  Conditions of N motions; each place is touched without a sense of approach."""
        given = conditions.part(row)
        if model.by_direction:
            given = replace(given, direction=np.zeros((len(row), len(model.robot.joints))))
        none = np.zeros((len(row), 6))
        real = predict(model, wanted, LoadCase(tool, none, given, track.branch[row], track.q[row]))
        rotation, position = np.tile(np.eye(3), (frames, 1, 1)), np.zeros((frames, 3))
        known = np.isin(np.arange(frames), frame)
        for index in np.flatnonzero(known):
            own = frame == index
            moved = rigid_motion(wanted.position[own], real.pose.position[own])
            rotation[index], position[index] = moved.rotation, moved.position
        return TouchedOff(Poses(rotation, position), known, frame, row, wanted, tool, real, given)

    def residual(self) -> Floats:
        """(T,) [m] how far each touched place is from where its base puts it."""
        fitted = self.motion[self.frame] @ self.wanted
        return np.asarray(np.linalg.norm(self.real.pose.position - fitted.position, axis=1))

    def goal(self, frame: Ints, wanted: Poses) -> Poses:
        """Where the tool is to be (K) for poses ``wanted`` (K) in the frames (K,)."""
        return self.motion[frame] @ wanted

    def sensitivity(self, touched: Floats, frame: Ints, place: Floats) -> Floats:
        """d(goal)/d(figure) (K, 3, P) at ``place`` (K, 3) in the frames (K,), of d(touched place)/d(figure)
        (T, 3, P): central differences of the fit."""
        derivatives = np.zeros((len(place), 3, touched.shape[2]))
        for index in np.unique(frame[self.known[frame]]):
            own, rows = self.frame == index, frame == index
            before, after = self.wanted.position[own], self.real.pose.position[own]
            for column in range(touched.shape[2]):
                moves = touched[own, :, column]
                size = np.abs(moves).max()
                if not size > 0:
                    continue
                step = STEP / size
                ends = [rigid_motion(before, after + sign * step * moves) for sign in (1.0, -1.0)]
                high, low = (place[rows] @ end.rotation.T + end.position for end in ends)
                derivatives[rows, :, column] = (high - low) / (2 * step)
        return derivatives
