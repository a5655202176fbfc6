"""The wrench that the workpiece puts on the tool, for every motion of a program."""

from postproc.process import codes as codes
from postproc.process.force_sources import not_requested, wrenches
from postproc.process.stated_forces import is_force_word, is_no_force
from postproc.process.wrenches import Wrenches

__all__ = ["Wrenches", "is_force_word", "is_no_force", "not_requested", "wrenches"]
