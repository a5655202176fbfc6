"""The data types of RAPID that positions are made of, and the data that every controller has.

Source: ABB, Technical reference manual, RAPID Instructions, Functions and Data types (speeddata, zonedata, tooldata,
wobjdata, robtarget).
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

Components = tuple[tuple[bytes, bytes], ...]


def _nums(names: str) -> Components:
    return tuple((name.encode(), b"NUM") for name in names.split())


_RECORDS: dict[bytes, Components] = {
    b"POS": _nums("X Y Z"),
    b"ORIENT": _nums("Q1 Q2 Q3 Q4"),
    b"CONFDATA": _nums("CF1 CF4 CF6 CFX"),
    b"EXTJOINT": _nums("EAX_A EAX_B EAX_C EAX_D EAX_E EAX_F"),
    b"ROBJOINT": _nums("RAX_1 RAX_2 RAX_3 RAX_4 RAX_5 RAX_6"),
    b"POSE": ((b"TRANS", b"POS"), (b"ROT", b"ORIENT")),
    b"ROBTARGET": (
        (b"TRANS", b"POS"),
        (b"ROT", b"ORIENT"),
        (b"ROBCONF", b"CONFDATA"),
        (b"EXTAX", b"EXTJOINT"),
    ),
    b"JOINTTARGET": ((b"ROBAX", b"ROBJOINT"), (b"EXTAX", b"EXTJOINT")),
    b"SPEEDDATA": _nums("V_TCP V_ORI V_LEAX V_REAX"),
    b"ZONEDATA": (
        (b"FINEP", b"BOOL"),
        *_nums("PZONE_TCP PZONE_ORI PZONE_EAX ZONE_ORI ZONE_LEAX ZONE_REAX"),
    ),
    b"LOADDATA": (
        (b"MASS", b"NUM"),
        (b"COG", b"POS"),
        (b"AOM", b"ORIENT"),
        *_nums("IX IY IZ"),
    ),
    b"TOOLDATA": ((b"ROBHOLD", b"BOOL"), (b"TFRAME", b"POSE"), (b"TLOAD", b"LOADDATA")),
    b"WOBJDATA": (
        (b"ROBHOLD", b"BOOL"),
        (b"UFPROG", b"BOOL"),
        (b"UFMEC", b"STRING"),
        (b"UFRAME", b"POSE"),
        (b"OFRAME", b"POSE"),
    ),
}
RECORDS: Mapping[bytes, Components] = MappingProxyType(_RECORDS)
"""Type -> its components with their types."""

_SPEEDS = (
    *(5, 10, 20, 30, 40, 50, 60, 80, 100, 150, 200, 300, 400, 500, 600, 800, 1000, 1500, 2000, 2500),
    *(3000, 4000, 5000, 6000, 7000),
)
SPEEDS: Mapping[bytes, float] = MappingProxyType({b"V%d" % speed: float(speed) for speed in _SPEEDS})
"""Name -> v_tcp [mm/s].  That of vmax depends on the robot."""

_ZONES = (1, 5, 10, 15, 20, 30, 40, 50, 60, 80, 100, 150, 200)
ZONES: Mapping[bytes, float] = MappingProxyType(
    {b"FINE": 0.0, b"Z0": 0.3, **{b"Z%d" % zone: float(zone) for zone in _ZONES}}
)
"""Name -> pzone_tcp [mm]; 0 for a stop point."""

STOP_KINDS: Mapping[bytes, float] = MappingProxyType({b"INPOS": 1.0, b"STOPTIME": 2.0, b"FOLLOWTIME": 3.0})
"""Name -> what a stop point waits for, the first component of stoppointdata."""

_TIMES = (b"0_5", b"1_0", b"1_5")
STOP_POINTS: Mapping[bytes, float] = MappingProxyType(
    {
        **{b"INPOS%d" % percent: STOP_KINDS[b"INPOS"] for percent in (20, 50, 100)},
        **{b"STOPTIME" + time: STOP_KINDS[b"STOPTIME"] for time in _TIMES},
        **{b"FLLWTIME" + time: STOP_KINDS[b"FOLLOWTIME"] for time in _TIMES},
    }
)
"""Name of stoppointdata -> what it waits for."""

FLY_BY = b"z0"
"""The smallest zone in which the robot does not stop."""

ABSENT = 8.9e9
"""An external axis at 9E9 is not there."""
