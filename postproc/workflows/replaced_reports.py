"""Reports carry the stem of a program: those of panel.src and panel.ngc in one folder have one name."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from postproc.base.findings import Finding


def program_of(page: Path, program: Path, target: Path | None = None) -> str:
    """Name of the other program whose report ``page`` already is; of a compensated one as long as that is there beside
    ``target``.  "" where there is none, or it is one of ``program`` itself."""
    earlier = _report(page)
    name = Path(str(earlier.get("program", ""))).name
    if not name or name.casefold() == program.name.casefold():
        return ""
    if target is not None:
        outputs = [Path(path) for path in earlier.get("outputs") or [""]]
        beside = target.with_name(outputs[0].name or name)
        if beside.name.casefold() == target.name.casefold() or not beside.exists():
            return ""
    return name


def replaced_reports(page: Path, program: Path, target: Path | None = None) -> list[Finding]:
    """FIL016 where the report ``page`` of ``program`` takes the place of another one's."""
    name = program_of(page, program, target)
    if not name:
        return []
    message = f"the reports replace those of {name}, which have the same names"
    return [
        Finding("FIL016", message, str(page), help="name another folder with -o or --report to keep both")
    ]


def _report(page: Path) -> Mapping[str, Any]:
    try:
        found = json.loads(page.read_bytes())
    except (OSError, ValueError):
        return {}
    return found if isinstance(found, dict) else {}
