"""The package from Python: light, typed, and its examples run."""

from __future__ import annotations

import doctest
import json
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import postproc
from postproc import api
from postproc.api_place import stated_force

ROOT = Path(__file__).resolve().parent.parent


@pytest.fixture
def at_samples(tmp_path, monkeypatch):
    """A working folder with the samples in it."""
    shutil.copytree(
        ROOT / "samples" / "kr270_taught",
        tmp_path / "samples" / "kr270_taught",
        ignore=shutil.ignore_patterns("compensated"),
    )
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("module", [postproc, api], ids=lambda module: module.__name__)
def test_the_examples_run(at_samples, module):
    done = doctest.testmod(module)
    assert done.attempted >= 1
    assert done.failed == 0


def test_import_is_light():
    code = "import sys, postproc, json; print(json.dumps(sorted(sys.modules)))"
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, check=True).stdout
    loaded = set(json.loads(out))
    assert {"postproc"} == {name for name in loaded if name.split(".")[0] == "postproc"}
    assert not loaded & {"numpy", "scipy", "pinocchio", "click", "yaml", "rich"}


def test_what_is_public_is_there_and_nothing_else():
    assert set(postproc.__all__) <= set(dir(postproc))
    for name in postproc.__all__:
        assert getattr(postproc, name) is not None
    assert postproc.compensate is api.compensate
    with pytest.raises(AttributeError, match="no attribute 'compensat'"):
        postproc.compensat  # noqa: B018


@pytest.mark.slow
def test_types_are_seen(tmp_path):
    """A caller's mistake is told by a type checker, from the installed package."""
    wrong = tmp_path / "caller.py"
    wrong.write_text(
        "import postproc\n"
        "good: postproc.Report = postproc.compensate('a.src', force=True)\n"
        "postproc.compensate('a.src', force=3)\n"
        "postproc.compensate('a.src', gaim=0.5)\n"
        "bad: int = postproc.check('a.src')\n"
    )
    words = [sys.executable, "-m", "mypy", "--no-incremental", "--follow-imports=silent", str(wrong)]
    done = subprocess.run(words, capture_output=True, text=True, cwd=ROOT)
    lines = [
        line.partition("caller.py:")[2].split(":")[0] for line in done.stdout.splitlines() if "error" in line
    ]
    assert [line for line in lines if line] == ["3", "4", "5"], done.stdout + done.stderr


def test_the_same_as_the_command(at_samples, compensate):
    path = "samples/kr270_taught/taught.src"
    report = postproc.compensate(path, force=True, gain=0.5, output="one/taught.src")
    done = compensate(path, "--force", "--gain", "0.5", "-o", "two/taught.src", "--json", "-")
    mine = json.loads(json.dumps(report.as_json()))
    theirs = done.json
    for result in (mine, theirs):
        result.pop("outputs")
    assert mine == theirs
    assert Path("one/taught.src").read_bytes() == Path("two/taught.src").read_bytes()


def test_mistakes_of_the_caller_are_told(at_samples):
    path = "samples/kr270_taught/taught.src"
    for wrong in ({"gain": 1.5}, {"force": " "}):
        with pytest.raises(ValueError, match=next(iter(wrong))):
            postproc.compensate(path, **wrong)
    with pytest.raises(postproc.Refusal) as refusal:
        postproc.check("samples/none.src")
    assert refusal.value.findings[0].code == "FIL001"


def test_a_result_is_a_table_a_dictionary_and_a_few_words(at_samples):
    path = "samples/kr270_taught/taught.src"
    report = postproc.compensate(path, force=True, dry_run=True)
    table = report.table()
    assert set(map(len, table.values())) == {report.motions}
    cutting = table["error_before_mm"] > 0.01
    assert cutting.any()
    assert table["error_after_mm"][cutting].max() == pytest.approx(report.after.max * 1e3)
    assert report.to_dict() == report.as_json()
    assert "taught.src" in repr(report)
    assert len(repr(report)) < 400
    page = report._repr_html_()
    assert page.count("<tr>") > 5
    assert "error_before_mm.max" in page
    checked = postproc.check(path)
    assert list(checked.table()["kind"]) == list(table["kind"])
    assert "x_mm" in checked.table()


@pytest.mark.slow
def test_the_other_commands_from_python(at_samples):
    path = "samples/kr270_taught/taught.src"
    done = postproc.verify(path, path, force=True)
    # it is looked more closely at what is judged
    assert done.original.error.max == pytest.approx(done.compensated.error.max, rel=1e-3)
    assert done.original.error.max > 0
    assert set(done.table()["program"]) == {"original", "compensated"}
    batched = postproc.batch("samples/kr270_taught", force=True, output="out", workers=1)
    assert list(batched.table()["state"]) == ["done"]
    assert list(batched.table()["error_after_max_mm"]) < list(batched.table()["error_before_max_mm"])
    planned = postproc.plan(
        "kuka_kr270", "joint_compliance", 8, "plan.csv", loads=[100.0], tool=(0, 200, 300)
    )
    assert len(planned.table()["A1_deg"]) == planned.poses
    assert "Planned" in repr(planned)
    with pytest.raises(ValueError, match="needs 3 or 6"):
        postproc.map("kuka_kr270", x=1, y=2, z=3, force="0,0,-500", tool=(1, 2))
    with pytest.raises(ValueError, match="from < to"):
        postproc.map("kuka_kr270", x=(2, 1), y=2, z=3, force="0,0,-500")


def test_a_table_becomes_a_data_frame(at_samples):
    pandas = pytest.importorskip("pandas")
    frame = postproc.check("samples/kr270_taught/taught.src").to_pandas()
    assert isinstance(frame, pandas.DataFrame)
    assert len(frame) == 26


@pytest.mark.slow
def test_engagement_from_python():
    pytest.importorskip("numba")
    engaged = postproc.engage(ROOT / "samples" / "kr270_stock" / "part.ngc")
    table = engaged.table()
    assert engaged.removal > 0
    assert table["removal_mm3"].sum() == pytest.approx(engaged.removal)
    assert {"air", "cut"} <= set(table["state"])
    assert "removal_mm3" in repr(engaged)


@pytest.mark.parametrize(
    "force", [(100, 50, -80), np.array([100.0, 50.0, -80.0]), [100.0, 50.0, -80.0, 0, 0, 0]]
)
def test_a_force_in_numbers_is_that_force(force):
    assert as_word(force) == as_word("100,50,-80")


def as_word(force):
    """What the run takes for the force, without a frame."""
    numbers = [float(word) for word in stated_force(force).split(",")]
    return numbers + [0.0] * (6 - len(numbers))


@pytest.mark.parametrize("force", [[], {}, 100, 1.0, ["a"], [[1, 2, 3]], object()])
def test_what_states_no_force_is_refused(force):
    with pytest.raises(TypeError, match="three or six numbers"):
        stated_force(force)
    assert stated_force(False) is None
    assert stated_force(True) == ""
