"""What is known of materials: the table beside this file, or the coefficients that a process states."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

from postproc.base.dataclass import dataclass
from postproc.base.findings import nearest
from postproc.base.units import MM
from postproc.base.yaml_section import YamlSection, load
from postproc.process.milling_forces import Coefficients

TABLE = Path(__file__).with_name("materials.yaml")
_LARGEST = 1e6
CUTTING, EDGE = ("ktc", "krc", "kac"), ("kte", "kre", "kae")


@dataclass(frozen=True)
class Material:
    """``ci95``: half width of the force's 95 % interval as a share of it, None where nothing states one.  ``axial``:
    axial coefficients are known."""

    name: str
    coefficients: Coefficients
    ci95: float | None
    source: str
    date: str
    axial: bool = True


def find_material(name: str) -> Material | None:
    """The material of the table that goes by this name, blanks, dashes and case aside."""
    for known, names in _spellings().items():
        if _plain(name) in map(_plain, names):
            return _table()[known]
    return None


def known_materials() -> str:
    """The table's names, for messages."""
    return ", ".join(_table())


def nearest_material(name: str) -> str:
    """``; did you mean 'x'?`` where a name of the table is near."""
    return nearest(name, [known for names in _spellings().values() for known in names])


def stated_coefficients(section: YamlSection) -> Material:
    """The material that ``section`` states by its coefficients, N/mm2 and N/mm.  Refusal YML..."""
    known = _coefficients(section)
    axial = "kac" in section
    return Material("own coefficients", known, None, section.text("source", "not stated"), "", axial)


def _coefficients(section: YamlSection) -> Coefficients:
    """Ktc and Krc have to be there; edge and axial coefficients count as 0 where they are not."""
    kt, kr = (section.number(key, low=0.0, high=_LARGEST, unit="N/mm2") for key in CUTTING[:2])
    ka = section.number("kac", 0.0, -_LARGEST, _LARGEST, unit="N/mm2")
    et, er, ea = (section.number(key, 0.0, -_LARGEST, _LARGEST, unit="N/mm") for key in EDGE)
    return Coefficients((kt / MM**2, kr / MM**2, ka / MM**2), (et / MM, er / MM, ea / MM))


@cache
def _table() -> dict[str, Material]:
    top = load(TABLE)
    materials = {}
    for name in top:
        section = top.section(name)
        section.only("also", "source", "date", *CUTTING, *EDGE, "published_ktc")
        coefficients = _coefficients(section)
        published = section.numbers("published_ktc", None)
        half = (max(published) - min(published)) / 2 / section.number("ktc")
        materials[name] = Material(
            name,
            coefficients,
            half if half > 0 else None,
            section.text("source"),
            section.text("date"),
            "kac" in section,
        )
    return materials


@cache
def _spellings() -> dict[str, tuple[str, ...]]:
    """Name in the table -> all that it goes by."""
    top = load(TABLE)
    return {name: (name, *top.section(name).texts("also")) for name in top}


def _plain(name: str) -> str:
    return re.sub(r"[^a-z0-9.]", "", name.lower())
