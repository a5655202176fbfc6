"""Texts of programs, robots and files as they are shown: they drive no terminal, and are read unchanged."""

from __future__ import annotations

import unicodedata


class _ShownCharacters(dict[int, int | str]):
    """Character -> what is shown of it; filled as characters come."""

    def __missing__(self, code: int) -> int | str:
        self[code] = "?" if unicodedata.category(chr(code)) in ("Cc", "Cf", "Zl", "Zp") else code
        return self[code]


_SHOWN = _ShownCharacters()


def sanitize(text: str) -> str:
    """``text`` with ``?`` for every character of the categories Cc, Cf, Zl and Zp, which is none to read: control
    characters and escapes, those that turn the direction of writing or take no room, ends of lines and paragraphs."""
    return text if text.isascii() and text.isprintable() else text.translate(_SHOWN)


def sanitize_lines(text: str) -> str:
    """The same, and its lines stay lines."""
    return "\n".join(sanitize(line) for line in text.split("\n"))
