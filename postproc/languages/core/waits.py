"""Whether a program waits between two motions: then the controller cannot plan the second one ahead, and stops."""

from __future__ import annotations

from enum import IntEnum


class Waits(IntEnum):
    """Whether it waits, or does what stops its advance run; MAYBE: on some paths, or it is not known."""

    NO = 0
    MAYBE = 1
    YES = 2
