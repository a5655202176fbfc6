"""A tool that turns about its spindle along the path: its gain, its text read by other code, and what is refused."""

from __future__ import annotations

import re
from itertools import product as every
from pathlib import Path

import numpy as np
import pytest
from place_cases import about, program_of, soft_wrist
from plant import Plant

from postproc.base.findings import Refusal
from postproc.base.units import DEG
from postproc.placement.spin import STEP, SpinScan, plan_spin
from postproc.report.placement import Placement
from postproc.workflows import place_spin
from postproc.workflows.place import place
from postproc.workflows.place_problem import PlaceRequest
from postproc.workflows.preparation import Request, prepare

SLOW = pytest.mark.slow


def spun(program: Path, folder: Path | None, **change) -> Placement:
    """The result with a tool that turns, and its programs in ``folder``."""
    return place(PlaceRequest((program,), spin=True, spin_output=folder, **{"force": "", **change}))


@pytest.fixture(scope="module")
def soft(tmp_path_factory):
    """The milling sample on a soft wrist: folder, result and written program."""
    folder = tmp_path_factory.mktemp("soft")
    program = soft_wrist(folder)
    return folder, spun(program, folder / "turned"), folder / "turned" / program.name


def poses_of(program: Path):
    """(line, position [mm], rotation) of each LIN and CIRC, its words kept until others are stated; from the text."""
    words = dict.fromkeys("XYZABC", 0.0)
    found = []
    for number, line in enumerate(program.read_text(encoding="latin-1").splitlines(), 1):
        if line.startswith(("LIN {", "CIRC {")):
            words |= {
                key: float(value)
                for key, value in re.findall(r"([XYZABC]) ([-\d.]+)", line.rpartition("{")[2])
            }
            z, y, x = np.eye(3)[[2, 1, 0]]
            turns = [about(axis, np.radians(words[key])) for axis, key in zip((z, y, x), "ABC", strict=True)]
            found.append((number, np.array([words[key] for key in "XYZ"]), turns[0] @ turns[1] @ turns[2]))
    return found


def with_comments(program: Path, force: str) -> str:
    """The text of the milling sample with a force in comments."""
    text = program.read_text(encoding="latin-1")
    text = re.sub(r"(LIN \{Z -[58]\.000\})", rf"\1\n;FORCE {force}", text)
    return text.replace("$VEL.CP=0.2500\nLIN {Z 50", ";FORCE OFF\n$VEL.CP=0.2500\nLIN {Z 50")


# the turn


@pytest.mark.parametrize("seed", range(4))
def test_the_largest_error_is_the_least_that_slow_turns_leave(seed):
    """Against all sequences of turns: a few places, one step of the grid between each and the next."""
    rng = np.random.default_rng(seed)
    angle = np.arange(-2, 3) * STEP
    error = rng.uniform(0.1, 1.0, (5, 5))
    scan = SpinScan(angle, error, error, rng.uniform(size=(5, 5)) > 0.2)
    scan.feasible[2] = True
    allowance, pinned = (np.arange(5) + 0.5) * STEP, np.zeros(5, np.bool_)
    turn = plan_spin(scan, allowance, pinned, np.full(5, np.inf), 1e-6, 0)
    steps = np.rint(turn / STEP).astype(int) + 2
    assert np.abs(turn / STEP - np.rint(turn / STEP)).max() < 1e-9
    assert np.abs(np.diff(steps)).max() <= 1
    assert scan.feasible[steps, np.arange(5)].all()
    cost = np.where(scan.feasible, scan.error, np.inf)
    least = min(
        max(cost[k, i] for i, k in enumerate(path))
        for path in every(range(5), repeat=5)
        if np.abs(np.diff(path)).max() <= 1
    )
    assert scan.error[steps, np.arange(5)].max() == pytest.approx(least)


def test_a_pinned_place_does_not_turn_and_no_error_grows():
    angle = np.arange(-36, 37) * STEP
    place = np.linspace(0.0, 10.0, 400)
    error = (angle[:, None] - np.sin(place)) ** 2
    scan = SpinScan(angle, error, error, np.ones(error.shape, np.bool_))
    pinned = np.zeros(400, np.bool_)
    pinned[[0, 200, 399]] = True
    turn = plan_spin(scan, place, pinned, np.full(400, np.inf), 10 * DEG, 0)
    assert not turn[pinned].any()
    assert np.abs(np.diff(turn) / np.diff(place)).max() <= 1 + 1e-6
    assert np.abs(turn).max() > 0.5
    most = error[36]
    assert plan_spin(scan, place, pinned, np.where(place < 5, 0.0, most), 10 * DEG, 0)[
        place < 4.5
    ] == pytest.approx(0)


@pytest.mark.slow
def test_the_gain_is_what_the_main_job_predicts(soft, compensate):
    folder, done, written = soft
    assert done.spun.worth
    assert done.spun.gain > 0.3
    before, after = (
        compensate(path, "--force", "--cell", folder / "cell.yaml", "--dry-run", "--json", "-").json
        for path in (folder / "bracket.src", written)
    )
    for key, figure in (("max", done.spun.error.max), ("rms", done.spun.error.rms)):
        assert after["error_before_mm"][key] == pytest.approx(figure * 1e3, abs=1e-6)
    for out, figure in ((before, done.spun.before), (after, done.spun.after)):
        assert out["across_feed_mm"]["before"]["max"] == pytest.approx(figure * 1e3, abs=1e-6)


@pytest.mark.slow
def test_tip_and_axis_of_every_motion_stay(soft):
    """By the text alone: words, their rotation matrices, and the lengths between them."""
    folder, done, written = soft
    old, new = poses_of(folder / "bracket.src"), poses_of(written)
    assert [one[0] for one in old] == [one[0] for one in new]
    turns = []
    for (_, here, turn), (_, there, turned) in zip(old, new, strict=True):
        assert np.abs(here - there).max() < 1e-9
        assert np.linalg.norm(np.cross(turn[:, 2], turned[:, 2])) < 3e-5
        assert turn[:, 2] @ turned[:, 2] > 0
        relative = turn.T @ turned
        turns.append(np.degrees(np.arctan2(relative[1, 0], relative[0, 0])))
    assert (np.abs(turns) > 1).sum() > 10
    assert max(turns) == pytest.approx(done.spun.turn[1] / DEG, abs=2e-3)
    assert min(turns) == pytest.approx(done.spun.turn[0] / DEG, abs=2e-3)
    steps = np.abs(np.diff(turns))
    length = np.linalg.norm(np.diff([one[1] for one in old], axis=0), axis=1)
    # arcs are longer than their chords
    assert (steps <= 0.5 * np.pi / 2 * length + 5e-3).all()


@pytest.mark.slow
def test_nothing_but_targets_changes(soft):
    folder, _, written = soft
    old, new = (path.read_text(encoding="latin-1").splitlines() for path in (folder / "bracket.src", written))
    assert len(old) == len(new)
    for one, other in zip(old, new, strict=True):
        if one != other:
            assert one.startswith(("LIN {", "CIRC {"))
            assert one.rpartition("}")[2] == other.rpartition("}")[2]


@pytest.mark.slow
def test_mujoco_sees_the_same_gain(soft):
    folder, done, written = soft
    largest = []
    for program in (folder / "bracket.src", written):
        task = prepare(Request(program, force="", cell=folder / "cell.yaml")).task
        plant, rows = Plant.of(task.model, links=()), np.flatnonzero(task.carries)
        moved = [
            plant.rest(task.track.q[row], task.wrench[row], task.tool[row]).position
            - plant.rest(task.track.q[row], np.zeros(6), task.tool[row]).position
            for row in rows
        ]
        tangent = task.desired_path.tangent(rows, np.ones(len(rows)))
        largest.append(np.linalg.norm(np.cross(moved, tangent), axis=1).max())
    assert largest == pytest.approx([done.spun.before, done.spun.after], rel=1e-3)


@pytest.mark.slow
def test_no_cut_becomes_worse(soft):
    folder, _, written = soft
    errors = []
    for program in (folder / "bracket.src", written):
        task = prepare(Request(program, force="", cell=folder / "cell.yaml")).task
        rows = np.flatnonzero(task.carries)
        moved = task.model.linear_deflection(task.track.q[rows], task.wrench[rows], task.tool[rows])[:, :3]
        errors.append(
            np.linalg.norm(np.cross(moved, task.desired_path.tangent(rows, np.ones(len(rows)))), axis=1)
        )
        cut = np.cumsum(np.diff(rows, prepend=rows[0]) > 1)
    assert cut.max() == 2
    for k in range(3):
        assert errors[1][cut == k].max() <= errors[0][cut == k].max() * 1.001


# what is not written


@pytest.mark.slow
def test_a_force_in_the_tool_frame_turns_and_is_refused(tmp_path):
    """The same force in the base and in the tool frame: the same gain, and only the first is written."""
    program = soft_wrist(tmp_path)
    # upright tool, A -45, C 180: X of the tool is (1, -1) / sqrt 2, Y is (-1, -1) / sqrt 2, Z is down
    in_tool = " ".join(f"{value:.6f}" for value in (-170 / np.sqrt(2), 110 / np.sqrt(2), -220))
    done = {}
    for frame, force in (("base", "-140 30 220"), ("tool", in_tool)):
        (tmp_path / frame).mkdir()
        (tmp_path / frame / program.name).write_text(with_comments(program, f"{force} @{frame}"))
        cell = (tmp_path / "cell.yaml").read_text().replace("process:", "# process:")
        (tmp_path / "cell_of_comments.yaml").write_text(cell)
        own = tmp_path / frame / program.name
        done[frame] = spun(own, tmp_path / f"{frame} turned", cell=tmp_path / "cell_of_comments.yaml")
    base, stated = done["base"], done["tool"]
    assert stated.spun.after == pytest.approx(base.spun.after, rel=1e-4)
    assert base.spun.gain > 0.1
    assert len(base.outputs) == 1
    assert stated.outputs == ()
    assert not (tmp_path / "tool turned").exists()
    (found,) = (one for one in stated.findings if one.code == "PLC014")
    assert "tool frame" in found.message
    assert stated.exit == 3


@pytest.mark.slow
def test_what_is_not_worth_it_is_not_written(tmp_path):
    done = spun(program_of("milling"), tmp_path / "turned")
    assert not done.spun.worth
    assert "no turn leaves" in done.spun.reason
    assert done.exit == 3
    assert not (tmp_path / "turned").exists()
    assert spun(program_of("milling"), None).exit == 0


def test_a_program_without_orientations_is_refused():
    with pytest.raises(Refusal) as refusal:
        spun(program_of("pocket"), None)
    (finding,) = refusal.value.findings
    assert finding.code == "PLC013"
    assert "states no orientation" in finding.message


@pytest.mark.slow
def test_rotary_words_of_gcode_turn_the_tool(tmp_path):
    """Under a TCP mode the words A, B, C state the whole orientation: C alone turns an upright tool."""
    text = program_of("pocket").read_text().partition("(LEVEL Z-4)")[0] + "M30\n%\n"
    head = "G0 X150.000 Y100.000 Z30."
    (tmp_path / "pocket.nc").write_text(text.replace(head, f"G43.4 H1\n{head} A0. B0. C0."))
    soft_wrist(tmp_path, "46")
    cell = (program_of("pocket").parent / "cell.yaml").read_text().replace("linuxcnc", "fanuc")
    (tmp_path / "cell.yaml").write_text(cell.replace("robot: kuka_kr270", "robot: soft.yaml", 1))
    done = spun(tmp_path / "pocket.nc", tmp_path / "turned")
    assert done.spun.worth
    words = [
        path.read_text().splitlines() for path in (tmp_path / "pocket.nc", tmp_path / "turned" / "pocket.nc")
    ]
    assert len(words[0]) == len(words[1])
    angles = []
    for one, other in zip(*words, strict=True):
        assert other.partition(" C")[0] == one.partition(" C")[0]
        angles += [float(found) for found in re.findall(r" C([-\d.]+)", other)]
    # the tool points down: it turns against the base
    assert max(angles) == pytest.approx(-done.spun.turn[0] / DEG, abs=2e-3)
    assert done.spun.turn[1] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        (("X 420.000", "X 420.010"), "the tool's tip of a motion is elsewhere"),
        ((",B 0.000,", ",B 0.050,"), "the tool's axis of a motion points elsewhere"),
        (("$VEL.CP=0.0480", "$VEL.CP=0.0490"), "the feed of a motion differs"),
        (("C_DIS", "     "), "the approximation of a motion differs"),
    ],
)
def test_a_wrong_text_is_not_written(tmp_path, monkeypatch, wrong, words):
    program, right = soft_wrist(tmp_path), place_spin.edited_contents

    def spoilt(documents, edits):
        contents = right(documents, edits)
        changed = contents[0].replace(wrong[0].encode(), wrong[1].encode(), 1)
        assert changed != contents[0]
        return (changed, *contents[1:])

    monkeypatch.setattr(place_spin, "edited_contents", spoilt)
    with pytest.raises(Refusal) as refusal:
        spun(program, tmp_path / "turned")
    assert refusal.value.findings[0].code == "FIL008"
    assert words in refusal.value.findings[0].message
    assert not (tmp_path / "turned").exists()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--spin-output", "turned"], ["PLC003", "add --spin"]),
        (["--spin", "--spin-output", "turned", "--x", "1400:1600"], ["PLC003", "-o CELL.yaml"]),
    ],
    ids=["not asked for", "no cell"],
)
def test_mistakes(job, compensate, monkeypatch, words, said):
    monkeypatch.chdir(job.folder)
    done = compensate("place", "part.src", "--force", *words)
    text = " ".join((done.err + done.out).split())
    assert done.code == 1, text
    assert [word for word in said if word not in text] == [], text
    assert not Path("turned").exists()


@pytest.mark.slow
def test_the_programs_do_not_overwrite_their_own(tmp_path):
    program = soft_wrist(tmp_path)
    before = program.read_bytes()
    with pytest.raises(Refusal) as refusal:
        spun(program, tmp_path)
    assert refusal.value.findings[0].code == "FIL007"
    assert program.read_bytes() == before


@pytest.mark.slow
@pytest.mark.parametrize("name", ["soft wrist", "milling"])
def test_a_large_program_is_looked_at_in_part_first(tmp_path, monkeypatch, soft, name):
    """Some motions decide whether a turn is worth a scan of all; that one has coarser steps."""
    _, whole, _ = soft
    monkeypatch.setattr(place_spin, "MANY", 10)
    monkeypatch.setattr(place_spin, "SOME", 3)
    done = spun(soft_wrist(tmp_path) if name == "soft wrist" else program_of(name), None)
    assert done.spun.worth == (name == "soft wrist")
    if done.spun.worth:
        assert done.spun.before == pytest.approx(whole.spun.before)
        assert done.spun.after <= 1.1 * whole.spun.after


@pytest.mark.slow
def test_programs_of_one_name_do_not_overwrite_each_other(tmp_path):
    program = soft_wrist(tmp_path)
    (tmp_path / "other").mkdir()
    other = tmp_path / "other" / program.name
    other.write_bytes(program.read_bytes())
    with pytest.raises(Refusal) as refusal:
        place(
            PlaceRequest(
                (program, other), "", cell=tmp_path / "cell.yaml", spin=True, spin_output=tmp_path / "turned"
            )
        )
    assert refusal.value.findings[0].code == "FIL007"
    assert not (tmp_path / "turned").exists()


@pytest.mark.slow
def test_the_turn_at_the_best_place(tmp_path):
    """A room, a turn at its best place, and both written: the main job finds what is stated."""
    program = soft_wrist(tmp_path)
    asked = PlaceRequest(
        (program,),
        "",
        {"x": (1200.0, 1300.0)},
        top=1,
        output=tmp_path / "new" / "cell.yaml",
        spin=True,
        spin_output=tmp_path / "new",
    )
    done = place(asked)
    assert done.spun.worth
    assert done.spun.before == pytest.approx(done.best.across.max, rel=1e-9)
    again = spun(tmp_path / "new" / program.name, None, cell=tmp_path / "new" / "cell.yaml")
    assert again.present.across.max == pytest.approx(done.spun.after, rel=1e-9)
    assert not again.spun.worth
