"""Under $ORI_TYPE=#CONSTANT angles do not count: targets that leave them out are those that state them."""

from __future__ import annotations

import re

import pytest
from conftest import CELL

PROGRAM = """DEF part()
$BASE=BASE_DATA[1]
$TOOL=TOOL_DATA[1]
$ORI_TYPE=#CONSTANT
PTP {A1 0,A2 -90,A3 110,A4 0,A5 40,A6 0}
LIN {X 0,Y 0,Z 50,A 0,B 0,C 180}
;FORCE -360 50 560 @base
LIN {X 0,Y 0,Z 0,A 0,B 0,C 180}
LIN {X 60,Y 0,Z 0,A 0,B 0,C 180}
LIN {X 60,Y 40,Z 0,A 0,B 0,C 180}
;FORCE OFF
LIN {X 60,Y 40,Z 50,A 0,B 0,C 180}
END
"""


def places(text):
    return [
        tuple(map(float, re.findall(r"[XYZ] ([-\d.]+)", line)))
        for line in text.splitlines()
        if line.startswith("LIN")
    ]


@pytest.mark.parametrize(
    "left_out", [r"(?<!Z 50),A 0,B 0,C 180", r",A 0,B 0,C 180", r"(?<=Z 0),A 0,B 0,C 180"]
)
def test_angles_that_do_not_count_may_be_left_out(compensate, job, left_out):
    job.cell(CELL)
    written = []
    for text in (PROGRAM, re.sub(left_out, "", PROGRAM)):
        job.program.write_bytes(text.encode())
        done = compensate(job.program, "--force", "--json", "-")
        assert (done.json["corrected"], done.json["uncorrected"]) == (3, 0)
        written.append(places(job.output.read_text()))
    assert written[0] == written[1]
