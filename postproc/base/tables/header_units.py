"""Units in the header of a CSV: ``FX [N]`` and ``fx (N)`` are ``fx`` where that is the unit of the column."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from postproc.base.tables.csv_table import CsvTable

UNITS = {
    "deg": (("deg", "degree", "degrees", "°"), "degrees are expected"),
    "mm": (("mm",), "millimetres are expected"),
    "N": (("n",), "newtons are expected"),
    "N m": (("n m", "nm", "n*m", "n·m"), "newton metres are expected"),
    "s": (("s",), "seconds are expected"),
    "degC": (("degc", "°c", "c"), "degrees Celsius are expected"),
    "": ((), "this column has no unit"),
}
"""Unit -> how people write it, in lower case, and what is expected in words."""

_BRACKETS = {"]": "[", ")": "("}


def split_unit(head: str) -> tuple[str, str]:
    """Name and unit of ``name [unit]`` or ``name (unit)``; the unit is "" without one."""
    closing = head[-1:]
    if closing not in _BRACKETS:
        return head, ""
    opening = head.find(_BRACKETS[closing], head.rfind(closing, 0, -1) + 1)
    name = head[: max(opening, 0)].rstrip()
    return (head, "") if opening < 0 or "\n" in name else (name, " ".join(head[opening + 1 : -1].split()))


def check_unit(table: CsvTable, head: str, written: str, unit: str) -> None:
    """Refusal where the column ``head`` states with ``written`` another unit than the ``unit`` of the format."""
    words, expected = UNITS[unit]
    if written and written.lower() not in words:
        raise table.header_error(
            f"the unit of column {head!r} is wrong: {expected}", "convert the column and its header"
        )


def without_units(table: CsvTable, units: Mapping[str, str]) -> CsvTable:
    """The table with the columns of ``units`` (name -> unit) under their names.  Refusal where one states another unit,
    or where two have one name."""
    columns = {}
    for head, column in table.columns.items():
        name, written = split_unit(head)
        if name in units:
            check_unit(table, head, written, units[name])
        else:
            name = head
        if name in columns:
            raise table.header_error(f"column {name!r} occurs twice")
        columns[name] = column
    return replace(table, columns=columns)
