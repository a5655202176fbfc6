"""The wrench that the workpiece puts on the tool, for every motion of a program."""

from postproc.forces.sources import wrenches
from postproc.forces.stated import is_force_word, is_no_force
from postproc.forces.wrench import Wrenches

__all__ = ["Wrenches", "is_force_word", "is_no_force", "wrenches"]
