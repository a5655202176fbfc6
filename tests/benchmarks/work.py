"""One run of the main job, and the calls of its stages, to be made again one at a time."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

from postproc.workflows import program as workflow
from postproc.workflows.preparation import Request
from tests.benchmarks.parts import program

STAGES = (
    "prepare",
    "correct",
    "divide",
    "planned",
    "write",
    "json_bytes",
    "corrections_csv",
    "unified_diff",
    "page_data",
    "program_page",
)
"""Functions that the job calls by these names."""


@dataclass
class Call:
    """A call as the job made it, and what came back."""

    function: Callable[..., Any]
    args: tuple[Any, ...]
    kwargs: dict[str, Any]
    result: Any

    def again(self) -> Any:
        """What the call returns now; what it makes piece by piece is made whole."""
        made = self.function(*self.args, **self.kwargs)
        return b"".join(made) if isinstance(made, Iterator) else made


@dataclass
class Work:
    """``motions`` of the program under ``path``, and the first call of each stage."""

    path: Path
    motions: int
    calls: dict[str, Call] = field(default_factory=dict)

    def __getitem__(self, stage: str) -> Call:
        return self.calls[stage]

    def noted(self, stage: str, function: Callable[..., Any]) -> Callable[..., Any]:
        """``function``, whose first call is noted."""

        def call(*args: Any, **kwargs: Any) -> Any:
            result = function(*args, **kwargs)
            self.calls.setdefault(stage, Call(function, args, kwargs, result))
            return result

        return call


def work_of(folder: Path, language: str, count: int) -> Work:
    """The main job on a program of ``count`` motions, with a force for each."""
    done = Work(program(folder, language, count), count)
    with pytest.MonkeyPatch.context() as patch:
        for stage in STAGES:
            patch.setattr(workflow, stage, done.noted(stage, getattr(workflow, stage)))
        workflow.compensate(Request(done.path, force=""))
    return done
