"""The wanted motions of a program: where the text side and the physics side meet."""

from postproc.toolpath.toolpath import (
    COMPUTED,
    LOST,
    Annotation,
    ArcFrame,
    FrameRef,
    Kind,
    OrientationMode,
    OrientationPath,
    Plan,
    Role,
    Toolpath,
    external_at,
)

__all__ = [
    "COMPUTED",
    "LOST",
    "Annotation",
    "ArcFrame",
    "FrameRef",
    "Kind",
    "OrientationMode",
    "OrientationPath",
    "Plan",
    "Role",
    "Toolpath",
    "external_at",
]
