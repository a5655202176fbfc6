"""Syntax trees of the package's and the tests' sources: each text is parsed once, each tree is walked once."""

from __future__ import annotations

import ast
from functools import cache
from pathlib import Path


@cache
def parse(source: str) -> ast.Module:
    """The tree of a source text; who asks again gets the same one, and changes nothing in it."""
    return ast.parse(source)


def parse_file(path: Path) -> ast.Module:
    return parse(path.read_text(encoding="utf-8"))


def walk(node: ast.AST) -> list[ast.AST]:
    """What ``ast.walk`` gives, in its order, but without the contexts ``Load`` and ``Store``."""
    return _walk_module(node) if isinstance(node, ast.Module) else _walk(node)


def _walk(node: ast.AST) -> list[ast.AST]:
    found = [node]
    for each in found:  # grows while it is read
        for value in each.__dict__.values():
            if type(value) is list:
                found += [part for part in value if isinstance(part, ast.AST)]
            elif isinstance(value, ast.AST) and not isinstance(value, ast.expr_context):
                found.append(value)
    return found


_walk_module = cache(_walk)
