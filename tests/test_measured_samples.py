"""The samples on measurements: what was hidden in them is found."""

import importlib.util
from pathlib import Path

import pytest

from postproc.model import StiffnessModel
from postproc.robot.description import find_robot, load_robot

ROOT = Path(__file__).resolve().parent.parent


@pytest.mark.slow
def test_the_story(tmp_path, compensate):
    """A hidden compensator is found, its parameters lie within their intervals, and what is cut with them is right."""
    place = ROOT / "samples" / "kr270_missing_compensator" / "story.py"
    spec = importlib.util.spec_from_file_location("story", place)
    story = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(story)
    results = story.main(tmp_path)
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
    assert gap["held_out_before_rms_mm"] > 0.08
    assert gap["held_out_after_rms_mm"] == pytest.approx(gap["noise_mm"], rel=0.05)
    again = compensate("diagnose", loads, "--robot", tmp_path / "found.yaml", "--json", "-").json
    assert again["verdict"] == "nothing_missing"
