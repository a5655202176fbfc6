"""YAML files read strictly: every mistake is reported with file, line, key and what is allowed.

PyYAML composes the nodes (safe: tags and aliases are refused, nothing is constructed); ``YamlSection`` returns
checked values.  Numbers, ``null`` and ``true`` follow YAML 1.2, so ``1e-6`` is a number and ``yes`` a word.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Sequence
from functools import lru_cache
from pathlib import Path

import yaml
from yaml.composer import Composer
from yaml.resolver import Resolver

from postproc.base.findings import Code, Finding, Refusal, define, nearest
from postproc.base.read_files import read_file

CODES = define(
    {
        "YML001": Code(
            "error",
            "file is not valid YAML",
            meaning="The file cannot be parsed, or contains aliases, tags or forbidden characters.",
            consequence="No value of the file can be used.",
            action="Correct the line that the message names.",
            example="A tab in the indentation.",
        ),
        "YML002": Code(
            "error",
            "unknown key",
            meaning="The key has no meaning at this place.",
            consequence="A misspelt key would be ignored silently, with a wrong result.",
            action="Correct or remove the key; the message lists those that are allowed.",
            example="`tolerence: 0.1`.",
        ),
        "YML003": Code(
            "error",
            "missing key",
            meaning="A required key is missing.",
            consequence="Without it the file is incomplete.",
            action="Add the key.",
            example="A cell without `robot:`.",
        ),
        "YML004": Code(
            "error",
            "wrong value",
            meaning="The value has the wrong kind, or is outside its range.",
            consequence="A wrong value would lead to a wrong correction.",
            action="Write a value of the kind and range that the message names.",
            example="`tolerance: -1`.",
        ),
        "YML005": Code(
            "error",
            "wrong unit",
            meaning="The unit does not belong to this quantity.",
            consequence="With a wrong unit the value is wrong by orders of magnitude.",
            action="Use one of the units that the message lists.",
            example="`{value: 1.0e-6, unit: N/mm}` for a joint compliance.",
        ),
    }
)

MAX_BYTES = 4_000_000
MAX_DEPTH = 20
KEPT = 1 << 16
"""Letters of a text that is parsed once, however often its file is read."""
MAX_NODES = 100_000
"""Values, lists and mappings: PyYAML takes 20 us and 500 bytes for each."""
_NUMBER = re.compile(r"[-+]?([0-9]+(\.[0-9]*)?|\.[0-9]+)([eE][-+]?[0-9]+)?\Z")
_NONZERO = re.compile(r"[^eE]*[1-9]")
SMALLEST, LARGEST = 1e-30, 1e30
"""Sizes of a number between which no product or quotient of two of them leaves the numbers of the machine."""
_NULLS = ("", "~", "null", "Null", "NULL")
_FLAGS = {"true": True, "True": True, "TRUE": True, "false": False, "False": False, "FALSE": False}
# no path and no terminal takes these; an escape in quotes (\0, \uD800) makes them
_UNPRINTABLE = re.compile("[\0\ud800-\udfff]")
_REQUIRED = object()


class YamlSection:
    """A mapping of a YAML file.  Getters raise Refusal with the line of the key they were asked for."""

    def __init__(self, node: yaml.MappingNode, file: Path, where: str) -> None:
        self.node = node
        self.file = file
        self.where = where
        self.line, self.column = node.start_mark.line + 1, node.start_mark.column + 1
        self._values: dict[str, yaml.Node] = {}
        for key, value in node.value:
            name = str(key.value)
            if not isinstance(key, yaml.ScalarNode):
                raise Refusal(
                    _finding(file, key, "YML001", f"{where or 'the file'}: a key must be a plain word")
                )
            if name in self._values:
                raise Refusal(_finding(file, key, "YML004", f"{self._path(name)} is defined twice"))
            self._values[name] = value
        self._keys = {str(key.value): key for key, _ in node.value}

    def __contains__(self, key: str) -> bool:
        return key in self._values and not self._is_null(key)

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def _is_null(self, key: str) -> bool:
        node = self._values[key]
        return isinstance(node, yaml.ScalarNode) and node.style is None and node.value in _NULLS

    def _path(self, key: str) -> str:
        return f"{self.where}.{key}" if self.where else key

    def error(self, code: str, message: str, key: str | None = None, help: str = "") -> Refusal:
        """A Refusal that points at ``key`` (at the section itself without one)."""
        node = self._keys.get(key) if key is not None else None
        line, column = (
            (node.start_mark.line + 1, node.start_mark.column + 1) if node else (self.line, self.column)
        )
        name = self._path(key) if key is not None else self.where
        text = f"{name}: {message}" if name else message
        return Refusal(Finding(code, text, str(self.file), line, column, help))

    def only(self, *allowed: str) -> None:
        """Refuse any key that is not one of ``allowed``."""
        for key in self._values:
            if key not in allowed:
                raise self.error(
                    "YML002",
                    f"the key is unknown{nearest(key, allowed)}",
                    key,
                    "a comma separates two keys here: write decimals with a point"
                    if key.isdigit()
                    else "these are allowed here: " + ", ".join(allowed),
                )

    def line_of(self, key: str) -> int:
        return int(self._keys[key].start_mark.line) + 1

    def section(self, key: str, default: object = _REQUIRED) -> YamlSection:
        """The mapping under ``key``; an empty one where it is absent and ``default`` is given."""
        node = self._get(key, default)
        if node is None:
            return YamlSection(
                yaml.MappingNode("", [], yaml.Mark("", 0, self.line - 1, 0, None, 0)),
                self.file,
                self._path(key),
            )
        if not isinstance(node, yaml.MappingNode):
            raise self.error("YML004", "must contain keys and values", key)
        return YamlSection(node, self.file, self._path(key))

    def sections(self, key: str) -> list[YamlSection]:
        """The mappings of the list under ``key``; none where it is absent."""
        node = self._get(key, None)
        if node is None:
            return []
        if not isinstance(node, yaml.SequenceNode):
            raise self.error("YML004", "must be a list", key)
        entries = []
        for index, item in enumerate(node.value):
            if not isinstance(item, yaml.MappingNode):
                raise self.error("YML004", f"entry {index + 1} must contain keys and values", key)
            entries.append(YamlSection(item, self.file, f"{self._path(key)}[{index + 1}]"))
        return entries

    def number(
        self,
        key: str,
        default: object = _REQUIRED,
        low: float = -math.inf,
        high: float = math.inf,
        unit: str = "",
    ) -> float:
        """The number under ``key``, within ``low`` .. ``high``; ``unit`` is for the message only."""
        node = self._get(key, default)
        if node is None:
            return float(default)  # type: ignore[arg-type]
        value = self._as_number(node, key, unit)
        if not low <= value <= high:
            raise self.error("YML004", f"{value:g} is not within {low:g} .. {high:g}", key)
        return value

    def numbers(
        self, key: str, count: int | None, default: Sequence[float] | None = None, unit: str = ""
    ) -> list[float]:
        """A list of ``count`` numbers (of one or more without it)."""
        node = self._get(key, _REQUIRED if default is None else default)
        if node is None:
            return [float(value) for value in default or ()]
        right = isinstance(node, yaml.SequenceNode) and len(node.value) == (count or max(1, len(node.value)))
        if not isinstance(node, yaml.SequenceNode) or not right:
            raise self.error("YML004", f"must be a list of {count or 'one or more'} numbers", key)
        return [self._as_number(item, key, unit) for item in node.value]

    def rows(self, key: str, width: int, unit: str = "") -> list[list[float]]:
        """The list of one or more lists of ``width`` numbers under ``key``."""
        node = self._get(key, _REQUIRED)
        items = node.value if isinstance(node, yaml.SequenceNode) else []
        if not items:
            raise self.error("YML004", f"must be a list of lists of {width} numbers", key)
        rows = []
        for index, item in enumerate(items):
            if not isinstance(item, yaml.SequenceNode) or len(item.value) != width:
                raise self.error("YML004", f"entry {index + 1} must be a list of {width} numbers", key)
            rows.append([self._as_number(value, key, unit) for value in item.value])
        return rows

    def text(self, key: str, default: object = _REQUIRED, choices: Sequence[str] = ()) -> str:
        node = self._get(key, default)
        if node is None:
            return str(default)
        if not isinstance(node, yaml.ScalarNode):
            raise self.error("YML004", "must be a word or a text", key)
        value = str(node.value)
        if choices and value not in choices:
            raise self.error(
                "YML004", f"{value!r} is not one of {', '.join(choices)}{nearest(value, choices)}", key
            )
        return value

    def texts(self, key: str) -> list[str]:
        """The words of the list under ``key``."""
        node = self._get(key, _REQUIRED)
        words = node.value if isinstance(node, yaml.SequenceNode) else None
        if words is None or not all(isinstance(word, yaml.ScalarNode) for word in words):
            raise self.error("YML004", "must be a list of words", key)
        return [str(word.value) for word in words]

    def flag(self, key: str, default: bool) -> bool:
        node = self._get(key, default)
        if node is None:
            return default
        if not isinstance(node, yaml.ScalarNode) or node.style is not None or node.value not in _FLAGS:
            raise self.error("YML004", "must be true or false", key)
        return _FLAGS[node.value]

    def length(self, key: str) -> int:
        """Entries of the list under ``key``, for lists of several lengths; 0 where there is no list."""
        node = self._values.get(key)
        return len(node.value) if isinstance(node, yaml.SequenceNode) else 0

    def is_list(self, key: str) -> bool:
        """Whether a list is under ``key``, for keys that may hold a word or a list."""
        return isinstance(self._values.get(key), yaml.SequenceNode)

    def is_mapping(self, key: str) -> bool:
        """Whether keys and values are under ``key``, for keys that may hold a number or a mapping."""
        return isinstance(self._values.get(key), yaml.MappingNode)

    def _get(self, key: str, default: object) -> yaml.Node | None:
        if key in self:
            return self._values[key]
        if default is _REQUIRED:
            if key in self._values:
                raise self.error("YML003", "has no value", key)
            raise self.error("YML003", f"the key {key!r} is missing")
        return None

    def _as_number(self, node: yaml.Node, key: str, unit: str) -> float:
        if not isinstance(node, yaml.ScalarNode) or node.style is not None or not _NUMBER.match(node.value):
            shown = repr(node.value[:40]) if isinstance(node, yaml.ScalarNode) else "a list or mapping"
            help = f"write a number in {unit}, without the unit" if unit else ""
            raise self.error("YML004", f"{shown} is not a number", key, help)
        value = float(node.value)
        if abs(value) > LARGEST:
            raise self.error("YML004", f"{node.value[:40]} is too large", key)
        if 0.0 < abs(value) < SMALLEST or (value == 0.0 and _NONZERO.match(node.value)):
            raise self.error("YML004", f"{node.value[:40]} is too small; write 0 instead", key)
        return value


def load(path: Path) -> YamlSection:
    """The top mapping of a YAML file.  Raises Refusal as ``read`` and ``parsed`` do."""
    return parsed(read(path), path)


def read(path: Path) -> bytes:
    """The bytes of a YAML file.  Raises Refusal FIL001 where they cannot be read."""
    return read_file(path, MAX_BYTES)


def parsed(raw: bytes, path: Path) -> YamlSection:
    """The top mapping of the YAML text ``raw``, as that of the file ``path``.

    Raises Refusal: FIL002 (empty), YML001 (no YAML, no mapping, too large, too many values, aliases,
    tags, too deep).
    """
    if len(raw) > MAX_BYTES:
        raise Refusal(Finding("YML001", f"the file is larger than {MAX_BYTES} bytes", str(path)))
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise Refusal(
            Finding("YML001", f"the file is not UTF-8 text (byte {error.start})", str(path))
        ) from None
    try:
        node = (_nodes if len(text) <= KEPT else _nodes.__wrapped__)(text, path)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        line, column = (mark.line + 1, mark.column + 1) if mark else (0, 0)
        raise Refusal(Finding("YML001", str(error.problem or "not YAML"), str(path), line, column)) from None
    except yaml.reader.ReaderError as error:
        line = text.count("\n", 0, error.position) + 1
        raise Refusal(Finding("YML001", str(error).splitlines()[0], str(path), line)) from None
    except (
        yaml.YAMLError,
        ValueError,
        OverflowError,
    ) as error:  # PyYAML passes on what chr() says of "\\UFFFFFFFF"
        raise Refusal(Finding("YML001", str(error).splitlines()[0], str(path))) from None
    if node is None:
        raise Refusal(Finding("FIL002", "the file is empty", str(path)))
    if not isinstance(node, yaml.MappingNode):
        raise Refusal(_finding(path, node, "YML001", "the file must contain keys and values (YAML)"))
    return YamlSection(node, path, "")


@lru_cache(maxsize=16)
def _nodes(text: str, path: Path) -> yaml.Node | None:
    """The nodes of a text.  Programs of one batch have one robot and mostly one cell: these are parsed once."""
    return _Composed(_checked(path, yaml.parse(text, Loader=yaml.SafeLoader))).get_single_node()


class _Composed(Composer, Resolver):
    """Builds nodes of events, as PyYAML does of its parser's."""

    def __init__(self, events: Iterator[yaml.Event]) -> None:
        Composer.__init__(self)
        Resolver.__init__(self)
        self._events, self._next = events, next(events)

    def check_event(self, *kinds: type[yaml.Event]) -> bool:
        return isinstance(self._next, kinds)

    def peek_event(self) -> yaml.Event:
        return self._next

    def get_event(self) -> yaml.Event:
        event, self._next = self._next, next(self._events, yaml.StreamEndEvent())
        return event


def _checked(path: Path, events: Iterable[yaml.Event]) -> Iterator[yaml.Event]:
    """The events; refuses what is not for this house before a node is built of it.

    The depth is counted here because PyYAML's scanner takes time by its square, and the composer the stack.
    """
    depth = nodes = 0
    for event in events:
        nodes += isinstance(event, yaml.NodeEvent)
        if nodes > MAX_NODES:
            raise Refusal(_finding(path, event, "YML001", f"the file has more than {MAX_NODES} values"))
        if isinstance(event, yaml.AliasEvent):
            raise Refusal(_finding(path, event, "YML001", "aliases (*name) are not allowed"))
        if getattr(event, "tag", None) is not None:
            raise Refusal(_finding(path, event, "YML001", "tags (!name) are not allowed"))
        if isinstance(event, yaml.ScalarEvent) and _UNPRINTABLE.search(event.value):
            raise Refusal(_finding(path, event, "YML001", "a text contains NUL or half a character"))
        depth += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
        if depth > MAX_DEPTH:
            raise Refusal(
                _finding(path, event, "YML001", f"the file is nested deeper than {MAX_DEPTH} levels")
            )
        yield event


def _finding(path: Path, node: yaml.Node | yaml.Event, code: str, message: str) -> Finding:
    mark = node.start_mark
    line, column = (mark.line + 1, mark.column + 1) if mark else (0, 0)
    return Finding(code, message, str(path), line, column)
