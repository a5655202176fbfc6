"""Tests and modules use what others offer: none reaches for a name of another that begins with an underscore."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest
from sources import parse, walk

FILES = sorted(Path(__file__).parent.rglob("*.py"))
MODULES = sorted((Path(__file__).parents[1] / "postproc").rglob("*.py"))
WITHOUT_PUBLIC_NAME = {
    *(("regex_automaton.py", name) for name in ("_compiler", "_constants", "_parser")),
    ("test_api.py", "report._repr_html_"),
    ("test_krl_aggregates.py", "there._replace"),
    ("gcode_flow_programs.py", "ran._replace"),
    ("test_paged_memory.py", "_core"),
    ("array_memory.py", "_core"),
    ("borrowed.py", "view._getvalue"),
    *(("stream.py", name) for name in ("_pytest", "item._fixtureinfo", "item._initrequest")),
    ("array_memory.py", "_ARRAY_API"),
}
"""Python parses a regular expression in modules that have no other names since version 3.11; notebooks ask
for a card by this name; so does a namedtuple call its copy; numpy's functions for extensions are in a table of this
name, and which handler an array has is asked for beside it; so are what numba makes of an array in compiled code, and
pytest's own way to run one test."""
BY_NAME = {"getattr", "hasattr", "setattr", "delattr"}
"""Functions and methods (``monkeypatch.setattr``) that take the name of an attribute as a text."""


def is_private(name: str) -> bool:
    return name.startswith("_") and not (name.startswith("__") and name.endswith("__"))


def own_names(tree: ast.AST) -> set[str]:
    """Names that a class, or a module, gives to itself: its functions, and what is assigned to ``self`` and ``cls``."""
    names = {node.name for node in walk(tree) if isinstance(node, ast.FunctionDef | ast.ClassDef)}
    for node in walk(tree):
        if isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store) and is_self(node.value):
            names.add(node.attr)
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            names.add(node.id)
    return names


def is_self(node: ast.AST) -> bool:
    return isinstance(node, ast.Name) and node.id in ("self", "cls")


def private_uses(text: str) -> Iterator[tuple[int, str]]:
    """(line, name) of every use of a private name in Python source that another module or class gave."""
    tree = parse(text)
    inside: dict[ast.AST, set[str]] = {}
    for node in walk(tree):
        if isinstance(node, ast.ClassDef):
            inside.update(dict.fromkeys(walk(node), own_names(node)))
    for node in walk(tree):
        if isinstance(node, ast.Attribute) and is_private(node.attr):
            if is_self(node.value) and node.attr in inside.get(node, ()):
                continue
            if ast.unparse(node) != "os._exit":
                yield node.lineno, ast.unparse(node)
        elif isinstance(node, ast.ImportFrom):
            words = [*(node.module or "").split("."), *(alias.name for alias in node.names)]
            yield from ((node.lineno, word) for word in words if is_private(word))
        elif isinstance(node, ast.Import):
            words = [word for alias in node.names for word in alias.name.split(".")]
            yield from ((node.lineno, word) for word in words if is_private(word))
        elif isinstance(node, ast.Call):
            called = getattr(node.func, "attr", getattr(node.func, "id", ""))
            texts = [one.value for one in node.args[:2] if isinstance(one, ast.Constant)]
            for said in texts if called in BY_NAME else ():
                name = str(said).rpartition(".")[2]
                own = is_self(node.args[0]) and name in inside.get(node, ())
                if is_private(name) and not own:
                    yield node.lineno, str(said)


@pytest.mark.parametrize(
    "text",
    [
        "from postproc.model import _forces",
        "from postproc._model import forces",
        "import postproc._model",
        "model._forces",
        "model._forces()",
        "model._forces = 1",
        "model()._forces[0]._laws",
        "monkeypatch.setattr(model, '_forces', None)",
        "monkeypatch.setattr('postproc.model._forces', None)",
        "getattr(model, '_forces')",
        "class A(B):\n    def f(self):\n        return super()._forces",
        "class A(B):\n    def f(self):\n        return self._forces",
        "class A(B):\n    def f(self):\n        return getattr(self, '_forces')",
    ],
)
def test_a_private_use_is_found(text):
    assert [*private_uses(text)]


@pytest.mark.parametrize(
    "text",
    [
        "from __future__ import annotations",
        "from postproc.model import forces as _forces",
        "_forces = 1\n_forces += 1",
        "model.__class__.__name__",
        "os._exit(1)",
        "class A:\n    def f(self):\n        self._a = 1\n        return self._a, self._g()\n    def _g(self): 0",
        "class A:\n    _forces: int = 0\n    def f(self):\n        return self._forces",
        "class A:\n    def f(self):\n        if not hasattr(self, '_forces'):\n            self._forces = 1",
        "print('_forces', getattr(model, 'forces'))",
    ],
)
def test_other_uses_are_no_private_ones(text):
    assert not [*private_uses(text)]


@pytest.mark.slow
def test_no_test_uses_a_private_name():
    found = [
        f"{path.name}:{line}: {name}"
        for path in FILES
        for line, name in private_uses(path.read_text(encoding="utf-8"))
        if (path.name, name) not in WITHOUT_PUBLIC_NAME
    ]
    assert len(FILES) > 100
    assert not found, "\n".join(found)


@pytest.mark.slow
def test_no_module_uses_a_private_name_of_another():
    """A class may lie in several files, and a namedtuple has methods that begin with an underscore."""
    found = []
    for path in MODULES:
        text = path.read_text(encoding="utf-8")
        own = own_names(parse(text)) | {"_replace"}
        for line, name in private_uses(text):
            last = name.rpartition(".")[2]
            if (path.name, name) in WITHOUT_PUBLIC_NAME:
                continue
            if last not in own and not name.startswith(("self.", "cls.")):
                found.append(f"{path.name}:{line}: {name}")
    assert len(MODULES) > 300
    assert not found, "\n".join(found)
