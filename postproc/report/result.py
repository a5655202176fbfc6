"""What the result of every command offers to Python: a dictionary, a table, a few words, a card in a notebook."""

from __future__ import annotations

import importlib
from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

import numpy as np
from numpy.typing import NDArray

Columns = Mapping[str, NDArray[Any]]
"""Name of a column, with its unit -> (K,) values."""

_LEAVES = 30
"""Figures that a card shows at most."""


class Result:
    """A result; the class of each command adds its figures.

    ``as_json()`` is what ``--json`` prints: mm, deg, N, and codes of findings.
    """

    def as_json(self) -> dict[str, object]:
        """The machine-readable result; the keys are public, ``compensate schema`` describes them."""
        return {}

    def to_dict(self) -> dict[str, object]:
        """The same as ``--json`` gives."""
        return self.as_json()

    def table(self) -> Columns:
        """The rows of the result as columns (K,); a name ends with the unit.  Raises ValueError where it has none."""
        raise ValueError(f"a {type(self).__name__} result has no table")

    def to_pandas(self) -> Any:
        """``table()`` as a pandas.DataFrame.  Raises ImportError where pandas is not installed."""
        return importlib.import_module("pandas").DataFrame(dict(self.table()))

    def figures(self) -> dict[str, object]:
        """The figures of ``to_dict`` by their path, without lists: ``error_after_mm.max``."""
        return dict(_leaves(self.as_json(), ""))

    def __repr__(self) -> str:
        figures = self.figures()
        shown = [f"{key}={_short(figures[key])}" for key in self.headline if figures.get(key) is not None]
        return f"<{type(self).__name__} {' '.join(shown)}>"

    headline: Sequence[str] = ("exit",)
    """The figures that ``repr`` shows."""

    def _repr_html_(self) -> str:
        rows = "".join(
            f"<tr><th scope='row'>{escape(key)}</th><td>{escape(_short(value))}</td></tr>"
            for key, value in list(self.figures().items())[:_LEAVES]
        )
        findings = self.as_json().get("findings")
        lines = "".join(
            f"<li><b>{escape(str(one['code']))}</b> {escape(str(one['message']))}</li>"
            for one in (findings if isinstance(findings, list) else [])[:_LEAVES]
        )
        return f"<table><caption>{escape(repr(self))}</caption>{rows}</table><ul>{lines}</ul>"


def columns_of(rows: Sequence[Mapping[str, object]]) -> Columns:
    """Rows of plain values as columns; what a row does not have is NaN or ""."""
    names = dict.fromkeys(name for row in rows for name in row)
    columns: dict[str, NDArray[Any]] = {}
    for name in names:
        values = [row.get(name) for row in rows]
        if all(value is None or isinstance(value, (int, float)) for value in values):
            columns[name] = np.array([np.nan if value is None else value for value in values])
        else:
            columns[name] = np.array(["" if value is None else str(value) for value in values])
    return columns


def _leaves(tree: Mapping[str, Any], before: str) -> list[tuple[str, object]]:
    found: list[tuple[str, object]] = []
    for key, value in tree.items():
        if isinstance(value, Mapping):
            found += _leaves(value, f"{before}{key}.")
        elif not isinstance(value, (list, tuple)):
            found.append((f"{before}{key}", value))
    return found


def _short(value: object) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)
