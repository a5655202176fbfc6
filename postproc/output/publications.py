"""How often this process has written files: whether a run that is ended has its results already."""

from __future__ import annotations


class _Published:
    count = 0


_published = _Published()


def note_publication() -> None:
    """Files are written, and are not taken back any more."""
    _published.count += 1


def publications() -> int:
    return _published.count
