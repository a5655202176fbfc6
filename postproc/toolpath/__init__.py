"""The wanted motions of a program: where the text side and the physics side meet."""

from postproc.toolpath.arcs import ArcFrame, Arcs
from postproc.toolpath.configuration import Configuration, pack_quadrants, unpack_quadrants
from postproc.toolpath.edit_constraints import EditConstraints
from postproc.toolpath.motion_sequence import MotionSequence
from postproc.toolpath.motion_speeds import MotionSpeeds
from postproc.toolpath.orientation_control import OrientationControl, OrientationMode, OrientationPath
from postproc.toolpath.partial_targets import PartialTargets
from postproc.toolpath.planned_motions import Plan, Role
from postproc.toolpath.program_comments import Annotation, ProgramComments
from postproc.toolpath.reflections import Reflections
from postproc.toolpath.stated_loads import StatedLoad
from postproc.toolpath.targets import COMPUTED, LOST, FrameRef, Kind, Targets
from postproc.toolpath.toolpath import Toolpath, external_at

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
    "MotionSequence",
    "MotionSpeeds",
    "OrientationControl",
    "OrientationMode",
    "OrientationPath",
    "PartialTargets",
    "Plan",
    "ProgramComments",
    "Reflections",
    "Role",
    "StatedLoad",
    "Targets",
    "Toolpath",
    "external_at",
    "pack_quadrants",
    "unpack_quadrants",
]
