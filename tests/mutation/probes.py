"""Who reaches a mutant, and the mutant in its place, without a second import.

A module with mutants is imported with calls in it that note which of them a run comes by: before the statement of each
mutant inside of a function; at the start of every function of the file for one that runs at import.  Every test may
come by a file without functions, a table, and the tests of a file by what runs at import in the modules that it
imports.  In a process that is forked later the function that holds a mutant gets the code of the mutated file: what was
imported stays.
"""

from __future__ import annotations

import ast
import builtins
import functools
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from importlib.machinery import ModuleSpec, PathFinder, SourceFileLoader
from pathlib import Path
from types import CodeType, FunctionType, ModuleType
from typing import Any

from mutation.mutants import Mutant

NOTE = "__mutant_reached__"
"""Name in ``builtins`` of what a probe calls."""
Function = ast.FunctionDef | ast.AsyncFunctionDef


class Reached:
    """Numbers of the mutants that what runs now comes by."""

    def __init__(self) -> None:
        self.now: set[int] = set()

    def __call__(self, *numbers: int) -> None:
        self.now.update(numbers)

    def turn(self, other: set[int]) -> set[int]:
        """Notes in ``other`` from here on; gives what was noted in before."""
        before, self.now = self.now, other
        return before


def nested_statements(node: ast.AST) -> Iterator[tuple[list[ast.stmt], ast.stmt]]:
    """Every statement below a node, with the list in which it is."""
    for _, value in ast.iter_fields(node):
        for part in value if isinstance(value, list) else [value]:
            if isinstance(part, ast.stmt) and isinstance(value, list):
                yield value, part
            if isinstance(part, ast.AST):
                yield from nested_statements(part)


def first_line(node: ast.stmt) -> int:
    """As ``co_firstlineno`` counts: decorators belong to a function."""
    decorators = getattr(node, "decorator_list", [])
    return min([node.lineno, *(decorator.lineno for decorator in decorators)])


def within(node: ast.stmt, place: tuple[int, int]) -> bool:
    return (node.lineno, node.col_offset) <= place < (node.end_lineno or 0, node.end_col_offset or 0)


def outer_functions(tree: ast.AST) -> list[Function]:
    """Functions of a module and of its classes, not those inside of others."""
    found: list[Function] = []
    for part in ast.iter_child_nodes(tree):
        if isinstance(part, Function):
            found.append(part)
        else:
            found += outer_functions(part)
    return found


def holder(tree: ast.Module, line: int, column: int) -> Function | None:
    """The outer function in whose body a place is; None for what runs at import, a default value too."""
    for function in outer_functions(tree):
        if any(within(statement, (line, column)) for statement in function.body):
            return function
    return None


def has_docstring(body: Sequence[ast.stmt]) -> bool:
    first = body[0]
    return isinstance(first, ast.Expr) and isinstance(first.value, ast.Constant)


def with_probes(source: str, mutants: dict[int, Mutant]) -> ast.Module:
    """The file's tree with a probe for each of its mutants (number -> mutant)."""
    tree = ast.parse(source)
    places: list[tuple[list[ast.stmt], ast.stmt, list[int]]] = []
    at_import = []
    for number, mutant in mutants.items():
        place = mutant.line, len(source.splitlines()[mutant.line - 1][: mutant.column].encode())
        function = holder(tree, *place)
        if function is None:
            at_import.append(number)
            continue
        # the last one is the innermost
        *_, (block, statement) = (part for part in nested_statements(function) if within(part[1], place))
        places.append((block, statement, [number]))
    if at_import:
        for function in outer_functions(tree):
            body = function.body
            place_in_body = 1 if has_docstring(body) and len(body) > 1 else 0
            places.append((body, body[place_in_body], at_import))
    for block, statement, numbers in places:
        call = ast.Call(ast.Name(NOTE, ast.Load()), [ast.Constant(number) for number in numbers], keywords=[])
        probe = ast.copy_location(ast.Expr(call), statement)
        block.insert(next(i for i, one in enumerate(block) if one is statement), probe)
    return ast.fix_missing_locations(tree)


class _Loader(SourceFileLoader):
    def __init__(self, name: str, path: str, mutants: dict[int, Mutant]) -> None:
        super().__init__(name, path)
        self.mutants = mutants

    def get_code(self, fullname: str) -> CodeType:
        tree = with_probes(Path(self.path).read_text(encoding="utf-8"), self.mutants)
        return compile(tree, self.path, "exec", dont_inherit=True)


class Probes:
    """Finds the modules that have mutants, and imports them with probes; ``mutants``: by their numbers."""

    def __init__(self, tree: Path, mutants: Sequence[Mutant]) -> None:
        self.files: dict[str, dict[int, Mutant]] = {}
        for number, mutant in enumerate(mutants):
            self.files.setdefault(str(tree / mutant.path), {})[number] = mutant
        self.reached = Reached()
        self.of_tables: set[int] = set()
        """Mutants of files without functions."""
        self.at_import: dict[str, set[int]] = {}
        """Name of a module -> its mutants that run at import alone."""
        for path, some in self.files.items():
            source = Path(path).read_text(encoding="utf-8")
            parsed, lines = ast.parse(source), source.splitlines()
            if not outer_functions(parsed):
                self.of_tables |= set(some)
            name = ".".join(Path(path).relative_to(tree).with_suffix("").parts)
            self.at_import[name] = {
                number
                for number, mutant in some.items()
                if holder(parsed, mutant.line, len(lines[mutant.line - 1][: mutant.column].encode())) is None
            }

    def install(self) -> None:
        setattr(builtins, NOTE, self.reached)
        sys.meta_path.insert(0, self)

    def find_spec(self, name: str, path: Any = None, target: ModuleType | None = None) -> ModuleSpec | None:
        found = PathFinder.find_spec(name, path, target)
        if found is None or found.origin not in self.files:
            return None
        found.loader = _Loader(name, found.origin, self.files[found.origin])
        return found


def codes(code: CodeType) -> Iterator[CodeType]:
    yield code
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from codes(constant)


def functions_of(owner: object, names: Sequence[str]) -> Iterator[FunctionType]:
    """Functions of a module or class behind a dotted name, below decorators that name what they wrap."""
    values = vars(owner) if isinstance(owner, ModuleType | type) else {}
    if names[0] not in values:
        return
    found: Any = values[names[0]]
    if len(names) > 1:
        yield from functions_of(found, names[1:])
        return
    open_: list[Any] = [found]
    while open_:
        one = open_.pop()
        if isinstance(one, FunctionType):
            yield one
        further = [getattr(one, name, None) for name in ("__wrapped__", "__func__", "fget", "fset", "func")]
        open_ += [part for part in further if part is not None and (callable(part) or hasattr(part, "fget"))]


def dotted(tree: ast.AST, function: Function) -> list[str]:
    """The names of the classes around an outer function, and its own."""
    for part in ast.iter_child_nodes(tree):
        if part is function:
            return [function.name]
        if any(inner is function for inner in ast.walk(part)):
            below = dotted(part, function)
            return [part.name, *below] if isinstance(part, ast.ClassDef) else below
    return [function.name]


@dataclass(frozen=True)
class Swap:
    """Functions of this process that hold a mutant, and the code that they have with it."""

    functions: tuple[FunctionType, ...]
    code: CodeType

    def put_in_place(self) -> None:
        for function in self.functions:
            function.__code__ = self.code


def swap_of(tree: Path, mutant: Mutant, text: str, source: str) -> Swap | None:
    """How to put a mutant in place, in this process; None where that can not be done."""
    path = str(tree / mutant.path)
    parsed = ast.parse(source)
    column = len(source.splitlines()[mutant.line - 1][: mutant.column].encode())
    function = holder(parsed, mutant.line, column)
    if function is None:
        return None
    place = function.name, first_line(function)
    wanted = [
        code
        for code in codes(compile(text, path, "exec", dont_inherit=True))
        if (code.co_name, code.co_firstlineno) == place
    ]
    module = next((one for one in list(sys.modules.values()) if getattr(one, "__file__", None) == path), None)
    if module is None or len(wanted) != 1:
        return None
    live = [
        one
        for one in functions_of(module, dotted(parsed, function))
        if (one.__code__.co_name, one.__code__.co_firstlineno) == place
        and one.__code__.co_freevars == wanted[0].co_freevars
    ]
    return Swap(tuple(live), wanted[0]) if live else None


def forget_results(tree: Path) -> None:
    """Empties what functions of the tree have cached by ``functools``."""
    kind = type(functools.lru_cache(print))
    for module in list(sys.modules.values()):
        if not str(getattr(module, "__file__", None) or "").startswith(str(tree)):
            continue
        for value in list(vars(module).values()):
            for one in [value, *(vars(value).values() if isinstance(value, type) else ())]:
                if isinstance(one, kind):
                    one.cache_clear()
