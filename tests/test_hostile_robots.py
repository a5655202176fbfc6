"""Files of a quarter of a megabyte whose reading once took time in the square of their size: TP with many registers,
branches, arcs and unclosed points; RAPID with loops in loops."""

from __future__ import annotations

import pytest
from linear import MB, MEGABYTES, SECONDS, all_cases, import_readers, is_linear, measure

CASES = {f"{case.kind}: {case.name}": case for case in all_cases() if case.kind in ("ls", "mod")}
NAMES = [
    "ls: '1:R[%d]=1 ;\\n'",
    "ls: '1:A P[%d] 9mm/sec FINE ;\\n'",
    "ls: '1:IF (DI[1]=ON) THEN ;\\n1:L P[1] 9mm/sec FINE ;\\n1:ENDIF ;\\n'",
    "ls: '1:FOR R[1]=1 TO 9 ;\\n1:L P[1] 9mm/sec FINE ;\\n1:ENDFOR ;\\n'",
    "ls: label around '1:IF DI[1]=ON,JMP LBL[1] ;\\n1:R[%d]=1 ;\\n'",
    "ls: '/POS\\nP[%d]{\\n'",
    "mod: 'MoveL *,v1,z1,t;\\n'",
]


@pytest.mark.parametrize("name", NAMES)
def test_what_took_the_square_of_its_size_is_read_in_time(name: str) -> None:
    import_readers()
    cost = measure(CASES[name], MB // 4)
    assert not cost.error
    assert cost.seconds < 2 * SECONDS
    assert cost.megabytes < MEGABYTES
    if cost.seconds > 0.3:
        assert is_linear(CASES[name], MB // 16)
