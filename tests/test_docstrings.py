"""A public docstring says the shape of every array and names every exception that the function raises itself.

Read from the source with ``ast``:

- Public: functions of a module, methods of a class, ``__init__`` and ``__call__`` among them, and fields of a class,
  without a leading underscore in the own name or the class's.  Functions inside of functions are not.
- An array: a parameter, a value or a field whose annotation names a type of ``ARRAYS``.  ``Poses``, ``PoseRows`` and
  ``Placed`` are none: their own docstrings say what they hold, and one pose may stand for all.
- A shape: sizes in round brackets, ``(N, 6)``, ``(K,)``, ``(..., 3)``, or the words scalar and shape.
- Stated: a docstring has as many shapes as there are arrays, or names every parameter and has a shape after the name in
  the same sentence (one may stand for several: ``a`` and ``b`` (N,)) and one more for the value.  Of a field the class
  names it so.  That the shape is the right one no reader of text can tell.
- A method without a docstring has that of the nearest base class that gives one; what ``__init__`` takes, and what a
  property without one is, may be said in the class's.
- Raised: ``raise Name(...)`` in the body.  What a ``try`` around it catches is not, nor are the ends of commands, whose
  docstrings are the help text that says the exit codes.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from plant import kr270
from sources import parse_file, walk

import postproc
from postproc.base.geometry import Poses, rotation_from_vector
from postproc.effects import Conditions
from postproc.effects.base_compliance import BaseCompliance
from postproc.effects.link_compliance import LinkCompliance
from postproc.effects.thermal_growth import ThermalGrowth
from postproc.effects.tool_compliance import ToolCompliance
from postproc.effects.tool_offset import ToolOffset
from postproc.model import StiffnessModel

ROOT = Path(postproc.__file__).parent
ARRAYS = {"Floats", "Ints", "Bools", "Bytes", "Offsets", "Fours", "NDArray", "ndarray", "ArrayLike"}
SIZE = r"(?:\.\.\.|(?:\d+ )?[A-Za-z]'?(?: [-+*/] \w+)?|\d+(?: or \d+)?|[A-Z]{2,}|count|rows|``\w+``)"
SHAPE = re.compile(rf"\({SIZE}(?:, {SIZE})+\)|\({SIZE},\)|\(\.\.\.\)|\bscalars?\b|\bshapes?\b")

Function = ast.FunctionDef | ast.AsyncFunctionDef


def is_public(name: str) -> bool:
    return not name.startswith("_") or name in ("__init__", "__call__")


def is_array(annotation: ast.expr | None) -> bool:
    """Whether an annotation names an array; what a function given as a value takes and gives is not meant."""
    if isinstance(annotation, ast.Constant) and isinstance(annotation.value, str):
        annotation = ast.parse(annotation.value, mode="eval").body
    if annotation is None:
        return False
    if isinstance(annotation, ast.Subscript) and ast.unparse(annotation.value) in (
        "Callable",
        "Iterator",
        "Literal",
    ):
        return ast.unparse(annotation.value) == "Iterator" and is_array(annotation.slice)
    if isinstance(annotation, ast.Name | ast.Attribute):
        return ast.unparse(annotation).rpartition(".")[2] in ARRAYS
    return any(is_array(child) for child in ast.iter_child_nodes(annotation) if isinstance(child, ast.expr))


def is_property(node: Function) -> bool:
    return any(ast.unparse(one).endswith("property") for one in node.decorator_list)


def follows(name: str, text: str) -> bool:
    """Whether a shape stands after ``name`` in the same sentence."""
    text = re.sub(r"(?<!\n)\n(?!\n)", " ", text)
    for found in re.finditer(rf"(?i)(?<!\w){re.escape(name)}s?(?!\w)", text):
        rest = re.split(r"\.\s+(?=[A-Z`])|\n\n", text[found.end() :], maxsplit=1)[0]
        if SHAPE.search(rest):
            return True
    return False


def without_named(names: list[str], text: str) -> str:
    """``text`` without the first shape behind each of ``names``: what remains is of the value."""
    ends = {
        found.end()
        for name in names
        for found in [re.search(rf"(?i)(?<!\w){re.escape(name)}s?(?!\w)", text)]
        if found
    }
    cut = {shape.span() for end in ends for shape in [SHAPE.search(text, end)] if shape}
    for start, stop in sorted(cut, reverse=True):
        text = text[:start] + text[stop:]
    return text


def without_shape(text: str, names: list[str], gives: bool) -> list[str]:
    """Of ``names`` and, where ``gives``, the value, those whose shape ``text`` does not state."""
    text = re.sub(r"(?<!\n)\n(?!\n)", " ", text)
    if len(SHAPE.findall(text)) >= len(names) + gives:
        return []
    missing = [name for name in names if not follows(name, text)]
    if gives and not SHAPE.search(without_named(names, text)):
        missing.append("the value")
    return missing


def raised(body: list[ast.stmt], caught: frozenset[str] = frozenset()) -> Iterator[str]:
    """Names of the exceptions that statements raise, but for those that they catch."""
    for node in body:
        if isinstance(node, Function | ast.ClassDef):
            continue
        if isinstance(node, ast.Raise):
            called = node.exc.func if isinstance(node.exc, ast.Call) else node.exc
            name = ast.unparse(called).rpartition(".")[2] if called else ""
            if name[:1].isupper() and name not in caught:
                yield name
        elif isinstance(node, ast.Try):
            types = [ast.walk(handler.type) for handler in node.handlers if handler.type]
            names = {one.id for type_ in types for one in type_ if isinstance(one, ast.Name)}
            yield from raised(node.body, caught | names)
            for handler in node.handlers:
                yield from raised(handler.body, caught)
            yield from raised([*node.orelse, *node.finalbody], caught)
        else:
            for part in ("body", "orelse"):
                yield from raised(getattr(node, part, []) if not isinstance(node, ast.expr) else [], caught)
            for case in getattr(node, "cases", []):
                yield from raised(case.body, caught)


class Source:
    """The classes and functions of the package."""

    def __init__(self, trees: dict[str, ast.Module]) -> None:
        self.trees = trees
        self.classes: dict[str, list[ast.ClassDef]] = {}
        for tree in trees.values():
            for node in walk(tree):
                if isinstance(node, ast.ClassDef):
                    self.classes.setdefault(node.name, []).append(node)

    def inherited(self, owner: ast.ClassDef, name: str) -> str:
        """The docstring that a base class of the package has for its method ``name``."""
        for base in owner.bases:
            for node in self.classes.get(ast.unparse(base).rpartition(".")[2].partition("[")[0], []):
                for own in node.body:
                    if isinstance(own, Function) and own.name == name and ast.get_docstring(own):
                        return ast.get_docstring(own) or ""
                found = self.inherited(node, name)
                if found:
                    return found
        return ""

    def faults(self, room: str = "") -> Iterator[str]:
        """``module:line name: what is missing`` of the modules of one room."""
        for path, tree in self.trees.items():
            if path.split("/")[0] == room or not room:
                yield from self._faults(path, tree.body, None)

    def _faults(self, path: str, body: list[ast.stmt], owner: ast.ClassDef | None) -> Iterator[str]:
        for node, after in zip(body, [*body[1:], None], strict=False):
            if isinstance(node, ast.ClassDef) and is_public(node.name):
                yield from self._faults(path, node.body, node)
            elif isinstance(node, Function) and is_public(node.name):
                yield from self._function(path, node, owner)
            elif isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name) and owner:
                name, text = node.target.id, ast.get_docstring(owner) or ""
                if isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant):
                    text += f"\n\n{name} {after.value.value}"
                if is_public(name) and is_array(node.annotation) and not follows(name, text):
                    yield f"{path}:{node.lineno} {owner.name}.{name}: no shape of the field"

    def _function(self, path: str, node: Function, owner: ast.ClassDef | None) -> Iterator[str]:
        text = ast.get_docstring(node) or ""
        if owner:
            text = text or self.inherited(owner, node.name)
            if node.name == "__init__" or (not text and is_property(node)):
                text += "\n\n" + (ast.get_docstring(owner) or "")
        where = f"{path}:{node.lineno} {owner.name + '.' if owner else ''}{node.name}"
        given = [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs]
        given += [one for one in (node.args.vararg, node.args.kwarg) if one]
        names = [one.arg for one in given if is_array(one.annotation)]
        missing = without_shape(text, names, is_array(node.returns))
        if missing:
            yield f"{where}: no shape of {', '.join(missing)}"
        unnamed = sorted({name for name in raised(node.body) if not re.search(rf"\b{name}\b", text)})
        if unnamed and not any("command" in ast.unparse(one) for one in node.decorator_list):
            yield f"{where}: does not say that it raises {', '.join(unnamed)}"


@cache
def package() -> dict[str, ast.Module]:
    """The modules of the package by their paths."""
    paths = sorted(ROOT.rglob("*.py"))
    return {path.relative_to(ROOT).as_posix(): parse_file(path) for path in paths}


@cache
def source() -> Source:
    return Source(package())


ROOMS = sorted({path.relative_to(ROOT).parts[0] for path in ROOT.rglob("*.py")})


@pytest.mark.slow
@pytest.mark.parametrize("room", ROOMS)
def test_docstrings_state_shapes_and_errors(room: str) -> None:
    faults = list(source().faults(room))
    assert not faults, "\n" + "\n".join(faults)


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ('def f(a: Floats) -> None:\n    """Of ``a`` (N, 6) [N]."""', ""),
        ('def f(a: Floats, b: Ints | None) -> None:\n    """Of ``a`` and ``b`` (N,)."""', ""),
        ('def f(a: Floats) -> None:\n    """Of ``a``.  What is (N,) is another thing."""', ""),
        ('def f(a: Floats) -> Floats:\n    """(N,) of ``a``."""', "no shape of a"),
        ('def f(a: Floats) -> Floats:\n    """Something of ``a`` (N,)."""', "no shape of the value"),
        ('def f(a: Floats, b: Floats) -> Floats:\n    """(N,) of ``a`` (N,)."""', "no shape of b"),
        ("def f() -> tuple[Ints, int]: ...", "no shape of the value"),
        ("def f(g: Callable[[Ints], Floats]) -> Poses: ...", ""),
        ("def _f(a: Floats) -> Floats: ...", ""),
        ('class C:\n    """x: places."""\n    x: Floats', "no shape of the field"),
        ('class C:\n    """x (N, 3) [m]: places."""\n    x: Floats', ""),
        ('class C:\n    x: Floats\n    """(N,) [m]"""', ""),
        (
            'class A:\n    def f(self) -> Floats:\n        """(N,)."""\nclass B(A):\n    def f(self) -> Floats: ...',
            "",
        ),
        ("class A:\n    @property\n    def f(self) -> Floats: ...", "no shape of the value"),
        ('class A:\n    """f (N,): it."""\n    @property\n    def f(self) -> Floats: ...', ""),
        ('def f() -> None:\n    """Does."""\n    if x:\n        raise Refusal(y)', "raises Refusal"),
        ('def f() -> None:\n    """Raises Refusal."""\n    if x:\n        raise Refusal(y)', ""),
        ("def f() -> None:\n    try:\n        raise ValueError\n    except ValueError:\n        raise", ""),
        ("def f() -> None:\n    with x:\n        raise ValueError(1)", "raises ValueError"),
        (
            "def f() -> None:\n    try:\n        g()\n    except KeyError:\n        raise OSError(1)",
            "raises OSError",
        ),
    ],
)
def test_what_counts_as_stated(text: str, fault: str) -> None:
    faults = list(Source({"room/module.py": ast.parse(text)}).faults())
    assert [bool(fault)] * len(faults) == ([True] if fault else [])
    assert all(fault in one for one in faults)


X, Y, Z = np.eye(3)

KELVIN = 12.0
VALUES = {
    BaseCompliance: {"c_x": 2e-8, "c_y": 3e-8, "c_z": 1e-8, "c_rx": 2e-8, "c_ry": 3e-8, "c_rz": 1e-8},
    LinkCompliance: {f"c{i}{axis}": 1e-7 * (i + 0.5 * (axis == "x")) for i in range(1, 7) for axis in "xy"},
    ThermalGrowth: {"g2": 1.5e-5, "g3": 2e-5, "g4": 1e-5},
    ToolOffset: {"x": 0.02, "y": -0.01, "z": 0.15, "rx": 0.3, "ry": -0.2, "rz": 0.1},
    ToolCompliance: {"radial": 5e-8, "axial": 1e-8},
}


def rebuilt_tcp(values: dict[str, float], q: np.ndarray, wrench: np.ndarray) -> np.ndarray:
    """TCP (3,) [m] of a KR 270 at ``q`` (6,) [rad] under ``wrench`` (6,) [N, N m], written from docstrings alone."""
    d1, a1, a2, a3, d4, d6 = 0.75, 0.35, 1.25, -0.055, 1.1, 0.23
    axes, xs, ys = (-Z, Y, Y, -X, Y, -X), (X, Z, Z, Z, Z, Z), (-Y, X, X, Y, X, Y)
    ways = (0 * X, a1 * X + d1 * Z, a2 * X, d4 * X + a3 * Z, 0 * X, 0 * X)
    # (turns, axis in the frame that the steps before have moved, what its amount follows from, amount without load)
    steps = [
        (k > 2, (X, Y, Z)[k % 3], f"c_{name}", 0.0)
        for k, name in enumerate(("x", "y", "z", "rx", "ry", "rz"))
    ]
    for i, (way, x, y, axis) in enumerate(zip(ways, xs, ys, axes, strict=True), 1):
        if way.any():
            length = float(np.linalg.norm(way))
            steps.append((False, way / length, "", length + values[f"g{i}"] * KELVIN))
        steps += [(True, x, f"c{i}x", 0.0), (True, y, f"c{i}y", 0.0), (True, axis, "", q[i - 1])]
    steps.append((False, X, "", d6))
    tool = (-Z, Y, X)  # the axes of the flange at zero
    steps += [(False, tool[k], "", values["xyz"[k]]) for k in range(3)]
    steps += [(True, tool[k], "", values[f"r{'xyz'[k]}"]) for k in range(3)]
    steps += [(False, tool[k], ("radial", "radial", "axial")[k], 0.0) for k in range(3)]
    amounts = [amount for *_, amount in steps]
    for _ in range(60):
        at, rotation, there = np.zeros(3), np.eye(3), []
        for (turns, axis, _, _), amount in zip(steps, amounts, strict=True):
            there.append((rotation @ axis, at))
            if turns:
                rotation = rotation @ rotation_from_vector(amount * axis)
            else:
                at = at + amount * (rotation @ axis)
        for k, ((own, origin), (turns, _, name, _)) in enumerate(zip(there, steps, strict=True)):
            if name:
                moment = wrench[3:] + np.cross(at - origin, wrench[:3])
                amounts[k] = values[name] * float(own @ (moment if turns else wrench[:3]))
    return at


def test_effects_can_be_rebuilt_from_their_docstrings() -> None:
    model = StiffnessModel.from_robot(kr270()).without_effects(["joint_compliance", "gravity_compensator"])
    for effect, values in VALUES.items():
        model = model.with_effect(effect(model.robot.joints))
        model = model.with_values({(len(model.terms) - 1, name): value for name, value in values.items()})
    q, wrench = (
        np.array([0.3, -0.8, 1.1, 0.4, 0.7, -0.5]),
        np.array([1500.0, -900.0, 2000.0, 120.0, -80.0, 60.0]),
    )
    conditions = Conditions(temperature=np.array([KELVIN]))
    found = model.equilibrium(q[None], wrench[None], Poses.identity(), conditions)
    stated = {name: value for values in VALUES.values() for name, value in values.items()}
    assert found.pose.position[0] == pytest.approx(rebuilt_tcp(stated, q, wrench), abs=1e-10)
    away = rebuilt_tcp(stated, q, wrench) - rebuilt_tcp(stated, q, 0 * wrench)
    assert np.linalg.norm(away) > 1e-3
