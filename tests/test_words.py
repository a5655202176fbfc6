"""What people read is in the words of the field: command line, schemas, pages, terminal, findings and documents; and so
are the names of modules, classes, functions, parameters and fields.

That messages of findings are sentences is in ``test_messages.py``.
"""

from __future__ import annotations

import ast
import re
from html.parser import HTMLParser
from pathlib import Path

import click
import pytest
from sources import parse_file, walk

import postproc
from postproc.cli.main import COMMANDS, main
from postproc.report.result_keys import FORMER_KEYS
from postproc.schemas import RESULT_SCHEMAS, SCHEMAS, schema_of
from postproc.workflows.option_names import FORMER_OPTIONS

ROOT = Path(postproc.__file__).parent
HTML = ROOT / "report" / "html"
TOPS = ("postproc", "robots", "samples", "tests")
"""Folders with documents."""

FORMER = re.compile(
    r"\b(?:doubt|how sure|blame|ten.percent.mm|on the way|error.way|way.after|links?|left|deserves?|bent|bends?"
    r"|stands?|passes beside|gives? way|no stable rest|postures are free|says? nothing|can not be seen|nothing is seen"
    r"|held(?!.out)|heldout|to go on with|spoken|by chance|no longer holds|does not hold|told|tells?|said|begins?"
    r"|beginning|anew|behind|a look|hangs? on|asleep|foils?|unseen|own.points|keep.points|force.offset|force.rerun)\b"
    r"|--again\b|^of it$",
    re.IGNORECASE,
)
"""The left column of the vocabulary, and verbs that stood for its terms."""

ALLOWED = (
    r"link (?:geometry|gravity|compliance)",  # names of effects
    r"links?(?= \[mm\]| lengths?\b| geometry\b| before\b| that a joint\b)|bearings and links|URDF link",  # of an arm
    r"(?:parent|its|base|tip|next) link|the links?\b|rigid links|[Ll]inks and (?:axis )?limits|k the link",
    r"[Ll]ink lengths",
    r"of links\b|links that|A link between|a link that grows|with links",
    r"symbolic link|[Aa] link in the place|that is a link|no link is|it links every|links of worst",  # files, pages
    r"expected\sby chance|is by chance",  # statistics
    r"left and right step",  # keys of the keyboard
    r"drift of a stand|stands upright",  # a tripod; an arm
    r"stand for (?:each|joints)",
    r"left\}|left\b.{1,6}\bright\b|(?:to (?:its|the)|the) left|material.left|: left",  # sides
    r"left[ -]out|(?:is|are|be|was|ones) left|left (?:half|in the median)",  # what remains
    r"(?:entered|leaves|ramp) and left|that ramps? leaves|left the point|up to 0.4|FIRST .* left|are entered and left",
    r"on the way (?:out|back)",
    r"controller's own points|needs its own points",
)
"""What is no former word though it looks like one, and why."""

NAMES = re.compile(
    r"doubts?|unsure|half_widths|ways?|ration|beginning|begin|partly|holding|hold|meant|given|pinned|timed|any_plane"
    r"|oriented|free_axis|slur|jumped|bulk|loose|unclear|strange|foreign|telling|judging|stands?|course|taken|foils?"
    r"|price|asleep|upto|seen|unseen|offer|tour|suspicion|wild|gives_way|motors_at|nudged?|ending|publish|printable"
    r"|give_back|large_apart|sheet|hands|made|found|told|said|held|kept|bent|behind|anew"
)
"""Names of code that say nothing to a reader: the left column of the vocabulary, and participles."""

NAMES_THAT_STAY = {
    "kept": "readings and points that are no outliers, and copies of programs",
    "found": "what a compiled loop writes into, and a match of a regular expression",
}

TABLES_OF_FORMER_NAMES = {"result_keys.py"}


def former_words(text: str) -> list[str]:
    """Former words in a text."""
    text = text.replace("_", " ")
    for allowed in ALLOWED:
        text = re.sub(allowed, "", text)
    return FORMER.findall(text)


def strings(path: Path):
    """(line, text) of the strings of a module but for its docstrings, and the sides on which columns of tables are."""
    tree = parse_file(path)
    bare = set()
    for node in walk(tree):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            bare.add(id(node.value))
        if isinstance(node, ast.keyword) and node.arg in ("justify", "title_justify"):
            bare |= {id(inner) for inner in walk(node.value)}
    for node in walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in bare:
            yield node.lineno, node.value


class Visible(HTMLParser):
    """What a template shows, and what it tells a reader of screens."""

    SHOWN = ("aria-label", "aria-roledescription", "title", "alt", "placeholder")

    def __init__(self) -> None:
        super().__init__()
        self.texts: list[str] = []

    def handle_starttag(self, tag, attrs):
        self.texts += [value for name, value in attrs if name in self.SHOWN and value]

    def handle_data(self, data):
        self.texts.append(data.strip())


def visible(path: Path) -> list[str]:
    """The texts of a template, those that it gives inside of braces among them."""
    source = path.read_text(encoding="utf-8")
    parser = Visible()
    parser.feed(re.sub(r"\{%.*?%\}|\{\{.*?\}\}", " ", source))
    given = [
        quoted
        for braces in re.findall(r"\{\{(.*?)\}\}", source)
        for quoted in re.findall(r'"([^"]*)"|\'([^\']*)\'', braces)
    ]
    return [text for text in (*parser.texts, *("".join(quoted) for quoted in given)) if text]


def described(schema, path=""):
    """(path, text) of every key and every description of a schema that is no former name."""
    if isinstance(schema, list):
        for one in schema:
            yield from described(one, path)
    if not isinstance(schema, dict) or schema.get("deprecated") is True:
        return
    for key in ("description", "title"):
        if isinstance(schema.get(key), str):
            yield path, schema[key]
    for key, one in schema.items():
        if key in ("properties", "patternProperties"):
            for name, inner in one.items():
                if inner.get("deprecated") is not True:
                    yield f"{path}.{name}", name
                yield from described(inner, f"{path}.{name}")
        else:
            yield from described(one, path)


def test_what_is_looked_for():
    for word in (
        "no doubt",
        "left",
        "left as it was",
        "on the way",
        "deserves a look",
        "bent path",
        "what it stands on",
    ):
        assert former_words(f"x {word} x"), word
    for words in (*FORMER_KEYS["program"][""], *(f"--{name.replace('_', '-')}" for name in FORMER_OPTIONS)):
        assert former_words(words.partition(".")[0]), words
    for word in (
        "held-out poses",
        "the links before A3",
        "link_compliance",
        "expected by chance",
        "uncertainty",
    ):
        assert not former_words(word), word


@pytest.mark.parametrize("name", ["", *COMMANDS])
def test_help(name):
    command = COMMANDS.get(name, main)
    text = command.get_help(click.Context(command, info_name=name, terminal_width=10_000))
    assert "Usage:" in text
    assert [(line, words) for line in text.splitlines() if (words := former_words(line.strip()))] == []


@pytest.mark.parametrize("name", [*SCHEMAS, *RESULT_SCHEMAS])
def test_schemas(name):
    found = list(described(schema_of(name)))
    assert len(found) > 20
    assert [(path, text) for path, text in found if former_words(text)] == []


@pytest.mark.parametrize("path", sorted(HTML.glob("*.j2")), ids=lambda path: path.name)
def test_pages(path):
    found = visible(path)
    assert found
    assert [(text, words) for text in found if (words := former_words(text))] == []


@pytest.mark.parametrize("path", sorted(HTML.glob("*.js")), ids=lambda path: path.name)
def test_scripts_of_pages(path):
    source = re.sub(r"textAlign = [^;]*;", "", path.read_text(encoding="utf-8"))  # a side, no word
    found = re.findall(r"'[^'\n]*'|\"[^\"\n]*\"|`[^`]*`", source)
    assert found
    assert [(text, words) for text in found if (words := former_words(text[1:-1]))] == []


@pytest.mark.parametrize("room", sorted({path.relative_to(ROOT).parts[0] for path in ROOT.rglob("*.py")}))
def test_texts_of_the_rooms(room):
    """Every string that is more than a word; of the rooms that people read, words as well."""
    paths = [ROOT / room] if room.endswith(".py") else sorted((ROOT / room).rglob("*.py"))
    found = [
        (path.name, line, text)
        for path in paths
        if path.name not in TABLES_OF_FORMER_NAMES
        for line, text in strings(path)
        if " " in text.strip() or room in ("report", "cli", "schemas")
    ]
    assert [(*place, text, words) for *place, text in found if (words := former_words(text))] == []


def documents() -> list[Path]:
    here = ROOT.parent
    return sorted([here / "README.md", *(path for top in TOPS for path in (here / top).rglob("*.md"))])


def prose(text: str) -> str:
    """A document without what is printed in it, which is looked at where it is made, and without code."""
    return re.sub(r"`[^`\n]*`", "", re.sub(r"^ *```.*?^ *```", "", text, flags=re.M | re.S))


@pytest.mark.parametrize("path", documents(), ids=lambda path: f"{path.parent.name}-{path.name}")
def test_documents(path):
    text = prose(path.read_text(encoding="utf-8"))
    assert len(text) > 300
    paragraphs = [" ".join(one.split()) for one in text.split("\n\n")]
    assert [(one, words) for one in paragraphs if (words := former_words(one))] == []


def names(tree: ast.Module):
    """The names of a module's classes, functions, parameters and fields."""
    for node in walk(tree):
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            yield node.name
        elif isinstance(node, ast.arg):
            yield node.arg
        if isinstance(node, ast.ClassDef):
            for one in node.body:
                if isinstance(one, ast.AnnAssign) and isinstance(one.target, ast.Name):
                    yield one.target.id


def test_names_of_the_code():
    found: dict[str, set[str]] = {}
    for path in sorted(ROOT.rglob("*.py")):
        for name in (path.stem, *names(parse_file(path))):
            if NAMES.fullmatch(name.strip("_").lower()):
                found.setdefault(name.strip("_").lower(), set()).add(path.relative_to(ROOT).as_posix())
    assert {name: places for name, places in found.items() if name not in NAMES_THAT_STAY} == {}
    assert found.keys() == NAMES_THAT_STAY.keys()


def test_no_script_of_others():
    """Scripts of others come as packages: what lies here is this project's own, and small."""
    here = ROOT.parent
    scripts = [
        path
        for path in here.rglob("*.js")
        if not any(part.startswith(".") or part == "node_modules" for part in path.relative_to(here).parts)
    ]
    assert {path.parent for path in scripts} == {HTML}
    for path in scripts:
        text = path.read_text(encoding="utf-8")
        assert not re.search(
            r"copyright|licen[cs]e|@preserve|sourceMappingURL|https?://", text, re.IGNORECASE
        ), path
        assert max(map(len, text.splitlines())) < 260, f"{path} is minified"
