"""Whether there is a stock: what reads it, and its tools, is loaded only then."""

from __future__ import annotations

from pathlib import Path

from postproc.base.yaml_section import load


def has_stock(path: Path) -> bool:
    """Whether a process file states a stock.  Refusal: FIL..., YML..."""
    return "stock" in load(path)
