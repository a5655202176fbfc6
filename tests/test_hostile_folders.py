"""Folders of results that are not what they seem: links that lead elsewhere, and forged records of what was done."""

from __future__ import annotations

import json
import os

import pytest
from batches import four_programs
from faults import there


@pytest.fixture
def shop(tmp_path):
    """A folder of four programs, and one outside of it that holds something."""
    outside = tmp_path / "outside"
    outside.mkdir()
    (outside / "p0.src").write_text("precious")
    folder = four_programs(tmp_path / "shop")
    (folder / "sub").mkdir()
    (folder / "sub" / "deep.src").write_bytes(
        (folder / "p0.src").read_bytes().replace(b"DEF p0", b"DEF deep")
    )
    return folder, outside


def untouched(outside) -> bool:
    return there(outside) == {"p0.src": b"precious"} and [p.name for p in outside.iterdir()] == ["p0.src"]


def test_results_of_a_program_do_not_follow_a_folder(compensate, shop):
    folder, outside = shop
    (folder / "compensated").symlink_to(outside)
    done = compensate(folder / "p0.src", "--force")
    assert done.code == 1
    assert untouched(outside)


@pytest.mark.slow
def test_results_of_a_batch_do_not_follow_a_folder(compensate, shop):
    folder, outside = shop
    (folder / "compensated").symlink_to(outside)
    jobs = folder / "jobs.yaml"
    jobs.write_text("programs: '*.src'\nforce: true\n")
    for words in ([folder, "--force"], [folder / "p0.src", "--force"], [jobs]):
        done = compensate("batch", *words, "-j", "1")
        assert done.code == 1
        assert "BAT003" in done.err
        assert untouched(outside)
    done = compensate("batch", folder, "--force", "-j", "1", "-o", outside)  # named, it is meant
    assert done.code == 0
    assert (outside / "p3.src").exists()


def test_a_folder_below_the_results(compensate, shop):
    folder, outside = shop
    (folder / "compensated").mkdir()
    (folder / "compensated" / "sub").symlink_to(outside)
    jobs = folder / "jobs.yaml"
    jobs.write_text("programs: ['**/*.src']\nforce: true\n")
    for words in ([folder / "**" / "*.src", "--force"], [jobs]):
        done = compensate("batch", *words, "-j", "1")
        assert (done.code, "BAT003" in done.err) == (1, True)
        assert untouched(outside)


@pytest.mark.slow
@pytest.mark.parametrize("what", ["folder", "lock", "open end"])
def test_locks_and_records_do_not_follow_links(compensate, shop, what):
    folder, outside = shop
    state = folder / "compensated" / ".compensate"
    if what == "folder":
        state.parent.mkdir()
        state.symlink_to(outside)
    else:
        state.mkdir(parents=True)
        (state / "p0.src.lock").symlink_to(outside / ("p0.src" if what == "lock" else "new"))
    done = compensate("batch", folder / "p0.src", "--force", "-j", "1")
    assert done.code == 1
    assert "FIL004" in done.out + done.err
    assert untouched(outside)


@pytest.mark.slow
def test_a_record_that_is_a_link_is_replaced(compensate, shop):
    folder, outside = shop
    state = folder / "compensated" / ".compensate"
    state.mkdir(parents=True)
    (state / "p0.src.json").symlink_to(outside / "p0.src")
    assert compensate("batch", folder / "p0.src", "--force", "-j", "1").code == 0
    assert untouched(outside)
    assert not (state / "p0.src.json").is_symlink()


FORGERIES = {
    "a list": lambda record: [],
    "numbers": lambda record: dict.fromkeys(record, 1),
    "nothing": lambda record: dict.fromkeys(record, None),
    "an endless input": lambda record: {**record, "inputs": {"/dev/zero": "0" * 64}},
    "an endless output": lambda record: {**record, "outputs": {"/dev/zero": "0" * 64}},
    "outputs elsewhere": lambda record: {**record, "outputs": {"/etc/../etc/passwd": "0"}},
    "deep": lambda record: {**record, "around": "[" * 10_000},
}


@pytest.mark.slow
@pytest.mark.parametrize("name", FORGERIES)
def test_a_forged_record_is_no_record(compensate, shop, name):
    """The program is done again, in its time."""
    folder, _ = shop
    words = ("batch", folder / "p0.src", "--force", "-j", "1", "--json", "-")
    assert compensate(*words).code == 0
    made = there(folder / "compensated")
    record = folder / "compensated" / ".compensate" / "p0.src.json"
    record.write_text(json.dumps(FORGERIES[name](json.loads(record.read_text()))))
    (folder / "compensated" / "p0.src").write_text("another")
    done = compensate(*words)
    assert done.code == 0, done.out
    assert [one["state"] for one in done.json["programs"]] == ["done"]
    assert there(folder / "compensated")["p0.src"] == made["p0.src"]


@pytest.mark.slow
@pytest.mark.parametrize("raw", [b"", b"\0", b"{", b"[" * 200_000, b'{"a": NaN}', os.urandom(1000)])
def test_a_spoilt_record_is_no_record(compensate, shop, raw):
    folder, _ = shop
    state = folder / "compensated" / ".compensate"
    state.mkdir(parents=True)
    (state / "p0.src.json").write_bytes(raw)
    done = compensate("batch", folder / "p0.src", "--force", "-j", "1")
    assert done.code == 0, done.out
    assert json.loads((state / "p0.src.json").read_bytes())
