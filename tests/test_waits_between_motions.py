"""Where a program waits between motions: a force log over time does not have that time."""

from __future__ import annotations

import numpy as np
import pytest
import test_force_logs
import test_krl_advance_run
import test_tp_asides
from gcode_writing import read as read_gcode
from test_force_logs import codes, log, path_of, run, told
from test_gcode_write import FANUC, SINUMERIK
from test_rapid_asides import read as read_rapid

MOVE = {
    "krl": "LIN {{X {0}, Y 0, Z 0, A 0, B 0, C 180}}\n",
    "rapid": "MoveL [[{0},2,3],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v50,z5,t;\n",
}


def waits_krl(between: str) -> list[bool]:
    text = "".join(MOVE["krl"].format(x) + (between if x == 2 else "") for x in range(1, 5))
    return test_krl_advance_run.read(text).toolpath.sequence.waits.tolist()


def waits_rapid(between: str) -> list[bool]:
    text = "".join(MOVE["rapid"].format(x) + (between if x == 2 else "") for x in range(1, 5))
    return read_rapid(f"PROC main()\n{text}ENDPROC\n").toolpath.sequence.waits.tolist()


def waits_tp(between: str) -> list[bool]:
    lines = [f"L P[{n}] 9mm/sec CNT50" for n in range(1, 5)]
    lines[2:2] = between.splitlines()
    return test_tp_asides.read(*lines).sequence.waits.tolist()


def waits_gcode(between: str, dialect=FANUC) -> list[bool]:
    text = "G21 G90 G54 G94\nT1 M6\n" + "".join(
        f"G1 X{x} Y0 Z0 F100\n" + (between if x == 2 else "") for x in range(1, 5)
    )
    return read_gcode(dialect, text).toolpath.sequence.waits.tolist()


@pytest.mark.parametrize(
    ("reader", "between", "waits"),
    [
        (waits_krl, "WAIT SEC 2\n", True),
        (waits_krl, "HALT\n", True),
        (waits_krl, "$VEL.CP=0.04\n", False),
        (waits_rapid, "WaitTime 2;\n", True),
        (waits_rapid, "Stop;\n", True),
        (waits_rapid, "k:=3;\n", False),
        (waits_tp, "WAIT 2.00(sec)\n", True),
        (waits_tp, "PAUSE\n", True),
        (waits_tp, "R[1]=2\n", False),
        (waits_gcode, "G4 P2000\n", True),
        (waits_gcode, "M0\n", True),
        (waits_gcode, "T2\n", True),
        (waits_gcode, "M6\n", True),
        (waits_gcode, "M8\n", False),
    ],
)
def test_a_program_waits_after_its_second_motion(reader, between: str, waits: bool) -> None:
    found = reader(between)
    assert found == [False, waits, False, False]


def test_a_dwell_of_a_sinumerik() -> None:
    assert waits_gcode("G4 F2\n", SINUMERIK) == [False, True, False, False]


def test_a_log_over_time_does_not_have_the_time_of_a_wait(tmp_path) -> None:
    """One after the last cut shifts nothing, nor does one in a log over the path."""
    path = path_of([[x, 0, 0] for x in (0, 0.1, 0.2, 0.3)], test_force_logs.PTP_THEN[:4])
    path = path.with_columns(feed=np.full(4, 0.001))
    t = np.arange(0.0, 301)
    loads = log(tmp_path, t, 0 * t + 100, "t_s")
    assert "FRC047" not in codes(run(path, loads))
    assert "FRC047" not in codes(run(path.with_columns(waits=np.array([True, False, False, True])), loads))
    finding = told(run(path.with_columns(waits=np.array([False, True, True, False])), loads), "FRC047")
    assert (finding.severity, finding.line) == ("warning", int(path.line[1]))
    assert finding.message.startswith("after 2 motions between cuts the program waits")
    over_path = log(tmp_path, t, 0 * t + 100, "s_mm")
    assert "FRC047" not in codes(
        run(path.with_columns(waits=np.array([False, True, True, False])), over_path)
    )
