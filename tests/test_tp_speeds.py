"""Fanuc TP: what changes the speed of motions, or the stop before them, without being a motion.

Truth from FANUC's operator's manual: OVERRIDE= sets $MCR.$GENOVERRIDE, in percent of the programmed speed.  A limit
(LINEAR_MAX_SPEED), the override of a program ($MCR_GRP[1].$PRGOVERRIDE) and PSPD act beside it: what is programmed and
OVERRIDE= do not state the speed then.  A user alarm pauses the program where its severity is PAUSE.
"""

from __future__ import annotations

import numpy as np
import pytest

from tests.test_tp_asides import program, read

CUT = "L P[{}] 50mm/sec FINE"
FEEDS = {
    "OVERRIDE=50%": 0.025,
    "$MCR.$GENOVERRIDE=50": 0.025,
    "$MCR . $GENOVERRIDE = 20": 0.010,
    "IF R[1]=1,$MCR.$GENOVERRIDE=50": np.nan,
    "$MCR.$GENOVERRIDE=R[1]": np.nan,
    "$MCR.$GENOVERRIDE=(50/2)": np.nan,
    "OVERRIDE=R[1]": np.nan,
    "LINEAR_MAX_SPEED=20": np.nan,
    "JOINT_MAX_SPEED[1]=20": np.nan,
    "$MCR_GRP[1].$PRGOVERRIDE=30": np.nan,
    "$WAITTMOUT=50": 0.05,
    "PAYLOAD[1]": 0.05,
}


@pytest.mark.parametrize("words", FEEDS)
def test_the_feed_is_what_the_statement_leaves(words: str) -> None:
    feed = read(CUT.format(1), words, CUT.format(2)).feed
    np.testing.assert_allclose(feed, [0.05, FEEDS[words]])


@pytest.mark.parametrize(
    "words", ["LINEAR_MAX_SPEED=20", "JOINT_MAX_SPEED[1]=20", "$MCR_GRP[1].$PRGOVERRIDE=30"]
)
def test_override_does_not_end_what_slows_beside_it(words: str) -> None:
    feed = read(words, "OVERRIDE=100%", CUT.format(1)).feed
    assert np.isnan(feed).all()
    sometimes = read(f"IF R[1]=1,{words}", "OVERRIDE=100%", CUT.format(1)).feed
    assert np.isnan(sometimes).all()


def test_the_pace_of_a_motion_is_a_speed_of_its_own() -> None:
    feed = read(CUT.format(1) + " PSPD50", CUT.format(2) + " ACC80 PSPD120", CUT.format(3) + " PSPD100").feed
    np.testing.assert_allclose(feed, [np.nan, np.nan, 0.05])


def test_the_robot_may_stop_at_a_user_alarm() -> None:
    path = read("L P[1] 50mm/sec FINE", "L P[2] 50mm/sec CR10", "UALM[1]", "L P[3] 50mm/sec FINE")
    assert np.isnan(path.approximation[1])
    assert (
        read("L P[1] 50mm/sec FINE", "L P[2] 50mm/sec CR10", "L P[3] 50mm/sec FINE").approximation[1] == 0.01
    )


def test_a_configuration_that_is_not_followed_is_named() -> None:
    """B is a configuration of the arm; 'N, 0, 0, 0' is none of six axes."""
    for config, words in (("N D B, 0, -1, 0", "with B"), ("N, 0, 0, 0", "none that is read")):
        found = program("J P[1] 50% FINE", config=config).findings
        assert [words in one.message for one in found if one.code == "FTP004"] == [True]
