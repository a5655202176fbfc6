"""A run that is told to end: by Ctrl-C, by the end of the session, by a terminal that goes away; and one that fails of
itself.  An exit code, a sentence, all old files or all new ones."""

from __future__ import annotations

import os
import random
import shutil
import signal
import subprocess
import sys
import time

import pytest
from faults import KILLS, Child, once, seconds, stray, there
from test_batch_killed import a_long_program

from postproc.cli.signals import SIGNALS, Stopped, ended_in_words

OLD, NEW = "--force=0,50,0", "--force=0,150,0"


@pytest.fixture
def shop(job):
    """A program of some blocks of rows, its old and its new results."""
    a_long_program(job.program, 0, 400)
    folder, made = job.output.parent, []
    for force in (OLD, NEW):
        assert Child([job.program, force], job.folder).end() in (0, 3)
        made.append(there(folder))
    return job, folder, made[0], made[1]


def begun_anew(folder, files) -> None:
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    for name, content in files.items():
        (folder / name).write_bytes(content)


def tidy(job) -> None:
    """Nothing is left half-written; old files and a lock that a signal kept from being taken away are gone after the
    next run."""
    left = stray(job.folder)
    assert all(name.endswith((".tmp.old", ".lock")) for name in left), left
    if left:
        assert Child([job.program, NEW, "-q"], job.folder).end() in (0, 3)
        assert stray(job.folder) == []


@pytest.mark.slow
@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM", "SIGHUP"])
@pytest.mark.parametrize("twice", [False, True], ids=["once", "twice"])
def test_ended_at_random_moments(shop, name, twice):
    job, folder, old, new = shop
    number, moments, ends = getattr(signal, name), random.Random(name + str(twice)), set()
    lasts = seconds(lambda: Child([job.program, NEW], job.folder).end())
    for _ in range(KILLS):
        begun_anew(folder, old)
        ready, begun = os.pipe()
        child = Child(
            [job.program, NEW, "-q"], job.folder, once(1, lambda begun=begun: os.write(begun, b"!"))
        )
        os.read(ready, 1)  # it is at work: from here on signals are its own business
        time.sleep(moments.uniform(0.0, lasts))
        for _ in range(1 + twice):
            os.kill(child.pid, number)
            time.sleep(moments.uniform(0.0, 0.004))
        ended = child.end()
        ends.add(ended)
        assert ended in (128 + number, 0, 3), child.said
        assert "Traceback" not in child.said
        assert ("interrupted" in child.said) == (ended == 128 + number)
        assert there(folder) in (old, new)
        assert ended != 0 or there(folder) == new
        tidy(job)
        os.close(ready)
        os.close(begun)
    assert 128 + number in ends


@pytest.mark.slow
def test_a_second_signal_does_not_disturb_the_way_out(shop):
    """Told to end at each request to the system, and told again at each one that it makes on its way out."""
    job, folder, old, new = shop
    for at in range(20, 70, 7 if KILLS == 5 else 1):
        begun_anew(folder, old)

        def told(number: int, at: int = at) -> None:
            if number >= at:
                os.kill(os.getpid(), signal.SIGINT)

        child = Child([job.program, NEW, "-q"], folder, told)
        ended = child.end()
        assert ended in (130, 0, 3), child.said
        assert "Traceback" not in child.said
        assert there(folder) in (old, new)
        tidy(job)


@pytest.mark.slow
def test_a_batch_is_ended_by_the_end_of_the_session(job):
    for number in range(30):
        a_long_program(job.folder / f"p{number}.src", 0, 100)
    job.program.unlink()
    words = [sys.executable, "-m", "postproc", "batch", str(job.folder), "--force", "-j", "2"]
    process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    deadline = time.monotonic() + 300
    while not list(job.output.parent.glob("*.src")) and time.monotonic() < deadline:
        time.sleep(0.02)
    process.terminate()
    out, err = process.communicate(timeout=300)
    assert (process.returncode, out) == (143, b"")
    assert b"continues from there" in err
    assert b"Traceback" not in err
    assert stray(job.folder) == []


def test_what_is_ignored_stays_ignored():
    """``nohup`` ignores the end of the terminal for whatever it begins."""
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with ended_in_words():
            assert signal.getsignal(signal.SIGHUP) == signal.SIG_IGN
    finally:
        signal.signal(signal.SIGHUP, before)


def test_signals_are_as_before_behind_a_run():
    before = [signal.getsignal(number) for number in SIGNALS]
    with pytest.raises(Stopped) as end, ended_in_words():
        signal.raise_signal(signal.SIGTERM)
    assert end.value.code == 143
    assert [signal.getsignal(number) for number in SIGNALS] == before


def test_the_signal_that_ends_a_process_is_the_last_one_it_hears():
    before = {number: signal.getsignal(number) for number in SIGNALS}
    try:
        with pytest.raises(Stopped), ended_in_words(and_exits=True):
            signal.raise_signal(signal.SIGINT)
        for number in SIGNALS:
            signal.raise_signal(number)
        with ended_in_words(and_exits=True):
            pass
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def test_a_signal_that_arrives_as_another_exception(capsys):
    """Python before 3.12 makes a RuntimeError of what is raised while a class is made, that is, in an import."""

    class Interrupted:
        def __set_name__(self, owner, name):
            try:
                signal.raise_signal(signal.SIGTERM)
            except Stopped as end:
                raise RuntimeError("Error calling __set_name__") from end

    with pytest.raises(Stopped) as end, ended_in_words():
        type("Imported", (), {"member": Interrupted()})
    said = capsys.readouterr().err
    assert end.value.code == 143
    assert said == "interrupted\n"


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (ZeroDivisionError("x"), "a defect of compensate"),
        (RuntimeError("x"), "a defect of compensate"),
        (MemoryError(), "the memory of this machine"),
        (RuntimeError("can't start new thread"), "the memory of this machine"),
    ],
)
def test_a_defect_is_told_as_one(capsys, error, words):
    with pytest.raises(SystemExit) as end, ended_in_words():
        raise error
    said = capsys.readouterr().err
    assert end.value.code == 1
    assert words in said
    assert ("ZeroDivisionError" in said) == isinstance(error, ZeroDivisionError)


@pytest.mark.slow
def test_not_enough_memory(shop):
    """The system gives no more: a sentence, and all files as they were."""
    import resource

    job, folder, old, _ = shop
    begun_anew(folder, old)
    a_long_program(job.program, 0, 20_000)

    def bounds() -> None:
        with open("/proc/self/statm") as stream:
            pages = int(stream.read().split()[0])
        resource.setrlimit(resource.RLIMIT_AS, (pages * resource.getpagesize() + 20_000_000,) * 2)

    child = Child([job.program, NEW, "-q"], job.folder, once(1, bounds))
    assert child.end() == 1, child.said
    assert "memory" in child.said
    assert "Traceback" not in child.said
    assert there(folder) == old
    assert stray(job.folder) == []
