"""What the text of a program states of approximations beside its motions: distances, modes, zones.

No correction changes them, so that a compensated program states the same in the same order.  They are read as text:
what a language does not know the distance of (C_VEL, ADIS, CYCLE832) is another one all the same.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from postproc.base.byte_search import matches

LONGEST = 1000
"""Bytes of a statement, at most."""

_NUMBER = rb"[-+]?[0-9.]++(?:E[-+]?[0-9]++)?"
_STATED = re.compile(
    rb"\$(?:APO|ORI_APO|APO_[A-Z_]++)\b[^\r\n;=]{0,80}=[^\r\n;]{1,200}"  # KRL
    rb"|\bAPO_[A-Z]++[ \t]++" + _NUMBER +  # KRL, of taught points
    rb"|\bzonedata\b[^;]{1,400}"  # RAPID
    rb"|(?<![A-Z0-9_.])G(?:6[014]|60[0-3]|64[0-5])(?:\.[0-9])?(?![0-9.])"  # G-code
    rb"(?:[ \t]*+[PQ][ \t]*+" + _NUMBER + rb"){0,2}"
    rb"|(?<![A-Z0-9_.])(?:ADIS|ADISPOS|CTOL|OTOL)[ \t]*+=[ \t]*+" + _NUMBER +
    rb"|(?<![A-Z0-9_.])CYCLE832[ \t]*+\([^)\r\n]{0,200}\)",
    re.IGNORECASE,
)  # fmt: skip
_WORDS = (b"APO", b"ZONEDATA", b"G6", b"ADIS", b"CTOL", b"OTOL", b"CYCLE832")
"""One of which is in all that is looked for."""


def approximation_words(texts: Sequence[bytes]) -> list[tuple[bytes, int]]:
    """What the ``texts`` of a program state, without blanks, and the lines, from 1 on."""
    found = []
    for text in texts:
        line, last = 1, 0
        for one in matches(_STATED, text, _WORDS, LONGEST):
            line, last = line + text.count(b"\n", last, one.start()), one.start()
            found.append((b"".join(one[0].split()).upper(), line))
    return found


def other_words(original: Sequence[bytes], compensated: Sequence[bytes]) -> tuple[str, int] | None:
    """What the second program states first that the first does not state there, and its line; None without one."""
    wanted, there = approximation_words(original), approximation_words(compensated)
    for (word, _), (other, line) in zip(wanted, there, strict=False):
        if word != other:
            return f"{other.decode('latin-1')} in the place of {word.decode('latin-1')}", line
    if len(there) > len(wanted):
        word, line = there[len(wanted)]
        return f"{word.decode('latin-1')}, which the original does not state", line
    if len(there) < len(wanted):
        return f"{wanted[len(there)][0].decode('latin-1')} is missing", 0
    return None
