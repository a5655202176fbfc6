"""Forces of a log: what is said of their bias, against the closed form of a wall under a spring."""

import json

import pytest

pytest.importorskip("numba")

from click.testing import CliRunner
from test_engage_command import CELL, STOCK, TOOLS

from postproc.cli.main import main
from postproc.robot.description import find_robot

FINISH = "G21 G90 G17 G54\nT1 M6\nG0 X20 Y67.5 Z5\nG0 Z-5\nG1 X{} F3600\nG0 Z30\nM2\n"
LOG = "s_mm,fx,fy,fz,frame\n" + "".join(f"{s},-10,20,-5,feed\n" for s in range(0, 140))


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "cell.yaml").write_text(CELL.format(robot=find_robot("kuka_kr270")))
    (tmp_path / "milling.yaml").write_text(STOCK + TOOLS)
    (tmp_path / "part.ngc").write_text(FINISH.format(80))
    (tmp_path / "log.csv").write_text(LOG)
    return tmp_path


def biases(folder):
    words = ["predict", str(folder / "part.ngc"), f"--force={folder / 'log.csv'}", "--json", "-"]
    result = CliRunner().invoke(main, words)
    assert result.exit_code in (0, 3), result.output
    findings = json.loads(result.stdout)["findings"]
    return [one["message"] for one in findings if one["code"] == "FRC032"]


@pytest.mark.slow
def test_the_bias_of_a_log_is_that_of_the_cut_that_yields(folder):
    """A wall with ae 0.5 by a robot of some um/N: the force as posted is a known share of the nominal one."""
    (message,) = biases(folder)
    share = float(message.split("compensated robot by ")[1].split(" %")[0])
    report = json.loads(
        CliRunner().invoke(main, ["predict", str(folder / "part.ngc"), "--force=", "--json", "-"]).stdout
    )
    posted = report["part_error_mm"]["as_posted"]
    assert posted["engagement"] == "coupled"
    # in the middle of the wall the force is even, but for entry and exit
    expected = 100 * (posted["force_max_n"] / posted["nominal_force_max_n"] - 1)
    assert abs(expected) > 1
    assert share == pytest.approx(expected, abs=2)


def test_without_a_stock_the_bias_is_said_to_be_unknown(folder):
    cell = folder / "cell.yaml"
    cell.write_text(cell.read_text().replace("process: milling.yaml", ""))
    (message,) = biases(folder)
    assert "not known, because the cell names no process file with a stock" in message
