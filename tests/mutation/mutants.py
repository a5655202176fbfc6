"""Mutants of a file by the operators of cosmic-ray: where they are, and the text that each makes.

A *site* is a place of the source and a kind of mutation; a sample draws sites, and of each site one mutant, so that
an arithmetic sign, which has six mutants, counts no more than a ``not``.  Left out, because they measure nothing:

* strings, annotations, decorators;
* mutants that Python itself refuses for nearly all operands (``+`` to ``<<``) or that hang on interning
  (``==`` to ``is``): arithmetic stays arithmetic, bits stay bits, order stays order;
* ``strict=True`` of ``zip``: it says what holds, and changes nothing where it does;
* ``if TYPE_CHECKING``.
"""

from __future__ import annotations

import random
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import cosmic_ray.plugins
import parso
from cosmic_ray.ast import Visitor, get_ast
from cosmic_ray.mutating import mutate_code

ARITHMETIC = ("Add", "Sub", "Mul", "Div", "FloorDiv", "Mod", "Pow")
BITS = ("BitOr", "BitAnd", "BitXor")
SHIFTS = ("RShift", "LShift")
ORDER = ("Eq", "NotEq", "Lt", "LtE", "Gt", "GtE")
IDENTITY = ("Is", "IsNot")
KINDS = {
    "ReplaceBinaryOperator": (ARITHMETIC, BITS, SHIFTS),
    "ReplaceComparisonOperator": (ORDER, IDENTITY),
}
LEFT_OUT = {"RemoveDecorator", "VariableReplacer", "VariableInserter"}


NO_OPERATORS = frozenset(["(", ")", "[", "]", "{", "}", ",", ".", ":", ";", "=", "->", ":=", "@"])
NO_PLACES = {
    *("name", "string", "fstring_start", "fstring_string", "fstring_end", "newline", "endmarker"),
    *("file_input", "suite", "simple_stmt", "expr_stmt", "return_stmt", "trailer", "atom", "atom_expr"),
    *("arglist", "argument", "parameters", "param", "subscriptlist", "subscript", "dictorsetmaker"),
    *("testlist_comp", "testlist_star_expr", "fstring", "fstring_expr", "strings", "funcdef", "classdef"),
}
"""Types of nodes at which no operator mutates: nine of ten."""


@dataclass(frozen=True)
class Mutant:
    """One mutation: ``occurrence`` counts the operator's places in the file, as cosmic-ray does."""

    path: str
    operator: str
    occurrence: int
    line: int
    column: int
    first_line: int
    """Line on which the statement begins: tests that reach it reach the mutant."""

    @property
    def site(self) -> tuple[str, int, int, str]:
        return self.path, self.line, self.column, self.operator.split("/")[1].split("_")[0]

    def text(self, source: str) -> str | None:
        """The file with the mutation in it; None where Python does not compile it."""
        made = mutate_code(source, cosmic_ray.plugins.get_operator(self.operator)(), self.occurrence)
        if made is None or made == source:
            return None
        try:
            compile(made, self.path, "exec", dont_inherit=True)
        except (SyntaxError, ValueError):
            return None
        return str(made)


def fair(operator: str) -> bool:
    """Whether the operator stays in its kind."""
    name, *pair = operator.split("/")[1].split("_")
    if name in LEFT_OUT:
        return False
    kinds = KINDS.get(name)
    return kinds is None or any(set(pair) <= set(kind) for kind in kinds)


def statement(node: parso.tree.NodeOrLeaf) -> parso.tree.NodeOrLeaf:
    """The statement, or the head of a block, in which a node stands."""
    while node.parent is not None and node.parent.type not in ("file_input", "suite", "decorated"):
        node = node.parent
    return node


def silent(node: parso.tree.NodeOrLeaf) -> bool:
    """Whether a mutation of the node could only change what no run looks at."""
    child = node
    while child.parent is not None:
        parent = child.parent
        if parent.type in ("decorator", "tfpdef", "import_from", "import_name"):
            return True
        if parent.type == "parameters" and child.type == "operator":
            return True
        if parent.type == "annassign" and child is parent.children[1]:
            return True
        if parent.type == "param" and child is not parent.default:
            return True
        if parent.type == "funcdef" and child is parent.annotation:
            return True
        if parent.type == "argument" and parent.get_code(include_prefix=False).startswith("strict="):
            return True
        child = parent
    return bool(re.match(r"if TYPE_CHECKING\b", statement(node).get_code(include_prefix=False)))


class _Places(Visitor):
    """All mutants of all operators in one walk."""

    def __init__(self, path: str) -> None:
        self.path = path
        self.found: list[Mutant] = []
        names = [name for name in cosmic_ray.plugins.operator_names() if fair(name)]
        self._operators = [(name, cosmic_ray.plugins.get_operator(name)()) for name in names]
        self._counted = dict.fromkeys(names, 0)

    def visit(self, node: parso.tree.NodeOrLeaf) -> parso.tree.NodeOrLeaf:
        if node.type in NO_PLACES or (node.type == "operator" and node.value in NO_OPERATORS):
            return node
        quiet: bool | None = None
        for name, operator in self._operators:
            for start, _ in operator.mutation_positions(node):
                occurrence = self._counted[name]
                self._counted[name] += 1
                if quiet is None:
                    quiet = silent(node)
                if quiet:
                    continue
                first = statement(node).start_pos[0]
                self.found.append(Mutant(self.path, name, occurrence, *start, first_line=first))
        return node


def mutants(tree: Path, path: str) -> list[Mutant]:
    """All mutants of one file of a tree, whether they compile or not."""
    places = _Places(path)
    places.walk(get_ast((tree / path).read_text(encoding="utf-8")))
    return places.found


def sample(
    found: list[Mutant], size: int, seed: int, sources: dict[str, str]
) -> Iterator[tuple[Mutant, str]]:
    """Sites drawn without replacement, of each one mutant that compiles, with its text."""
    sites: dict[tuple[str, int, int, str], list[Mutant]] = {}
    for mutant in found:
        sites.setdefault(mutant.site, []).append(mutant)
    order = list(sites.values())
    chance = random.Random(seed)
    chance.shuffle(order)
    drawn = 0
    for site in order:
        if drawn == size:
            return
        chance.shuffle(site)
        for mutant in site:
            text = mutant.text(sources[mutant.path])
            if text is not None:
                drawn += 1
                yield mutant, text
                break
