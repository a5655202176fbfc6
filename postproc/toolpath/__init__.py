"""The wanted motions of a program: where the text side and the physics side meet."""

from postproc.toolpath.arcs import ArcFrame, Arcs
from postproc.toolpath.configuration import Configuration, pack_quadrants, unpack_quadrants
from postproc.toolpath.edit_constraints import EditConstraints
from postproc.toolpath.orientation_control import OrientationControl, OrientationMode, OrientationPath
from postproc.toolpath.partial_targets import PartialTargets
from postproc.toolpath.planned_motions import Plan, Role
from postproc.toolpath.toolpath import (
    COMPUTED,
    LOST,
    Annotation,
    FrameRef,
    Kind,
    Toolpath,
    external_at,
)

__all__ = [
    "COMPUTED",
    "LOST",
    "Annotation",
    "ArcFrame",
    "Arcs",
    "Configuration",
    "EditConstraints",
    "FrameRef",
    "Kind",
    "OrientationControl",
    "OrientationMode",
    "OrientationPath",
    "PartialTargets",
    "Plan",
    "Role",
    "Toolpath",
    "external_at",
    "pack_quadrants",
    "unpack_quadrants",
]
