"""Faults planted in written programs: ``verify`` rejects every one of them (see ``planted_faults``)."""

import re
import shutil

import pytest
from judge.cases import CASES, FIVE_AXIS, gcode, straight
from judge.drawn import drawn
from judge.further_cases import FURTHER
from planted_faults import ROOT, SAMPLES, Written

import postproc
from postproc.base.findings import Refusal
from postproc.workflows.preparation import Request
from postproc.workflows.program import compensate
from postproc.workflows.verify import verify

FAULTS = [
    pytest.param(sample, plant, id=f"{sample}: {name}")
    for sample, (faults, _, _) in SAMPLES.items()
    for name, plant in faults
]


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """Name of a sample -> what was written for it."""
    known = {}

    def made(name):
        if name not in known:
            known[name] = Written(name, tmp_path_factory.mktemp(name) / name)
        return known[name]

    return made


@pytest.mark.sample(1)
@pytest.mark.parametrize("name", SAMPLES)
def test_what_was_written_is_not(written, name):
    code, told = written(name).code, written(name).findings
    if name == "milling":  # a straight line that ends in a stop is divided, and stops where it is
        told = {one for one in told if "the motion stops where the original flows" not in one[1]}
        code = 0
    assert (code, told) == (0, set())


@pytest.mark.sample(1)
@pytest.mark.parametrize(("name", "plant"), FAULTS)
def test_a_planted_fault_is_rejected(written, tmp_path, name, plant):
    assert written(name).rejects(plant, tmp_path)


def test_there_are_fifty_of_them_and_some_in_every_language():
    assert len(FAULTS) >= 50
    assert {dialect.split(",")[0] for _, _, dialect in SAMPLES.values()} == {"KRL", "G-code", "RAPID", "TP"}
    assert min(len(faults) for faults, _, _ in SAMPLES.values()) >= 8


CORNERS = {c.name: c for c in [*CASES, *FURTHER]}


@pytest.mark.parametrize(
    "name",
    [
        "corners, C_DIS 0.5",
        pytest.param("corners, C_DIS 2", marks=pytest.mark.slow),
        pytest.param("entered from above, C_DIS 3", marks=pytest.mark.slow),
        "positioner, 0 to 25",
    ],
)
def test_points_of_rounded_corners_lie_beside_those_of_the_original(name, tmp_path):
    """Where the correction turns at an approximated vertex no motion of what was written ends at it."""
    program = CORNERS[name].build(tmp_path)
    assert compensate(Request(program, force="")).exit == 0
    done = verify(Request(program, force=""), tmp_path / "compensated" / program.name)
    assert [one for one in done.findings if one.severity != "info"] == []
    assert done.exit == 0


def test_a_vertex_that_is_left_out_is_rejected(tmp_path):
    program = CORNERS["corners, C_DIS 0.5"].build(tmp_path)
    compensate(Request(program, force=""))
    output = tmp_path / "compensated" / program.name
    lines = output.read_text().splitlines(keepends=True)
    cut = [i for i, text in enumerate(lines) if "C_DIS" in text and text.startswith("LIN")]
    output.write_text("".join(text for i, text in enumerate(lines) if i not in cut[:2]))
    assert verify(Request(program, force=""), output).exit == 3


def test_an_orientation_that_cannot_be_stated_is_judged_where_it_is_kept(tmp_path):
    """Under constant orientation control, as the report does (COR019)."""
    program = CORNERS["CIRC #CONSTANT #BASE"].build(tmp_path)
    assert compensate(Request(program, force="")).exit == 3
    done = verify(Request(program, force=""), tmp_path / "compensated" / program.name)
    assert done.exit == 3
    assert any("off its orientation" in one.message for one in done.findings)


G61 = [
    "G21 G90 G17 G54", "T1 M6", "G61", "G0 X0. Y0. Z50.", "G1 Z0. F600", "(FORCE -150 260 -60 @FEED)",
    "G1 X150. F1800", "G1 Y100.", "(FORCE OFF)", "G1 Z50. F3000",
]  # fmt: skip


def test_points_that_the_mode_of_the_program_stops_at_are_counted(tmp_path):
    program = gcode(*G61, cell=FIVE_AXIS.replace("fanuc", "linuxcnc"))(tmp_path)
    report = compensate(Request(program, force=""))
    assert report.inserted > 0
    assert report.path.transitions.stops == report.inserted
    done = verify(Request(program, force=""), tmp_path / "compensated" / program.name)
    assert done.exit == 0
    assert done.compensated.stops == done.original.stops + report.inserted


@pytest.mark.slow
def test_an_original_that_has_no_figure_is_no_fault_of_what_was_written(tmp_path):
    """Its deflected tool jumps over a corner; the corrected one does not."""
    program = drawn(916).build(tmp_path)
    assert compensate(Request(program, force="")).exit == 0
    done = verify(Request(program, force=""), tmp_path / "compensated" / program.name)
    assert (done.original.converged, done.compensated.converged) == (False, True)
    assert {one.code for one in done.findings if one.code.startswith("VER")} == {"VER008"}
    assert done.exit == 0
    again = verify(Request(program, force=""), program)
    assert {"VER003", "VER007"} & {one.code for one in again.findings}
    assert again.exit == 3


@pytest.mark.parametrize(
    ("old", "new"),
    [
        (" C_DIS", " C_VEL"),
        ("$APO.CDIS=0.5", "$APO.CDIS=0.6"),
        ("$APO.CDIS=0.5", "$APO.CDIS=0.5\n$APO.CVEL=50"),
    ],
)
def test_another_approximation_is_rejected(old, new, tmp_path):
    """However little it moves the path, and where nobody knows by how much."""
    program = CORNERS["corners, C_DIS 0.5"].build(tmp_path)
    compensate(Request(program, force=""))
    output = tmp_path / "compensated" / program.name
    assert verify(Request(program, force=""), output).exit == 0
    text = output.read_text()
    assert old in text
    output.write_text(text.replace(old, new, 1))
    done = verify(Request(program, force=""), output)
    assert done.exit != 0
    assert any(one.code == "VER005" and "another approximation" in one.message for one in done.findings)


@pytest.mark.parametrize("name", ["hysteresis", "backlash"])
def test_lost_motion_puts_no_points_into_air(name, tmp_path):
    """The long way from the home position turns axes round; nothing is cut on it."""
    program = straight(name, {"hysteresis": "w1", "backlash": "b1"}[name])(tmp_path)
    assert compensate(Request(program, force="")).exit == 0
    done = verify(Request(program, force=""), tmp_path / "compensated" / program.name)
    assert (done.exit, [one for one in done.findings if one.severity != "info"]) == (0, [])


def test_a_feed_that_no_machine_has_is_refused(tmp_path):
    program = CORNERS["corners, C_DIS 0.5"].build(tmp_path)
    text = program.read_text()
    assert "$VEL.CP=0.05" in text
    program.write_text(text.replace("$VEL.CP=0.05", "$VEL.CP=1000000000"))
    with pytest.raises(Refusal) as refused:
        compensate(Request(program, force=""))
    assert [one.code for one in refused.value.findings] == ["FIL015"]
    assert not (tmp_path / "compensated").exists()


def test_the_number_of_a_point_that_is_inserted_into_a_motion_that_stops(tmp_path):
    """Arcs of Fanuc TP that end with FINE: the points within them flow with CNT100, and with no other number."""
    for name in ("cell.yaml", "arm.yaml", "pocket.ls"):
        shutil.copy(ROOT / "samples" / "m900ib_pocket" / name, tmp_path / name)
    program = tmp_path / "pocket.ls"
    text = re.sub(r"(:  P\[\d+\] 50mm/sec) CNT100", r"\1 FINE", program.read_bytes().decode("latin-1"))
    program.write_bytes(text.encode("latin-1"))
    postproc.compensate(program, force=True)
    written = tmp_path / "compensated" / "pocket.ls"
    clean = written.read_bytes()
    rows = [
        i for i, line in enumerate(clean.split(b"\n")) if re.search(rb":C P\[\d+\] P\[\d+\] .*CNT100", line)
    ]
    assert len(rows) > 3

    def codes():
        return {one.code for one in postproc.verify(program, written, force=True).findings}

    assert "VER005" not in codes()
    lines = clean.split(b"\n")
    lines[rows[1]] = lines[rows[1]].replace(b"CNT100", b"CNT40")
    written.write_bytes(b"\n".join(lines))
    assert "VER005" in codes()
