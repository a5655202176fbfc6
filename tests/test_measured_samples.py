"""The commands of the README on measurements print what stands there, word for word."""

import re
import shlex
import shutil
from pathlib import Path

import pytest

from postproc.cli.main import run

ROOT = Path(__file__).resolve().parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")


def example(command):
    """The words of a command in the README, and what it is said to print."""
    found = re.search(
        rf"```sh\n(compensate {command} [^\n]*)\n```(?:(?!```sh).)*?```\n(.*?)\n```", README, re.DOTALL
    )
    assert found, command
    return shlex.split(found[1])[1:], found[2].splitlines()


@pytest.mark.parametrize(("command", "exit_code"), [("identify", 3), ("diagnose", 0)])
def test_the_readme_prints_what_the_command_prints(command, exit_code, tmp_path, monkeypatch, capsys):
    words, told = example(command)
    shutil.copytree(ROOT / "samples", tmp_path / "samples", ignore=shutil.ignore_patterns("compensated"))
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as ended:
        run(words)
    assert ended.value.code == exit_code
    assert [line.rstrip() for line in capsys.readouterr().out.splitlines()] == told
    assert (tmp_path / words[words.index("-o") + 1]).is_file()
