"""Drill cycles: holes are read where LinuxCNC drills them, moved by their own words, drilled where the plan says."""

from __future__ import annotations

import random
from pathlib import Path

import numpy as np
import pytest
from conftest import CELL
from gcode_judge.misreadings import written as made_of
from gcode_judge.oracle import MISSING, RS274, Motion, execute
from gcode_writing import WRITING, assert_reads_as, free, random_plan, read, written

from postproc.base.document import apply
from postproc.base.units import MM
from postproc.languages.dialect import EditedTargets, Plan, Program, Role
from postproc.languages.gcode import DIALECTS, GcodeDialect

NAMES = {dialect.name: dialect for dialect in DIALECTS}
FANUC, LINUX = NAMES["fanuc"], NAMES["linuxcnc"]
HEAD = "G21 G90 G17 T1 M6\nG0 X0 Y0 Z20\n"
needs_rs274 = pytest.mark.skipif(RS274 is None, reason=MISSING)


def moved(
    program: Program, by: dict[int, tuple[float, float, float]], dialect: GcodeDialect
) -> EditedTargets:
    """The edits that move rows by so many mm."""
    path = program.toolpath
    position = path.position.copy()
    for row, shift in by.items():
        position[row] += np.array(shift) * MM
    n = len(path)
    none = np.full((n, 3), np.nan)
    plan = Plan(np.arange(n), np.zeros(n), position, path.rotation, none, none, none[:, 0])
    return dialect.edit_targets(program, plan, WRITING)


def output(text: str, by: dict[int, tuple[float, float, float]], dialect: GcodeDialect = LINUX) -> str:
    program = read(dialect, HEAD + text)
    edits = moved(program, by, dialect)
    assert not edits.unwritten
    return apply(program.documents[0], edits.edits).decode()[len(HEAD) :]


def why(text: str, dialect: GcodeDialect = LINUX) -> dict[int, str]:
    refused = read(dialect, HEAD + text).toolpath.constraints.refused
    return {row: finding.message.partition(": ")[2] for row, finding in refused.items()}


@pytest.mark.parametrize("dialect", [LINUX, FANUC], ids=["linuxcnc", "fanuc"])
def test_stated_words_move_and_r_stays(dialect: GcodeDialect) -> None:
    text = "G98 G81 X10. Y10. Z-5. R2. F100\nX20.\nG80\nG0 Z50.\nM2\n"
    assert output(text, {1: (0.1, -0.2, -0.3)}, dialect).startswith(
        "G98 G81 X10.100 Y9.800 Z-5.300 R2. F100\n"
    )


def test_what_a_later_hole_inherits_is_stated_where_it_is_another() -> None:
    text = "G98 G81 X10 Y10 Z-5 R2 F100\nX20\nY30\nG80\nM2\n"
    same = output(text, dict.fromkeys((1, 2, 3), (0.1, 0.0, -0.3)))
    assert same == "G98 G81 X10.100 Y10 Z-5.300 R2 F100\nX20.100\nY30\nG80\nM2\n"
    assert output(text, {1: (0.0, 0.0, -0.3)}).splitlines()[1:3] == ["X20 Z-5.000", "Y30"]
    assert output(text, {2: (0.1, 0.2, 0.0)}).splitlines()[:3] == [
        "G98 G81 X10 Y10 Z-5 R2 F100",
        "X20.100 Y10.200",
        "Y30 X20.000",
    ]


def test_the_level_to_which_g98_goes_back_stays() -> None:
    path = read(LINUX, HEAD + "G1 X5 F100\nG98 G81 X10 Y10 Z-5 R2\nG80 G0 X50\nM2\n").toolpath
    assert [*path.constraints.locked] == [1]
    path = read(LINUX, HEAD + "G1 X5 F100\nG99 G81 X10 Y10 Z-5 R2\nG80 G0 X50\nM2\n").toolpath
    assert not path.constraints.locked


def test_a_level_that_a_correction_would_lift_above_r_stays() -> None:
    path = read(LINUX, HEAD + "G0 Z1.9\nG98 G81 X10 Y10 Z-5 R2 F100\nG80 G0 X50\nM2\n").toolpath
    assert [*path.constraints.locked][:1] == [1]


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("G91 G81 X10 Y10 Z-5 R-2 F100\n", "G91"),
        ("G91 G81 X10 Y10 Z-5 R-2 L3 F100\n", "G91"),
        ("G81 X10 Y10 Z-5 R2 L3 F100\n", "number of times"),
        ("G87 X10 Y10 Z-5 R2 I1 J1 K-3 F100\n", "not in the program"),
        ("G81 X10 Y10 R2 F100\n", "its depth"),
        ("G81 X10 Y10 Z-5 F100\n", "its R"),
        ("G81 X10 Y10 Z5 R2 F100\n", "not below R"),
    ],
)
def test_what_is_not_the_hole_of_the_block_is_told(text: str, reason: str) -> None:
    found = why(text + "M2\n")
    assert [*found] == [1]
    assert reason in found[1]


@pytest.mark.parametrize(
    "between",
    ["G80\nG81", "G1 X5\nG81", "G82", "G52 Z1\nG81", "G20\nG81", "G55\nG81", "G43 H1\nG81", "G18\nG81"],
)
def test_words_of_another_stretch_do_not_hold(between: str) -> None:
    path = read(LINUX, HEAD + f"G81 X10 Y10 Z-5 R2 F100\n{between} X20 Y20\nM2\n").toolpath
    assert path.drills[1]
    assert not path.drills[-1]


def test_a_depth_beyond_r_is_held() -> None:
    program = read(LINUX, HEAD + "G81 X10 Y10 Z1.9 R2 F100\nM2\n")
    assert [one.code for one in moved(program, {1: (0, 0, 0.2)}, LINUX).unwritten.values()] == ["GCW003"]
    assert not moved(program, {1: (0, 0, -0.05)}, LINUX).unwritten


def test_a_hole_gets_no_rotary_words_and_nothing_before_it() -> None:
    text = "G43.4 H1\nG1 A0 B0 C0 Z30 F100\nG81 X10 Y10 Z-5 R2\nG80\nG1 X50\nM2\n"
    path = read(FANUC, HEAD + text).toolpath
    hole = int(np.flatnonzero(path.drills)[0])
    assert not path.constraints.orientation_programmed[hole]
    assert {hole, hole + 1} <= {*path.constraints.no_insert_before}


def drawn(seed: int) -> str:
    """A program of holes with what holds around them, as LinuxCNC accepts it."""
    chance = random.Random(seed)
    lines = ["G21 G90 G17 G54 G94 G98 F500", "T1 M6", "S1000 M3", "G0 X0 Y0 Z60"]
    inch = False

    def place() -> str:
        size = 4.0 if inch else 90.0
        return f"{chance.uniform(-size, size):.{chance.choice((1, 3, 4))}f}"

    for _ in range(chance.randint(2, 5)):
        if chance.random() < 0.3:
            inch = not inch
            lines.append("G20" if inch else "G21")
        plane = chance.choice((17, 17, 17, 18, 19))
        one, two, along = {17: "XYZ", 18: "ZXY", 19: "YZX"}[plane]
        lines.append(
            f"G{plane} G90 G{chance.choice((0, 1))} G{chance.choice((98, 98, 99))}"
            f" X{place()} Y{place()} Z{place()} F300"
        )
        if chance.random() < 0.3:
            lines.append(f"G92 {chance.choice('XYZ')}{place()}")
            lines.append(f"G0 X{place()} Y{place()} Z{place()}")
        code = chance.choice((73, 81, 81, 82, 83, 85, 86, 89))
        for hole in range(chance.randint(1, 6)):
            depth = chance.uniform(-30, 0) / (25.4 if inch else 1)
            retract = depth + chance.uniform(2, 40) / (25.4 if inch else 1)
            first = hole == 0
            words = [f"G{code}"] if first or chance.random() < 0.3 else []
            words += [chance.choice(("G98", "G99"))] if chance.random() < 0.1 else []
            words += [axis + place() for axis in chance.sample((one, two), chance.choice((1, 1, 2)))]
            words += [f"{along}{depth:.3f}"] if first or chance.random() < 0.3 else []
            words += [f"R{retract:.3f}"] if first or f"{along}{depth:.3f}" in words else []
            words += ["Q.2"] if first and code in (73, 83) else []
            words += ["P.1"] if first and code in (82, 86, 89) else []
            chance.shuffle(words)
            lines.append(" ".join(words))
        if chance.random() < 0.5:
            lines.append("G80")
        else:
            lines.append(f"G1 {chance.choice('XYZ')}{place()}")
    return "\n".join([*lines, "M2"]) + "\n"


def bottom(motions: list[Motion], axis: int) -> Motion:
    feeds = [motion for motion in motions if motion.kind == "LIN"]
    return min(feeds, key=lambda motion: float(motion.end[axis]))


def check_on_linuxcnc(seed: int, folder: Path) -> tuple[int, int]:
    """Reads, moves, writes and runs a drawn program; the holes, and those that are known."""
    text = drawn(seed)
    if execute(made_of(text), folder) is None:
        return 0, 0
    program = read(LINUX, text)
    path = program.toolpath
    plan = random_plan(program, seed, size=2e-4)
    edits = LINUX.edit_targets(program, plan, WRITING)
    if edits.unwritten:
        assert {finding.code for finding in edits.unwritten.values()} == {"GCW003"}
        return 0, 0
    raw = written(LINUX, program, plan)
    assert_reads_as(LINUX, program, plan, raw)
    motions = execute(made_of(raw.decode()), folder)
    assert motions is not None, raw.decode()
    again = read(LINUX, raw).toolpath
    for row in np.flatnonzero(path.drills).tolist():
        at = int(np.flatnonzero((plan.source == row) & (plan.role == Role.ORIGINAL))[0])
        own = [motion for motion in motions if motion.line == again.line[at]]
        axis = (2, 1, 0)[int(program.text.plane[row])]
        reached = bottom(own, axis)
        scale = program.text.scale[row] / MM
        near = 0.5 * 10.0 ** -(3 if scale == 1 else 5) * scale + reached.step + 1e-6
        np.testing.assert_allclose(
            reached.end, plan.position[at] / MM, rtol=0, atol=near, err_msg=f"seed {seed}\n{raw.decode()}"
        )
    return int((path.kind != 0).sum()), int((path.drills & free(path)).sum())


@pytest.mark.slow
@needs_rs274
def test_linuxcnc_drills_where_the_plan_says(tmp_path: Path) -> None:
    assert sum(check_on_linuxcnc(seed, tmp_path)[1] for seed in range(25)) > 60


@pytest.mark.slow
@needs_rs274
def test_linuxcnc_drills_more_where_the_plan_says(tmp_path: Path) -> None:
    assert sum(check_on_linuxcnc(seed, tmp_path)[1] for seed in range(1000, 1300)) > 1000


def test_the_main_job_moves_holes(compensate, job) -> None:
    job.cell(CELL + "orientation: {a: 0, b: 0, c: 180}\n")
    lines = ["G21 G90 G17 G54", "T1 M6", "G0 X0. Y0. Z50.", "(FORCE 0 0 200 @BASE)", "G98 G81 X20. Y10. Z-5. R2. F300",
             "X120.", "Y90. Z-8.", "G80", "(FORCE OFF)", "G0 Z50.", "M30"]  # fmt: skip
    program = job.write(lines, "\n", "part.ngc")
    done = compensate(program, "--force", "--json", "-")
    assert done.code == 0, done.out + done.err
    report = done.json
    assert (report["corrected"], report["uncorrected"]) == (3, 0), done.out
    assert report["error_before_mm"]["max"] > 0.05
    assert report["error_after_mm"]["max"] <= 0.002
    out = (job.folder / "compensated" / "part.ngc").read_text()
    assert " R2. " in out
    verified = compensate(
        "verify", program, job.folder / "compensated" / "part.ngc", "--force", "--json", "-"
    )
    assert verified.json["compensated"]["max"] <= 0.02
    shown = compensate("verify", program, job.folder / "compensated" / "part.ngc", "--force").out
    assert "verdict: within tolerance" in shown
    assert "points of splines or drilled holes are compared alone" in shown
    assert "(line 0)" not in compensate(program, "--force", "--dry-run").out


def test_a_cut_behind_a_hole_is_told(compensate, job) -> None:
    job.cell(CELL + "orientation: {a: 0, b: 0, c: 180}\n")
    lines = ["G21 G90 G17 G54", "T1 M6", "G0 X0. Y0. Z50.", "(FORCE 100 0 200 @BASE)",
             "G99 G81 X20. Y10. Z-5. R2. F300",
             "G80 G1 X120.", "(FORCE OFF)", "G0 Z50.", "M30"]  # fmt: skip
    done = compensate(job.write(lines, "\n", "part.ngc"), "--force", "--dry-run", "--json", "-")
    assert done.json["corrected"] == 2, done.out + done.err
    (told,) = [finding for finding in done.json["findings"] if finding["code"] == "COR023"]
    assert told["message"].startswith("a drill cycle is before this motion")
    assert told["line"] == 6
