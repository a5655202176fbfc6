"""The commands of the README on measurements print what stands there, word for word."""

import importlib.util
import re
import shlex
import shutil
from pathlib import Path

import pytest

from postproc.cli.main import run
from postproc.model import StiffnessModel
from postproc.robot.description import find_robot, load_robot

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


def test_the_story(tmp_path, capsys, compensate):
    """A hidden compensator is found, its parameters lie within their intervals, and what is cut with them is right."""
    place = ROOT / "samples" / "kr270_missing_compensator" / "story.py"
    spec = importlib.util.spec_from_file_location("story", place)
    story = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(story)
    results = story.main(tmp_path)
    told = [line.rstrip() for line in capsys.readouterr().out.splitlines()]
    block = re.search(r"```\n(the panel, .*?)\n```", README, re.DOTALL)
    assert told[-4:] == block[1].splitlines()
    posted, old, new = (results[name].max() for name in results)
    assert new < 0.2 * old < 0.01 * posted
    true = {
        term.effect.name: term.values
        for term in StiffnessModel.from_robot(load_robot(find_robot("kuka_kr270"))).terms
    }
    found = StiffnessModel.from_robot(load_robot(tmp_path / "found.yaml"))
    (spring,) = (term for term in found.terms if term.effect.name == "gravity_compensator")
    for name in ("K_c", "s0"):
        value = spring.stated[name]
        assert abs(value.value - true["gravity_compensator"][name]) <= value.interval < 0.2 * value.value
    loads = place.parent / "loads.csv"
    first = compensate("diagnose", loads, "--robot", place.parent / "kr270_plain.yaml", "--json", "-").json
    assert [(one["effect"], one["joints"]) for one in first["named"]] == [("gravity_compensator", ["A2"])]
    gap = first["gap"]
    assert gap["heldout_before_rms_mm"] > 0.08
    assert gap["heldout_after_rms_mm"] == pytest.approx(gap["noise_mm"], rel=0.05)
    again = compensate("diagnose", loads, "--robot", tmp_path / "found.yaml", "--json", "-").json
    assert again["verdict"] == "nothing_missing"
