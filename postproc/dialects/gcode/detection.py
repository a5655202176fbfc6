"""Which control a G-code file is for, by its name and content."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

SUFFIXES = frozenset(
    f".{suffix}"
    for suffix in (
        *("nc", "ngc", "tap", "cnc", "gcode", "gco", "g", "ptp", "iso", "eia", "din", "mpf", "spf"),
        *("ncc", "ncd", "min", "pim", "fnc", "ncp", "anc"),
    )
)
BEGIN = 65536
"""Bytes from the begin of a file that are looked at."""

_KRL = re.compile(
    rb"^(?:\xef\xbb\xbf)?[ \t]*(?:(?:GLOBAL[ \t]+)?DEF(?:FCT|DAT)?[ \t]+[A-Za-z_$]|&(?:ACCESS|REL|PARAM)\b"
    rb"|S?(?:PTP|LIN|CIRC)[ \t]*\{)",
    re.I | re.M,
)
_BLOCK = re.compile(
    rb"^(?:\xef\xbb\xbf)?[ \t]*/?[ \t]*(?:N[ \t]*\d+[ \t]*)?"
    rb"(?:G[ \t]*\d{1,3}(?:\.\d)?|[XYZ][ \t]*[-+]?[ \t]*\.?\d|[MT][ \t]*\d{1,4}(?![A-Za-z_]))"
    rb"[^\r\n;({=]{0,200}(?:[;(\r\n]|\Z)",
    re.I | re.M,
)
_MOTION = re.compile(rb"(?:^|[^A-Za-z])G[ \t]*0?[0-3](?![\d.])|[XYZ][ \t]*[-+]?[ \t]*\.?\d", re.I)
_FANUC = re.compile(
    rb"^[ \t]*(?:O[ \t]*\d{1,8}(?![ \t]*[A-Za-z<\d])|:[ \t]*\d{1,8}[ \t]*(?:\(|\r?$))"
    rb"|^[^(;\r\n]*(?:G[ \t]*(?:0?5(?:\.1)?[ \t]*[PQ]|54\.1|154|43\.[45]|234|68\.2|65[ \t]*P)|M[ \t]*98[ \t]*P"
    rb"|(?:IF|WHILE)[ \t]*\[|GOTO[ \t]*\d)",
    re.I | re.M,
)


def is_gcode(path: Path, raw: bytes) -> bool:
    """Whether a file is G-code of any control: by its suffix, or by lines that are blocks with a motion in them."""
    begin = raw[:BEGIN]
    if _KRL.search(begin):
        return False
    if path.suffix.lower() in SUFFIXES:
        return True
    return _BLOCK.search(begin) is not None and _MOTION.search(begin) is not None


def is_fanuc(path: Path, raw: bytes) -> bool:
    """A program number, or codes that LinuxCNC does not know."""
    return is_gcode(path, raw) and _FANUC.search(raw[:BEGIN]) is not None


CLAIMS: dict[str, Callable[[Path, bytes], bool]] = {"fanuc": is_fanuc, "linuxcnc": is_gcode}
