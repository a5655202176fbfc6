"""Forces of a log: what is said of their bias, against the closed form of a wall under a spring."""

import json
import math
import re

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


@pytest.mark.slow
def test_the_nominal_force_of_the_part_is_the_largest_of_the_program(folder):
    """A plunge before a slot, where a ramp takes most of its force: the report names one largest force."""
    text = "G21 G90 G17 G54\nT1 M6\nG0 X20 Y40 Z5\nG1 Z-2 F3600\nY-5\nG0 Z30\nM2\n"
    (folder / "part.ngc").write_text(text)
    result = CliRunner().invoke(
        main, ["program", str(folder / "part.ngc"), "--force=", "-o", str(folder / "out")]
    )
    assert result.exit_code in (0, 3), result.output
    report = json.loads((folder / "out" / "part.report.json").read_text())
    posted = report["part_error_mm"]["as_posted"]
    assert posted["nominal_force_max_n"] == pytest.approx(report["force"]["max_n"], abs=1e-3)


def test_without_a_stock_the_bias_is_said_to_be_unknown(folder):
    cell = folder / "cell.yaml"
    cell.write_text(cell.read_text().replace("process: milling.yaml", ""))
    (message,) = biases(folder)
    assert "not known, because the cell names no process file with a stock" in message


SLOT = "G21 G90 G17 G54 G94\nT1 M6\nS12000 M3\nG0 X-20 Y30 Z5\nG0 Z-4\n"
SLOT += "G1 X-8 F3600\nG1 X50\nG1 X108\nG1 X120\nG0 Z30\nM2\n"
EDGES = "{ktc: 780, krc: 190, kac: 210, kte: 22, kre: 21, kae: 1}"
CHIP = 3600 / 12000 / 3


def in_slot(depth=4.0, teeth=3):
    """[N] feed, left, spindle: mean force of a slot by a flat cutter, in closed form."""
    steel = dict(part.split(": ") for part in EDGES.strip("{}").split(", "))
    ktc, krc, kac, kte, kre, kae = (float(value) for value in steel.values())
    edge = teeth * depth
    return (
        -edge * (krc * CHIP / 4 + kre / math.pi),
        edge * (ktc * CHIP / 4 + kte / math.pi),
        -edge * (kac * CHIP / math.pi + kae / 2),
    )


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda x, y, z: (x, y, z), None),
        (lambda x, y, z: (0.6 * x, 1.4 * y, 2.0 * z), None),
        (lambda x, y, z: (-x, -y, -z), "point 1.. deg away"),
        (lambda x, y, z: (x, -y, z), "point 12. deg away"),
        (lambda x, y, z: (x / 1000, y / 1000, z / 1000), "are 0.0011? times"),
        (lambda x, y, z: (4.45 * x, 4.45 * y, 4.45 * z), "are 4.[2-9] times"),
    ],
)
@pytest.mark.parametrize("source", ["option", "table"])
def test_forces_that_contradict_the_stock_are_reported(folder, change, words, source):
    (folder / "part.ngc").write_text(SLOT)
    tools = TOOLS.replace("{material: EN AW-7075-T6}", f"{{coefficients: {EDGES}, ci95: 0.1}}")
    (folder / "milling.yaml").write_text(STOCK + tools)
    force = ",".join(f"{value:.4f}" for value in change(*in_slot()))
    stated = f"{force}@feed"
    if source == "table":
        stated = folder / "forces.csv"
        stated.write_text(f"line,fx,fy,fz,frame\n7,{force},feed\n8,{force},feed\n")
    arguments = ["predict", str(folder / "part.ngc"), f"--force={stated}", "--json", "-"]
    result = CliRunner().invoke(main, arguments)
    findings = [one for one in json.loads(result.stdout)["findings"] if one["code"] == "FRC040"]
    assert len(findings) == bool(words), result.output
    if words:
        assert re.search(words, findings[0]["message"]), findings
        assert result.exit_code == 3
