"""``compensate identify`` from file to file: what it writes can be identified again, and what can not be is refused."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from postproc.effects import EFFECTS as KINDS
from postproc.identification.identifiable import identifiability
from postproc.identification.unknowns import Unknown, with_gauge
from postproc.robot.description import Value, find_robot, load_robot

SAMPLE = Path(__file__).parent.parent / "samples" / "kr270_campaign" / "loads.csv"
EFFECTS = ["--effects", "joint_compliance,gravity_compensator", "--bootstrap", "0", "--folds", "0"]


def rewritten(path: Path, change) -> Path:
    """The sample with its cells changed: ``change(header, cells)`` gives the cells of a row."""
    lines = SAMPLE.read_text().splitlines()
    comments, rows = ([x for x in lines if (x[0] == "#") is is_comment] for is_comment in (True, False))
    header = rows[0].split(",")
    new = [",".join(change(header, row.split(","))) for row in rows]
    path.write_text("\n".join([*comments, *new]) + "\n")
    return path


def scaled(*names: str, by: float):
    def change(header: list[str], cells: list[str]) -> list[str]:
        if cells == header:
            return cells
        return [f"{float(c) * by:.9f}" if h in names else c for h, c in zip(header, cells, strict=True)]

    return change


def exchanged(one: str, other: str):
    def change(header: list[str], cells: list[str]) -> list[str]:
        names = {one: other, other: one}
        return [cells[header.index(names.get(name, name))] for name in header] if cells != header else cells

    return change


@pytest.fixture
def identified(compensate, tmp_path):
    """``identified(*words)``: the JSON of a run, and its findings by code."""

    def call(*words):
        done = compensate("identify", *words, "--json", str(tmp_path / "result.json"))
        assert done.code in (0, 3), done.err
        told = json.loads((tmp_path / "result.json").read_text())
        return told["effects"], {finding["code"]: finding["message"] for finding in told["findings"]}

    return call


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    ("change", "code", "words"),
    [
        (scaled("DX", "DY", "DZ", by=1e-3), "IDN012", "are they in metres"),
        (scaled("DX", "DY", "DZ", by=1 / 25.4), "IDN012", "are the deflections in inches?"),
        (scaled("FZ", by=1 / 9.80665), "IDN012", "are the forces in kg?"),
        (exchanged("A2", "A3"), "IDN014", "the columns of A2 and A3 exchanged"),
        (exchanged("A4", "A6"), "IDN014", "the columns of A4 and A6 exchanged"),
    ],
)
def test_the_sample_in_other_units_or_columns_is_refused(compensate, tmp_path, change, code, words):
    data, new = rewritten(tmp_path / "loads.csv", change), tmp_path / "new.yaml"
    done = compensate("identify", str(data), *EFFECTS, "-o", str(new))
    assert (done.code, code in done.err, words in done.err) == (1, True, True), done.err
    assert not new.exists()


@pytest.mark.slow
def test_identified_again_from_the_new_file(identified, tmp_path):
    """The same values and intervals; intervals of the same readings are no second source."""
    new = tmp_path / "new.yaml"
    first, _ = identified(str(SAMPLE), *EFFECTS, "-o", str(new))
    again, told = identified(str(SAMPLE), *EFFECTS, "--robot", str(new))
    assert "IDN031" not in told
    for effect, parameters in first.items():
        for name, found in parameters.items():
            assert abs(again[effect][name]["value"] - found["value"]) < 0.01 * found["ci95"]
            assert again[effect][name]["ci95"] == pytest.approx(found["ci95"], rel=1e-3)
    _, told = identified(str(SAMPLE), *EFFECTS, "--robot", str(new), "--priors")
    assert "joint_compliance.c2" in told["IDN031"]
    assert "gravity_compensator.L" not in told["IDN031"]


def test_a_dimension_that_readings_say_nothing_of_keeps_its_source(identified, tmp_path):
    new = tmp_path / "new.yaml"
    identified(str(SAMPLE), *EFFECTS, "-o", str(new))
    lines = [line.strip() for line in new.read_text().splitlines()]
    assert (
        'L: {value: 184.72, unit: mm, ci: 0.06, ci_level: unstated, source: "Klimchik et al., Table 1"}'
        in lines
    )
    assert not any(line.startswith("gravity_compensator.L:") for line in lines)
    assert any(line.startswith("gravity_compensator.K_c:") for line in lines)


def test_a_named_robot_is_not_replaced(compensate, tmp_path, monkeypatch):
    """Its file is an input, even where only the readings name it."""
    from postproc.robot import description

    folder = tmp_path / "robots"
    folder.mkdir()
    own = folder / "kuka_kr270.yaml"
    own.write_bytes(description.find_robot("kuka_kr270").read_bytes())
    monkeypatch.setattr(description, "robot_files", lambda: {"kuka_kr270": own})
    before = own.read_bytes()
    done = compensate("identify", str(SAMPLE), *EFFECTS, "-o", str(own))
    assert (done.code, "FIL007" in done.err) == (1, True), done.err
    assert own.read_bytes() == before


@pytest.mark.parametrize("interval", [None, 4e-6])
def test_a_stated_value_close_to_its_null_does_not_make_a_good_interval_too_weak(interval):
    """A file written by identify states offsets that are smaller than their intervals: they are found again."""
    effect = KINDS["joint_offset"](load_robot(find_robot("kuka_kr270")).joints)
    parameter = effect.parameters[1]
    stated = None if interval is None else Value(1e-6, interval, 0.95, "identify")
    unknown = Unknown("joint_offset.o2", 0, parameter, 1e-6, stated)
    column = np.full((1, 1), 1.96 * parameter.scale / 4e-6)
    nothing = np.zeros((1, 0))
    found = identifiability([unknown], column, nothing, [], np.zeros((1, 1)), np.array([1e-6]))
    assert (found.observable, found.dropped) == ((0,), ())


@pytest.mark.parametrize(
    ("deviation", "told"), [(1e-3, True), (1.6e-3, True), (1.7e-3, False), (4e-3, False)]
)
def test_geometry_that_tracker_and_targets_nearly_hide_stays_as_stated(deviation, told):
    """A zero is plausible within 5 mrad: readings that by themselves say it to some 1.7 mrad choose a value by their
    scatter, and what they were fitted to predicts other campaigns worse than what is stated."""
    effect = KINDS["joint_offset"](load_robot(find_robot("kuka_kr270")).joints)
    (unknown,) = with_gauge([Unknown("joint_offset.o6", 0, effect.parameters[5], 0.0)])
    scale = unknown.parameter.scale
    column = np.array([[30.0], [scale / deviation]])
    nuisance = np.array([[1.0], [0.0]])
    prior = np.array([[scale / unknown.prior]])
    found = identifiability([unknown], column, nuisance, ["target"], prior, np.array([0.0]))
    assert bool(found.observable) == told
    assert [one.name for one in found.dropped] == [] if told else ["joint_offset.o6"]
