"""A variable, an element and a component hold a value by their type: an INT rounds and divides to whole numbers."""

from __future__ import annotations

import math
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from krl_judge.judge import Case, judge

from postproc.base.document import Document
from postproc.base.units import MM
from postproc.languages.dialect import Program, ReadingSettings
from postproc.languages.krl import KrlDialect

FULL = "LIN {X 1,Y 2,Z 3,A 4,B 5,C 6}\n"
STRUC = "STRUC part_type REAL width,INT count,rest,FRAME P\n"
DAT = f"DEFDAT part\n{STRUC}DECL part_type d={{width %s,count %s,rest %s}}\nDECL REAL r=%s\nDECL INT i=%s\n"
DAT += "DECL REAL rs[2]\nrs[2]=%s\nDECL INT n[2]\nn[2]=%s\nENDDAT\n"
PLACES = ("d.width", "d.count", "d.rest", "r", "i", "rs[2]", "n[2]")
REALS = ("d.width", "r", "rs[2]")


def source(body: str) -> str:
    return f"DEF part()\nBAS(#BASE,1)\nBAS(#TOOL,1)\n{FULL}{body}END\n"


def read(src: str, dat: str = "", config: str = "", name: str = "$config.dat") -> Program:
    documents = [Document(Path("part.src"), src.encode())]
    documents += [Document(Path("part.dat"), dat.encode())] * bool(dat)
    references = (Document(Path(name), config.encode()),) * bool(config)
    return KrlDialect().read(tuple(documents), ReadingSettings(references=references))


def x(program: Program) -> float | None:
    """X of the last motion; None where it is refused."""
    path = program.toolpath
    if len(path) - 1 in path.constraints.refused:
        return None
    return round(float(path.position[-1, 0]) / MM, 9)


def held(place: str, value: float) -> float:
    """By the description of the language: an INT gets the next whole number, halves away from zero."""
    return float(value) if place in REALS else math.copysign(math.floor(abs(value) + 0.5), value)


def half(place: str, value: float) -> float:
    """Of what a place holds; of whole numbers the whole part."""
    kept = held(place, value)
    return kept / 2 if place in REALS else math.trunc(kept / 2)


@pytest.mark.parametrize(
    ("place", "text"), [*product(PLACES, ["3", "-3", "2.75", "-2.75", "7.0", "2.5", "0"])]
)
def test_a_place_makes_of_a_value_what_its_type_says(place: str, text: str) -> None:
    """Of what the .dat states, and of what the program assigns."""
    stated = DAT % ((text,) * len(PLACES))
    other = DAT % (("1",) * len(PLACES))
    for body, dat in ((f"LIN {{X {place}/2}}\n", stated), (f"{place}={text}\nLIN {{X {place}/2}}\n", other)):
        found = read(source(body), dat)
        assert x(found) == half(place, float(text)), found.findings
        assert not judge(Case(source(body), dat)).disagreements


@given(st.sampled_from(PLACES), st.sampled_from(PLACES), st.decimals(-99, 99, places=2))
def test_values_go_from_place_to_place_as_in_a_run(one: str, other: str, value: object) -> None:
    body = f"{one}={value}\n{other}={one}/4\nLIN {{X {other}/2}}\n"
    assert not judge(Case(source(body), DAT % (("1",) * len(PLACES)))).disagreements


@pytest.mark.parametrize(
    ("dat", "config", "name", "found"),
    [
        (STRUC, "", "", 1.5),
        ("DECL " + STRUC, "", "", 1.5),
        ("  struc PART_TYPE real WIDTH , int COUNT;REAL\n", "", "", 1.5),
        ("STRUC part_type INT rest[2,2],REAL width,INT count\n", "", "", 1.5),
        ("STRUC part_type INT width,count\n", "", "", 1),
        ("", STRUC, "$config.dat", 1.5),
        ("", "GLOBAL " + STRUC, "other.dat", 1.5),
        ("", "DECL GLOBAL " + STRUC, "other.dat", 1.5),
        ("STRUC part_type INT width,count\n", STRUC, "$config.dat", 1),  # the module's own goes before
        ("", "", "", None),
        ("", STRUC, "other.dat", None),  # no other module knows it
        ("STRUC part_type REAL count\n", "", "", None),
        (STRUC + STRUC, "", "", 1.5),
        (STRUC + "STRUC part_type INT width\n", "", "", None),
        (f";{STRUC}", "", "", None),
    ],
)  # fmt: skip
def test_a_structure_has_the_types_of_its_declaration(
    dat: str, config: str, name: str, found: float | None
) -> None:
    """Of the .dat, the program, or another file that all modules know; else nothing is divided."""
    for body in ("LIN {X d.width/2}\n", "d.width=3\nLIN {X d.width/2}\n"):
        stated = f"DEFDAT part\n{dat}DECL part_type d={{width 3,count 3}}\nENDDAT\n"
        other = config and f"DEFDAT other\n{config}ENDDAT\n"
        assert x(read(source(body), stated, other, name)) == found
    if dat and not config:
        body = "d.width=3\nLIN {X d.width/2}\n"
        inside = source(body).replace("BAS(#BASE,1)\n", f"{dat}DECL part_type d\nBAS(#BASE,1)\n", 1)
        assert x(read(inside)) == found


def test_a_counter_that_is_no_whole_number_is_not_followed() -> None:
    body = "FOR n=1 TO 2\nLIN {X n/2}\nENDFOR\n"
    assert x(read(source(f"DECL INT n\n{body}"))) == 1
    assert x(read(source(f"DECL REAL n\n{body}"))) is None


@pytest.mark.parametrize(("type_", "found"), [("INT", 1), ("REAL", 1.35), ("BOOL", None), ("", None)])
def test_a_number_of_the_cell_has_the_type_of_its_name(type_: str, found: float | None) -> None:
    config = f"DEFDAT $CONFIG\nDECL {type_} OFFSET\nENDDAT\n" if type_ else ""
    document = Document(Path("part.src"), source("LIN {X OFFSET/2}\n").encode())
    references = (Document(Path("$config.dat"), config.encode()),) * bool(config)
    settings = ReadingSettings(references=references, symbols={"OFFSET": 2.7})
    assert x(KrlDialect().read((document,), settings)) == found


def test_of_a_component_whose_type_is_not_declared_a_whole_number_is_known() -> None:
    head = "DECL unknown_type d\n"
    assert x(read(source(f"{head}d.count=3\nLIN {{X d.count}}\n"))) == 3
    assert x(read(source(f"{head}d.count=3\nLIN {{X d.count*2+1}}\n"))) == 7
    assert x(read(source(f"{head}d.count=3\nLIN {{X d.count/2}}\n"))) is None
    program = read(source(f"{head}d.count=2.7\nLIN {{X d.count}}\n"))
    assert x(program) is None


@pytest.mark.parametrize(
    ("type_", "component", "found"),
    [("LDAT", "VEL", 1.5), ("PDAT", "APO_DIST", 1.5), ("FDAT", "BASE_NO", 1), ("LOAD", "M", 1.5),
     ("POS", "S", 1), ("E6POS", "T", 1), ("E6POS", "X", 1.5), ("LOAD", "CM.X", 1.5)],
)  # fmt: skip
def test_structures_of_the_controller_have_types(type_: str, component: str, found: float) -> None:
    body = f"DECL {type_} d\nd.{component}=3\nLIN {{X d.{component}/2}}\n"
    if type_ in ("POS", "E6POS"):
        body = body.replace("d." + component, "d={X 3,Y 0,Z 0,A 0,B 0,C 0}\nd." + component, 1)
    assert x(read(source(body))) == found


def test_a_component_called_as_one_of_a_point_is_none_in_a_structure() -> None:
    """STRUC with components X and Y of other types than those of a frame."""
    dat = "DEFDAT part\nSTRUC cell INT X,Y\nSTRUC outer cell C\n"
    dat += "DECL cell d={X 3,Y 5}\nDECL outer o={C {X 3,Y 5}}\nENDDAT\n"
    for place in ("d.X", "o.C.X"):
        assert x(read(source(f"LIN {{X {place}/2}}\n"), dat)) == 1
        assert x(read(source(f"{place}=2.7\nLIN {{X {place}/2,Y {place}}}\n"), dat)) == 1
    path = read(source("d.X=2.7\nLIN {X d.X}\n"), dat).toolpath
    assert np.isclose(path.position[-1, 0] / MM, 3)


@pytest.mark.parametrize(("component", "half"), [("S", 3), ("T", 3), ("X", 3.5), ("C", 3.5)])
def test_status_and_turn_of_a_point_are_whole_numbers(component: str, half: float) -> None:
    body = f"DECL POS p\n{FULL}p={{X 1,Y 2,Z 3,A 4,B 5,C 6,S 2,T 2}}\np.{component}=7\nLIN {{X p.{component}/2}}\n"
    assert x(read(source(body))) == half
