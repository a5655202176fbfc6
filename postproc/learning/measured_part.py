"""The CSV of a measured part, read strictly: deviations along the outward normal at points of the nominal surface."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from postproc.base.arrays import Floats, Ints, frozen
from postproc.base.findings import Finding, Refusal, nearest
from postproc.base.tables import CsvTable, is_missing, read_table
from postproc.base.tables.header_units import without_units
from postproc.base.units import MM
from postproc.learning.checked_place import check_by_hand
from postproc.learning.deviation_signs import SIGNS
from postproc.learning.measured_places import PLACES as MEASURED
from postproc.learning.measured_places import sign_shown

KEYS = (
    "positive",
    "alignment",
    "cut_with",
    "sha256",
    "sigma_mm",
    "probe_radius",
    "spring_pass",
    "base",
    "checked",
)
ALIGNMENTS = ("free", "datum", "partial")
FREEDOMS = ("x", "y", "z", "a", "b", "c")
PLACE, NORMAL = ("x", "y", "z"), ("nx", "ny", "nz")
COLUMNS = (*PLACE, *NORMAL, "dev", "sigma", "line", "operation", "feature", "part", "t", "temp", *MEASURED)

FAR, LARGEST, LEAST_SIGMA, MOST_SIGMA = 20_000.0, 5.0, 1e-4, 1.0
"""[mm] of a place, a deviation, and the scatter of a probe."""

LEAST, MOST = 6, 5000
"""Points of one file."""

ROWS = (
    "below the comments come one header (X,Y,Z,NX,NY,NZ,DEV, ...) and a row a point with as many cells, without rows of"
    " units or totals; DEV is empty, - or nan where a point has none"
)
"""What to do where nothing more special is known."""

SHOWN = 3

_UNITS = {"dev": "mm", "sigma": "mm", "t": "s", "temp": "degC", **dict.fromkeys((*PLACE, *MEASURED), "mm")}
_KEYED = re.compile(r"([^:=]*+)[:=]\s*+(.*)")
_HEX = re.compile(r"[0-9a-f]{12,64}\Z")


@dataclass(frozen=True, eq=False)
class MeasuredPart:
    """K measured points.

    point (K, 3) [m] of the nominal surface and normal (K, 3), outward, in the axes of the program's base; deviation
    (K,) [m], positive where material is left; sigma (K,) [m]: standard deviation of the probe; feature, operation:
    names of each point, "" without; program_line (K,): 0 without; part (K,): number of the part in this file; time
    (K,) [s], NaN without; line (K,): of the file.  freedoms: of x, y, z, a, b, c those in which the part was aligned to
    its own points; cut_with: file of the program that cut it, "" for the original; program_digest: what the file states
    of it; base: number of the base, None without; sign: what the file says that a positive DEV is; sign_seen: measured
    places or a place that was checked by hand lie on that side of the nominal ones that the deviations say.
    """

    file: Path
    digest: str
    point: Floats
    normal: Floats
    deviation: Floats
    sigma: Floats
    feature: tuple[str, ...]
    operation: tuple[str, ...]
    program_line: Ints
    part: Ints
    time: Floats
    line: Ints
    freedoms: tuple[str, ...]
    cut_with: str
    program_digest: str
    spring_pass: bool
    base: int | None
    findings: tuple[Finding, ...]
    sign: str = SIGNS[0]
    sign_seen: bool = False

    def __len__(self) -> int:
        return len(self.deviation)


def read_planned_points(path: Path) -> tuple[Floats, Floats, tuple[str, ...]]:
    """Points (K, 3) [m], normals (K, 3) and features of a file without deviations, from a drawing or a measuring plan.

    Raises Refusal: FIL001..FIL003 (no text), LRN001 (the header or rows are wrong).
    """
    table = _named(read_table(path, "LRN001"), PLACE + NORMAL)
    point, normal = _block(table, PLACE), _block(table, NORMAL)
    every = np.arange(len(table))
    _check_sizes(table, point, normal, np.full(len(table), 1.0), every)
    normal = normal / np.linalg.norm(normal, axis=1, keepdims=True)
    return point * MM, normal, _texts(table, "feature", every)


def read_measured_part(path: Path) -> MeasuredPart:
    """Reads the CSV of a measured part.

    Raises Refusal: FIL001..FIL003 (no text), LRN001 (comments, header or rows are wrong).
    """
    try:
        return _read(path)
    except Refusal as refusal:
        raise Refusal(
            *(
                one if one.help or one.code == "FIL001" else replace(one, help=ROWS)
                for one in refusal.findings
            )
        ) from None


def _read(path: Path) -> MeasuredPart:
    table = _named(read_table(path, "LRN001"))
    stated, findings = _stated(table)
    sign = _choice(table, stated, "positive", SIGNS, "what a positive DEV means")
    freedoms = _freedoms(table, stated)
    cut_with = _needed(table, stated, "cut_with", "the program that cut this part, or original")[1]
    digest = _program_digest(table, stated)
    point, normal = _block(table, PLACE), _block(table, NORMAL)
    deviation = table.numbers_or_nan("dev")
    rows = np.flatnonzero(np.isfinite(deviation))
    if len(rows) < LEAST:
        message = f"{len(rows)} of {len(table)} rows have a deviation, where at least {LEAST} are needed"
        raise _wrong(table, table.header_line, message, "fill in DEV (mm)")
    if len(rows) > MOST:
        raise _wrong(
            table, table.header_line, f"{len(rows)} points are more than {MOST}", "remove neighbours"
        )
    if len(rows) < len(table):
        left = len(table) - len(rows)
        message = f"rows without a deviation are excluded: {left} of {len(table)}"
        findings.append(Finding("LRN005", message, str(path), int(table.lines[np.isnan(deviation)][0])))
    _check_sizes(table, point, normal, deviation, rows)
    sigma = _sigma(table, stated, rows)
    _check_same_points(table, point, deviation, rows)
    _flag(
        table, stated, "probe_radius", ("removed",), "let the probe's software remove the radius of its tip"
    )
    spring = _flag(table, stated, "spring_pass", ("true", "false"), "write true or false") == "true"
    length = np.linalg.norm(normal[rows], axis=1, keepdims=True)
    time = table.numbers_or_nan("t") if "t" in table else np.full(len(table), np.nan)
    outward = deviation * (1 if sign == "material_left" else -1)
    seen = sign_shown(table, (point, normal), outward, rows, freedoms)
    seen |= check_by_hand(table, stated.get("checked", (0, "")), point, outward[rows], sigma, rows)
    return MeasuredPart(
        file=path,
        digest=table.digest,
        point=frozen(point[rows] * MM),
        normal=frozen(normal[rows] / length),
        deviation=frozen(outward[rows] * MM),
        sigma=frozen(sigma * MM),
        feature=_texts(table, "feature", rows),
        operation=_texts(table, "operation", rows),
        program_line=frozen(_lines(table)[rows], (-1,), np.int64),
        part=frozen(_parts(table, rows), (-1,), np.int64),
        time=frozen(time[rows]),
        line=frozen(table.lines[rows], (-1,), np.int64),
        freedoms=freedoms,
        cut_with="" if cut_with.lower() == "original" else cut_with,
        program_digest=digest,
        spring_pass=spring,
        base=_base(table, stated),
        findings=tuple(findings),
        sign=sign,
        sign_seen=seen,
    )


def _named(table: CsvTable, needed: Sequence[str] = (*PLACE, *NORMAL, "dev")) -> CsvTable:
    """The table with its units checked and taken off the names of its columns; ``needed``: names that must be there."""
    table = without_units(table, {**dict.fromkeys(COLUMNS, ""), **_UNITS})
    columns = table.columns
    unknown = [name for name in columns if name not in COLUMNS]
    for name in needed:
        if name not in columns:
            help = "X,Y,Z (nominal point, mm), NX,NY,NZ (outward normal) and DEV (mm) are needed"
            also = (
                ", and "
                + " and ".join(f"{one[:40]!r}" for one in unknown[:SHOWN])
                + (" is" if len(unknown) == 1 else " are")
                + " unknown"
            )
            raise table.header_error(f"column {name.upper()!r} is missing" + also * bool(unknown), help)
    for name in unknown:
        help = "remove it, or rename it to one of " + ", ".join(name.upper() for name in COLUMNS)
        raise table.header_error(f"column {name[:40]!r} is unknown{nearest(name, COLUMNS)}", help)
    return table


def _stated(table: CsvTable) -> tuple[dict[str, tuple[int, str]], list[Finding]]:
    """key -> line, value of the comments above the header.  A key that is misspelt, repeated or below is refused."""
    stated: dict[str, tuple[int, str]] = {}
    for line, text in table.comments:
        keyed = _KEYED.fullmatch(text.lstrip("# \t"))
        if keyed is None:
            continue
        key, value = "_".join(keyed[1].lower().split()), keyed[2].strip()
        if key not in KEYS:
            close = nearest(key, KEYS)
            if close:
                raise _wrong(
                    table, line, f"# {keyed[1][:40]}: is not a key{close}", "use one of " + ", ".join(KEYS)
                )
            continue
        if line > table.header_line:
            raise _wrong(table, line, f"# {key}: is below the header; move it above", "")
        if key in stated:
            raise _wrong(table, line, f"# {key}: occurs in line {stated[key][0]} already", "")
        stated[key] = line, value
    return stated, []


def _needed(table: CsvTable, stated: Mapping[str, tuple[int, str]], key: str, what: str) -> tuple[int, str]:
    line, value = stated.get(key, (table.header_line, ""))
    if not value:
        raise _wrong(table, line, f"the comment `# {key}:` is missing", f"it states {what}")
    return line, value


def _choice(
    table: CsvTable, stated: Mapping[str, tuple[int, str]], key: str, choices: Sequence[str], what: str
) -> str:
    line, value = _needed(table, stated, key, f"{what}: {' or '.join(choices)}")
    if value.lower() not in choices:
        help = "write " + " or ".join(choices)
        raise _wrong(table, line, f"# {key}: {value[:40]!r} is not understood{nearest(value, choices)}", help)
    return value.lower()


def _flag(
    table: CsvTable, stated: Mapping[str, tuple[int, str]], key: str, choices: Sequence[str], help: str
) -> str:
    line, value = stated.get(key, (0, ""))
    if line and value.lower() not in choices:
        raise _wrong(table, line, f"# {key}: {value[:40]!r} is not {' or '.join(choices)}", help)
    return value.lower()


def _freedoms(table: CsvTable, stated: Mapping[str, tuple[int, str]]) -> tuple[str, ...]:
    what = "how the measured part was aligned: free (best fit), datum (by the base of the program), or partial x y c"
    line, value = _needed(table, stated, "alignment", what)
    word, *others = value.lower().replace(",", " ").split()
    if word not in ALIGNMENTS or (word == "partial") != bool(others):
        raise _wrong(table, line, f"# alignment: {value[:40]!r} is not understood", f"it states {what}")
    wrong = [one for one in others if one not in FREEDOMS]
    if wrong or len(set(others)) < len(others):
        help = "name some of " + " ".join(FREEDOMS)
        raise _wrong(table, line, f"# alignment: {value[:40]!r} names no freedoms", help)
    return FREEDOMS if word == "free" else tuple(others)


def _program_digest(table: CsvTable, stated: Mapping[str, tuple[int, str]]) -> str:
    line, value = _needed(
        table, stated, "sha256", "the SHA-256 of the program that cut this part (12 digits or more)"
    )
    if not _HEX.match(value.lower()):
        raise _wrong(
            table,
            line,
            f"# sha256: {value[:40]!r} is not the start of a SHA-256",
            "write 12 to 64 digits 0-9a-f",
        )
    return value.lower()


def _base(table: CsvTable, stated: Mapping[str, tuple[int, str]]) -> int | None:
    if "base" not in stated:
        return None
    line, value = stated["base"]
    if not value.isdecimal():
        raise _wrong(table, line, f"# base: {value[:40]!r} is not the number of a base", "")
    return int(value)


def _block(table: CsvTable, names: Sequence[str]) -> Floats:
    return np.stack([table.numbers(name) for name in names], axis=1)


def _check_sizes(table: CsvTable, point: Floats, normal: Floats, deviation: Floats, rows: Ints) -> None:
    """Numbers of a size that a part has, and normals of length one."""
    wrong = np.flatnonzero(np.abs(point).max(axis=1) > FAR)
    if len(wrong):
        raise table.error(int(wrong[0]), "X", f"a point is more than {FAR:g} mm away", "write mm")
    length = np.linalg.norm(normal, axis=1)
    wrong = np.flatnonzero(np.abs(length - 1.0) > 0.02)
    if len(wrong):
        row = int(wrong[0])
        help = "NX, NY, NZ are a vector of length 1 that leads out of the material"
        raise table.error(row, "NX", f"the normal has the length {length[row]:.3g}", help)
    wrong = rows[np.abs(deviation[rows]) > LARGEST]
    if len(wrong):
        row = int(wrong[0])
        help = "DEV is measured minus nominal along the normal, in mm, with the radius of the probe removed"
        raise table.error(row, "DEV", f"{deviation[row]:g} mm is more than {LARGEST:g} mm", help)
    size = float(np.abs(deviation[rows]).max())
    extent = float((point[rows].max(axis=0) - point[rows].min(axis=0)).max())
    if extent < 2.0:
        message = f"all points lie within {extent:g} mm"
        raise _wrong(table, table.header_line, message, "X, Y, Z and DEV are in mm, not in m")
    if size == 0.0:
        raise _wrong(table, table.header_line, "all deviations are zero", "write the measured deviations")
    if size < 2e-3:
        message = f"no deviation exceeds {size:g} mm"
        raise _wrong(table, table.header_line, message, "DEV is in mm, not in m")


def _check_same_points(table: CsvTable, point: Floats, deviation: Floats, rows: Ints) -> None:
    """A row that occurs twice would count twice."""
    whole = np.column_stack([point, deviation])[rows]
    _, index, count = np.unique(whole, axis=0, return_index=True, return_counts=True)
    if (count > 1).any():
        row = int(rows[index[np.argmax(count > 1)]])
        raise table.error(row, "DEV", "this point with this deviation occurs twice", "remove copies of rows")


def _sigma(table: CsvTable, stated: Mapping[str, tuple[int, str]], rows: Ints) -> Floats:
    """(rows,) [mm] the cell, else what the file states."""
    own = table.numbers_or_nan("sigma")[rows] if "sigma" in table else np.full(len(rows), np.nan)
    if np.isnan(own).any():
        what = "the standard deviation of a measured deviation in mm, by the probe's certificate or repeated points"
        line, value = _needed(table, stated, "sigma_mm", what)
        try:
            common = float(value.replace(",", "."))
        except ValueError:
            common = np.nan
        if not LEAST_SIGMA <= common <= MOST_SIGMA:
            help = f"one number from {LEAST_SIGMA:g} to {MOST_SIGMA:g} without a unit"
            raise _wrong(table, line, f"# sigma_mm: {value[:40]!r} is not a scatter in mm", help)
        own = np.where(np.isnan(own), common, own)
    wrong = np.flatnonzero((own < LEAST_SIGMA) | (own > MOST_SIGMA))
    if len(wrong):
        message = f"{own[wrong[0]]:g} mm is not from {LEAST_SIGMA:g} to {MOST_SIGMA:g} mm"
        raise table.error(int(rows[wrong[0]]), "SIGMA", message)
    return np.asarray(own)


def _texts(table: CsvTable, name: str, rows: Ints) -> tuple[str, ...]:
    if name not in table:
        return ("",) * len(rows)
    cells = table.texts(name)
    return tuple("" if is_missing(cells[row]) else " ".join(cells[row].split()) for row in rows.tolist())


def _lines(table: CsvTable) -> Ints:
    """(rows,) line of the program, 0 without."""
    if "line" not in table:
        return np.zeros(len(table), np.int64)
    numbers = np.nan_to_num(table.numbers_or_nan("line"))
    wrong = np.flatnonzero((numbers != np.round(numbers)) | (numbers < 0))
    if len(wrong):
        raise table.error(int(wrong[0]), "LINE", "this is not the line of a motion in the program")
    return numbers.astype(np.int64)


def _parts(table: CsvTable, rows: Ints) -> Ints:
    """(rows,) number of the part from 0, in the order in which they occur."""
    names = _texts(table, "part", rows)
    number = {name: index for index, name in enumerate(dict.fromkeys(names))}
    return np.array([number[name] for name in names])


def _wrong(table: CsvTable, line: int, message: str, help: str) -> Refusal:
    return Refusal(Finding("LRN001", message, str(table.path), line, help=help))
