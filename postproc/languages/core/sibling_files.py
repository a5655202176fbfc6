"""Files that lie beside a program."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from postproc.base.document import Document
from postproc.base.read_files import list_folder, read_file


def files_in(folder: Path, is_wanted: Callable[[Path], bool] = lambda path: True) -> list[Path] | None:
    """The files of a folder that are wanted, sorted; None where there is no such folder.  Raises Refusal FIL001."""
    try:
        return [path for path in list_folder(folder) if is_wanted(path) and path.is_file()]
    except FileNotFoundError:
        return None


def document_of(path: Path) -> Document:
    """Raises Refusal FIL001."""
    return Document(path, read_file(path))
