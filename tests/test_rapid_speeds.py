"""RAPID: what changes the speed of motions without being a motion.

Truth from ABB's reference manual: VelSet has a factor in percent and a largest speed, and ends only what VelSet set.
SpeedRefresh, TriggSpeed and the limits of SpeedLimAxis and SpeedLimCheckPoint act beside it, on the motion that runs
already too: what is programmed does not state the speed then.  A routine that is run again starts with them.
"""

from __future__ import annotations

import numpy as np
import pytest

from tests.test_rapid_asides import read

CUT = "MoveL p,v50,z10,t;"
FEEDS = {
    "VelSet 50,5000;": 0.025,
    "VelSet 50,800;": np.nan,
    "SpeedRefresh 50;": np.nan,
    "SpeedRefresh 50;\nVelSet 100,5000;": np.nan,
    "TriggSpeed d1,5,0.1\\DipLag:=0.2,0.5;": np.nan,
    "TriggSpeed d1,5,0.1,0.5;\nVelSet 100,5000;": np.nan,
    "SpeedLimAxis ROB_1,1,20;\nVelSet 100,5000;": np.nan,
    "SpeedLimCheckPoint 20;": np.nan,
    "IF di1=1 SpeedRefresh n;\nVelSet 100,5000;": np.nan,
    "AccSet 50,50;": 0.05,
    "SetSysData t;": 0.05,
    "PathAccLim TRUE\\AccMax:=4,FALSE;": 0.05,
}


def feeds(text: str) -> list[float]:
    return read(text).toolpath.feed.tolist()


@pytest.mark.parametrize("words", FEEDS)
def test_the_feed_is_what_the_instruction_leaves(words: str) -> None:
    np.testing.assert_allclose(
        feeds(f"PROC main()\nEXIT;\nENDPROC\nPROC cut()\n{words}\n{CUT}\nENDPROC\n"), [FEEDS[words]]
    )


def test_what_scales_speeds_is_no_call_of_another_module() -> None:
    program = read(
        f"PROC main()\n{CUT}\nSpeedLimAxis ROB_1,1,20;\nTriggSpeed d1,5,0.1,0.5;\n{CUT}\nENDPROC\n"
    )
    assert not [one.code for one in program.findings]
    assert program.toolpath.continues[1]


def test_a_trap_may_scale_speeds_at_any_time_and_displaces_nothing() -> None:
    program = read(f"PROC main()\nVelSet 100,5000;\n{CUT}\nENDPROC\nTRAP tr\nSpeedRefresh n;\nENDTRAP\n")
    assert np.isnan(program.toolpath.feed[0])
    assert not program.toolpath.constraints.refused
    both = read(f"PROC main()\n{CUT}\nENDPROC\nTRAP tr\nSpeedRefresh n;\nPDispSet d;\nENDTRAP\n")
    assert both.toolpath.constraints.refused[0].code == "RAP008"


def test_a_motion_beyond_the_usual_limit_may_be_slower() -> None:
    fast = CUT.replace("v50", "v6000")
    assert np.isnan(feeds(f"PROC main()\n{fast}\nENDPROC\n")[0])
    assert feeds(f"PROC main()\n{CUT.replace('v50', 'v5000')}\nENDPROC\n") == [5.0]


@pytest.mark.parametrize(
    ("zone", "between", "expected"),
    [
        ("z10", "", [0.05, np.nan, np.nan, np.nan]),
        ("fine", "", [0.05, 0.05, 0.05, np.nan]),
        ("z10", "WaitTime\\InPos,0;\n", [0.05, 0.05, 0.05, np.nan]),
    ],
)
def test_speedrefresh_changes_the_motion_that_runs(zone: str, between: str, expected: list[float]) -> None:
    """The program is ahead of the robot by motions that end in zones, but not where the robot stops, or where it waits
    until the robot stands."""
    stop, last = CUT.replace("z10", "fine"), CUT.replace("z10", zone)
    body = f"{stop}\n{CUT}\n{last}\n{between}SpeedRefresh 50;\n{CUT}\n"
    text = f"PROC main()\nEXIT;\nENDPROC\nPROC cut()\n{body}ENDPROC\n"
    np.testing.assert_allclose(feeds(text), expected)
