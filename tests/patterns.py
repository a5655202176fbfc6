"""Every regular expression of the package and how it is used: `match`, `fullmatch` or `search`."""

import ast
import importlib
import pkgutil
import re
import types
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path

from sources import parse_file, walk

import postproc

USES = {
    "match": "match",
    "fullmatch": "fullmatch",
    **dict.fromkeys(("search", "finditer", "findall", "split", "sub", "subn"), "search"),
}
Pattern = tuple[str, re.Pattern, str]  # where, the pattern, its use


@cache
def find_patterns() -> list[Pattern]:
    """Patterns of all modules, those compiled on import and those written inside of functions."""
    found: dict[tuple, Pattern] = {}
    trees = {}
    for module in _modules():
        source = Path(module.__file__ or "")
        trees[module.__name__] = parse_file(source)
    everywhere = _uses_of_names(trees.values())
    for module in _modules():
        here = _uses_of_names([trees[module.__name__]])
        for name, pattern in _patterns_in(vars(module), ""):
            last = name.split(".")[-1].split("[")[0]
            uses = here if last.startswith("_") else everywhere
            for use in sorted(uses.get(last, {"match", "search"})):
                found.setdefault(
                    (pattern.pattern, pattern.flags, use), (f"{module.__name__}.{name}", pattern, use)
                )
        if isinstance(comment := getattr(module, "COMMENT", None), bytes):  # compiled by the lexer
            found.setdefault(comment, (f"{module.__name__}.COMMENT", re.compile(comment, re.M), "search"))
        for line, pattern, use in _written_in_functions(trees[module.__name__]):
            found.setdefault(
                (pattern.pattern, pattern.flags, use), (f"{module.__name__}:{line}", pattern, use)
            )
    return list(found.values())


def _modules() -> Iterator[types.ModuleType]:
    yield postproc
    for each in pkgutil.walk_packages(postproc.__path__, "postproc."):
        if not each.name.endswith("__main__"):
            yield importlib.import_module(each.name)


def _patterns_in(names: dict, before: str, deep: int = 0) -> Iterator[tuple[str, re.Pattern]]:
    for name, value in list(names.items()):
        place = f"{before}{name}"
        if isinstance(value, re.Pattern):
            yield place, value
        elif isinstance(value, dict) and deep < 3 and not str(name).startswith("__"):
            yield from _patterns_in({f"[{key!r}]": each for key, each in value.items()}, place, deep + 1)
        elif isinstance(value, tuple | list | frozenset | set) and deep < 3:
            yield from _patterns_in(
                {f"[{number}]": each for number, each in enumerate(value)}, place, deep + 1
            )
        elif isinstance(value, type) and value.__module__.startswith("postproc") and deep < 2:
            yield from _patterns_in(dict(vars(value)), f"{place}.", deep + 1)
        elif hasattr(value, "__dataclass_fields__") and not isinstance(value, type) and deep < 3:
            fields = {each: getattr(value, each, None) for each in value.__dataclass_fields__}
            yield from _patterns_in(fields, f"{place}.", deep + 1)


def _uses_of_names(trees: Iterable[ast.Module]) -> dict[str, set[str]]:
    """Uses by the last name of what is called: `_NAME.search(...)`, `lexing.NAME.match`."""
    uses: dict[str, set[str]] = {}
    for tree in trees:
        for node in walk(tree):
            if isinstance(node, ast.Attribute) and node.attr in USES:
                owner = node.value
                while isinstance(owner, ast.Subscript | ast.Call):
                    owner = owner.value if isinstance(owner, ast.Subscript) else owner.func
                name = owner.attr if isinstance(owner, ast.Attribute) else getattr(owner, "id", "")
                uses.setdefault(name, set()).add(USES[node.attr])
    return uses


def _written_in_functions(tree: ast.Module) -> Iterator[tuple[int, re.Pattern, str]]:
    """Patterns as literals of `re.match(...)` and the like; a part that is put in is a letter here."""
    functions = [each for each in walk(tree) if isinstance(each, ast.FunctionDef)]
    inside = {inner: None for function in functions for inner in walk(function)}  # one may lie in another
    for node in inside:
        called = isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute)
        if not (called and getattr(node.func.value, "id", "") == "re" and node.args):
            continue
        text = _literal(node.args[0])
        if text is None or node.func.attr not in {*USES, "compile"}:
            continue
        flags = re.NOFLAG
        for each in [*node.args[1:], *(keyword.value for keyword in node.keywords if keyword.arg == "flags")]:
            for part in walk(each):
                if isinstance(part, ast.Attribute) and isinstance(getattr(re, part.attr, None), re.RegexFlag):
                    flags |= getattr(re, part.attr)
        yield node.lineno, re.compile(text, flags), USES.get(node.func.attr, "search")


def _literal(node: ast.expr) -> str | bytes | None:
    if isinstance(node, ast.Constant):
        return node.value
    if isinstance(node, ast.JoinedStr):
        return "".join(part.value if isinstance(part, ast.Constant) else "q" for part in node.values)
    return None
