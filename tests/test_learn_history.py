"""The record of the parts of earlier runs: what counts, what is refused, and that nothing is lost by a kill."""

import hashlib
import os
import random
import shutil
import signal
from pathlib import Path

import numpy as np
import pytest
from blind_parts.cutting import aligned_rms, cut, probe, surface_of, write_csv
from blind_parts.shop import surface_points
from blind_parts.truth import draw_truth
from faults import Child, once, stray

import postproc
from postproc.learning.history import DamagedRecord, PartHistory, RecordedPart, RecordedStep, read_history

SAMPLE = Path(__file__).resolve().parent.parent / "samples" / "kr270_second_part"
RECORD = "part.parts.json"
ONE = RecordedPart("part1.csv", "a" * 64, "b" * 64)
STEP = RecordedStep(1, "named", 0.1, 1 / 30, 0.3, "learned/cut/cccccccccccc/part.src", "c" * 64)
HISTORY = PartHistory("d" * 64, "", {"part.src": "d" * 64, "cell.yaml": "e" * 64}, (ONE,), (STEP,))


def test_a_record_is_read_as_it_was_written():
    again = read_history(HISTORY.as_bytes())
    assert again == HISTORY
    assert again.promised("c" * 64) == STEP
    assert again.promised("d" * 64) is None
    assert again.with_step((ONE,), STEP) == again
    assert len(again.with_step((ONE, ONE), STEP).steps) == 2


def test_every_damage_is_seen():
    """A byte that is changed, lost or added, and a record that ends early; blanks between its tokens change nothing."""
    raw = HISTORY.as_bytes()
    rng = random.Random(3)
    damaged = [raw[: rng.randrange(len(raw))] for _ in range(40)] + [b"", b"[]", b"{}", b"[" * 100_000]
    for _ in range(300):
        at = rng.randrange(len(raw))
        if raw[at : at + 1].isspace():
            continue
        damaged += [raw[:at] + bytes([raw[at] ^ 1]) + raw[at + 1 :], raw[:at] + raw[at + 1 :]]
    for one in damaged:
        with pytest.raises(DamagedRecord, match=r"^it |^its |^an entry "):
            read_history(one)


def refusals(code, *arguments, **options):
    with pytest.raises(postproc.Refusal) as caught:
        postproc.learn(*arguments, **options)
    assert [finding.code for finding in caught.value.findings] == [code]
    return " ".join(finding.message for finding in caught.value.findings)


@pytest.fixture(scope="module")
def once_learned(tmp_path_factory):
    """The sample with a plant, part 1 cut by it and learnt from."""
    folder = tmp_path_factory.mktemp("history") / "shop"
    shutil.copytree(SAMPLE, folder)
    (folder / "part1.csv").unlink()
    rng = np.random.default_rng(7)
    surface = surface_of(folder, *surface_points(90, rng))
    truth = draw_truth(rng, list(surface.program.operations.names))
    plant = truth.plant()

    def measured(number, program, points=60):
        """The part that ``program`` cuts, measured at some points; the RMS of its surface [mm]."""
        errors = cut(surface, truth, plant, program, rng)
        chosen = rng.choice(90, points, replace=False)
        deviation = probe(surface, errors, chosen, 1e-5, rng)
        write_csv(folder / f"part{number}.csv", surface, chosen, deviation, program, 1e-5)
        return 1e3 * aligned_rms(surface, errors)

    sizes = [measured(1, folder / "cut1.src", 14)]
    first = postproc.learn(folder / "part.src", folder / "part1.csv")
    shutil.copytree(folder, folder.with_name("copy"))
    return folder, measured, sizes, first


@pytest.fixture
def shop(once_learned, tmp_path):
    shutil.copytree(once_learned[0].with_name("copy"), tmp_path / "shop")
    return tmp_path / "shop"


@pytest.mark.slow
def test_parts_add_up_and_their_programs_are_kept(once_learned):
    """Part 2 is cut by what 14 points of part 1 told, part 3 by what both told; each run names one file."""
    folder, measured, sizes, first = once_learned
    following = folder / "learned" / "part.src"
    second_program = following.read_bytes()
    sizes.append(measured(2, following))
    second = postproc.learn(folder / "part.src", folder / "part2.csv")
    assert [name for name, _ in second.data] == ["part1.csv", "part2.csv"]
    assert second.attribution.layout.sigma.size > 1.8 * first.attribution.layout.sigma.size
    assert following.read_bytes() != second_program
    digest = hashlib.sha256(second_program).hexdigest()
    assert (folder / "learned" / "cut" / digest[:12] / "part.src").read_bytes() == second_program
    assert second.history[1].promised == pytest.approx((first.promise.lower, first.promise.upper), abs=1e-9)
    assert 1e3 * second.history[1].rms == pytest.approx(sizes[1], rel=0.3)
    sizes.append(measured(3, following))
    third = postproc.learn(folder / "part.src", folder / "part3.csv", dry_run=True)
    # of both later parts the programs are found, though another one lies there now
    assert [one.file for one in third.history] == ["part1.csv", "part2.csv", "part3.csv"]
    assert sizes[1] < sizes[0]
    assert sizes[2] < 0.5 * sizes[0]
    assert np.mean(third.attribution.deviations) < np.mean(first.attribution.deviations)
    # what is named again counts once, and a record that starts anew holds only what is named
    again = postproc.learn(folder / "part.src", [folder / "part2.csv", folder / "part1.csv"], dry_run=True)
    assert [name for name, _ in again.data] == ["part1.csv", "part2.csv"]
    alone = postproc.learn(folder / "part.src", folder / "part2.csv", new_history=True, dry_run=True)
    assert [name for name, _ in alone.data] == ["part2.csv"]


@pytest.mark.slow
def test_a_record_of_something_else_is_refused(shop):
    program, part, record = shop / "part.src", shop / "part1.csv", shop / RECORD
    good = record.read_bytes()
    record.write_bytes(good.replace(b"nothing_missing", b"named"))
    assert "not what was written" in refusals("LRN015", program, part)
    record.write_bytes(b"\0")
    assert "no JSON" in refusals("LRN015", program, part)
    record.write_bytes(good)
    cell = (shop / "cell.yaml").read_text()
    (shop / "cell.yaml").write_text(cell.replace("x: 1350", "x: 1351"))
    assert "cell.yaml has changed" in refusals("LRN015", program, part)
    (shop / "cell.yaml").write_text(cell)
    text = program.read_text()
    program.write_text(text + ";\n")
    assert "another program" in refusals("LRN015", program, part)
    program.write_text(text)
    robot = str(shop / "learned" / "kuka_kr270_learned.yaml")
    assert "count twice" in refusals("LRN015", program, part, robot=robot, new_history=True)
    assert record.read_bytes() == good


@pytest.mark.slow
def test_an_earlier_part_that_is_gone_or_changed_is_no_surprise(shop):
    program, part, record = shop / "part.src", shop / "part1.csv", shop / RECORD
    good = record.read_bytes()
    other = shop / "other.csv"
    lines = part.read_text().splitlines()
    other.write_text("\n".join(lines[:-2]) + "\n")
    moved = shop / "measured" / "part1.csv"
    moved.parent.mkdir()
    part.rename(moved)
    shutil.copy(shop / "cut1.src", moved.parent)
    assert "is not there" in refusals("LRN015", program, other)
    done = postproc.learn(program, moved, dry_run=True)
    assert [name for name, _ in done.data] == ["part1.csv"]
    other.rename(part)
    shutil.rmtree(moved.parent)
    shutil.copy(part, shop / "copy.csv")
    with (shop / "copy.csv").open("a") as stream:
        stream.write("\n")
    assert "not what was learnt from" in refusals("LRN015", program, shop / "copy.csv")
    done = postproc.learn(program, part, dry_run=True)
    assert "LRN016" in {finding.code for finding in done.findings}
    assert done.attribution.layout.sigma.size <= len(lines) - 2
    assert record.read_bytes() == good


@pytest.mark.slow
def test_part_of_what_was_learnt(shop):
    """Half the gain leaves half of the error: the program of before and the one of all are equally far away."""
    places = {}
    whole = shutil.copy(SAMPLE / "part1.csv", shop / "whole.csv")
    for gain in (0.0, 0.5, 1.0):
        learned = postproc.learn(shop / "part.src", whole, gain=gain, new_history=True, dry_run=True)
        places[gain] = learned.promise
    found = places[1.0].before
    assert places[0.0].after == pytest.approx(found, rel=0.25)
    assert places[0.5].after == pytest.approx(0.5 * found, rel=0.25)
    assert places[1.0].after < 0.25 * found
    assert not places[0.0].better


def count(file: Path, number: int) -> None:
    """Adds a byte to a file that is watched by nobody."""
    handle = os.open(file, os.O_CREAT | os.O_WRONLY | os.O_APPEND)
    os.write(handle, b".")
    os.close(handle)


@pytest.mark.slow
def test_a_kill_at_any_moment_loses_nothing(shop):
    """Whatever was asked of the system when the run was killed: the record is that of before or after, the program that
    was there before is still somewhere, and the same command gives the same files."""
    program, record = shop / "part.src", shop / RECORD
    lines = (shop / "part1.csv").read_text().splitlines()
    other = shop / "part2.csv"  # of the same plant: parts that contradict each other are refused, and copies
    rng, begin = np.random.default_rng(1), next(i for i, line in enumerate(lines) if not line.startswith("#"))
    column = lines[begin].split(",").index("DEV")
    rows = [line.split(",") for line in lines[begin + 1 :]]
    for row in rows:
        row[column] = f"{float(row[column]) + rng.normal(0.0, 0.005):.5f}"
    other.write_text("\n".join([*lines[: begin + 1], *(",".join(row) for row in rows), ""]))
    words = ["learn", program, other, "-q"]
    before = record.read_bytes()
    old = (shop / "learned" / "part.src").read_bytes()
    spare = shop.parent / "spare"
    shutil.copytree(shop, spare)
    counted = shop.parent / "count"
    assert Child(
        ["learn", spare / "part.src", spare / "part2.csv", "-q"], spare, lambda n: count(counted, n)
    ).end() in (0, 3)
    requests = counted.stat().st_size
    states = set()
    for back in (110, 70, 40, 24, 10, 4):
        child = Child(words, shop, once(requests - back, lambda: os.kill(os.getpid(), signal.SIGKILL)))
        assert child.end() in (-signal.SIGKILL, 0, 3)
        assert record.read_bytes() == before or b"part2.csv" in record.read_bytes()
        states.add(b"part2.csv" in record.read_bytes())
        assert old in {file.read_bytes() for file in shop.rglob("part.src")}
    child = Child(words, shop)
    assert child.end() in (0, 3), child.said
    assert states == {False, True}
    assert stray(shop) == []
    for name in (RECORD, "learned/part.src", "learned/part.force_factors.yaml"):
        assert (shop / name).read_bytes() == (spare / name).read_bytes()
