"""$LOAD and LOAD_DATA that a program sets: what the robot carries, as it tells the controller.

``$LOAD={M 8.5,CM {..},J {..}}``: mass [kg] and centre of what is at the flange; ``$LOAD_A1`` to ``$LOAD_A3``: further
loads on axes; ``LOAD_DATA[n]``: the load of tool n, which BAS(#TOOL,n) takes (KUKA, Load data).  A mass below zero
stands for the data of the machine.
"""

from __future__ import annotations

import re

from postproc.base.byte_search import matches
from postproc.base.document import Document
from postproc.toolpath.stated_loads import StatedLoad

_NUMBER = rb"([-+]?(?:\d++\.?\d*+|\.\d++)(?:E[-+]?\d++)?+)"
_SET = re.compile(
    rb"^[^;\"\r\n]*?(?<![A-Za-z0-9_$])(\$LOAD(?:_A[1-3])?|LOAD_DATA[ \t]*\[([^\[\]\r\n]*+)\])[ \t]*+"
    rb"(?:(\.[A-Za-z.]++)[ \t]*+)?=(?!=)[ \t]*+([^;\r\n]*+)",
    re.I | re.M,
)
_ENTRY = re.compile(rb"S?LOAD(?:_DATA)?[ \t]*[\[(][ \t]*(\d+)[ \t]*[\])]", re.I)
_MASS = re.compile(rb"\{(?:[ \t]*LOAD[ \t]*:)?[ \t]*M[ \t]*" + _NUMBER + rb"[ \t]*[,}]", re.I)


def krl_loads(document: Document) -> tuple[StatedLoad, ...]:
    """The loads that the statements of a program set, in the order of the text."""
    found = []
    for said in matches(_SET, document.raw, (b"LOAD",)):
        name, index, component, value = said[1], said[2], said[3], said[4].strip()
        source = _ENTRY.fullmatch(value.split(b",")[0].strip()) if name.upper() == b"$LOAD" else None
        entry = (
            int(source[1])
            if source
            else int(index)
            if index is not None and index.strip().isdigit()
            else None
        )
        mass = _MASS.match(value)
        number = mass[1] if mass else value if component is not None and component.upper() == b".M" else b""
        known = float(number) if re.fullmatch(_NUMBER, number) else None
        text = f"{said[0][said.start(1) - said.start() :].decode('latin-1').strip()[:60]}"
        found.append(
            StatedLoad(
                document.place(said.start(1))[0],
                text,
                None if known is None or known < 0 else known,
                entry,
                from_entry=source is not None,
            )
        )
    return tuple(found)
