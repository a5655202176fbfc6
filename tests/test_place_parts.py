"""Which part of a batch lies where: the assignment against all permutations, its figures against the main job."""

from __future__ import annotations

from itertools import permutations

import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

import postproc
from postproc.base.findings import Refusal
from postproc.workflows.place_parts import assign_places

PLACES = {
    "left": (1500.0, -200.0, 600.0),
    "right": (1350.25, -380.0, 600.0, -20.0),
    "far": (4000.0, 0.0, 600.0),
}


@given(st.integers(1, 4), st.integers(1, 4), st.integers(0, 10_000))
def test_no_permutation_is_better(parts, places, seed):
    rng = np.random.default_rng(seed)
    values = np.where(rng.uniform(size=(parts, places)) < 0.3, np.inf, rng.uniform(0, 1e-3, (parts, places)))
    chosen = assign_places(values)
    taken = chosen[chosen >= 0].tolist()
    assert len(set(taken)) == len(taken)
    assert np.isfinite(values[chosen >= 0, taken]).all()
    best = (0, 0.0)
    slots = [*range(places), *[-1] * parts]
    for order in set(permutations(slots, parts)):
        pairs = [(part, at) for part, at in enumerate(order) if at >= 0]
        sizes = [values[pair] for pair in pairs]
        if np.isfinite(sizes).all():
            best = min(best, (-len(pairs), float(sum(sizes))))
    assert -len(taken) == best[0]
    assert sum(values[chosen >= 0, taken]) == pytest.approx(best[1])


@pytest.fixture
def parts(job):
    """Two programs of one cell that cut in two directions."""
    text = job.program.read_text(encoding="latin-1")
    other = job.folder / "other.src"
    other.write_text(
        text.replace("DEF part", "DEF other").replace("-360 50 560", "150 300 -200"), encoding="latin-1"
    )
    return job, (job.program, other)


@pytest.mark.slow
def test_each_figure_is_that_of_the_main_job(parts, compensate):
    job, programs = parts
    words = [f"--at={name}={','.join(map(str, values))}" for name, values in PLACES.items()]
    done = compensate("assign", *programs, "--force", *words, "--cells", job.folder / "cells", "--json", "-")
    assert done.code == 0, done.err
    found = done.json
    assert {one["place"] for one in found["assignment"]} == {"left", "right"}
    cell = yaml.safe_load((job.folder / "cell.yaml").read_text())
    for pair in found["pairs"]:
        if pair["place"] == "far":
            assert pair["objective_mm"] is None
            assert "at place far" in pair["lack"]
            assert "out of reach" in pair["lack"]
            assert pair["lack_line"] > 0
            continue
        x, y, z, *turn = PLACES[pair["place"]]
        frame = cell["bases"][1]
        moved = {**frame, "x": x, "y": y, "z": z, "a": frame.get("a", 0.0) + (turn or [0.0])[0]}
        (job.folder / "moved.yaml").write_text(yaml.safe_dump({**cell, "bases": {1: moved}}))
        run = compensate(
            pair["program"], "--force", "--cell", job.folder / "moved.yaml", "--dry-run", "--json", "-"
        )
        assert run.json["across_feed_mm"]["before"]["max"] == pytest.approx(pair["objective_mm"], abs=1e-6)
    chosen = {one["program"]: one["place"] for one in found["assignment"]}
    values = {(one["program"], one["place"]): one["objective_mm"] for one in found["pairs"]}
    assert found["total_mm"] == pytest.approx(sum(values[pair] for pair in chosen.items()))
    for program, name in chosen.items():
        new = job.folder / "cells" / f"{program.rpartition('/')[2].removesuffix('.src')}.cell.yaml"
        assert yaml.safe_load(new.read_text())["bases"][1]["x"] == PLACES[name][0]
        run = compensate(program, "--force", "--cell", new, "--dry-run", "--json", "-")
        assert run.json["across_feed_mm"]["before"]["max"] == pytest.approx(values[program, name], abs=1e-6)


@pytest.mark.slow
def test_a_part_without_a_place_is_told(parts, compensate):
    job, programs = parts
    done = compensate("assign", *programs, "--force", "--at", "left=1500,-200,600", "--at", "far=4000,0,600")
    assert done.code == 3, done.err
    text = " ".join((done.out + done.err).split())
    assert "PLC017" in text
    assert "1 of 2 parts" in text
    assert "another part lies better at left" in text
    assert "collisions are NOT checked" in done.out.splitlines()[0]
    strict = compensate(
        "assign",
        *programs,
        "--force",
        "--at",
        "left=1500,-200,600",
        "--strict",
        "--cells",
        job.folder / "new",
    )
    assert strict.code == 1
    assert not (job.folder / "new").exists()


def test_no_place_at_all(job):
    with pytest.raises(Refusal) as refusal:
        postproc.assign([job.program], {"far": (4000, 0, 600), "farther": (5000, 0, 600)}, force=True)
    assert [one.code for one in refusal.value.findings] == ["PLC016"] * 2
    assert all(one.line and "out of reach" in one.message for one in refusal.value.findings)


@pytest.mark.slow
def test_from_python(parts):
    _, programs = parts
    done = postproc.assign(programs, {"left": (1500, -200, 600), "right": (1400, -100, 600)}, force=True)
    assert len(done.table()["part"]) == 4
    assert sum(done.table()["chosen"]) == 2
    with pytest.raises(ValueError, match="is not x, y, z"):
        postproc.assign(programs, {"left": (1500, -200)}, force=True)


def test_places_in_other_units_are_reported(job, compensate):
    done = compensate("assign", job.program, "--force", "--at", "a=1.5,-0.2,0.6")
    assert done.code == 1
    assert "for metres write --at a=1500,-200,600" in " ".join(done.err.split())
    done = compensate("assign", job.program, "--force", "--at", "a=1500,-200,600,0.785", "--json", "-")
    assert done.code == 3
    assert "PLC021" in {one["code"] for one in done.json["findings"]}


def test_two_places_at_one_spot_are_refused(parts, compensate):
    """Of several parts: one part may be compared with itself, turned."""
    job, programs = parts
    places = ["--at", "a=1500,-200,600", "--at", "b=1500,-200.0001,600,90"]
    done = compensate("assign", *programs, "--force", *places)
    assert done.code == 1
    assert "PLC023 the places a and b are at one spot" in done.err
    done = compensate("assign", job.program, "--force", *places)
    assert "PLC023" not in done.err


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--at", "left"], "no place NAME=x,y,z"),
        (["--at", "left=1,2"], "no place NAME=x,y,z"),
        (["--at", "left=1,2,z"], "is not a number"),
        (["--at", "a=1,2,3", "--at", "a=1,2,4"], "stated twice"),
        ([], "--at"),
    ],
)
def test_mistakes(job, compensate, words, said):
    done = compensate("assign", job.program, "--force", *words)
    assert done.code == 2
    assert said in done.err
