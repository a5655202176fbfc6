"""Names, paths and locks of the systems that this package runs on."""

from __future__ import annotations

import multiprocessing
import ntpath
import os
from pathlib import Path

import pytest

from postproc.base import system
from postproc.base.findings import Refusal
from postproc.base.locks import lock_file
from postproc.base.system import FileSet, refusal_of_the_system, relative_path, windows_name_problem
from postproc.output import atomic_write
from postproc.output.atomic_write import write_atomically


@pytest.mark.parametrize(
    "name",
    [
        "CON",
        "con.src",
        "nul.tar.gz",
        "Aux",
        "COM1.nc",
        "lpt9",
        "COM¹.src",
        "prn .src",
        "a:b.src",
        "a?.src",
        "a.",
        "a ",
    ],
)
def test_names_that_windows_does_not_write_where_they_say(name):
    assert windows_name_problem(Path(name))


@pytest.mark.parametrize(
    "name", ["console.src", "com.src", "com10.src", "nulls", "part.src", ".part.src", "a b.src", "ä.nc"]
)
def test_names_that_windows_writes(name):
    assert windows_name_problem(Path(name)) == ""


def test_a_path_on_another_drive_is_absolute(monkeypatch):
    assert relative_path("/a/b/c", "/a/d") == "../b/c"

    def other_drive(path, start):
        return ntpath.relpath("D:\\b", "C:\\a")

    monkeypatch.setattr(os.path, "relpath", other_drive)
    assert relative_path("/b", "/a") == "/b"


def test_programs_on_several_drives_are_refused_in_words(tmp_path, monkeypatch):
    from postproc.batching.job_file import jobs_of

    def other_drive(paths):
        return ntpath.commonpath(["C:\\a", "D:\\b"])

    (tmp_path / "a.src").write_text("DEF a()\nEND\n")
    monkeypatch.setattr(os.path, "commonpath", other_drive)
    with pytest.raises(Refusal) as refusal:
        jobs_of([str(tmp_path)], {})
    assert "different drives" in refusal.value.findings[0].message


def test_a_name_in_another_case_is_the_same_file_where_the_disk_says_so(tmp_path, monkeypatch):
    read, other = tmp_path / "Panel.src", tmp_path / "PANEL.SRC"
    read.write_text("a")
    files = FileSet([read])
    assert read in files
    assert other not in files  # this disk distinguishes them
    monkeypatch.setattr(os.path, "samefile", lambda one, two: True)
    assert other in files
    assert tmp_path / "panel2.src" not in files


def test_links_lead_to_their_file_and_second_names_do_not(tmp_path):
    read = tmp_path / "a.src"
    read.write_text("a")
    (tmp_path / "link").symlink_to(read)
    os.link(read, tmp_path / "second")
    files = FileSet([read])
    assert tmp_path / "link" in files
    assert tmp_path / "second" not in files


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (MemoryError(), "memory"),
        (RuntimeError("can't start new thread"), "memory"),
        (OSError(12, "Cannot allocate memory"), "memory"),
        (OSError(24, "Too many open files", "x"), "ulimit"),
        (OSError(36, "File name too long", "a" * 300), "aaa...: File name too long"),
        (OSError(2, "No such file or directory", "\x1b[31m"), "?[31m: No such file"),
        (ZeroDivisionError(), ""),
        (ValueError("x"), ""),
    ],
)
def test_what_the_system_refuses_is_told_from_a_defect(error, words):
    said = refusal_of_the_system(error)
    assert words in said
    assert bool(said) == bool(words)
    assert "\n" not in said
    assert len(said) < 200


# ------------------------------------------------------------------------------------------ writing, on Windows


class Open:
    """Renaming files as Windows does while another program has them open, the first ``times`` times."""

    def __init__(self, times: int) -> None:
        self.times, self.real = times, os.replace

    def __call__(self, source, target) -> None:
        if self.times:
            self.times -= 1
            raise PermissionError(13, "The process cannot access the file", str(target))
        self.real(source, target)


@pytest.fixture
def windows(monkeypatch):
    monkeypatch.setattr(system, "WINDOWS", True)
    monkeypatch.setattr(atomic_write, "PATIENCE", (0.001, 0.001, 0.001))
    return monkeypatch


@pytest.mark.parametrize("times", [1, 2, 3])
def test_a_file_that_is_open_for_a_moment_is_waited_for(tmp_path, windows, times):
    (tmp_path / "a.csv").write_bytes(b"old")
    windows.setattr(os, "replace", Open(times))
    write_atomically({tmp_path / "a.csv": b"new"})
    assert (tmp_path / "a.csv").read_bytes() == b"new"
    assert os.listdir(tmp_path) == ["a.csv"]


def test_a_file_that_stays_open_is_told(tmp_path, windows):
    files = {tmp_path / "a.csv": b"old", tmp_path / "a.src": b"old"}
    write_atomically(files)
    windows.setattr(os, "replace", Open(4))
    with pytest.raises(Refusal) as refusal:
        write_atomically(dict.fromkeys(files, b"new"), last=tmp_path / "a.src")
    (finding,) = refusal.value.findings
    assert finding.code == "FIL004"
    assert "open in another program" in finding.message
    assert {path: path.read_bytes() for path in files} == files
    assert sorted(os.listdir(tmp_path)) == ["a.csv", "a.src"]


def test_elsewhere_a_refused_renaming_is_not_repeated(tmp_path, monkeypatch):
    opened = Open(1)
    monkeypatch.setattr(os, "replace", opened)
    with pytest.raises(Refusal):
        write_atomically({tmp_path / "a.csv": b"new"})
    assert opened.times == 0


def test_a_device_is_no_output(tmp_path, windows):
    with pytest.raises(Refusal) as refusal:
        write_atomically({tmp_path / "good.csv": b"1", tmp_path / "nul.csv": b"2"})
    assert "device" in refusal.value.findings[0].message
    assert os.listdir(tmp_path) == []


def test_a_path_that_is_too_long_for_windows_is_told(tmp_path, windows):
    folder = tmp_path / ("a" * 150)
    path = folder / ("b" * 150)

    def full(source, target):
        raise FileNotFoundError(2, "The system cannot find the path specified")

    windows.setattr(os, "replace", full)
    with pytest.raises(Refusal) as refusal:
        write_atomically({path: b"1"})
    assert "259 characters" in refusal.value.findings[0].help


def test_a_name_as_long_as_the_file_system_allows(tmp_path):
    path = tmp_path / ("ä" * 125 + ".src")  # 254 bytes
    write_atomically({path: b"old"})
    write_atomically({path: b"new"})
    assert path.read_bytes() == b"new"
    assert os.listdir(tmp_path) == [path.name]


# ------------------------------------------------------------------------------------------ locks


def _count(folder: str, times: int) -> None:
    counter = Path(folder) / "counter"
    for _ in range(times):
        with lock_file(Path(folder) / "x.lock"):
            counter.write_text(str(int(counter.read_text()) + 1))


@pytest.mark.slow
def test_processes_that_are_spawned_hold_a_lock_one_after_another(tmp_path):
    (tmp_path / "counter").write_text("0")
    spawn = multiprocessing.get_context("spawn")
    processes = [spawn.Process(target=_count, args=(str(tmp_path), 40)) for _ in range(3)]
    for process in processes:
        process.start()
    for process in processes:
        process.join()
    assert [process.exitcode for process in processes] == [0, 0, 0]
    assert (tmp_path / "counter").read_text() == "120"
    assert os.listdir(tmp_path) == ["counter"]


def test_a_lock_that_leads_elsewhere_is_not_followed(tmp_path):
    (tmp_path / "x.lock").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(OSError, match="symbolic"), lock_file(tmp_path / "x.lock"):
        pass
    assert not (tmp_path / "elsewhere").exists()
