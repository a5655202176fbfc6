"""Templates that were compiled once, and the folder of them that cannot be used."""

from __future__ import annotations

import sys
from pathlib import Path

import jinja2
import pytest

from postproc.report.compiled_templates import CompiledTemplates


def shown(sources: Path, folder: Path, settings: bytes = b"1", **options: bool) -> str:
    """A page by an environment of its own, as another process has it."""
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(sources), bytecode_cache=CompiledTemplates(folder, settings), **options
    )
    return environment.get_template("page.j2").render(x=2)


@pytest.fixture
def sources(tmp_path, monkeypatch):
    monkeypatch.setattr(sys, "dont_write_bytecode", False)
    (tmp_path / "html").mkdir()
    (tmp_path / "html" / "page.j2").write_text("{{ x + 1 }}")
    return tmp_path / "html"


def test_compiled_once(sources, monkeypatch):
    folder = sources / "__pycache__"
    assert shown(sources, folder) == "3"
    assert len(list(folder.iterdir())) == 1
    monkeypatch.setattr(jinja2.Environment, "compile", None)  # nothing is compiled again
    assert shown(sources, folder) == "3"


def test_another_source_is_compiled_anew(sources):
    folder = sources / "__pycache__"
    shown(sources, folder)
    (sources / "page.j2").write_text("{{ x + 2 }}")
    assert shown(sources, folder) == "4"


def test_other_settings_are_compiled_anew(sources):
    folder = sources / "__pycache__"
    (sources / "page.j2").write_text("{% if x %}\n{{ x }}{% endif %}")
    assert shown(sources, folder) == "\n2"
    assert shown(sources, folder, b"2", trim_blocks=True) == "2"


@pytest.mark.parametrize("content", [b"", b"j2", b"no bytecode at all" * 20])
def test_a_file_that_is_none(sources, content):
    folder = sources / "__pycache__"
    shown(sources, folder)
    (file,) = folder.iterdir()
    for kept in (content, file.read_bytes()[:-20], file.read_bytes()[:60] + content):
        file.write_bytes(kept)
        assert shown(sources, folder) == "3"


def test_a_folder_that_takes_no_files(sources):
    folder = sources / "__pycache__"
    folder.write_text("a file")
    assert shown(sources, folder) == "3"
    assert folder.read_text() == "a file"


def test_python_may_be_told_to_write_none(sources, monkeypatch):
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    assert shown(sources, sources / "__pycache__") == "3"
    assert not (sources / "__pycache__").exists()
