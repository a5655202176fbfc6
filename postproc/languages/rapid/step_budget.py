"""How many statements of a module are followed."""

from __future__ import annotations

from postproc.languages.rapid.declared_data import walk
from postproc.languages.rapid.syntax_tree import Module, PlainMotions

MOST_STEPS = 4_000_000
"""Statements that are followed; each statement of a file counts for four more."""
MOST_IN_RUN = 10_000
"""Statements of a run of the program, with eight more for each of the file, after which calls are not followed any
more: what routines do that call others several times each grows with a power of their number."""


MOST_CALLS = 10_000
"""Calls that are followed in a run of the program."""


class TooLong(Exception):
    """The flow is too long to follow."""


class StepBudget:
    """Of the statements of a module."""

    def __init__(self, module: Module) -> None:
        statements = sum(_length(one) for routine in module.routines for one in walk(routine.body))
        self._left = MOST_STEPS + 4 * statements
        self._in_run = MOST_IN_RUN + 8 * statements
        self._last_called = 0  # at as many that are left calls are not followed any more
        self._calls = MOST_CALLS

    def start_run(self) -> None:
        """Starts a run of the program."""
        self._last_called = self._left - self._in_run
        self._calls = MOST_CALLS

    def take_call(self) -> bool:
        """Whether a call is still followed in this run."""
        self._calls -= 1
        return self._calls >= 0 and self._left >= self._last_called

    def take(self, statement: object) -> None:
        """Follows a statement.  Raises TooLong."""
        self._left -= _length(statement)
        if self._left < 0:
            raise TooLong


def _length(statement: object) -> int:
    """The statements that a statement counts for."""
    return len(statement) if isinstance(statement, PlainMotions) else 1
