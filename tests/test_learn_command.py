"""``compensate learn``: its files and results, what it refuses, and the part that a plant cuts with its program."""

import hashlib
import json
import shutil
from pathlib import Path

import jsonschema_rs
import numpy as np
import pytest
from blind_parts.cutting import aligned_rms, cut, probe, surface_of, write_csv
from blind_parts.shop import surface_points, write_shop
from blind_parts.truth import draw_truth
from click.testing import CliRunner

import postproc
from postproc.cell import load_cell
from postproc.cli.main import main, normalized
from postproc.robot.description import load_robot
from postproc.schemas import schema_of
from postproc.workflows.preparation import Request, prepare

pytestmark = pytest.mark.slow

SAMPLE = Path(__file__).resolve().parent.parent / "samples" / "kr270_second_part"


def call(folder: Path, *words: object):
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        return CliRunner().invoke(main, normalized(["learn", *map(str, words)]))


def files(folder: Path) -> set[str]:
    return {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}


@pytest.fixture
def shop(tmp_path):
    shutil.copytree(SAMPLE, tmp_path / "shop")
    return tmp_path / "shop"


@pytest.fixture(scope="module")
def learned(tmp_path_factory):
    """The sample, learnt once: its folder and the result."""
    folder = tmp_path_factory.mktemp("once") / "shop"
    shutil.copytree(SAMPLE, folder)
    done = call(folder, "part.src", "part1.csv", "--json", "result.json", "--csv", "points.csv")
    assert done.exit_code == 0, done.output
    return folder, json.loads((folder / "result.json").read_text())


def changed(folder: Path, change) -> None:
    """``change`` takes the lines of part1.csv."""
    path = folder / "part1.csv"
    path.write_text("\n".join(change(path.read_text().splitlines())) + "\n")


def body(lines):
    start = next(i for i, line in enumerate(lines) if line.startswith("X,"))
    return lines[: start + 1], [line.split(",") for line in lines[start + 1 :]]


def with_rows(lines, change):
    head, rows = body(lines)
    return [*head, *(",".join(row) for row in change(rows))]


def test_the_result_is_what_its_schema_says(learned):
    folder, result = learned
    jsonschema_rs.validate(schema_of("learn"), result)
    assert result["exit"] == 0
    assert all((folder / name).is_file() for name in result["outputs"])
    assert {
        "learned/part.src",
        "learned/kuka_kr270_learned.yaml",
        "learned/part.force_factors.yaml",
    } <= files(folder)
    assert len((folder / "points.csv").read_text().splitlines()) == 1 + result["points"]["used"]
    assert result["promise"]["after_rms_mm"] < 0.3 * result["promise"]["before_rms_mm"]


def test_what_is_off_lies_in_its_interval(learned):
    """The plant of the sample: A1 is 25 % softer, all forces are 30 % larger."""
    causes = {one["cause"]: one for one in learned[1]["causes"]}
    assert causes["joint_compliance.c1"]["lower"] < 1.25 < causes["joint_compliance.c1"]["upper"]
    assert causes["force"]["lower"] < 1.3 < causes["force"]["upper"]
    for name in ("joint_compliance.c2", "joint_compliance.c3", "radius of tool 1"):
        null = 1.0 if causes[name]["unit"] == "1" else 0.0
        assert causes[name]["lower"] < null < causes[name]["upper"]


def test_the_robot_file_has_the_values_and_how_they_came(learned):
    folder, result = learned
    robot = load_robot(folder / "learned" / "kuka_kr270_learned.yaml")
    run = robot.identified[-1]
    digest = hashlib.sha256((folder / "part1.csv").read_bytes()).hexdigest()
    assert (run.command, run.data) == ("learn", (("part1.csv", digest),))
    assert "joint_compliance.c1" in run.names
    assert result["points"]["used"] == run.readings


def test_the_factors_of_the_cell_are_those_of_the_next_program(learned):
    """A cell with these lines and the new robot file gives the forces that the next program was made with."""
    folder, result = learned
    cell = folder / "new.yaml"
    cell.write_text(
        (folder / "cell.yaml").read_text() + (folder / "learned" / "part.force_factors.yaml").read_text()
    )
    factors = load_cell(cell).force_factors
    causes = {one["cause"]: one["value"] for one in result["causes"]}
    for name, one in factors.items():
        own = 1.0 if name == "others" else causes[f"force of {name}"]
        assert one.factor == pytest.approx(causes["force"] * own, rel=1e-3)
    stated = prepare(Request(folder / "part.src", force="")).task
    now = prepare(Request(folder / "part.src", force="", cell=cell)).task
    carries = np.flatnonzero(stated.carries)
    ratio = np.linalg.norm(now.wrench[carries, :3], axis=1) / np.linalg.norm(
        stated.wrench[carries, :3], axis=1
    )
    assert min(ratio) == pytest.approx(min(f.factor for n, f in factors.items() if n != "others"), rel=1e-2)
    assert max(ratio) == pytest.approx(max(f.factor for n, f in factors.items() if n != "others"), rel=1e-2)


def test_all_that_was_learnt_gives_the_next_program_again(learned):
    """Robot file, force factors and tool errors, in a cell beside the program."""
    folder, _ = learned
    lines = [
        (folder / "learned" / f"part.{name}.yaml").read_text() for name in ("force_factors", "tool_errors")
    ]
    cell = folder / "all.yaml"
    cell.write_text((folder / "cell.yaml").read_text() + "".join(lines))
    assert load_cell(cell).tool_errors[1].radius == pytest.approx(3e-6, abs=2e-6)
    robot = str(folder / "learned" / "kuka_kr270_learned.yaml")
    program = folder / "again" / "part.src"
    postproc.compensate(folder / "part.src", force=True, cell=cell, robot=robot, output=program)
    one, other = (
        prepare(Request(path, cell=cell)).task.toolpath.position
        for path in (program, folder / "learned" / "part.src")
    )
    np.testing.assert_allclose(one, other, atol=1.1e-6, equal_nan=True)


def test_a_larger_tool_is_said(shop):
    """0.05 mm less material at every wall than the sample has: the tool is larger, to be checked or set."""

    def deeper(row):
        wall = float(row[5]) < 0.5
        return [*row[:6], f"{float(row[6]) - 0.05 * wall:.4f}", *row[7:]]

    changed(shop, lambda lines: with_rows(lines, lambda rows: map(deeper, rows)))
    done = call(shop, "part.src", "part1.csv", "--dry-run", "--json", "r.json", "-v")
    assert "LRN018 tool 1 is probably larger than programmed by 0.0" in done.output
    assert "part.tool_errors.yaml to the cell; not both" in done.output


def test_a_run_is_its_own_repetition(learned, shop):
    call(shop, "part.src", "part1.csv", "-q")
    for name in ("part.src", "part.force_factors.yaml"):
        assert (shop / "learned" / name).read_bytes() == (learned[0] / "learned" / name).read_bytes()


def test_from_python(shop):
    before = files(shop)
    learned = postproc.learn(shop / "part.src", shop / "part1.csv", dry_run=True)
    assert files(shop) == before
    assert set(learned.table()) >= {"measured_mm", "causes_mm", "remaining_mm"}
    explained = learned.table()["causes_mm"] + learned.table()["alignment_mm"] + learned.table()["smooth_mm"]
    rest = learned.table()["measured_mm"] - explained
    np.testing.assert_allclose(rest, learned.table()["remaining_mm"], atol=1e-9)
    assert np.sqrt(np.mean(rest**2)) < 0.1 * np.sqrt(np.mean(learned.table()["measured_mm"] ** 2))


def comment(key, value):
    return lambda lines: [f"# {key}: {value}" if line.startswith(f"# {key}:") else line for line in lines]


def rolled(rows):
    """The deviations of a third of the rows further on."""
    return [[*row[:6], rows[i - len(rows) // 3][6], *row[7:]] for i, row in enumerate(rows)]


def exchanged(rows):
    """The deviations of two walls, as far as both have points."""
    walls = [[i for i, row in enumerate(rows) if row[7] == name] for name in ("WALL B", "WALL C")]
    moved = [list(row) for row in rows]
    for i, j in zip(*walls, strict=False):
        moved[i][6], moved[j][6] = rows[j][6], rows[i][6]
    return moved


def the_original(lines):
    """As if the uncompensated program had cut the part: with its name and its digest."""
    digest = hashlib.sha256((SAMPLE / "part.src").read_bytes()).hexdigest()
    return comment("sha256", digest)(comment("cut_with", "original")(lines))


def shifted(rows):
    """One wall in five faces along X and is touched no more, all others are as before."""
    return [[str(float(row[0]) + 1.0), *row[1:]] for row in rows]


BAD = {
    "the other sign of a part that a compensated program cut": (
        comment("positive", "material_missing"),
        "LRN004",
    ),
    "the original, with its digest": (the_original, "LRN002"),
    "an origin that is 1 mm off": (lambda lines: with_rows(lines, shifted), "LRN003"),
    "features exchanged": (lambda lines: with_rows(lines, exchanged), "LRN004"),
    "a probe that scatters more than the part": (comment("sigma_mm", "0.6"), "LRN004"),
    "another program": (comment("sha256", "0" * 16), "LRN002"),
    "a program that is not there": (comment("cut_with", "other.src"), "LRN002"),
    "the original, which did not cut it": (comment("cut_with", "original"), "LRN002"),
    "metres": (
        lambda lines: with_rows(
            lines, lambda rows: [[f"{float(v) / 1000:.7f}" for v in r[:3]] + r[3:] for r in rows]
        ),
        "LRN001",
    ),
    "the next part on the fixture": (
        lambda lines: with_rows(lines, lambda rows: [[str(float(r[0]) + 31.7), *r[1:]] for r in rows]),
        "LRN003",
    ),
    "normals into the material": (
        lambda lines: with_rows(
            lines, lambda rows: [[*r[:3], *(str(-float(v)) for v in r[3:6]), *r[6:]] for r in rows]
        ),
        "LRN003",
    ),
    "rows in another order": (lambda lines: with_rows(lines, rolled), "LRN004"),
    "the radius of the probe": (
        lambda lines: with_rows(lines, lambda rows: [[*r[:6], str(float(r[6]) + 1.0), *r[7:]] for r in rows]),
        "LRN004",
    ),
    "measured places instead of nominal ones": (
        lambda lines: with_rows(
            lines,
            lambda rows: [
                [*(str(float(r[i]) + float(r[i + 3]) * float(r[6])) for i in range(3)), *r[3:]] for r in rows
            ],
        ),
        "LRN004",
    ),
    "an operation that is none": (
        lambda lines: [line.replace("FEATURE", "OPERATION").replace("WALL A", "WALL Q") for line in lines],
        "LRN001",
    ),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_data_are_refused_in_words_and_nothing_is_written(shop, case):
    """The sign is stated twice, where it is not the mistake, so that no second look at the part helps to find it."""
    change, code = BAD[case]
    changed(shop, lambda lines: change([line for line in lines if not line.startswith("# checked:")]))
    before = files(shop)
    again = () if "sign" in case else ("--positive", "material_left")
    done = call(shop, "part.src", "part1.csv", *again)
    assert done.exit_code == 1, done.output
    assert code in done.output
    assert "nothing is written" in done.output
    assert files(shop) == before


def test_a_compensated_program_is_no_original(shop):
    done = call(shop, "cut1.src", "part1.csv")
    assert done.exit_code == 1
    assert not (shop / "learned").exists()


UNKNOWN = {
    "a base that moves with the robot file": (
        "correct: process",
        "correct: touched_off\ntouch_points: [[0, 0, 0], [400, 0, 0], [0, 300, 0]]\n"
        "controller: {absolute_accuracy: false}",
        "touched_off",
    ),
    "a track under the robot": (
        "correct: process",
        "correct: process\nexternal_axes:\n  E1: {kind: track, direction: +y, limits: [-5000, 5000], start: 0}",
        "external axes carry",
    ),
}


@pytest.mark.parametrize("case", UNKNOWN)
def test_a_cell_that_learning_does_not_know_is_refused_in_words(shop, case):
    old, new, words = UNKNOWN[case]
    cell = shop / "cell.yaml"
    cell.write_text(cell.read_text().replace(old, new))
    if "track" in case:
        program = shop / "part.src"
        program.write_text(
            program.read_text().replace(",A -45.000,B 0.000,C 180.000}", ",A -45,B 0,C 180,E1 0}")
        )
    before = files(shop)
    done = call(shop, "part.src", "part1.csv")
    assert done.exit_code == 1, done.output
    assert "LRN011" in done.output
    assert words in " ".join(done.output.split())
    assert files(shop) == before


def test_a_part_counts_once(shop):
    shutil.copy(shop / "part1.csv", shop / "copy.csv")
    done = call(shop, "part.src", "part1.csv", "copy.csv")
    assert done.exit_code == 1
    assert "LRN001" in done.output


def test_an_output_never_replaces_an_input(shop):
    done = call(shop, "part.src", "part1.csv", "--csv", "part1.csv")
    assert done.exit_code == 1
    assert "FIL007" in done.output


def test_a_next_program_in_place_of_the_original_leaves_nothing_behind(shop):
    before = files(shop)
    done = call(shop, "part.src", "part1.csv", "-o", ".")
    assert done.exit_code == 1
    assert "FIL007" in done.output
    assert files(shop) == before
    assert not (shop / "cut").exists()


def test_the_next_part_of_a_plant_is_better(tmp_path):
    """Another robot, process and part in MuJoCo, with outliers: more than half of the error goes, within the promise;
    the deviations with the other sign are refused, as the error of an uncompensated part shows it."""
    program = write_shop(tmp_path / "shop")
    postproc.compensate(program, force=True)
    rng = np.random.default_rng(8)
    surface = surface_of(program.parent, *surface_points(120, rng))
    truth = draw_truth(rng, list(surface.program.operations.names))
    plant = truth.plant()
    first = program.parent / "compensated" / "part.src"
    errors = cut(surface, truth, plant, first, rng)
    chosen = rng.choice(120, 80, replace=False)
    deviation = probe(surface, errors, chosen, 1e-5, rng)
    deviation[:2] += [3e-4, -3e-4]
    write_csv(program.parent / "m.csv", surface, chosen, deviation, first, 1e-5)
    learned = postproc.learn(program, program.parent / "m.csv")
    assert not learned.attribution.kept[:2].any()
    assert learned.attribution.kept.sum() >= 76
    after = aligned_rms(surface, cut(surface, truth, plant, program.parent / "learned" / "part.src", rng))
    assert after < 0.5 * aligned_rms(surface, errors)
    assert after < learned.promise.upper
    raw = cut(surface, truth, plant, None, rng)
    write_csv(
        program.parent / "wrong.csv",
        surface,
        chosen,
        -probe(surface, raw, chosen, 1e-5, rng),
        program,
        1e-5,
        checked=False,
    )
    with pytest.raises(postproc.Refusal) as caught:
        postproc.learn(program, program.parent / "wrong.csv")
    assert [finding.code for finding in caught.value.findings] == ["LRN004"]


def test_a_program_that_leaves_cuts_as_they_are_is_not_written(shop):
    """Without room for points whole cuts stay uncorrected: the next part would be worse than the measured one."""
    cell = shop / "cell.yaml"
    cell.write_text(cell.read_text().replace("max_growth: 8", "max_growth: 1"))
    done = call(shop, "part.src", "part1.csv", "--json", "result.json")
    assert done.exit_code == 3, done.output
    result = json.loads((shop / "result.json").read_text())
    codes = {one["code"] for one in result["findings"]}
    assert {"COR003", "LRN021", "LRN009"} <= codes
    assert not (shop / "learned" / "part.src").exists()
    assert result["next_program"] is None
    promise = result["promise"]
    # 37 of 59 points stay 0.3 mm RMS off by the shipped robot and forces, which are a third too small
    assert 1.2 * 0.296 < promise["after_rms_mm"] < 2.0 * 0.296
    assert promise["after_rms_mm"] > promise["before_rms_mm"]
    assert promise["lower_rms_mm"] < promise["after_rms_mm"] < promise["upper_rms_mm"]
