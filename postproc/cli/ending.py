"""How a run ends that is not let to its end: by a signal, or by a defect of this program."""

from __future__ import annotations

import contextlib
import signal
import sys
import traceback
from collections.abc import Iterator
from types import FrameType

SIGNALS = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))
"""Ctrl-C; the end of the session or of the machine; the end of the terminal."""


class Stopped(SystemExit):
    """A signal ends the run; ``code``: 128 + its number, as a shell expects; ``words``: what is said of it."""

    words = "interrupted"


@contextlib.contextmanager
def ended_in_words(and_exits: bool = False) -> Iterator[None]:
    """Signals become ``Stopped``, so that a run takes its half-written files away; further ones do not disturb it on
    its way out.  A defect is told as one, with exit code 1.  ``and_exits``: the process ends with the run, so that a
    signal that stopped it is the last one that it hears."""
    stopped = False

    def stop(number: int, _frame: FrameType | None) -> None:
        nonlocal stopped
        if not stopped:
            stopped = True
            raise Stopped(128 + number)

    # what whoever began this run ignores (nohup) stays ignored
    heard = [number for number in SIGNALS if signal.getsignal(number) != signal.SIG_IGN]
    before = {number: signal.signal(number, stop) for number in heard}
    try:
        yield
    except Stopped as end:
        _say(end.words)
        raise
    except MemoryError:
        _say("this machine has not the memory for this run: nothing was written")
        raise SystemExit(1) from None
    except Exception:
        _say(traceback.format_exc())
        _say("this is a defect of compensate: please report the lines above, with the input that leads there")
        raise SystemExit(1) from None
    finally:
        for number, handler in before.items() if not (stopped and and_exits) else ():
            signal.signal(number, handler)


def _say(words: str) -> None:
    with contextlib.suppress(OSError):  # the terminal may be gone
        print(words, file=sys.stderr, flush=True)
