"""Motions of a cut that only turn the tool, or the part on a positioner: ``verify`` judges them where they are."""

import pytest

HEAD = """DEF part()
$BASE=BASE_DATA[1]
$TOOL=TOOL_DATA[1]
$ORI_TYPE=#VAR
PTP {A1 0,A2 -90,A3 100,A4 0,A5 80,A6 EXTRA}
$VEL.CP=0.05
"""
TURNS = (
    HEAD.replace("EXTRA", "170")
    + """LIN {X 0,Y 0,Z 50,A 0,B 0,C 180}
;FORCE 100 200 300 @base
LIN {X 0,Y 0,Z 0}
LIN {X 100,Y 0,Z 0}
LIN {X 100,Y 0,Z 0,A 10}
LIN {X 200,Y 0,Z 0,A 10}
;FORCE OFF
LIN {X 200,Y 0,Z 50}
END
"""
)
TABLE_TURNS = HEAD.replace("EXTRA", "0,E2 0").replace("BASE_DATA[1]", "BASE_DATA[2]") + (
    """LIN {X 0,Y 0,Z 50,A 90,B 0,C 180,E2 0}
;FORCE 100 200 300 @base
LIN {X 0,Y 0,Z 0,A 90,E2 0}
LIN {X 0,Y 100,Z 0,A 90,E2 0}
LIN {X 0,Y 100,Z 0,A 90,E2 40}
LIN {X 50,Y 100,Z 0,A 90,E2 -40}
;FORCE OFF
LIN {X 0,Y 0,Z 50,A 90,E2 -40}
END
"""
)
CELL = """robot: kuka_kr270
tools:
  1: {x: 20, y: 0, z: 300, a: 0, b: 0, c: 0, axis: +z}
bases:
  1: {x: 1350, y: 0, z: 850, a: 0, b: 0, c: 0}
  2: {x: 1300, y: 0, z: 800, a: 0, b: 0, c: 0}
correct: process
"""
TABLE = """external_axes:
  E2: {kind: positioner, axis: +z, point: [1300, 0, 0], limits: [-180, 180], bases: [2]}
"""


@pytest.fixture
def written(job, compensate):
    """Compensates a program, with its output ``change``d, and returns the result and that of ``verify``."""

    def write(text, cell=CELL, change=None):
        job.cell(cell)
        job.write(text.splitlines())
        report = compensate(job.program, "--force", "--json", "-").json
        output = job.output.read_text()
        if change is not None:
            assert change[0] in output
            job.output.write_text(output.replace(*change))
        return report, compensate("verify", job.program, job.output, "--force", "--json", "-")

    return write


def codes(done):
    return {one["code"] for one in done.json["findings"] if one["code"].startswith("VER")}


@pytest.mark.parametrize("along", [1, -1])
def test_the_tool_turns_in_a_cut(written, along):
    """A force along the feed moves the tool past the place where it turns, by tenths of a millimetre."""
    text = TURNS.replace("FORCE 100", f"FORCE {800 * along}")
    _, done = written(text)
    assert done.json["original"]["cut_ends"]["max"] > 0.2
    assert done.code == 0, done.json["findings"]
    assert done.json["compensated"]["orientation_deg"] < 0.002
    assert done.json["original"]["orientation_deg"] < 0.2
    assert not codes(done)


def test_another_turn_is_reported(written):
    _, done = written(TURNS, change=("A 9.9", "A 10.0"))
    assert "VER003" in codes(done)
    assert done.json["compensated"]["orientation_deg"] == pytest.approx(0.1, abs=0.002)


@pytest.mark.parametrize("force", ["100 200 300", "-100 200 300", "200 0 0", "0 300 300"])
def test_the_table_turns_in_a_cut(written, force):
    """Divided nowhere, the motion is as far off in its middle as the report says; nothing else differs."""
    report, done = written(TABLE_TURNS.replace("100 200 300", force), CELL + TABLE)
    assert codes(done) == {"VER003"}
    stated = report["path_error_mm"]["max"]
    assert done.json["compensated"]["max"] == pytest.approx(stated, abs=5e-4)
    assert done.json["compensated"]["orientation_deg"] < 0.01


def test_another_angle_of_the_table_is_reported(written):
    _, done = written(TABLE_TURNS, CELL + TABLE, ("E2 40}", "E2 39.9}"))
    (found,) = [one for one in done.json["findings"] if one["code"] == "VER005"]
    assert (found["line"], found["message"]) == (11, "no motion of the output ends where this motion ends")
