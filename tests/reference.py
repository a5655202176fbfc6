"""Pinocchio itself, state by state: the reference for the chain that is evaluated in batches."""

import numpy as np
import pinocchio as pin

from postproc.base.geometry import Poses


def reference_flange(chain, q):
    """Flange poses (N) of the rigid robot at ``q`` (N, n), in the robot base."""
    data, found = chain.model.createData(), []
    for state in chain.placed(q)[: chain.model.nq].T:
        pin.framesForwardKinematics(chain.model, data, state)
        found.append(data.oMf[chain.model.getFrameId("flange")].copy())
    return Poses(np.array([at.rotation for at in found]), np.array([at.translation for at in found]))
