"""The story of samples/kr270_second_part: part 2 is right, and so is a part at another place."""

import importlib.util
from pathlib import Path

import pytest

HERE = Path(__file__).resolve().parent


@pytest.mark.slow
def test_the_second_part_is_right(tmp_path):
    place = HERE.parent / "samples" / "kr270_second_part" / "story.py"
    spec = importlib.util.spec_from_file_location("second_part", place)
    story = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(story)
    sizes = story.main(tmp_path)
    assert sizes["part 2"] < 0.15 * sizes["part 1"]
    assert sizes["another place, learnt"] < 0.4 * sizes["another place, shipped robot file"]
