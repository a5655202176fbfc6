"""How a run ends that is not let to its end: by a signal, or by a defect of this program."""

from __future__ import annotations

import contextlib
import signal
import sys
import traceback
from collections.abc import Iterator
from types import FrameType
from typing import NoReturn

SIGNALS = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))
"""Ctrl-C; the end of the session or of the machine; the end of the terminal."""


class Stopped(SystemExit):
    """A signal ends the run; ``code``: 128 + its number, as a shell expects; ``words``: what is reported of it."""

    words = "interrupted"


@contextlib.contextmanager
def ended_in_words(and_exits: bool = False) -> Iterator[None]:
    """Signals become ``Stopped``, so that a run takes its half-written files away; further ones do not disturb it on
    its way out.  A defect is reported as one.  Raises SystemExit: 1 after a defect, Stopped with 128 and the number of
    the signal after one.  ``and_exits``: the process ends with the run, so that a signal that stopped it is the
    last one that it hears."""
    stopped = False

    def stop(number: int, _frame: FrameType | None) -> None:
        nonlocal stopped
        if not stopped:
            stopped = True
            raise Stopped(128 + number)

    # what whoever started this run ignores (nohup) stays ignored
    heard = [number for number in SIGNALS if signal.getsignal(number) != signal.SIG_IGN]
    before = {number: signal.signal(number, stop) for number in heard}
    try:
        yield
    except Stopped as end:
        _print_error(end.words)
        raise
    except (MemoryError, RuntimeError) as error:
        if not isinstance(error, MemoryError) and "can't start new thread" not in str(
            error
        ):  # no room for its stack
            _report_defect()
        _print_error("the memory of this machine is too small for this run: nothing is written")
        raise SystemExit(1) from None
    except Exception:
        _report_defect()
    finally:
        for number, handler in before.items() if not (stopped and and_exits) else ():
            signal.signal(number, handler)


def _report_defect() -> NoReturn:
    _print_error(traceback.format_exc())
    _print_error("this is a defect of compensate: please report the lines above together with the input")
    raise SystemExit(1) from None


def _print_error(words: str) -> None:
    with contextlib.suppress(OSError):  # the terminal may be gone
        print(words, file=sys.stderr, flush=True)
