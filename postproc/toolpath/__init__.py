"""The wanted motions of a program: where the text side and the physics side meet."""

from postproc.toolpath.arcs import ArcFrame, Arcs
from postproc.toolpath.plan import Plan, Role
from postproc.toolpath.toolpath import (
    COMPUTED,
    LOST,
    Annotation,
    FrameRef,
    Kind,
    OrientationMode,
    OrientationPath,
    Toolpath,
    external_at,
)

__all__ = [
    "COMPUTED",
    "LOST",
    "Annotation",
    "ArcFrame",
    "Arcs",
    "FrameRef",
    "Kind",
    "OrientationMode",
    "OrientationPath",
    "Plan",
    "Role",
    "Toolpath",
    "external_at",
]
