"""What a run's exit code is worth where nobody can read its words: closed, full and broken standard streams."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from conftest import LINES
from faults import stray, there

COMPENSATE = [sys.executable, "-m", "postproc"]
WRITTEN = {"part.src", "part.corrections.csv", "part.diff", "part.report.html", "part.report.json"}


def shell(folder: Path, words: str, redirected: str) -> tuple[int, str]:
    """``compensate WORDS`` with what a shell makes of its streams; standard error goes to a file."""
    line = f'"{sys.executable}" -m postproc {words} {redirected}'
    environment = {
        **os.environ,
        "PYTHONPATH": os.pathsep.join([str(Path(__file__).parent.parent), *sys.path]),
    }
    done = subprocess.run(["bash", "-c", line], cwd=folder, env=environment, capture_output=True, check=False)
    return done.returncode, done.stderr.decode()


@pytest.mark.sample(1)
@pytest.mark.parametrize("words", ["part.src --force", "part.src --force --json -", "part.src --force -v"])
@pytest.mark.parametrize(
    "redirected",
    [">/dev/full", ">&-", "<&- >&- 2>&-", ">/dev/full 2>/dev/full", "| true; exit ${PIPESTATUS[0]}"],
    ids=["full", "closed", "all closed", "all full", "reader gone"],
)
def test_files_that_are_written_are_told_by_the_exit_code(job, words, redirected):
    code, said = shell(job.folder, words, redirected)
    assert code == 0, said
    assert {path.name for path in job.output.parent.iterdir()} == WRITTEN
    assert "Traceback" not in said
    assert ("the files are written" in said) == (redirected in (">/dev/full", ">&-"))


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    "redirected", [">/dev/full", ">&-", ">/dev/full 2>&1", "| true; exit ${PIPESTATUS[0]}"]
)
@pytest.mark.parametrize(
    "words",
    [
        "check part.src",
        "robots",
        "schema cell",
        "--help",
        "part.src --force --dry-run",
    ],
)
def test_a_result_that_nobody_gets_is_a_failure(job, words, redirected):
    code, said = shell(job.folder, words, redirected)
    assert code == 1, said
    assert "Traceback" not in said
    assert ("the result is lost" in said) == (redirected in (">/dev/full", ">&-"))
    assert job.nothing_written()


@pytest.mark.slow
def test_a_refusal_stays_one(job):
    job.write([line.replace("X 100.000", "X 99999.000") for line in LINES])
    for redirected in (">/dev/full 2>/dev/full", "<&- >&- 2>&-"):
        assert shell(job.folder, "part.src --force", redirected)[0] == 1
        assert job.nothing_written()
        assert shell(job.folder, "part.src --wrong", redirected)[0] == 2


@pytest.mark.slow
def test_a_quiet_run_needs_no_output(job):
    assert shell(job.folder, "check part.src -q", ">&-")[0] == 0
    assert shell(job.folder, "check part.src -q", ">/dev/full")[0] == 0


@pytest.mark.slow
def test_a_console_that_knows_few_letters(job):
    """cp1252, as of a Windows console, and ASCII: what they do not have is an escape."""
    job.write([LINES[0], "; \u0416\u4e2d\U0001f600", *LINES[1:]][:1] + LINES[1:])
    name = job.folder / "Ж中\U0001f600.src"
    name.write_bytes(job.program.read_bytes())
    for encoding in ("cp1252", "ascii", "cp437"):
        done = subprocess.run(
            [*COMPENSATE, str(name), "--force", "-v"],
            env={**os.environ, "PYTHONIOENCODING": encoding, "PYTHONUTF8": "0"},
            capture_output=True,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        assert b"\\u0416" in done.stdout
        done.stdout.decode(encoding)


@pytest.mark.slow
def test_a_signal_after_the_files_are_written_changes_nothing(job):
    """The run waits for a reader that does not come; the end of its session lets it end as it would."""
    for number in (signal.SIGTERM, signal.SIGHUP, signal.SIGINT):
        reader, writer = os.pipe()
        os.set_blocking(writer, False)
        try:
            while os.write(writer, b" " * 4096):
                pass
        except BlockingIOError:
            os.set_blocking(writer, True)
        process = subprocess.Popen(
            [*COMPENSATE, str(job.program), "--force"], stdout=writer, stderr=subprocess.PIPE
        )
        deadline = time.monotonic() + 60
        while not job.output.exists() and time.monotonic() < deadline:
            time.sleep(0.01)
        time.sleep(1.0)
        assert process.poll() is None, "it did not wait"
        process.send_signal(number)
        _, said = process.communicate(timeout=30)
        os.close(reader)
        os.close(writer)
        assert process.returncode == 0, said
        assert {path.name for path in job.output.parent.iterdir()} == WRITTEN
        assert stray(job.folder) == []
        job.output.unlink()


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_at_any_moment_of_a_process(job, number):
    """From its first moment on: ended by the signal, or with 128 + its number, and without a traceback."""
    codes = set()
    for wait in (0.02, 0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.6, 0.9, 1.3):
        process = subprocess.Popen(
            [*COMPENSATE, str(job.program), "--force", "-q"], stdout=subprocess.PIPE, stderr=subprocess.STDOUT
        )
        time.sleep(wait)
        process.send_signal(number)
        said, _ = process.communicate(timeout=60)
        written = set(there(job.output.parent))
        if b"<frozen" in said:  # Python itself was interrupted while it started
            assert written == set()
            continue
        assert process.returncode in (-number, 128 + number, 0), said
        assert written == (WRITTEN if process.returncode == 0 else set())
        assert b"Traceback" not in said
        codes.add(process.returncode)
        for path in job.output.parent.glob("*"):
            path.unlink()
    assert 128 + number in codes


@pytest.mark.slow
def test_a_terminal_that_goes_away(job):
    """In the midst of the work: the session's end, whole files or none, an exit code that says which."""
    pty = pytest.importorskip("pty")
    codes = set()
    for wait in (0.3, 0.8, 1.2, 1.6, 2.5):
        pid, terminal = pty.fork()
        if pid == 0:
            os.chdir(job.folder)
            os.execv(sys.executable, [*COMPENSATE, "part.src", "--force"])
        time.sleep(wait)
        os.close(terminal)
        code = os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])
        written = set(there(job.output.parent))
        # before Python has started the system itself ends it
        assert code in (-signal.SIGHUP, 128 + signal.SIGHUP, 0, 1)
        assert written == (WRITTEN if code == 0 else set()), (code, written)
        codes.add(code)
        for path in job.output.parent.glob("*"):
            path.unlink()
    assert codes


@pytest.mark.slow
def test_from_standard_input_to_standard_output(job):
    """The bytes are those of the file, and nothing else is printed or written."""
    command = [sys.executable, "-m", "postproc"]
    subprocess.run([*command, "part.src", "--force", "-q"], cwd=job.folder, check=True)
    wanted = job.output.read_bytes()
    shutil.rmtree(job.folder / "compensated")
    text = job.program.read_bytes()
    job.program.unlink()
    before = sorted(job.folder.rglob("*"))
    words = [*command, "-", "-o", "-", "--stdin-name", "part.src", "--force"]
    done = subprocess.run(words, cwd=job.folder, input=text, capture_output=True)
    assert done.returncode == 0
    assert done.stdout == wanted
    assert b"error before" in done.stderr
    assert sorted(job.folder.rglob("*")) == before
    refused = subprocess.run(words, cwd=job.folder, input=b"DEF part()\nEND\n", capture_output=True)
    assert (refused.returncode, refused.stdout) == (1, b"")
    with open("/dev/full", "wb") as full:
        lost = subprocess.run(words, cwd=job.folder, input=text, stdout=full, stderr=subprocess.PIPE)
    assert lost.returncode == 1
    assert b"cannot be written" in lost.stderr
