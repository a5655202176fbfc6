"""Tables that are written to be filled in: one with readings is not replaced by an empty one."""

from __future__ import annotations

import contextlib
import csv
from collections.abc import Collection
from pathlib import Path

from postproc.base.findings import Finding, Refusal
from postproc.measurements import value_columns
from postproc.output.atomic_write import edited_file

_DELIMITERS = ",;\t"


def refuse_filled(path: Path, columns: Collection[str]) -> None:
    """Refusal FIL017 where ``path`` is a table that has a value in one of its ``columns``."""
    if not _has_values(path, {name.casefold() for name in columns}):
        return
    message = "the table has readings already, and an empty one would replace it"
    help = "name another file, or move this one away"
    raise edited_file(path, message, help)


def refuse_filled_plan(path: Path) -> None:
    """Refusal FIL017 where ``path`` is a plan of poses that has readings, of whatever kind."""
    refuse_filled(path, [name for kind in (True, False) for names in value_columns(kind) for name in names])


def _has_values(path: Path, columns: Collection[str]) -> bool:
    if not path.is_file():
        return False
    try:  # not as an input: it is replaced
        text = path.read_bytes().decode("utf-8-sig", "replace")
    except OSError as error:
        what = f"what is there cannot be read, so it is not replaced: {error.strerror}"
        raise Refusal(Finding("FIL001", what, str(path))) from None
    lines = [line for line in text.splitlines() if line.strip() and not line.lstrip(' "').startswith("#")]
    if not lines:
        return False
    delimiter = max(_DELIMITERS, key=lines[0].count)
    with contextlib.suppress(csv.Error):
        head, *rows = csv.reader(lines, delimiter=delimiter)
        places = [index for index, name in enumerate(head) if name.strip().casefold() in columns]
        return any(row[index].strip() for row in rows for index in places if index < len(row))
    return False
