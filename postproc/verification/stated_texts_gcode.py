"""Statements of G-code: one a line, with words in any order."""

from __future__ import annotations

import re
from collections.abc import Sequence

from postproc.verification.stated_texts import NONE, MovingLines, Statements

_NUMBER = rb"[-+]?+[ \t]*+(?:[0-9]++\.?+[0-9]*+|\.[0-9]++)(?:EX[-+]?[0-9]++)?+"
_BRACKETS = rb"\[(?:[^\[\]]|\[(?:[^\[\]]|\[[^\[\]]*+\])*+\])*+\]"
_VALUE = (
    rb"(?:" + _NUMBER + rb"(?![ \t]*+=)|[-+]?#(?:<[^<>]*+>|[0-9]++|" + _BRACKETS + rb")|[-+]?" + _BRACKETS + rb")"
)  # fmt: skip
_EXPRESSION = (
    rb"(?:(?:AC|IC|DC|ACP|ACN)[ \t]*+\([^()]*+\)|" + _NUMBER + rb"(?![-+*/0-9.])"
    rb"|(?:[^ \t;()]|\((?:[^()]|\([^()]*+\))*+\))++)"
)
_TARGET = re.compile(
    rb"(?<![A-Z_$<])(?:"
    rb"(?:[XYZABCIJK][0-9]?|CR|X[123]|THETA|PHI|PSI)[ \t]*+=[ \t]*+" + _EXPRESSION +
    rb"|[XYZABCIJKR][ \t]*+" + _VALUE +
    rb"|G[ \t]*+0*+[0-3](?![0-9.])|CIP(?![A-Z_])"
    rb")"
)  # fmt: skip
"""Words of a target in a block in capitals, and how it leads there."""

_FEED = re.compile(rb"(?<![A-Z_$<])F[ \t]*+=?[ \t]*+" + _NUMBER)
_COMMENT = re.compile(rb"(?<![A-Z0-9_])\([^)]*+\)?|;.*+", re.DOTALL)
_WORD = re.compile(rb"[A-Z][^A-Z]*+|[^A-Z]++")


class GcodeStatements:
    """G-code as a ``StatementForm``."""

    flowing: frozenset[bytes] = frozenset()

    def read(self, files: Sequence[list[bytes]], lines: MovingLines) -> list[Statements]:
        return [_read(file, lines if number == 0 else None) for number, file in enumerate(files)]

    def words(self, text: bytes) -> frozenset[bytes]:
        return frozenset(_WORD.findall(text))

    def insertable(self, words: frozenset[bytes]) -> bool:
        return all(word[:1] in (b"G", b"F", b"/") for word in words)

    def opens_block(self, _text: bytes) -> bool:
        return False


def _read(file: list[bytes], lines: MovingLines | None) -> Statements:
    found = Statements()
    moving = NONE if lines is None else lines.moving
    for number, line in enumerate(file, 1):
        if number in moving and lines is not None:
            code, comments = line.upper(), b""
            if b"(" in code or b";" in code:
                comments = b"".join(_COMMENT.findall(code))
                code = _COMMENT.sub(b" ", code)
            words = _TARGET.sub(b"", code)
            if number in lines.inverse:
                words = _FEED.sub(b"", words)
            found.add_motion(b"".join(words.split()) + comments.rstrip(), NONE, number)
        else:
            text = line.strip()
            if text:
                found.add(text, number)
    return found
