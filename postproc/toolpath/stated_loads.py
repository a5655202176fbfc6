"""Loads that a program states while it runs: what the robot carries besides, or instead of, the tool of the cell."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class StatedLoad:
    """A statement of a program by which the load of the robot becomes another one.

    ``line``: from 1.  ``text``: the statement as messages show it.  ``mass`` [kg]: None where it is not known.
    ``entry``: number of the tool of the controller whose own load it is, None where it is no entry's; ``from_entry``:
    the statement takes that load, and does not change it.  ``gripped``: it is carried besides the tool; without, it is
    the whole load at the flange.
    """

    line: int
    text: str
    mass: float | None
    entry: int | None = None
    from_entry: bool = False
    gripped: bool = False
