"""YAML files with other values, by ruamel.yaml's round trip: comments, order, quotes and numbers stay as written.

ruamel.yaml lays some lines out again (blanks in braces, a value below its key).  Where such a line has its old content,
the old file's is put back.
"""

from __future__ import annotations

import codecs
import re
from collections.abc import Callable, Iterable, Mapping
from difflib import SequenceMatcher
from io import StringIO
from pathlib import Path
from typing import Any

import yaml
from ruamel.yaml import YAML, CommentToken
from ruamel.yaml.comments import CommentedMap, CommentedSeq
from ruamel.yaml.constructor import RoundTripConstructor
from ruamel.yaml.error import CommentMark, YAMLError
from ruamel.yaml.nodes import ScalarNode
from ruamel.yaml.representer import RoundTripRepresenter
from ruamel.yaml.scalarstring import DoubleQuotedScalarString as Quoted
from ruamel.yaml.scalarstring import FoldedScalarString, LiteralScalarString

from postproc.base.findings import Finding, Refusal
from postproc.base.yaml_section import parsed

__all__ = ["Number", "Quoted", "Tree", "edited", "extend", "in_braces", "in_brackets", "put", "tree"]

_TAG = "tag:yaml.org,2002:"
_LONGEST_LINE = 1 << 20

Tree = list[Any]


class Number(str):
    """A number, a flag or a null, as it is written."""


class _Constructor(RoundTripConstructor):
    def number(self, node: ScalarNode) -> Number:
        return Number(node.value)


class _Representer(RoundTripRepresenter):
    def number(self, data: Number) -> ScalarNode:
        text = str(data)
        return self.represent_scalar(self.dumper.resolver.resolve(ScalarNode, text, (True, False)), text)


for _kind in ("int", "float", "bool", "null", "timestamp"):
    _Constructor.add_constructor(_TAG + _kind, _Constructor.number)
_Representer.add_representer(Number, _Representer.number)


def in_braces(values: Mapping[str, object]) -> CommentedMap:
    """A mapping on one line."""
    mapping = CommentedMap(values)
    mapping.fa.set_flow_style()
    return mapping


def in_brackets(values: Iterable[object]) -> CommentedSeq:
    """A list on one line."""
    sequence = CommentedSeq(values)
    sequence.fa.set_flow_style()
    return sequence


def extend(parent: CommentedMap, key: str, more: CommentedMap | CommentedSeq, gap: bool = False) -> None:
    """Put the entries of ``more`` after those under ``key``, ``gap``: each below an empty line; where there is none
    yet, ``more`` itself.

    Comment lines that follow the block follow what is new.
    """
    existing = parent.get(key)
    if key not in parent:
        _append(parent, key, more, gap=True)
    elif not isinstance(existing, type(more)) or not existing:
        parent[key] = more
    else:
        for name, value in more.items() if isinstance(more, CommentedMap) else enumerate(more):
            _append(existing, name, value, gap)


def put(parent: CommentedMap, key: str, value: object) -> None:
    """Put ``value`` in the place of the one under ``key``; comments beside the key and below the old value stay."""
    old = parent[key]
    if isinstance(old, CommentedMap) and old and not old.fa.flow_style():
        below, token = _cut_comment(old, False), parent.ca.items.get(key, [None] * 4)[2]
        beside = token.value.partition("\n")[0] if token else ""
        _set_comment(parent, key, 2, f"{beside}\n{below}" if beside or below else None)
    parent[key] = value


def _append(block: CommentedMap | CommentedSeq, key: object, value: object, gap: bool) -> None:
    below = _cut_comment(block, gap) if block and not block.fa.flow_style() else ""
    if isinstance(block, CommentedSeq):
        block.append(value)
    else:
        block[key] = value
    if below:
        _set_comment(*_end(block), "\n" + below)


def _cut_comment(block: CommentedMap | CommentedSeq, gap: bool) -> str:
    """Remove, and return, the comment lines below a block; keep an empty line there for a ``gap``."""
    owner, last, slot = _end(block)
    token = owner.ca.items.get(last, [None] * 4)[slot]
    text = token.value if token else ""
    if isinstance(owner[last], FoldedScalarString | LiteralScalarString):
        # its own line end is not in the comment
        text = "\n" + text
    beside, _, below = text.partition("\n")
    _set_comment(owner, last, slot, beside + "\n" * (1 + gap) if beside or gap else None)
    return below


def _end(block: CommentedMap | CommentedSeq) -> tuple[Any, Any, int]:
    """The innermost block that ends with this one, its last key, and the place of a comment after that."""
    last = [*block][-1] if isinstance(block, CommentedMap) else len(block) - 1
    inner = block[last]
    if isinstance(inner, CommentedMap | CommentedSeq) and inner and not inner.fa.flow_style():
        return _end(inner)
    return block, last, 2 if isinstance(block, CommentedMap) else 0


def _set_comment(owner: Any, key: Any, slot: int, text: str | None) -> None:
    place = owner.ca.items.setdefault(key, [None] * 4)
    place[slot] = None if text is None else CommentToken(text, CommentMark(0))


def edited(raw: bytes, path: Path, edit: Callable[[CommentedMap], None]) -> bytes:
    """The bytes ``raw`` of a YAML file after ``edit`` of its top mapping.

    Lines with their old content are byte for byte those of ``raw``, unless the indentation of the file does not
    allow it.  Raises Refusal ROB002 where ruamel.yaml does not read it.
    """
    text = raw.decode("utf-8-sig")
    newline = "\r\n" if "\r\n" in text[: text.find("\n") + 1] else "\n"
    try:
        plain, new = (
            _dumped(text.replace("\r\n", "\n"), change).replace("\n", newline)
            for change in (lambda _: None, edit)
        )
    except (YAMLError, AssertionError) as error:
        # it asserts that the version of a %YAML line is one that it knows
        words = " ".join(str(error).split())
        raise Refusal(Finding("ROB002", words, str(path), help="write it as plain YAML 1.2")) from None
    merged = "\n".join(_merged(*(each.split("\n") for each in (text, plain, new))))
    means = tree(parsed(new.encode(), path).node)
    try:
        same = tree(parsed(merged.encode(), path).node) == means
    except Refusal:
        same = False
    bom = codecs.BOM_UTF8 if raw.startswith(codecs.BOM_UTF8) else b""
    return bom + (merged if same else new).encode()


def tree(node: yaml.Node) -> Tree:
    """What a node holds, without where and how it is written: pairs, entries, or one text."""
    if isinstance(node, yaml.MappingNode):
        return [(key.value, tree(value)) for key, value in node.value]
    if isinstance(node, yaml.SequenceNode):
        return [tree(item) for item in node.value]
    return [node.value]


def _dumped(text: str, edit: Callable[[CommentedMap], None]) -> str:
    """``text`` loaded, edited and written by ruamel.yaml."""
    rounds = YAML()
    rounds.Constructor, rounds.Representer = _Constructor, _Representer
    rounds.preserve_quotes, rounds.width = True, _LONGEST_LINE
    dashes = [line for line in text.split("\n") if line.lstrip().startswith("- ")]
    offset = 0 if dashes and dashes[0].startswith("-") else 2
    rounds.indent(mapping=2, sequence=2 + offset, offset=offset)
    top, out = rounds.load(text), StringIO()
    edit(top)
    rounds.dump(top, out)
    return out.getvalue()


def _merged(old: list[str], plain: list[str], new: list[str]) -> list[str]:
    """``old`` with the lines that differ between ``plain``, which holds what ``old`` holds, and ``new``."""
    place = {a + i: b + i for a, b, size in _matcher(plain, old).get_matching_blocks() for i in range(size)}
    below = {i + 1: j + 1 for i, j in place.items()}
    # of the first line that is replaced, and after the last one
    starts, stops = {0: 0} | below | place, place | below | {len(plain): len(old)}
    lines: list[str] = []
    done = 0
    for kind, a, a_stop, b, b_stop in _matcher(plain, new).get_opcodes():
        if kind == "equal":
            continue
        while a not in starts:
            a, b = a - 1, b - 1
        while a_stop not in stops:
            a_stop, b_stop = a_stop + 1, b_stop + 1
        start = (stops if a == a_stop else starts)[a]
        if start < done:
            return new
        lines += old[done:start] + new[b:b_stop]
        done = stops[a_stop]
    return lines + old[done:]


def _matcher(lines: list[str], others: list[str]) -> SequenceMatcher[str]:
    """Compares lines; blanks do not count."""
    one, other = ([re.sub(r"\s", "", line) for line in each] for each in (lines, others))
    return SequenceMatcher(None, one, other, autojunk=False)
