"""The report of one program as a page: words and tables that need no script, and figures that a script draws.

A page is one file.  It needs no network and asks for none: its policy (Content-Security-Policy) allows this script and
this style sheet, by their digests, and nothing else.  Everything that comes from a program is escaped: as HTML by the
templates, as data by ``embedded``.
"""

from __future__ import annotations

import base64
import hashlib
import json
import os
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

import jinja2
import numpy as np
from markupsafe import Markup

from postproc import __version__
from postproc.base.findings import CODES, Finding
from postproc.base.system import relative_path
from postproc.compensation.correct import MotionOutcome
from postproc.compensation.problem import CompensationProblem
from postproc.report.compiled_templates import CompiledTemplates
from postproc.report.page_data import PageData
from postproc.report.page_words import (
    badge,
    parameter_rows,
    printed,
    program_facts,
    program_tiles,
    program_verdict,
    reasons,
)
from postproc.toolpath import Kind

if TYPE_CHECKING:
    from postproc.part.part_figures import PartError

FOLDER = Path(__file__).parent / "html"

FINDINGS = 300
"""A page shows so many findings at most; all are in the JSON."""

SCRIPTS = ("canvas.js", "view3d.js", "view3d_input.js", "chart.js", "listing.js", "program.js", "tables.js")
PART = ("robot.js", "part.js", "play.js")
TABLES = ("tables.js",)
"""Scripts of a page of a program, with a part, and of every other page."""
STYLE = "page.css"

_SEVERITY = {"info": ("i", "note"), "warning": ("!", "warning"), "error": ("x", "error")}


def program_page(
    data: PageData,
    links: Mapping[str, str],
    part: PartError | None = None,
    task: CompensationProblem | None = None,
) -> bytes:
    """The page of one program.  links: what is beside it, words -> relative path; part, task: its part, and the
    problem with whose robot that is shown."""
    report = data.report
    shown = None
    if part is not None and task is not None:
        from postproc.report.part_page import oblique_yaw, part_data, part_section
        from postproc.report.part_scene import part_scene  # numba: only where there is a stock

        scene = part_scene(task, data.rows)
        section = part_section(part, report.uncertainty, oblique_yaw(part, scene["robot"]))
        path = scene["path"]
        thinned = f"{path['count']} of {path['all']}" if path["count"] < path["all"] else ""
        shown = {**section, "thinned": thinned, "data": embedded(part_data(part, scene))}
    return rendered(
        "program.html.j2",
        scripts=SCRIPTS if shown is None else (*SCRIPTS, *PART),
        part=shown,
        title=Path(report.program).name,
        program=report.program,
        what="compensation" if data.corrected else "prediction",
        verdict=program_verdict(data),
        badge=badge(report.exit, report.corrected if data.corrected else None),
        tiles=program_tiles(data),
        uncorrected=reasons(data),
        facts=program_facts(report),
        places=_places(data),
        listing=data.listing,
        listed={row.number for row in data.listing},
        inserted=report.inserted,
        transition_moves=[(move.line, f"{move.length_mm:.3f}") for move in report.transition_moves],
        findings=finding_rows(report.findings),
        more_findings=max(0, len(report.findings) - FINDINGS),
        parameters=parameter_rows(report.model),
        digests=report.digests,
        links=linked(links),
        shown=len(data.rows),
        motions=data.motions,
        goes=True,
        corrected=data.corrected,
        interval=bool(np.isfinite(data.widths).any()),
        evaluated=data.evaluated,
        lower_bound=report.uncertainty.lower_bound,
        data=embedded(_figures(data)),
    )


def rendered(template: str, scripts: tuple[str, ...] = TABLES, **what: Any) -> bytes:
    """The bytes of a page, of ``template`` with the style sheet of all pages.

    scripts: files of ``html/``.  what: for the base of all pages
    title, what, verdict, badge, findings (``finding_rows``), more_findings, links
    (``linked``), and goes: whether a finding's line can be shown in a figure; for the template what else it names.
    """
    script = _script(scripts)
    style = Markup((FOLDER / STYLE).read_text(encoding="utf-8"))
    policy = (
        f"default-src 'none'; script-src 'sha256-{_digest(script)}'; style-src 'sha256-{_digest(style)}';"
        " img-src data:; base-uri 'none'; form-action 'none'"
    )
    page = _templates().get_template(template)
    always = {"style": style, "script": script, "policy": policy, "version": __version__}
    text = page.render({"goes": False, "listed": (), "program": None, **what, **always})
    return text.encode("utf-8", "replace")


def embedded(value: object) -> Markup:
    """JSON that may be in a script element of a page: no ``<``, ``>``, ``&`` and no line separators in it."""
    text = json.dumps(value, separators=(",", ":"), allow_nan=False)
    for letter in "<>&\u2028\u2029":
        text = text.replace(letter, f"\\u{ord(letter):04x}")
    return Markup(text)


def finding_rows(findings: Sequence[Finding]) -> list[dict[str, object]]:
    """The first findings of a page, the gravest first."""
    order = list(_SEVERITY)
    rows = []
    for finding in sorted(findings, key=lambda one: -order.index(one.severity))[:FINDINGS]:
        code = CODES[finding.code]
        sign, word = _SEVERITY[finding.severity]
        rows.append(
            {
                "sign": sign,
                "word": word,
                "severity": finding.severity,
                "code": finding.code,
                "title": code.title,
                "place": finding.place,
                "line": finding.line,
                "file": finding.file,
                "message": finding.message,
                "help": finding.advice,
            }
        )
    return rows


def beside(page: Path, files: Mapping[str, Path | None]) -> dict[str, str]:
    """Words -> path of each of ``files`` as seen from the folder of ``page``, without those that are None."""
    return {word: relative_path(path, page.parent) for word, path in files.items() if path is not None}


def linked(links: Mapping[str, str]) -> list[tuple[str, str, str]]:
    """Words -> path as (word, what is shown, address); a colon or a percent sign in a name is no part of an address."""
    rows = []
    for word, path in links.items():
        parts = Path(path).as_posix()
        address = Path(path).as_uri() if Path(path).is_absolute() else "./" + quote(os.fsencode(parts))
        rows.append((word, parts, address))
    return rows


def _places(data: PageData) -> list[dict[str, object]]:
    """Rows of the table of the worst places."""
    size = np.linalg.norm(data.correction, axis=1)
    force = np.linalg.norm(data.force, axis=1)
    return [
        {
            "row": int(data.rows[place.row]),
            "line": int(data.line[place.row]),
            "cut": int(data.cut[place.row]) + 1,
            "why": place.why,
            "before": _number(data.before[place.row], 3),
            "correction": _number(size[place.row], 3),
            "after": _number(data.after[place.row], 4),
            "path_error": _number(data.path_error[place.row], 4),
            "force": f"{force[place.row]:.0f}",
            "source": place.source,
            "written": list(place.written),
            "same": place.written == (place.source,),
            "state": MotionOutcome(data.state[place.row]).name.lower(),
        }
        for place in data.places
    ]


def _number(value: float, decimals: int) -> str:
    return f"{value:.{decimals}f}" if np.isfinite(value) else "–"


def _figures(data: PageData) -> dict[str, object]:
    """What the script draws."""
    columns = {
        "row": (data.rows, "i4"),
        "line": (data.line, "i4"),
        "cut": (data.cut, "i4"),
        "kind": (data.kind, "u1"),
        "state": (data.state, "u1"),
        "path_length": (data.path_length, "f4"),
        "position": (data.position, "f4"),
        "force": (data.force, "f4"),
        "deflection": (data.deflection, "f4"),
        "correction": (data.correction, "f4"),
        "before": (data.before, "f4"),
        "after": (data.after, "f4"),
        "path_error": (data.path_error, "f4"),
        "inserted": (data.inserted, "i4"),
        "before_width": (data.widths[:, 0], "f4"),
        "after_width": (data.widths[:, 1], "f4"),
        "arc": (data.arcs, "i4"),
        "arc_points": (data.arc_points.reshape(-1, 3), "f4"),
    }
    return {
        "count": len(data.rows),
        "each": data.arc_points.shape[1],
        "motions": data.motions,
        "corrected": data.corrected,
        "force_word": data.force_word,
        "tolerance": data.tolerance,
        "kinds": [kind.name for kind in Kind],
        "states": [_STATES[state] for state in MotionOutcome],
        "places": [int(data.rows[place.row]) for place in data.places],
        "columns": {name: _column(values, form) for name, (values, form) in columns.items()},
    }


_STATES = {
    MotionOutcome.AIR: "nothing to correct",
    MotionOutcome.CORRECTED: "corrected",
    MotionOutcome.UNCORRECTED: "not corrected",
    MotionOutcome.OFF: "not corrected, as the program says",
    MotionOutcome.LEAD_IN: "lead-in in air to the corrected start of a cut",
}


def _column(values: np.ndarray, form: str) -> dict[str, object]:
    """Numbers as base64 of little-endian bytes, row by row."""
    if form.startswith("f"):
        values = np.where(
            np.isnan(values), np.nan, values
        )  # the sign of none depends on how many rows went together
    raw = np.ascontiguousarray(values, dtype=f"<{form}").tobytes()
    wide = values.shape[1] if values.ndim > 1 else 1
    return {"form": form, "wide": wide, "base64": base64.b64encode(raw).decode("ascii")}


def _script(names: Iterable[str]) -> Markup:
    parts = "\n".join((FOLDER / name).read_text(encoding="utf-8") for name in names)
    return Markup("(() => {\n'use strict';\n" + parts + "})();\n")


def _digest(text: str) -> str:
    return base64.b64encode(hashlib.sha256(text.encode()).digest()).decode("ascii")


def _finalized(value: object) -> object:
    """Every text that a template shows passes here."""
    return printed(value) if isinstance(value, str) and not isinstance(value, Markup) else value


@cache
def _templates() -> jinja2.Environment:
    settings = __version__.encode() + Path(__file__).read_bytes()  # they are below
    return jinja2.Environment(
        loader=jinja2.FileSystemLoader(FOLDER),
        bytecode_cache=CompiledTemplates(FOLDER / "__pycache__", settings),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        finalize=_finalized,
        trim_blocks=True,
        lstrip_blocks=True,
    )
