"""Which control a G-code file is for, by its name and content."""

from __future__ import annotations

import re
from pathlib import Path

SUFFIXES = frozenset(
    f".{suffix}"
    for suffix in (
        *("nc", "ngc", "tap", "cnc", "gcode", "gco", "g", "ptp", "iso", "eia", "din", "mpf", "spf"),
        *("ncc", "ncd", "min", "pim", "fnc", "ncp", "anc"),
    )
)
BEGIN = 65536
"""Bytes from the start of a file that are looked at."""

_KRL = re.compile(
    rb"^(?:\xef\xbb\xbf)?[ \t]*+(?:(?:GLOBAL[ \t]++)?(?:DEF|DEFDAT)[ \t]++[A-Za-z_$][A-Za-z0-9_$]*+[ \t]*+"
    rb"(?:\(|;|PUBLIC|\r?$)"
    rb"|&(?:ACCESS|REL|PARAM)\b|S?(?:PTP|LIN|CIRC)(?:_REL)?[ \t]*+\{|BAS[ \t]*+\(|\$(?:BASE|TOOL|VEL|APO)\b)",
    re.I | re.M,
)
_BLOCK = re.compile(
    rb"^(?:\xef\xbb\xbf)?[ \t]*+/?[ \t]*+(?:N[ \t]*+\d++[ \t]*+)?"
    rb"(?:G[ \t]*+\d{1,3}(?:\.\d)?|[XYZ][ \t]*+[-+]?[ \t]*+\.?\d|[MT][ \t]*+\d{1,4}(?![A-Za-z_]))"
    rb"[^\r\n;({=]{0,200}(?:[;(\r\n]|\Z)",
    re.I | re.M,
)
_MOTION = re.compile(rb"(?:^|[^A-Za-z])G[ \t]*0?[0-3](?![\d.])|[XYZ][ \t]*+(?:[-+][ \t]*+)?\.?\d", re.I)
_FANUC = re.compile(
    rb"^[ \t]*(?:O[ \t]*\d{1,8}(?![ \t]*[A-Za-z<\d])|:[ \t]*\d{1,8}[ \t]*(?:\(|\r?$))"
    rb"|^[^(;\r\n]*(?:G[ \t]*(?:0?5(?:\.1)?[ \t]*[PQ]|54\.1|154|43\.[45]|234|68\.2|65[ \t]*P)|M[ \t]*98[ \t]*P"
    rb"|(?:IF|WHILE)[ \t]*\[|GOTO[ \t]*\d)",
    re.I | re.M,
)


def is_gcode(path: Path, raw: bytes) -> bool:
    """Whether a file is G-code of any control: by its suffix, or by lines that are blocks with a motion in them."""
    start = raw[:BEGIN]
    if _KRL.search(start):
        return False
    if path.suffix.lower() in SUFFIXES:
        return True
    return _BLOCK.search(start) is not None and _MOTION.search(start) is not None


def is_fanuc(path: Path, raw: bytes) -> bool:
    """A program number, or codes that LinuxCNC does not know."""
    return is_gcode(path, raw) and _FANUC.search(raw[:BEGIN]) is not None


def is_kuka_cnc(path: Path, raw: bytes) -> bool:
    """A # command."""
    if not is_gcode(path, raw):
        return False
    from postproc.languages.gcode import kuka_cnc  # takes its time to load

    return kuka_cnc.claims(raw)


def is_sinumerik(path: Path, raw: bytes) -> bool:
    """A suffix of its own, or words that no other control has."""
    if not is_gcode(path, raw):
        return False
    from postproc.languages.gcode import sinumerik  # takes its time to load

    return sinumerik.claims(path.suffix, raw)
