"""Laws of the numbered frames of KRL: what a program may change anywhere is not what the controller has."""

from __future__ import annotations

from pathlib import Path

import pytest

from postproc.base.document import Document
from postproc.languages.krl import KrlDialect

OTHER = "{X 7,Y 0,Z 0,A 0,B 0,C 0}"
CHANGES = [
    "@={other}",
    "@.X=7",
    "elsewhere(@)",
    "elsewhere(1,@)",
    "inside(@)",
    "n=elsewhere(@)",
    "IF elsewhere(1,@.X)>2 THEN\nENDIF",
    "LIN elsewhere(@)",
    "EXT taking(FRAME:OUT)\ntaking(@)",
    "EXTFCT INT taking(FRAME:OUT)\nn=taking(@)",
]
"""What may change an entry (@)."""
READINGS = [
    "MINE=@",
    "elsewhere(@.X+1)",
    "EXT taking(FRAME:IN)\ntaking(@)",
    "n=ABS(@.X)",
    "MINE=INV_POS(@)",
]
"""What only reads it."""
INSIDE = "DEF inside(F:OUT)\nDECL FRAME F\nF.X=7\nEND\n"
PLACES = ["{use}{change}", "LOOP\n{use}{change}ENDLOOP\n", "{use}IF $IN[1] THEN\n{change}ENDIF\n"]
"""Where it is changed only after it was used: the program may have run before."""


def frames(text: str, table: str) -> set[str]:
    """What the motions of a program are told of one of their frames."""
    declared = "DECL FRAME MINE\nDECL INT n\n"
    document = Document(Path("part.src"), f"DEF part()\n{declared}{text}END\n{INSIDE}".encode())
    lines = KrlDialect().read((document,)).toolpath.dump()
    word = "base " if table == "BASE_DATA" else "tool "
    return {line.partition(word)[2].split(" tool ")[0].split(" refused")[0] for line in lines if word in line}


@pytest.mark.parametrize("table", ["BASE_DATA", "TOOL_DATA"])
@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("change", [*CHANGES, *READINGS])
def test_an_entry_that_is_changed_anywhere_is_not_the_controllers(
    change: str, place: str, table: str
) -> None:
    """Of the entry that is used; a change of another one, or one that only reads, leaves it the controller's."""
    other = "TOOL" if table == "BASE_DATA" else "BASE"
    use = f"BAS(#{table[:4]},2)\nBAS(#{other},1)\nLIN {{X 1,Y 0,Z 0,A 0,B 0,C 0}}\n"

    def with_entry(number: str) -> set[str]:
        changed = change.replace("@", f"{table}[{number}]").replace("{other}", OTHER) + "\n"
        return frames(place.replace("{use}", use).replace("{change}", changed), table)

    if "LOOP" not in place:
        assert "[2]" in with_entry("3")
    if change in READINGS:
        assert with_entry("2") == {"[2]"}
    else:
        assert "[2]" not in with_entry("2")
        assert "[2]" not in with_entry("n")
