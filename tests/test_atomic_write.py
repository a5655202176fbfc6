"""All files or none, whole or absent."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
import time

import pytest

from postproc.base.findings import Refusal
from postproc.output.atomic_write import sweep, write_atomically


def names(folder) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_writes_all_and_leaves_no_other_file(tmp_path):
    files = {tmp_path / "new" / "a.src": b"a", tmp_path / "new" / "a.dat": b"b"}
    write_atomically(files, last=tmp_path / "new" / "a.src")
    assert names(tmp_path / "new") == ["a.dat", "a.src"]
    write_atomically({path: content * 2 for path, content in files.items()}, last=tmp_path / "new" / "a.src")
    assert {path.read_bytes() for path in files} == {b"aa", b"bb"}
    assert names(tmp_path / "new") == ["a.dat", "a.src"]


@pytest.mark.parametrize("failing", [1, 2, 3, 4])
def test_a_failing_rename_brings_the_old_files_back(tmp_path, monkeypatch, failing):
    files = {tmp_path / "a.src": b"old src", tmp_path / "a.dat": b"old dat"}
    write_atomically(files)
    real, calls = os.replace, [0]

    def replace(source, target):
        calls[0] += 1
        if calls[0] == failing:
            raise OSError(28, "No space left on device")
        real(source, target)

    monkeypatch.setattr(os, "replace", replace)
    with pytest.raises(Refusal) as refusal:
        write_atomically(dict.fromkeys(files, b"new"), last=tmp_path / "a.src")
    assert refusal.value.findings[0].code == "FIL004"
    assert {path: path.read_bytes() for path in files} == files
    assert names(tmp_path) == ["a.dat", "a.src"]


def test_a_name_that_is_a_folder(tmp_path):
    (tmp_path / "a.src").mkdir()
    with pytest.raises(Refusal):
        write_atomically({tmp_path / "a.dat": b"1", tmp_path / "a.src": b"2"}, last=tmp_path / "a.src")
    assert (tmp_path / "a.src").is_dir()
    assert not (tmp_path / "a.dat").exists()


def test_parts_are_made_while_they_are_written(tmp_path):
    def parts():
        for number in range(3):
            # what was made is not held until all is there
            temporary = [path for path in tmp_path.iterdir() if path.suffix == ".tmp"]
            assert max(path.stat().st_size for path in temporary) >= 100_000 * number
            assert not (tmp_path / "a.csv").exists()
            yield b"%d" % number * 100_000

    write_atomically({tmp_path / "a.csv": parts(), tmp_path / "a.src": b"src"}, last=tmp_path / "a.src")
    assert (tmp_path / "a.csv").read_bytes() == b"".join(b"%d" % number * 100_000 for number in range(3))
    assert names(tmp_path) == ["a.csv", "a.src"]


@pytest.mark.parametrize("error", [ValueError("no"), KeyboardInterrupt()])
def test_parts_that_can_not_be_made_leave_nothing(tmp_path, error):
    (tmp_path / "a.csv").write_bytes(b"old")

    def parts():
        yield b"new"
        raise error

    with pytest.raises(type(error)):
        write_atomically({tmp_path / "a.src": b"src", tmp_path / "a.csv": parts()}, last=tmp_path / "a.src")
    assert names(tmp_path) == ["a.csv"]
    assert (tmp_path / "a.csv").read_bytes() == b"old"


def test_what_a_killed_run_left_is_swept_and_nothing_else(tmp_path):
    left = [tmp_path / f".a.src.abcd1234.tmp{end}" for end in ("", ".old")]
    others = [
        tmp_path / name for name in (".b.src.abcd1234.tmp", ".a.src.tmp", "a.src", ".a.src.abcd1234.tmp2")
    ]
    for path in (*left, *others):
        path.write_bytes(b"x")
    sweep([tmp_path / "a.src", tmp_path / "nowhere" / "a.src"])
    assert names(tmp_path) == sorted(path.name for path in others)


def test_a_file_that_is_being_written_is_not_swept(tmp_path):
    path, begun, goes_on = tmp_path / "a.src", threading.Event(), threading.Event()

    def parts():
        yield b"new"
        begun.set()
        goes_on.wait()
        yield b" and whole"

    writer = threading.Thread(target=write_atomically, args=({path: parts()},))
    writer.start()
    begun.wait()
    sweeper = threading.Thread(target=sweep, args=([path],))
    sweeper.start()
    sweeper.join(0.3)
    waits = sweeper.is_alive()
    goes_on.set()
    writer.join()
    sweeper.join()
    assert waits
    assert path.read_bytes() == b"new and whole"
    assert names(tmp_path) == ["a.src"]


LOOP = """
import sys
from pathlib import Path
from postproc.output.atomic_write import write_atomically
folder = Path(sys.argv[1])
n = 0
while True:
    n += 1
    text = (b"%d" % n) * 20000
    write_atomically({folder / "a.src": text, folder / "a.dat": text}, last=folder / "a.src")
"""


@pytest.mark.sample(3)
@pytest.mark.parametrize("step", range(12))
def test_a_killed_writer_never_leaves_half_a_file(tmp_path, step):
    program, data = tmp_path / "a.src", tmp_path / "a.dat"
    writer = subprocess.Popen([sys.executable, "-c", LOOP, str(tmp_path)])
    try:
        deadline = time.monotonic() + 60
        while not program.exists():
            assert writer.poll() is None, "the writer ended by itself"
            assert time.monotonic() < deadline, "the writer has written nothing"
            time.sleep(0.002)
        time.sleep(0.0013 * step)
        assert writer.poll() is None, "the writer ended by itself"
    finally:
        writer.kill()
        writer.wait()
    texts = [path.read_bytes() for path in (program, data) if path.exists()]
    for text in texts:
        assert text == text[: len(text) // 20000] * 20000
    if program.exists():  # it is taken away first and comes last
        assert texts[0] == texts[1]
