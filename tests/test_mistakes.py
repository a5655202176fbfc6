"""Mistakes that users make, in one table: what is done, the exit code, and words of the message that name what is
wrong and what to do.  In none of the refused cases a file is written."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import pytest

FORCE = "0,360,560"
P = "part.src"


@dataclass(frozen=True)
class Mistake:
    """``prepare``: changes to the folder of a sound job; ``words``: the command line; ``said``: what is told."""

    name: str
    prepare: Sequence[Callable[[Path], object]]
    words: Sequence[str]
    code: int
    said: Sequence[str]


def program(old, new):
    return lambda folder: replaced(folder / P, old, new)


def cell(old, new):
    return lambda folder: replaced(folder / "cell.yaml", old, new)


def added(text):
    return lambda folder: (folder / "cell.yaml").open("a").write(text)


def replaced(path, old, new):
    raw = path.read_bytes()
    assert old.encode() in raw
    path.write_bytes(raw.replace(old.encode(), new.encode(), 1))


def put(name, content):
    raw = content if isinstance(content, bytes) else content.encode()
    return lambda folder: (folder / name).write_bytes(raw)


def before_cut(comment):
    return program("LIN {X 100.000", f"{comment}\r\nLIN {{X 100.000")


TOLERANCE = "tolerance: 0.02"
TOOL = "{x: 120, y: 0, z: 250, a: 0, b: 30, c: 0, axis: +z}"
BASE = "{x: 1500, y: -200, z: 600, a: 0, b: 0, c: 0}"
RUN = (P, f"--force={FORCE}", "--dry-run")

PLAN = ("plan", "--robot", "kuka_kr270", "--effects", "joint_compliance", "--poses", "5", "-o", "p.csv")

MISTAKES = [
    # forces
    Mistake("a folder", [], [".", f"--force={FORCE}"], 1, ["FIL001", "this is a folder", "compensate batch ."]),
    Mistake("another suffix", [], ["part.nc", f"--force={FORCE}"], 1, ["FIL001", f"is it {P}?"]),
    Mistake("no --force", [], [P], 1, ["FRC030", "FORCE comments", "add --force to the command"]),
    Mistake(
        "no --force and no force",
        [program(";FORCE -360 50 560 @base", ";"), program(";FORCE 0 200 0", ";")],
        [P],
        1,
        ["FRC030", ";FORCE 0 360 560", "part.force.csv", "force: 0,360,560@base"],
    ),
    Mistake(
        "no --force, one in the cell",
        [program(";FORCE -360 50 560 @base", ";"), program(";FORCE 0 200 0", ";"), added("force: 1,2,3\n")],
        [P],
        1,
        ["FRC030", "the cell states force: 1,2,3"],
    ),
    Mistake("decimal commas", [], [P, "--force=-82,5 152,4 -34,4"], 1, ["FRC002", "commas and blanks", "point"]),
    Mistake("semicolons", [], [P, "--force=0;360;560"], 1, ["FRC002", "semicolons"]),
    Mistake(
        "decimal commas in a comment",
        [before_cut(";FORCE -82,5 152,4 -34,4")],
        [P, "--force"],
        1,
        ["part.src:10", "commas and blanks"],
    ),
    Mistake("letter in a number", [before_cut(";FORCE 0 36O 560")], [P, "--force"], 1, ["part.src:10", "'36O'"]),
    Mistake("unit in a number", [before_cut(";FORCE 0N 360N 560N")], [P, "--force"], 1, ["'0N'"]),
    Mistake("words instead of one", [], [P, "--force", "0", "360", "560"], 2, ["force is one word"]),
    Mistake(
        "a PTP under a force",
        [program(" ; slot", " ; slot\r\nPTP {X 200.000,Y 80.000,Z -2.000,A 0.000,B 0.000,C 180.000}")],
        [P, "--force", "--dry-run"],
        3,
        ["FRC009", "line 12", "point-to-point", "FORCE OFF before it"],
    ),
    Mistake("frame apart", [], [P, "--force", FORCE, "@base"], 2, ["force is one word"]),
    Mistake("frame misspelt", [], [P, f"--force={FORCE}@bse"], 1, ["did you mean 'base'"]),
    Mistake("two numbers", [], [P, "--force=0,360"], 1, ["2 numbers", "3 or 6"]),
    Mistake("millinewtons", [], [P, "--force=0,360000,560000"], 1, ["no robot carries", "in N"]),
    Mistake("kilonewtons", [], [P, "--force=0,0.36,0.56", "--dry-run"], 3, ["FRC034", "as if it were in kN", "560"]),
    Mistake("overflow", [], [P, "--force=0,1e308,0"], 1, ["exceeds 1e+09 N"]),
    Mistake("spreadsheet", [put("f.xlsx", b"PK\3\4")], [P, "--force", "f.xlsx"], 2, ["spreadsheet", "as CSV"]),
    Mistake("JSON file", [put("f.json", "{}")], [P, "--force", "f.json"], 2, ["f.json is neither"]),
    Mistake("text file", [put("f.txt", "x")], [P, "--force", "f.txt"], 2, ["CSV or YAML file: rename f.txt"]),
    Mistake("no such CSV", [], [P, "--force", "f.csv"], 1, ["f.csv", "No such file"]),
    Mistake("empty CSV", [put("f.csv", "")], [P, "--force", "f.csv"], 1, ["no header and no rows"]),
    Mistake("no header", [put("f.csv", "9,0,360,560\n")], [P, "--force", "f.csv"], 1, ["header is missing"]),
    Mistake("unit in a header", [put("f.csv", "line,fx_kn\n10,1\n")], [P, "--force", "f.csv"], 1, ["fx_kn"]),
    Mistake(
        "CSV of another program",
        [put("f.csv", "line,fx,fy,fz\n9999,0,1,2\n")],
        [P, "--force", "f.csv"],
        1,
        ["line 9999", "contains no motion"],
    ),
    Mistake(
        "comments and CSV",
        [put("part.force.csv", "line,fx,fy,fz\n10,0,1,2\n")],
        [P, "--force", "--dry-run"],
        3,
        ["FRC031", "part.force.csv is not used"],
    ),
    Mistake("no process file", [], [P, "--force", "mill.yaml"], 1, ["mill.yaml", "No such file"]),
    Mistake("foreign process", [put("m.yaml", "cutter: 3\n")], [P, "--force", "m.yaml"], 1, ["m.yaml:1", "cutter"]),
    # the cell
    Mistake("tool in metres", [cell(TOOL, TOOL.replace("120", "0.12").replace("250", "0.25"))], RUN, 3, ["CEL005"]),
    Mistake(
        "base in metres",
        [cell(BASE, "{x: 1.5, y: -0.2, z: 0.6}")],
        RUN,
        3,
        ["CEL005", "metres", "x: 1500"],
    ),
    Mistake("angles in radians", [cell("b: 30", "b: 0.5236")], RUN, 3, ["CEL005", "radians", "30"]),
    Mistake("mass in grams", [cell("axis: +z", "axis: +z, mass: 42000, com: [0, 0, 99]")], RUN, 3, ["grams"]),
    Mistake("mass in tonnes", [cell("axis: +z", "axis: +z, mass: 0.042, com: [0, 0, 99]")], RUN, 3, ["tonnes"]),
    Mistake("com in metres", [cell("axis: +z", "axis: +z, mass: 42, com: [0, 0, 0.1]")], RUN, 3, ["com", "metres"]),
    Mistake("cutter in metres", [cell("axis: +z", "axis: +z, diameter: 0.016")], RUN, 3, ["diameter in metres", "16"]),
    Mistake("ramp in metres", [added("force_ramp: 0.008\n")], RUN, 3, ["CEL005", "force_ramp", "8"]),
    Mistake("tolerance in um", [cell(TOLERANCE, "tolerance: 20")], RUN, 3, ["CEL007", "0.02"]),
    Mistake("angle tolerance", [added("tolerance_deg: 10\n")], RUN, 3, ["CEL007"]),
    Mistake("axis turned round", [cell("axis: +z", "axis: -z")], RUN, 3, ["CEL006", "change its sign"]),
    Mistake("TCP inside the wrist", [cell(TOOL, "{x: 0, y: 0, z: -250}")], RUN, 3, ["CEL006", "inside the wrist"]),
    Mistake("start in radians", [cell("45, 0]", "0.7854, 0]"), cell("[0, -90, 90", "[0, -1.5708, 1.5708")], RUN, 3,
            ["start", "radians"]),
    Mistake("decimal comma", [cell("x: 1500", "x: 1500,5")], RUN, 1, ["cell.yaml:5", "decimals with a point"]),
    Mistake("unit in a value", [cell(TOLERANCE, "tolerance: 0.02 mm")], RUN, 1, ["tolerance", "0.02 mm"]),
    Mistake("negative tolerance", [cell(TOLERANCE, "tolerance: -0.02")], RUN, 1, ["above 0"]),
    Mistake("key misspelt", [cell("tolerance", "tolerence")], RUN, 1, ["did you mean 'tolerance'"]),
    Mistake("key twice", [added(TOLERANCE + "\n")], RUN, 1, ["defined twice"]),
    Mistake("tab", [added("force:\t1,2,3\n")], RUN, 1, ["cell.yaml:8"]),
    Mistake("percent", [added("force_ci95: 20\n")], RUN, 1, ["within 0 .. 1"]),
    Mistake("start beyond a limit", [cell("[0, -90, 90", "[0, 90, -90")], RUN, 3, ["CEL014", "A2 is 90"]),
    Mistake("cell.yml", [lambda f: (f / "cell.yaml").rename(f / "cell.yml")], RUN, 1, ["rename it to"]),
    Mistake("cell.yaml.txt", [lambda f: (f / "cell.yaml").rename(f / "cell.yaml.txt")], RUN, 1, ["--cell cell"]),
    Mistake("mode misspelt", [added("correct: proces\n")], RUN, 1, ["did you mean 'process'"]),
    Mistake("absolute alone", [added("correct: absolute\n")], [P], 1, ["CEL010", "absolute_accuracy"]),
    Mistake("base missing", [program("BASE_DATA[1]", "BASE_DATA[7]")], RUN, 1, ["base 7 is not defined"]),
    Mistake("UTF-16 cell", [lambda f: (f / "cell.yaml").write_bytes("robot: a\n".encode("utf-16"))], RUN, 1, ["UTF-8"]),
    Mistake("program as cell", [], [*RUN, "--cell", P], 1, ["keys and values (YAML)"]),
    Mistake("cell for G-code", [added("dialect: {name: fanuc}\n")], RUN, 1, ["CEL008", "cell.yaml:8", "in KRL"]),
    Mistake("robot misspelt", [], [*RUN, "--robot", "kuka_kr27"], 1, ["did you mean 'kuka_kr270'"]),
    # the program
    Mistake("no such program", [], ["prat.src", "--force"], 1, ["prat.src", "No such file"]),
    Mistake("data list", [program("DEF part", "DEFDAT part"), lambda f: (f / P).rename(f / "part.dat")],
            ["part.dat", "--force"], 1, ["name part.src"]),
    Mistake("cell as program", [], ["cell.yaml", "--force"], 1, ["FIL009", "name the program"]),
    Mistake("RAPID module", [put("p.MOD", "%%%\n VERSION:1\n%%%\nMODULE Part\nPROC main()\nENDPROC\nENDMODULE\n")],
            ["p.MOD", "--force"], 1, ["FIL009", "contains no motion (read as rapid)"]),
    Mistake("TP program", [put("p.ls", "/PROG  P\n/MN\n   1:  R[1]=1 ;\n/POS\n/END\n")],
            ["p.ls", "--force"], 1, ["FIL009", "contains no motion (read as tp)"]),
    Mistake("CSV as program", [put("f.csv", "line,fx\n1,2\n")], ["f.csv", "--force"], 1, ["with --force"]),
    Mistake("UTF-16", [lambda f: (f / P).write_bytes((f / P).read_text().encode("utf-16"))], RUN, 1, ["UTF-16"]),
    Mistake("spreadsheet as program", [put("p.src", b"PK\3\4\0\0")], ["p.src", "--force"], 1, ["spreadsheet"]),
    Mistake("empty", [put(P, "")], RUN, 1, ["file is empty"]),
    Mistake("no motion", [put(P, "DEF part()\nEND\n")], RUN, 1, ["no motion"]),
    Mistake("line ends of old", [lambda f: (f / P).write_bytes((f / P).read_bytes().replace(b"\r\n", b"\r"))], RUN, 1,
            ["FIL009", "CR alone"]),
    Mistake("two programs", [put("b.src", "DEF b()\nEND\n")], [P, "b.src", "--force"], 2, ["compensate batch"]),
    Mistake("decimal comma in a target", [program("X 100.000", "X 100,000")], RUN, 3, ["part.src:10"]),
    Mistake("cut off", [lambda f: (f / P).write_bytes((f / P).read_bytes()[:-60])], RUN, 3, ["part.src"]),
    Mistake("point without its .dat", [program("LIN {X 100.000", "LIN XP1 ;{")], RUN, 1, ["XP1 is not declared"]),
    # options and outputs
    Mistake("gain with a comma", [], [*RUN, "--gain", "0,5"], 2, ["decimal comma; write 0.5"]),
    Mistake("gain in percent", [], [*RUN, "--gain", "50%"], 2, ["write 0.5"]),
    Mistake("gain above 1", [], [*RUN, "--gain", "50"], 2, ["not in the range"]),
    Mistake("gain nan", [], [*RUN, "--gain", "nan"], 2, ["not a number"]),
    Mistake("option misspelt", [], [P, "--forse"], 2, ["Did you mean --force"]),
    Mistake("command misspelt", [], ["predit", P], 2, ["did you mean 'predict'"]),
    Mistake("output is the input", [], [P, f"--force={FORCE}", "-o", P], 1, ["is an input of the same run"]),
    Mistake("output no controller loads", [], [P, f"--force={FORCE}", "-o", "part.txt"], 1, ["FIL014", "part.src"]),
    Mistake("part before the program", [put("m.csv", "X,Y\n1,2\n")], ["learn", "m.csv", P, "--force"], 1,
            ["MEA013", "this is a program (krl)", "name the program first"]),
    Mistake("name no module has", [], [P, f"--force={FORCE}", "-o", "1 part.src"], 1, ["cannot name a KRL module"]),
    Mistake("JSON in a folder", [], [*RUN, "--json", "."], 2, ["must end in .json"]),
    Mistake("program as $config.dat", [], [*RUN, "--config-dat", P], 1, ["no data list of a controller", "DEFDAT"]),
    Mistake("pattern as program", [], ["*.src", "--force"], 1, ["this is a pattern", "compensate batch '*.src'"]),
    Mistake("loads in grams", [], [*PLAN, "--loads", "100000"], 1, ["PLN006", "is it in grams?"]),
    Mistake("help as a command", [], ["help"], 2, ["see compensate --help"]),
    Mistake("batch of nothing", [], ["batch", "nothing"], 1, ["matches nothing"]),
    Mistake("verify one file", [], ["verify", P], 2, ["COMPENSATED"]),
]  # fmt: skip


@pytest.mark.sample(30)
@pytest.mark.parametrize("mistake", MISTAKES, ids=lambda mistake: mistake.name)
def test_a_mistake_is_told_in_words(compensate, job, monkeypatch, mistake):
    monkeypatch.chdir(job.folder)
    for change in mistake.prepare:
        change(job.folder)
    done = compensate(*mistake.words)
    text = done.err + done.out
    assert done.code == mistake.code, text
    # a terminal folds long lines
    plain = " ".join(text.split())
    assert [said for said in mistake.said if said not in plain] == [], text
    assert "Traceback" not in text
    assert "Warning" not in text
    if mistake.code in (1, 2):
        assert job.nothing_written()


@pytest.mark.slow
def test_a_batch_without_force_writes_nothing(compensate, job, monkeypatch):
    monkeypatch.chdir(job.folder)
    done = compensate("batch", ".")
    assert done.code == 1
    assert "FRC030" in done.err + done.out
    assert not job.output.exists()


def test_upper_case_suffixes_are_read(compensate, job):
    program = job.program.rename(job.folder / "PART.SRC")
    assert compensate(program, f"--force={FORCE}", "--dry-run").code == 0


def test_an_option_that_resembles_none_is_not_compared_by_its_dashes(compensate, job):
    done = compensate("check", job.folder / P, "--robot")
    assert done.code == 2
    assert "There is no option '--robot'." in done.err
    assert "Did you mean" not in done.err
