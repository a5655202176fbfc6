"""Programs larger than memory: arrays in temporary files, blocks of any size and any number of threads give the same
bytes; nothing of the files stays, and a signal is heard."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from functools import wraps
from pathlib import Path

import numpy as np
import pytest
from benchmarks.parts import MAKERS
from benchmarks.parts import program as made
from numpy._core.multiarray import get_handler_name

from postproc import api
from postproc.base import batches, geometry, paged_memory
from postproc.base.array_storage import ArrayStore, GrowingColumns
from postproc.base.findings import Refusal
from postproc.base.sized_bytes import SizedBytes
from postproc.languages.core import plan_rows
from postproc.languages.krl import dependent_targets, inserting, motion_table
from postproc.languages.rapid import module_toolpath

SAMPLES = Path(__file__).parents[1] / "samples"
PROGRAMS = (
    "irb6700_pocket/pocket.mod",
    "m900ib_pocket/pocket.ls",
    "kr270_pocket/pocket.ngc",
)
LANGUAGE_BLOCKS = plan_rows, dependent_targets, inserting, motion_table, module_toolpath
"""Modules that work on ``BLOCK`` motions at a time."""
ALONE = "POSTPROC_TEST_ALONE"
FILES = "postproc_files"
"""numpy's name of the handler."""


@pytest.fixture
def small(monkeypatch, tmp_path_factory):
    """Every program is a large one, every array of some rows too, and their pages are given back all the time."""
    monkeypatch.setattr(paged_memory, "PROGRAM", 0)
    monkeypatch.setattr(paged_memory, "LARGE", 1 << 16)
    monkeypatch.setattr(paged_memory, "RESIDENT", 0)
    monkeypatch.setattr(paged_memory, "WAITING", 8 << 20)
    folder = tmp_path_factory.mktemp("room")
    monkeypatch.setattr(paged_memory, "temporary_folder", lambda room, program: str(folder))
    yield folder
    monkeypatch.undo()
    with paged_memory.large_arrays_in_files(Path(__file__)):  # the C library keeps what it was told last
        pass


def results(program: Path, output: Path) -> dict[str, bytes]:
    """All files of a run, without the paths in them."""
    shutil.rmtree(output, ignore_errors=True)
    api.compensate(program, force=True, output=output / program.name)
    folder = str(output).encode()
    return {path.name: path.read_bytes().replace(folder, b"") for path in sorted(output.iterdir())}


def set_blocks(monkeypatch, rows: int, threads: int) -> None:
    monkeypatch.setattr(batches, "ROWS", rows)
    monkeypatch.setattr(batches, "SPAN", rows + 1)
    monkeypatch.setenv(batches.THREADS, str(threads))


@pytest.mark.slow
def test_files_blocks_and_threads_change_no_byte(tmp_path, monkeypatch, request):
    program = SAMPLES / "kr270_taught" / "taught.src"
    expected = results(program, tmp_path / "one" / "of")
    room = request.getfixturevalue("small")
    for rows, threads in ((1, 2), (7, 1), (4096, 4)):
        set_blocks(monkeypatch, rows, threads)
        assert results(program, tmp_path / "one" / "of") == expected
    assert os.listdir(room) == []


@pytest.mark.slow
@pytest.mark.parametrize("name", PROGRAMS)
def test_samples_have_the_same_bytes(name, tmp_path, monkeypatch, request):
    shutil.copytree(SAMPLES / Path(name).parent, tmp_path / "sample")
    program = tmp_path / "sample" / Path(name).name
    expected = results(program, tmp_path / "one")
    request.getfixturevalue("small")
    for rows, threads in ((7, 2), (4096, 4)):
        set_blocks(monkeypatch, rows, threads)
        assert results(program, tmp_path / "one") == expected


@pytest.mark.slow
@pytest.mark.parametrize("language", MAKERS)
def test_generated_programs_have_the_same_bytes(language, tmp_path, monkeypatch, request):
    """As they are in memory on one thread; and ``verify`` finds the same figures in them."""
    program = made(tmp_path / "part", language, 12)
    output = tmp_path / "one"
    set_blocks(monkeypatch, batches.ROWS, 1)
    expected = results(program, output)
    verified = api.verify(program, output / program.name, force=True).to_dict()
    request.getfixturevalue("small")
    for rows, threads in ((1, 4), (7, 2), (4096, 1)):
        set_blocks(monkeypatch, rows, threads)
        for module in LANGUAGE_BLOCKS:
            monkeypatch.setattr(module, "BLOCK", rows)
        monkeypatch.setattr(geometry, "STORED", rows)
        assert results(program, output) == expected
        assert api.verify(program, output / program.name, force=True).to_dict() == verified


@pytest.mark.parametrize("command", ["verify", "learn", "place", "assign", "engage"])
def test_every_command_that_reads_a_program_has_room_for_a_large_one(command, monkeypatch):
    """It is asked for with the size of all programs before the first of them is read."""
    asked = []

    class Asked(Exception):
        pass

    def ask(room: int, program: Path) -> None:
        asked.append((room, program))
        raise Asked

    monkeypatch.setattr(paged_memory, "PROGRAM", 0)
    monkeypatch.setattr(paged_memory, "temporary_folder", ask)
    program = SAMPLES / "kr270_taught" / "taught.src"
    calls = {
        "verify": lambda: api.verify(program, program, force=True),
        "learn": lambda: api.learn(program, [SAMPLES / "no_such.csv"], force=True),
        "place": lambda: api.place([program, program], force=True),
        "assign": lambda: api.assign([program, program], places={}, force=True),
        "engage": lambda: api.engage(program),
    }
    with pytest.raises(Asked):
        calls[command]()
    several = command in ("verify", "place", "assign")
    assert asked == [(paged_memory.ROOM * program.stat().st_size * (1 + several), program)]


def alone(test: Callable[..., None]) -> Callable[..., None]:
    """Runs ``test`` in a process of its own: in one that has freed much the C library finds room without new pages."""

    @wraps(test)
    def run(**fixtures: object) -> None:
        if ALONE in os.environ:
            test(**fixtures)
            return
        command = [sys.executable, "-m", "pytest", "-q", "-n", "0", "-p", "no:cacheprovider"]
        command += ["-m", "slow or not slow"]
        done = subprocess.run(
            [*command, f"{__file__}::{test.__name__}"],
            env=os.environ | {ALONE: "1"},
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stdout

    return run


def pages_at(address: int) -> str:
    """The line by which the system lists the second page of an array."""
    with open("/proc/self/maps") as stream:
        for line in stream:
            start, _, stop = line.split()[0].partition("-")
            if int(start, 16) <= address + 4096 < int(stop, 16):
                return line
    raise AssertionError("this memory is not mapped")


@alone
def test_large_arrays_lie_in_files_and_outlive_the_run(small):
    with paged_memory.large_arrays_in_files(Path(__file__)):
        large, zeros = np.arange(100_000), np.zeros(100_000)
        storage = paged_memory.current_storage.get()
        assert get_handler_name(large) == get_handler_name(zeros) == FILES
        assert "deleted" in pages_at(large.ctypes.data)
        assert "deleted" in pages_at(zeros.ctypes.data)
        assert len(storage.files) == 2
        assert get_handler_name(np.arange(10)) == FILES
        assert len(storage.files) == 2
        more = large.copy()
        more.resize(300_000, refcheck=False)
        assert "deleted" in pages_at(more.ctypes.data)
        used = np.full(100_000, 7.0)
        count = len(storage.files)
        del used
        again = np.zeros(100_000)
        assert len(storage.files) == count, "the file of an array that is gone was not used again"
        paged_memory.release_pages()
        assert not again.any(), "the place of an array that is gone has its old content"
        inside = paged_memory.with_small_arrays(lambda _: np.arange(100_000), None)
    assert get_handler_name(inside) == get_handler_name(np.arange(3)) == "default_allocator"
    assert np.array_equal(large, np.arange(100_000))
    assert np.array_equal(more[:100_000], large)
    assert not more[100_000:].any()
    assert os.listdir(small) == []


@pytest.mark.slow
@alone
def test_pages_are_given_back_and_keep_what_they_hold(small, monkeypatch):
    def resident() -> int:
        return int(Path("/proc/self/statm").read_text().split()[2])

    monkeypatch.setattr(paged_memory, "RESIDENT", 1 << 40)
    with paged_memory.large_arrays_in_files(Path(__file__)):
        array = np.arange(8_000_000)
        gone = np.arange(8_000_000)
        del gone
        before = resident()
        monkeypatch.setattr(paged_memory, "RESIDENT", 0)
        for _ in range(100):  # what is just being written stays a little longer
            paged_memory.release_pages()
            if resident() < before - 10_000:
                break
            time.sleep(0.05)
        else:
            pytest.fail("the pages stay resident")
        assert array.sum() == 8_000_000 * 7_999_999 // 2


@pytest.mark.slow
@alone
def test_rows_here_and_there_do_not_bring_the_whole_array(small, monkeypatch):
    """Some bytes of each page are read; with all of them at once the array would be resident."""
    monkeypatch.setattr(batches, "SPAN", 1 << 19)
    seen, release = [], paged_memory.release_pages

    def look() -> None:
        with open("/proc/self/statm") as stream:
            seen.append(int(stream.read().split()[2]) * 4096)
        release()

    monkeypatch.setattr(batches, "release_pages", look)
    monkeypatch.setattr(paged_memory, "EVERY", 60.0)  # nobody else gives pages back
    with paged_memory.large_arrays_in_files(Path(__file__)):
        values = np.arange(8 << 20)
        rows = np.arange(0, len(values), 256)
        release()
        with open("/proc/self/statm") as stream:
            before = int(stream.read().split()[2]) * 4096
        assert np.array_equal(batches.select_rows(values, rows), rows)
        assert len(seen) == 16
        assert max(seen) < before + 3 * values.nbytes // 16
        seen.clear()
        values[rows].sum()
        look()
        assert seen[0] > before + values.nbytes // 2  # this is what is measured


@alone
def test_giving_pages_back_touches_no_other_memory(small):
    """Arrays end at any moment, and other memory comes to where they were, while pages are given back all the time."""
    done = threading.Event()
    rng = np.random.default_rng(3)
    with paged_memory.large_arrays_in_files(Path(__file__)):
        storage = paged_memory.current_storage.get()

        def give_back() -> None:
            while not done.is_set():
                storage.release()

        threads = [threading.Thread(target=give_back) for _ in range(3)]
        for thread in threads:
            thread.start()
        kept: dict[int, tuple[np.ndarray, int]] = {}
        try:
            for step in range(600):
                size = int(rng.integers(20_000, 400_000))
                if rng.random() < 0.5:
                    array = np.full(size, step)
                elif rng.random() < 0.5:
                    array = paged_memory.with_small_arrays(lambda size: np.full(size, step), size)  # noqa: B023
                else:
                    array = np.zeros(size, int)
                    assert not array.any()
                    array += step
                kept[int(rng.integers(20))] = array, step
                for other, number in kept.values():
                    assert (other[:: 1 + step % 97] == number).all()
        finally:
            done.set()
            for thread in threads:
                thread.join()
        assert len(storage.files) <= 21
    for other, number in kept.values():
        assert (other == number).all()


@alone
def test_an_array_in_a_file_becomes_smaller_and_larger(small):
    """In the run and after it; the C library knows of one page of it alone, and then again of all."""
    with paged_memory.large_arrays_in_files(Path(__file__)):
        array = np.arange(300_000)
        for size in (200_000, 5_000, 400_000, 100_000):
            array.resize(size, refcheck=False)
            known = min(size, 5_000) if size >= 100_000 and size != 200_000 else size
            assert np.array_equal(array[:known], np.arange(known))
        array = np.arange(300_000)
        count = len(paged_memory.current_storage.get().files)
        assert count
    for size in (250_000, 500_000, 1_000):
        array.resize(size, refcheck=False)
        assert np.array_equal(array[: min(size, 250_000)], np.arange(min(size, 250_000)))
    del array


def failing(at: int) -> Iterator[float]:
    yield from [1.0] * at
    raise ValueError("the last one")


@pytest.mark.parametrize(
    ("work", "error"),
    [
        (lambda: np.array([1.0] * 100_000 + ["x"], dtype=object).astype(float), ValueError),
        (lambda: np.fromiter(failing(100_000), dtype=float), ValueError),
        (lambda: np.frompyfunc(lambda x: 1 // (99_999 - x), 1, 1)(np.arange(100_000)), ZeroDivisionError),
        (lambda: (np.arange(100_000) + 1, next(failing(0))), ValueError),
    ],
)
def test_an_error_is_heard_while_an_array_goes_back(work, error, small):
    """Arrays end while exceptions are on their way: no Python function may be called then."""
    with paged_memory.large_arrays_in_files(Path(__file__)), pytest.raises(error):
        work()


@pytest.mark.slow
@alone
def test_bytes_lie_in_a_file_before_they_are_written(small):
    parts = [bytes([k % 251]) * (k + 1) for k in range(2000)]
    with paged_memory.large_arrays_in_files(Path(__file__)):
        text = SizedBytes(sum(map(len, parts)))
        text.write_all(parts)
        written = text.done()
        assert "deleted" in pages_at(id(written))
        paged_memory.release_pages()
        assert written == b"".join(parts)
    assert written == b"".join(parts)
    assert hash(written) == hash(b"".join(parts))


@pytest.mark.parametrize("size", [0, 1, 3, 4, 7])
def test_bytes_of_another_number_than_was_stated(size):
    text = SizedBytes(size)
    text.write_all([b"ab", b"", b"cd"])
    assert text.done() == b"abcd"


def test_a_small_program_stays_in_memory(tmp_path):
    program = tmp_path / "part.src"
    program.write_bytes(b"END\n")
    with paged_memory.large_arrays_in_files(program):
        assert get_handler_name(np.arange(10_000_000)) == "default_allocator"


def test_a_disk_without_room_leaves_the_array_in_memory(small, monkeypatch):
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "posix_fallocate", full)
    with paged_memory.large_arrays_in_files(Path(__file__)):
        array = np.arange(100_000)
        assert not paged_memory.current_storage.get().files
    assert array.sum() == 99_999 * 50_000


@alone
def test_files_that_wait_make_room_on_a_full_disk(small, monkeypatch):
    real, sizes = os.posix_fallocate, []

    def full(number: int, start: int, length: int) -> None:
        waiting = sum(file.length for file in storage.waiting)
        sizes.append(waiting)
        if waiting:
            raise OSError(28, "No space left on device")
        real(number, start, length)

    with paged_memory.large_arrays_in_files(Path(__file__)):
        storage = paged_memory.current_storage.get()
        for _ in range(3):
            np.arange(100_000)
        assert len(storage.files) == 1, "a file serves one array after another"
        monkeypatch.setattr(os, "posix_fallocate", full)
        array = np.arange(10_000_000)
        assert "deleted" in pages_at(array.ctypes.data)
        assert sizes == [sizes[0], 0]
        assert sizes[0] > 0
    assert array[-1] == 9_999_999


def test_no_room_anywhere_is_refused_before_anything_is_computed(tmp_path, monkeypatch):
    monkeypatch.setattr(paged_memory, "PROGRAM", 0)
    monkeypatch.setattr(paged_memory, "ROOM", 1 << 60)
    with (
        pytest.raises(Refusal) as refusal,
        paged_memory.large_arrays_in_files(Path(__file__)),
    ):
        pytest.fail("the run started")
    assert [finding.code for finding in refusal.value.findings] == ["FIL013"]


def test_a_signal_while_memory_is_asked_for_is_heard(small, monkeypatch):
    """An exception out of what numpy calls would be printed and forgotten."""
    real, done = paged_memory.PagedStorage.take_over, []

    def interrupted(storage, *arguments):
        if not done:
            done.append(1)
            signal.raise_signal(signal.SIGINT)
        return real(storage, *arguments)

    monkeypatch.setattr(paged_memory.PagedStorage, "take_over", interrupted)
    before = signal.getsignal(signal.SIGINT)

    def run() -> None:
        with paged_memory.large_arrays_in_files(Path(__file__)):
            array = np.arange(100_000)
            del array
            time.sleep(2.0)

    with pytest.raises(KeyboardInterrupt):
        run()
    assert done
    assert signal.getsignal(signal.SIGINT) is before


KILLED = """
import os, signal, sys
from pathlib import Path
import numpy as np
from postproc.base import paged_memory
paged_memory.PROGRAM = 0
paged_memory._folder = lambda room, program: sys.argv[1]
with paged_memory.large_arrays_in_files(Path(sys.argv[1])):
    array = np.ones(4_000_000)
    assert paged_memory.current_storage.get().files
    os.kill(os.getpid(), signal.SIGKILL)
"""


def test_nothing_of_the_files_stays_when_the_process_is_killed(tmp_path):
    with tempfile.TemporaryDirectory(dir=tmp_path) as folder:
        done = subprocess.run([sys.executable, "-c", KILLED, folder], check=False)
        assert done.returncode == -signal.SIGKILL
        assert os.listdir(folder) == []


def test_growing_columns_that_are_large(monkeypatch):
    monkeypatch.setattr(ArrayStore, "SIZE", 1000)
    columns = GrowingColumns(np.int32, np.float64)
    for start in range(0, 5000, 70):
        part = np.arange(start, min(start + 70, 5000))
        columns.add(part, part / 4)
    whole = np.arange(5000)
    one, other = columns.done()
    assert one.dtype == np.int32
    assert np.array_equal(one, whole)
    assert np.array_equal(other, whole / 4)
