"""GripLoad, SetSysData and \\TLoad: what the robot carries besides its tool, or instead of the load in its tooldata.

A loaddata is ``[mass [kg], centre [mm], axes, moments]``; load0 has no mass (ABB, Technical reference manual RAPID).
"""

from __future__ import annotations

import re

from postproc.base.document import Document
from postproc.toolpath.stated_loads import StatedLoad

_PASSED = re.compile(rb'"[^"\r\n]*+"?|![^\r\n]*+')
_SET = re.compile(
    rb"\b(?:GripLoad|SetSysData)[ \t\r\n]++([^;]{1,200}+);|\\TLoad[ \t\r\n]*+:=[ \t\r\n]*+(\w++|\[[^;]{1,200}+)",
    re.I,
)
_VALUE = re.compile(rb"(?<![\w.])(\w++)(?:\.\w++)*+[ \t\r\n]*+:=[ \t\r\n]*+")
_MASS = re.compile(rb"\[[ \t\r\n]*+([-+]?(?:\d++\.?\d*+|\.\d++)(?:E[-+]?\d++)?+)[ \t\r\n]*+,", re.I)
_NONE = b"LOAD0"


def grip_loads(document: Document) -> tuple[StatedLoad, ...]:
    """The loads that the statements of a module set, in the order of the text; load0 is none."""
    text = _PASSED.sub(lambda found: b" " * len(found[0]), document.raw)
    statements = list(_SET.finditer(text))
    values = _values(text) if statements else {}
    found = []
    for said in statements:
        operand = (said[1] if said[2] is None else said[2]).strip()
        is_system_data = text[said.start() : said.start() + 3].upper() == b"SET"
        if operand.upper() == _NONE or (is_system_data and values.get(operand.upper()) is None):
            continue  # SetSysData may name a tool or a work object, too
        literal = _MASS.match(operand)
        mass = float(literal[1]) if literal is not None else values.get(operand.upper())
        shown = " ".join(said[0].decode("latin-1").split()).rstrip(";")[:60]
        found.append(StatedLoad(document.place(said.start())[0], shown, mass, gripped=said[2] is None))
    return tuple(found)


def _values(text: bytes) -> dict[bytes, float | None]:
    """Name -> mass [kg] of the aggregate that it gets, None where it gets several."""
    found: dict[bytes, float | None] = {}
    for said in _VALUE.finditer(text):
        mass, name = _MASS.match(text, said.end()), said[1].upper()
        found[name] = float(mass[1]) if mass is not None and name not in found else None
    return found
