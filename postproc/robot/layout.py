"""Where things stand in the text of a YAML file, and edits on it: what no edit covers is copied.

Places come from the marks of the nodes.  A child of a block (an entry of a list, a key of a mapping) owns the comments
above it and those on its lines.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import NamedTuple

import yaml

from postproc.yamlfile import Section

_LINE_END = re.compile("[\r\n\x85\u2028\u2029]")
_DASH = re.compile(r"^[ \t]*-(?=\s)", re.MULTILINE)


class Edit(NamedTuple):
    """``text`` in the place of the characters ``start .. stop - 1``."""

    start: int
    stop: int
    text: str


class Part(NamedTuple):
    """A child of a block, from the end of the line before it to the end of its last line.  ``column``: of its dash or
    key."""

    start: int
    stop: int
    column: int


def spliced(text: str, edits: Sequence[Edit]) -> str:
    """``text`` with the edits in it; those at one place in the order given."""
    pieces, at = [], 0
    for edit in sorted(edits, key=lambda edit: edit[:2]):
        pieces += [text[at : edit.start], edit.text]
        at = edit.stop
    return "".join([*pieces, text[at:]])


def key_node(section: Section, key: str) -> yaml.Node:
    return next(word for word, _ in section.node.value if word.value == key)


def value_node(section: Section, key: str) -> yaml.Node:
    return next(value for word, value in section.node.value if word.value == key)


def in_one_line(node: yaml.Node) -> bool:
    """Whether a value stands beside its key: in brackets, in braces, or as a word."""
    return not isinstance(node, yaml.CollectionNode) or bool(node.flow_style)


def stop(text: str, node: yaml.Node) -> int:
    """The end of a node's last character; the marks of blocks stand at what follows them."""
    if not in_one_line(node) and node.value:
        last = node.value[-1]
        return stop(text, last[1] if isinstance(node, yaml.MappingNode) else last)
    return max(len(text[: node.end_mark.index].rstrip()), node.start_mark.index)


def line_end(text: str, at: int) -> int:
    match = _LINE_END.search(text, at)
    return match.start() if match else len(text)


def keys_of(text: str, section: Section, key: str) -> dict[str, Part]:
    """The parts of the block mapping under ``key``."""
    parts, at = {}, line_end(text, key_node(section, key).end_mark.index)
    for word, value in value_node(section, key).value:
        parts[str(word.value)] = Part(at, line_end(text, stop(text, value)), word.start_mark.column)
        at = parts[word.value].stop
    return parts


def entries_of(text: str, section: Section, key: str) -> list[Part]:
    """The parts of the list under ``key``; none where it is empty.

    Raises Refusal ROB002 where its entries do not begin with a dash on a line each.
    """
    parts, at = [], line_end(text, key_node(section, key).end_mark.index)
    for item in value_node(section, key).value if key in section else ():
        dash = _DASH.search(text, at, item.start_mark.index + 1)
        if dash is None:
            raise section.error(
                "ROB002",
                "its entries stand in brackets",
                key,
                "write each entry on lines of its own, the first of them beginning with a dash",
            )
        parts.append(Part(at, line_end(text, stop(text, item)), dash.end() - 1 - dash.start()))
        at = parts[-1].stop
    return parts


def inserted_after(part: Part, blocks: Sequence[str], gap: str = "\n") -> list[Edit]:
    """The edit that puts blocks of lines below a part, in its column."""
    text = "".join(gap + block for block in blocks)
    return [Edit(part.stop, part.stop, indented(text, part.column))] if blocks else []


def replaced_by_block(
    text: str, section: Section, key: str, blocks: Sequence[str], column: int, gap: str = "\n"
) -> list[Edit]:
    """The edits that put blocks of lines in the place of a value beside its key."""
    node = value_node(section, key)
    end = stop(text, node)
    begin = len(text[: node.start_mark.index].rstrip(" \t"))
    return [Edit(begin, end, ""), *inserted_after(Part(begin, line_end(text, end), column), blocks, gap)]


def indented(block: str, column: int) -> str:
    return "\n".join(" " * column + line if line else line for line in block.split("\n"))
