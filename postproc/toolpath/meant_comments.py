"""Comments that were meant to speak to this tool, by a word that resembles FORCE or COMPENSATE."""

from __future__ import annotations

import re

from postproc.base.findings import resembles

_VALUE = r"[-+]?\d[\d.]*+"
_LETTER = r"[FM]?[XYZ][ \t]*+(?:[:=][ \t]*+)?"
_FORCE = (
    r"([A-Za-z]{4,7})[ \t:=,_]*+"
    rf"(?:(O\w{{1,3}}|0FF)[ \t]*+$|(?:{_LETTER})?{_VALUE}(?:[ \t,;]++(?:{_LETTER})?{_VALUE}){{2}})"
)
"""A word, and OFF or three numbers with or without letters: what a force comment states, misspelt or not."""
_SWITCH = r"([A-Za-z]{8,14})[ \t:=_]*+(?:ON|OFF?)[ \t]*+$"
_MEANT_FORCE = re.compile(_FORCE, re.IGNORECASE)
_MEANT_SWITCH = re.compile(_SWITCH, re.IGNORECASE)

MAY_BE_MEANT = (
    rf"(?:{_FORCE}|{_SWITCH})".replace("([A", "(?:[A").replace("(O", "(?:O").replace("$", r"\r?$").encode()
)
"""Pattern (re.M) of bytes behind the sign of a comment and blanks that may be meant: for readers that pass most lines
over together."""


def meant_as_force(text: str) -> bool:
    """Whether a comment that states no force was meant to: FORCE misspelt, or with other signs before its numbers."""
    found = _MEANT_FORCE.match(text.strip())
    if found is None or not resembles(found[1], "FORCE"):
        return False
    return found[2] is None or resembles(found[2].replace("0", "O"), "OFF")


def meant_as_switch(text: str) -> bool:
    """Whether a comment was meant to switch the correction: COMPENSATE, or a misspelling of it."""
    found = _MEANT_SWITCH.match(text.strip())
    return found is not None and resembles(found[1], "COMPENSATE")


def meant_to_speak(text: str) -> bool:
    """Whether a comment was meant as one of those that speak to this tool."""
    return meant_as_force(text) or meant_as_switch(text)
