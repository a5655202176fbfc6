"""Files beside a program that declare what it names: $config.dat, other data lists, other modules."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from pathlib import Path

from postproc.base.document import Document
from postproc.base.read_files import note_absent, note_listing
from postproc.languages.core.sibling_files import document_of, files_in
from postproc.languages.dialect import Program, ReadingSettings
from postproc.languages.krl.data import DEFAULTS
from postproc.languages.krl.lexing import FRAME_TABLES, identifiers

ABOVE = 4
"""Folders above the program's in which $config.dat is looked for."""
_CONFIG = "$config.dat"
_SYSTEMS = ((), ("system",), ("r1", "system"))
"""Where it lies below one of these folders."""
_DATA = re.compile(rb"^[ \t]*DEFDAT[ \t]", re.I | re.M)
_GLOBAL = re.compile(
    rb"^[ \t]*(?:DECL[ \t]+)?GLOBAL[ \t]+(?:DECL[ \t]+|CONST[ \t]+)?([^=\r\n]{0,200})", re.I | re.M
)


def find(program: Program, settings: ReadingSettings, beside: Path | None = None) -> tuple[Document, ...]:
    """What is not read yet of the files that declare what ``program`` does not resolve.

    They lie in its folder, or in ``beside``; those of a program that is compensated may lie above its folder too.
    Raises Refusal FIL001.
    """
    wanted = program.unresolved
    if not wanted:
        return ()
    path = program.documents[0].path
    folders = [beside or path.parent, *([path.parent.parent] if program.marker is not None else [])]
    read = {_place(one.path) for one in (*program.documents, *settings.references, *settings.siblings)}
    stems = {one.path.stem.lower() for one in (*program.documents, *settings.siblings)}
    names = {name.upper().encode("latin-1") for name in wanted if not name.endswith("()")}
    names = {name for name in names if not name.startswith((DEFAULTS, *FRAME_TABLES))}
    modules = {name[:-2].lower() for name in wanted if name.endswith("()")} - stems
    found: list[Document] = []
    if not any("config" in one.path.stem.lower() for one in (*settings.references, *settings.siblings)):
        found += [document_of(one) for one in _configs(folders[0])]
    for folder in folders:
        if found_here := _beside(folder, modules, names, stems):
            found += found_here
            break
    return tuple(one for one in found if _place(one.path) not in read and b"\0" not in one.raw)


def _beside(folder: Path, modules: set[str], names: set[bytes], stems: set[str]) -> list[Document]:
    """The files of these modules in a folder, and data lists other than ``stems`` that declare one of the names."""
    files = files_in(folder)
    if files is None:
        return []
    for stem in modules - {one.stem.lower() for one in files if one.suffix.lower() == ".src"}:
        note_absent(folder / f"{stem}.src")
    if names:
        note_listing(folder, ".dat")
    found = []
    for file in files:
        suffix, stem = file.suffix.lower(), file.stem.lower()
        if stem in modules and suffix in (".src", ".dat"):
            found.append(document_of(file))
        elif suffix == ".dat" and names and stem not in stems and stem != _CONFIG[:-4]:
            document = document_of(file)
            if _declares(document.raw, names):
                found.append(document)
    return found


def _place(path: Path) -> str:
    return os.path.normcase(os.path.abspath(path))


def _declares(raw: bytes, names: set[bytes]) -> bool:
    """Whether a data list declares one of the names for other modules."""
    if b"\0" in raw or _DATA.search(raw) is None:
        return False
    return any(not names.isdisjoint(identifiers(found[1])) for found in _GLOBAL.finditer(raw))


def _configs(folder: Path) -> list[Path]:
    """Every $config.dat at the nearest level that has one."""
    folder = Path(os.path.abspath(folder))
    for level in (folder, *folder.parents[:ABOVE]):
        found = [one for parts in _SYSTEMS for one in _below(level, (*parts, _CONFIG))]
        if found:
            return found
        for parts in _SYSTEMS:
            note_absent(level.joinpath(*parts, _CONFIG))
    return []


def _below(folder: Path, parts: tuple[str, ...]) -> Iterator[Path]:
    """Files of this path below a folder, whatever the case of the letters."""
    try:
        entries = sorted(entry.name for entry in os.scandir(folder) if entry.name.lower() == parts[0])
    except OSError:
        return
    for name in entries:
        if len(parts) > 1:
            yield from _below(folder / name, parts[1:])
        elif (folder / name).is_file():
            yield folder / name
