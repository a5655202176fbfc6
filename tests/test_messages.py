"""Every message is a sentence in the words of the field: collected from the source with ``ast``.

A text has a verb if one of its words is a finite verb form that the messages never use as a noun ("is", "exceeds"), or
if one of its clauses starts with an imperative ("name", "state").  So a bare noun phrase ("no compliance") fails, and a
noun that looks like a verb ("the force", "its limits") does not help it.
"""

from __future__ import annotations

import ast
import itertools
import re
from functools import cache
from pathlib import Path

import pytest
from sources import parse, walk

import postproc
from postproc.base.findings import CODES, SEVERITIES, Code, Finding, define
from postproc.codes import ALL, TABLES

ROOT = Path(postproc.__file__).parent
CODE = re.compile(r"[A-Z]{3}[0-9]{3}\Z")


def words_of(text):
    return frozenset(text.split())


FINITE = words_of(
    """
    collide collides cuts face meets reaches removes touches
    accepts act acts affects agree allows answers applies approximates are asks assumes becomes belong
    belongs can cannot carries carry causes chooses combines come compares computes consist consists contain
    contains continue continues contradict contradicts contribute converge converges converts corrects could counts
    declares decreases define defines deflects depend depends describe describes determine determines did
    differ differs disagrees divides do does drives enters equals exceed exceeds exclude excludes executes
    exist exists explain explains express fails fits follow follows fulfils generates get gets give gives
    has have ignores imply includes interpolates is keep keeps lacks lead leads leaves make makes may mimics
    mixes move must need needs occupy occur occurs omits overflows overlap overwrites permits precedes
    predicts preserve produces proposes reach reaches reads reduce refuses relates relies remain remains
    repeats replaces requests require requires reserves rotate rotates sees select selects separate serves
    should show shows slows starts stops stays subtracts treat use uses varies want wants was will would writes wrote
    """
)
"""Verb forms that no message uses as a noun."""
IMPERATIVES = words_of(
    """
    complete retract
    add allow approach attach build call change check choose close compare compensate convert copy correct
    create declare define expand export fill fit give identify ignore import increase insert install keep
    let limit list load loosen make mark measure move name omit open pass pick plan program put raise
    re-orient read record reduce remove rename repeat replace report request require retype run save select
    separate set sort split start state study subtract treat use wait watch write
    """
)
"""Verbs with which a clause tells what to do; elsewhere many of them are nouns."""
OLD_WORDS = re.compile(
    r"""\b(
    doubts?|blame|on\ the\ way|way|ways|links?|left|deserves|bent|bends?|stands?\ (on|for|beside|with|twice|in)|stands
    |passes\ beside|mm\ beside|deg\ beside|holds?|held(?!-out)|gives?\ way|stable\ rest|no\ rest|postures?
    |says?|saying|said|nothing\ can\ be\ seen|told|tells?|by\ chance|by\ accident|foils?|behind|begins?|beginning|begun
    |was\ meant|is\ meant|than\ meant|own-points|keep-points|force-offset|force-rerun|--again|can\ not|no\ longer
    )\b""",
    re.X | re.I,
)
HOMOGRAPHS = words_of(
    """
    address calls count cover covers form match matches moves name names runs share shifts state states
    """
)
"""Nouns as well as verbs: a verb where an object follows."""
OBJECTS = words_of(
    """
    a an another the no none nothing only it its their each every what as {}
    """
)

ALLOWED = {
    ("cell/", "left"): "the side of a wall",
    ("workflows/cell_tool_errors.py", "left"): "the side of a wall",
    ("robot/", "link"): "of an arm, as a URDF calls it",
    ("effects/", "link"): "of an arm",
    ("effects/", "links"): "of an arm",
    ("batching/", "link"): "a symbolic link of the file system",
    ("workflows/program.py", "link"): "a symbolic link of the file system",
}
"""(Where, an old word) -> the meaning in which it is right there."""

COMPOSED = {
    "column {}: {}": "the message of a cell, with its column",
    "column {} of the header {}": "the last value is 'has no name' or 'repeats the name ...'",
    "touch_points: {}": "the message of a touch point",
    "--wanted {}: {}": "the message of a wish",
    "the touch point {}, {}, {} {} with the tool and orientation of line {}": "'is out of reach' and the like",
    "{}, tolerance {} mm": "an error in a sentence, and its tolerance",
}
"""Templates whose verb is in one of their values."""


def flat(node):
    """The text of a string or f-string, each value of it as ``{}``; None for anything else."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return node.value
    if isinstance(node, ast.JoinedStr):
        return "".join(part.value if isinstance(part, ast.Constant) else "{}" for part in node.values)
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add):
        left, right = flat(node.left), flat(node.right)
        return None if left is None and right is None else (left or "{}") + (right or "{}")
    return None


def choices(node, names):
    """(line, text) that an argument may have: a template, one of a condition, or of the assignments to its name."""
    if isinstance(node, ast.IfExp):
        return choices(node.body, names) + choices(node.orelse, names)
    if isinstance(node, ast.Name):
        return names.get(node.id, [])
    text = flat(node)
    return [] if text is None else [(node.lineno, text)]


def assignments(function):
    """Name -> the texts that are assigned to it in a function, with what is appended (``+=``) to the last one."""
    names: dict[str, list] = {}
    nodes = [node for node in walk(function) if isinstance(node, ast.Assign | ast.AugAssign)]
    for node in sorted(nodes, key=lambda one: one.lineno):
        target = node.targets[0] if isinstance(node, ast.Assign) else node.target
        if not isinstance(target, ast.Name):
            continue
        here = names.setdefault(target.id, [])
        if isinstance(node, ast.Assign):
            here.extend(choices(node.value, {}))
        elif here:
            here[-1] = (here[-1][0], here[-1][1] + (flat(node.value) or "{}"))
    return names


def is_code(node):
    """Whether a node is the code of a finding, or a choice of two."""
    if isinstance(node, ast.IfExp):
        return is_code(node.body) or is_code(node.orelse)
    return isinstance(node, ast.Constant) and isinstance(node.value, str) and bool(CODE.match(node.value))


def arguments(call):
    """The arguments of a call that are a message, or a help: after a code, or by their names."""
    name = getattr(call.func, "id", getattr(call.func, "attr", ""))
    at = next((k for k, node in enumerate(call.args) if is_code(node)), None)
    if at is None and name == "Finding":
        at = 0
    if at is None or name == "Code":
        return []
    later = [node for node in call.args[at + 2 :] if name == "error" and " " in (flat(node) or "")]
    return [
        *call.args[at + 1 : at + 2],
        *later,
        *(word.value for word in call.keywords if word.arg == "help"),
    ]


def collect(source):
    """(line, text) of the messages and helps of all findings, and of all exceptions, in a source text."""
    tree = parse(source)
    names: dict[ast.AST, dict] = {}
    for function in walk(tree):
        if isinstance(function, ast.FunctionDef):
            here = assignments(function)
            names.update((node, here) for node in walk(function))
    found = set()
    for node in walk(tree):
        wanted = arguments(node) if isinstance(node, ast.Call) else []
        if isinstance(node, ast.Raise) and isinstance(node.exc, ast.Call) and not arguments(node.exc):
            wanted = [value for value in node.exc.args if " " in (flat(value) or "")]
        for value in wanted:
            found.update(choices(value, names.get(node, {})))
    return sorted(found)


def literals(source):
    """(line, text) of every text of a source but its docstrings and the help of command-line options."""
    tree = parse(source)
    skipped = set()
    for node in walk(tree):
        if isinstance(node, ast.Expr):
            skipped.add(node.value)
        elif isinstance(node, ast.JoinedStr):
            skipped.update(node.values)
        elif isinstance(node, ast.Call) and getattr(node.func, "attr", "") in ("option", "argument"):
            skipped.update(walk(node))
    found = [(node.lineno, flat(node)) for node in walk(tree) if node not in skipped and flat(node)]
    return [(line, text) for line, text in found if " " in text.strip()]


def clauses(text):
    """The clauses of a text, each as its words in lower case."""
    for clause in re.split(r"[.;:,(]\s+|\s(?:and|or|then|so|to)\s", text):
        words = re.findall(r"{}|[a-z][a-z-]*", clause.lower().removeprefix("please "))
        if words:
            yield words


def has_verb(text):
    """Whether a text has a finite verb, a clause that starts with an imperative, or a homograph with an object."""
    return any(
        words[0] in IMPERATIVES
        or FINITE & set(words)
        or any(one in HOMOGRAPHS and other in OBJECTS for one, other in itertools.pairwise(words))
        for words in clauses(text)
    )


def is_composed(text):
    """Whether a text is nothing but values and what joins them: its words are those of other templates."""
    return text in COMPOSED or not re.search(r"[a-z]{2}", text)


@cache
def sources():
    """Path -> source of every module that reports something about an input; reports and schemas have other words."""
    return {
        path.relative_to(ROOT).as_posix(): path.read_text(encoding="utf-8")
        for path in sorted(ROOT.rglob("*.py"))
        if path.relative_to(ROOT).parts[0] not in ("report", "schemas")
    }


def old_word(text, path=""):
    """A word in a text that no message may have, or None."""
    words = (match[0].lower() for match in OLD_WORDS.finditer(text))
    return next(
        (word for word in words if not any(path.startswith(at) and word == one for at, one in ALLOWED)), None
    )


@pytest.mark.slow
def test_every_message_has_a_verb():
    wrong = [
        f"{path}:{line}: {text}"
        for path, source in sources().items()
        for line, text in collect(source)
        if not is_composed(text) and not has_verb(text)
    ]
    assert wrong == []


@pytest.mark.slow
def test_no_message_has_a_word_that_the_field_does_not_know():
    wrong = [
        f"{path}:{line}: {word!r} in {text}"
        for path, source in sources().items()
        for line, text in literals(source)
        if (word := old_word(text, path))
    ]
    assert wrong == []


@pytest.mark.parametrize("code", sorted(ALL))
def test_every_code_is_explained(code):
    """What it means, why it matters and what to do, each in sentences; and an example."""
    entry = ALL[code]
    assert entry.severity in SEVERITIES
    assert entry.title
    for part in (entry.meaning, entry.consequence, entry.action):
        assert part.endswith(".")
        for sentence in re.split(r"(?<=[a-z)`0-9])\. (?=[A-Z])", part):
            assert has_verb(sentence), sentence
    assert entry.example.endswith((".", "?"))
    assert Finding(code, "a message is here").advice == entry.action


def test_the_rooms_tables_are_apart_and_complete():
    """No code is in two tables, and the table of ``check --list-codes`` has all that a source names."""
    assert sum(map(len, TABLES)) == len(ALL)
    assert dict(CODES) == ALL
    named = {
        node.value
        for source in sources().values()
        for node in walk(parse(source))
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and CODE.match(node.value)
    }
    assert named == set(ALL)


def test_a_code_belongs_to_one_room():
    code = next(iter(ALL))
    other = Code("info", "another", "It is another.", "It matters.", "Do it.", "This.")
    with pytest.raises(ValueError, match=code):
        define({code: other})
    with pytest.raises(ValueError, match="is not defined"):
        Finding("XYZ999", "a message")


def test_a_module_knows_the_codes_that_it_uses():
    """What a module imports, its packages and what these import, defines every code that it names."""
    graph: dict[str, set[str]] = {}
    uses: dict[str, set[str]] = {}
    defines: dict[str, set[str]] = {}
    names = {}
    for path, source in sources().items():
        parts = ["postproc", *Path(path).with_suffix("").parts]
        names[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = parse(source)
    for name, tree in names.items():
        wanted = graph.setdefault(name, set())
        wanted.update(".".join(name.split(".")[:k]) for k in range(1, name.count(".") + 1))
        for node in walk(tree):
            if isinstance(node, ast.ImportFrom):
                wanted.add(str(node.module))
                wanted.update(f"{node.module}.{alias.name}" for alias in node.names)
            if isinstance(node, ast.Constant) and isinstance(node.value, str) and CODE.match(node.value):
                uses.setdefault(name, set()).add(node.value)
            if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "define":
                defines[name] = {key.value for key in node.args[0].keys}
    assert set().union(*defines.values()) == set(ALL)

    def reached(name):
        seen, todo = set(), [name]
        while todo:
            here = todo.pop()
            if here not in seen:
                seen.add(here)
                todo += [other for other in graph.get(here, ()) if other in graph]
        return seen

    for name, codes in uses.items():
        known = set().union(*(defines.get(other, set()) for other in reached(name)))
        assert codes <= known, f"{name}: {sorted(codes - known)}"


@pytest.mark.parametrize(
    ("text", "good"),
    [
        ("the base is not known", True),
        ("state it in the cell", True),
        ("check the base, or name it", True),
        ("no compliance", False),
        ("the force of a motion", False),
        ("cut of lines 3 to 7", False),
        ("its limits", False),
    ],
)
def test_a_bare_noun_phrase_has_no_verb(text, good):
    assert has_verb(text) is good


def test_messages_are_collected_from_the_source():
    source = """
def check(table, rows):
    message = f"row {rows[0]} is wrong"
    message += " here"
    table.refuse(rows, "FRC003", message)
    raise Refusal(Finding("FIL001" if rows else "FIL002", "a held " + message, help="look"))
    raise ValueError("no good")
"""
    texts = [text for _, text in collect(source)]
    assert texts == ["row {} is wrong here", "a held {}", "look", "no good"]
    assert [text for text in texts if not has_verb(text)] == ["a held {}", "look", "no good"]
    assert [text for text in texts if old_word(text)] == ["a held {}"]
