"""Places and ranges that were written in another unit, or against another place, than they are read in."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from postproc.base.findings import Finding
from postproc.base.units import DEG, MM, are_radians
from postproc.placement.room import FREEDOMS, TOOL_TURN, TURN, UNITS, Room, X, Y, Z

METRES = 10.0
"""[mm] Lengths that are all within so little were written in metres: no part lies so close to the robot's foot."""


def metres_help(ranges: Mapping[str, tuple[float, float]]) -> str:
    """A help where all lengths of ``ranges`` [mm] are those of metres; "" otherwise."""
    lengths = {name: ranges[name] for name in ("x", "y", "z") if name in ranges}
    if not lengths or any(max(-low, high) >= METRES for low, high in lengths.values()):
        return ""
    name, (low, high) = next(iter(lengths.items()))
    ends = f"{1000 * low:g}:{1000 * high:g}" if low < high else f"{1000 * low:g}"
    return f"ranges are in mm: for metres write --{name} {ends}"


def metre_ranges(ranges: Mapping[str, tuple[float, float]], file: str) -> list[Finding]:
    """PLC022 where all lengths of ``ranges`` [mm] are those of metres."""
    help = metres_help(ranges)
    if not help:
        return []
    message = f"all ranges of lengths are within {METRES:g} mm of the robot's base, as if they were in metres"
    return [Finding("PLC022", message, file, help=help)]


def metre_places(places: Mapping[str, Sequence[float]]) -> dict[str, str]:
    """Name -> help, of those of ``places`` (x, y, z [mm] ...) whose lengths are those of metres."""
    found = {}
    for name, place in places.items():
        if max(abs(length) for length in place[:3]) < METRES:
            there = ",".join(f"{1000 * length:g}" for length in place[:3])
            found[name] = f"places are in mm: for metres write --at {name}={there}"
    return found


def metre_findings(places: Mapping[str, Sequence[float]], file: str) -> list[Finding]:
    """PLC022 for those of ``places`` (x, y, z [mm] ...) whose lengths are those of metres."""
    return [
        Finding("PLC022", f"place {name} is within {METRES:g} mm of the robot's base, as if it were in metres", file,
                help=help)
        for name, help in metre_places(places).items()
    ]  # fmt: skip


def radian_ranges(room: Room, file: str) -> list[Finding]:
    """PLC021 for ranges of turns whose ends are round parts of pi: deg that were written as radians."""
    found = []
    for i in (TURN, TOOL_TURN):
        low, high = (float(end[i] / UNITS[i]) for end in (room.lower, room.upper))
        if i in room.stated and are_radians((low, high)):
            name = FREEDOMS[i].replace("_", "-")
            message = f"the range of {name}, {low:g} .. {high:g} deg, is round only in radians"
            help = f"turns are in deg: from radians --{name} {low / DEG:.4g}:{high / DEG:.4g}"
            found.append(Finding("PLC021", message, file, help=help))
    return found


def radian_places(places: Mapping[str, Sequence[float]], file: str) -> list[Finding]:
    """PLC021 for turns of ``places`` (x, y, z [mm], turn [deg]) that are round parts of pi."""
    found = []
    for name, (*_, turn) in places.items():
        if are_radians([turn]):
            message = f"the turn of place {name}, {turn:g} deg, is round only in radians"
            found.append(
                Finding("PLC021", message, file, help=f"turns are in deg: from radians {turn / DEG:.4g}")
            )
    return found


def room_elsewhere(room: Room) -> str:
    """A help where the room does not contain the present place: its ranges may be meant against that; "" otherwise."""
    away = [i for i in (X, Y, Z) if not room.lower[i] <= room.present[i] <= room.upper[i]]
    if not away:
        return ""
    now = ", ".join(f"{FREEDOMS[i]} {room.present[i] / MM:g}" for i in away)
    words = f"ranges are places of the base in $WORLD; the present one, {now}, is outside of them"
    about = [i for i in away if room.lower[i] < 0.0 < room.upper[i]]
    if about:
        shifted = np.array([room.lower, room.upper]) + room.present
        ends = " ".join(f"--{FREEDOMS[i]} {shifted[0, i] / MM:g}:{shifted[1, i] / MM:g}" for i in about)
        words += f"; relative to it, write {ends}"
    return words
