"""The record of the parts that were learnt from: which files, what cut them, and what was promised of the next one.

A small JSON file beside the cell.  It names measured parts and programs by file and SHA-256 and holds no deviation:
those are read from their files again.  A digest of its own content identifies a damaged record; digests of what
predicts the program distinguish one of another program, cell or robot.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any

VERSION = 1
KIND = "parts learnt from"

_DIGEST = re.compile(r"[0-9a-f]{64}\Z")


class DamagedRecord(ValueError):
    """The bytes are no record, or not as they were written."""


@dataclass(frozen=True)
class RecordedPart:
    """A measured part: ``file`` as seen from the record, its ``sha256``, and the SHA-256 of the program that cut it."""

    file: str
    sha256: str
    program: str


@dataclass(frozen=True)
class RecordedStep:
    """One run: numbers of ``parts`` it learnt from, the errors [mm] that it promised, and the next program: ``file`` as
    seen from the record and its ``sha256``, both "" where none was written."""

    parts: int
    verdict: str
    after_rms_mm: float
    lower_rms_mm: float
    upper_rms_mm: float
    file: str = ""
    sha256: str = ""


@dataclass(frozen=True)
class PartHistory:
    """``inputs``: name of a file -> SHA-256 of what predicts the program; ``force``: as the command states it."""

    program: str
    force: str
    inputs: Mapping[str, str]
    parts: tuple[RecordedPart, ...] = ()
    steps: tuple[RecordedStep, ...] = ()

    def promised(self, program: str) -> RecordedStep | None:
        """The step that wrote the program with this SHA-256."""
        return next((step for step in reversed(self.steps) if step.sha256 and step.sha256 == program), None)

    def with_step(self, parts: tuple[RecordedPart, ...], step: RecordedStep) -> PartHistory:
        """The record after another run; one that repeats the last run counts once."""
        repeats = bool(self.steps) and self.parts == parts and self.steps[-1] == step
        return replace(self, parts=parts, steps=self.steps if repeats else (*self.steps, step))

    def as_bytes(self) -> bytes:
        """The file."""
        content = {"record": KIND, "version": VERSION, **asdict(self)}
        content["inputs"] = dict(self.inputs)
        return (json.dumps({**content, "sha256": _digest(content)}, indent=1) + "\n").encode()


def read_history(raw: bytes) -> PartHistory:
    """The record of the bytes of its file.  Raises DamagedRecord with what is wrong."""
    try:
        content = json.loads(raw)
    except (ValueError, RecursionError):
        raise DamagedRecord("it is no JSON") from None
    if not isinstance(content, dict) or content.get("record") != KIND:
        raise DamagedRecord("it is no record of parts")
    if content.get("version") != VERSION:
        raise DamagedRecord("it was written by another version of this program")
    stated = content.pop("sha256", None)
    if stated != _digest(content):
        raise DamagedRecord("its content is not what was written")
    try:
        return PartHistory(
            _text(content["program"]),
            _text(content["force"]),
            {_text(name): _sha256(digest) for name, digest in content["inputs"].items()},
            tuple(_part(one) for one in content["parts"]),
            tuple(_step(one) for one in content["steps"]),
        )
    except (KeyError, TypeError, AttributeError, ValueError):
        raise DamagedRecord("an entry is missing or has another form") from None


def _digest(content: Mapping[str, Any]) -> str:
    text = json.dumps(content, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()


def _part(one: Mapping[str, Any]) -> RecordedPart:
    return RecordedPart(_text(one["file"]), _sha256(one["sha256"]), _sha256(one["program"]))


def _step(one: Mapping[str, Any]) -> RecordedStep:
    digest = _text(one["sha256"])
    return RecordedStep(
        int(one["parts"]),
        _text(one["verdict"]),
        float(one["after_rms_mm"]),
        float(one["lower_rms_mm"]),
        float(one["upper_rms_mm"]),
        _text(one["file"]),
        _sha256(digest) if digest else "",
    )


def _text(value: object) -> str:
    if not isinstance(value, str):
        raise TypeError
    return value


def _sha256(value: object) -> str:
    if not _DIGEST.match(_text(value)):
        raise ValueError
    return str(value)
