"""How a run ends that is not let to its end: by a signal, by its surroundings, or by a defect of this program."""

from __future__ import annotations

import contextlib
import signal
import sys
import traceback
from collections.abc import Iterator
from types import FrameType
from typing import NoReturn

from postproc.base.system import refusal_of_the_system
from postproc.cli.streams import GuardedStream
from postproc.output.publications import publications

SIGNALS = tuple(
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK") if hasattr(signal, name)
)
"""Ctrl-C; the end of the session or of the machine; the end of the terminal; Ctrl-Break on Windows."""


class Stopped(SystemExit):
    """A signal ends the run; ``code``: 128 + its number, as a shell expects; ``words``: what is reported of it."""

    words = "interrupted"


@contextlib.contextmanager
def ended_in_words(and_exits: bool = False) -> Iterator[None]:
    """Signals become ``Stopped``, so that a run takes its half-written files away; further ones do not disturb it on
    its way out.  One that comes when the files are written lets the run end as it would, without its words.  What the
    system refuses (files, memory) is one line, a defect is reported as one.

    Raises SystemExit: 1 after a defect or a refusal of the system, Stopped with 128 and the number of the signal after
    one.  ``and_exits``: the process ends with the run, so that a signal that stopped it is the last one that it hears.
    """
    stopped: Stopped | None = None
    before_run = publications()

    def stop(number: int, _frame: FrameType | None) -> None:
        nonlocal stopped
        if publications() > before_run:
            for stream in (sys.stdout, sys.stderr):
                if isinstance(stream, GuardedStream):
                    stream.abandon()
        elif stopped is None:
            stopped = Stopped(128 + number)
            raise stopped

    # what whoever started this run ignores (nohup) stays ignored
    heard = [number for number in SIGNALS if signal.getsignal(number) != signal.SIG_IGN]
    before = {number: signal.signal(number, stop) for number in heard}
    try:
        yield
    except Stopped as end:
        _print_error(end.words)
        raise
    except Exception as error:
        if stopped is not None:  # what Python made of it on its way, RuntimeError out of __set_name__
            _print_error(stopped.words)
            raise stopped from None
        written = "files are written already" if publications() > before_run else "nothing is written"
        why = refusal_of_the_system(error)
        if why:
            _print_error(f"{why}: {written}")
            raise SystemExit(1) from None
        _report_defect()
    finally:
        # what remains is the end of the process, whose exit code is known
        decided = and_exits and (stopped is not None or publications() > before_run)
        for number, handler in before.items():
            signal.signal(number, signal.SIG_IGN if decided else handler)


def _report_defect() -> NoReturn:
    _print_error(traceback.format_exc())
    _print_error("this is a defect of compensate: please report the lines above together with the input")
    raise SystemExit(1) from None


def _print_error(words: str) -> None:
    with contextlib.suppress(OSError):  # the terminal may be gone
        print(words, file=sys.stderr, flush=True)
