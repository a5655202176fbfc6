"""Odd cells and odd numbers at random, as somebody may type them: ``python -m tests.odd_cells 2000`` runs so many."""

from __future__ import annotations

import contextlib
import io
import json
import random
import re
import sys
import tempfile
from pathlib import Path

from postproc.cli.main import run

SIZES = (
    *(
        "0",
        "-0",
        "1e-30",
        "-1e-30",
        "5e-324",
        "1e-310",
        "1e-9",
        "1e-6",
        "1e-4",
        "0.001",
        "0.02",
        "0.5",
        "1",
        "7",
    ),
    *(
        "33.3",
        "-33.3",
        "180",
        "-180",
        "359.999999",
        "1e3",
        "1e4",
        "1e6",
        "1e9",
        "1e15",
        "1e30",
        "1e150",
        "1e308",
    ),
    *(
        "1e309",
        "-1e308",
        "9007199254740993",
        "2147483648",
        "4294967296",
        "nan",
        ".inf",
        "-.inf",
        "0x10",
        "1_000",
    ),
    *("1,5", "1e", "'1'", "null", "~", "true", "[1]", "{}", "[]", "1.5.2", "+5", "007", "1e+2", ".5", "5."),
)
FRAME = ("x", "y", "z", "a", "b", "c")
MAX_CORRECTION = 10.0
"""[mm] Of a cell that states none."""

_MOVE = re.compile(r"LIN \{X (\S+?),Y (\S+?),Z (\S+?),.*;p(\d+)$", re.MULTILINE)


def odd_cell(rng: random.Random) -> str:
    """A cell that is right but for some of its numbers."""
    tool = {"x": "120", "y": "0", "z": "250", "a": "0", "b": "30", "c": "0"}
    base = {"x": "1500", "y": "-200", "z": "600", "a": "0", "b": "0", "c": "0"}
    top = {"tolerance": "0.02"}
    start = ["0", "-90", "90", "0", "45", "0"]
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        odd = rng.choice(SIZES)
        place = rng.randrange(8)
        if place == 0:
            tool[rng.choice((*FRAME, "mass", "diameter"))] = odd
        elif place == 1:
            base[rng.choice(FRAME)] = odd
        elif place == 2:
            start[rng.randrange(6)] = odd
        else:
            names = (
                "tolerance",
                "tolerance_deg",
                "max_correction",
                "min_segment",
                "max_growth",
                "force_ramp",
            )
            top[rng.choice((*names, "temperature", "force_ci95"))] = odd
    lines = [
        "robot: kuka_kr270",
        f"tools: {{1: {{{', '.join(f'{key}: {value}' for key, value in tool.items())}, axis: +z}}}}",
        f"bases: {{1: {{{', '.join(f'{key}: {value}' for key, value in base.items())}}}}}",
        f"start: [{', '.join(start)}]",
        *(f"{key}: {value}" for key, value in top.items()),
    ]
    return "\n".join(lines) + "\n"


def odd_program(rng: random.Random) -> str:
    """A cut whose moves are marked by comments, with an odd number in one of its places or in none."""
    force = ["-360", "50", "560"]
    corners = [
        ["0", "0", "-2"],
        ["100", "0", "-2"],
        ["200", "0", "-2"],
        ["200", "150", "-2"],
        ["20", "150", "-2"],
    ]
    speed = "0.05"
    if rng.random() < 0.5:
        odd, place = rng.choice(SIZES), rng.randrange(6)
        if place < 3:
            force[place] = odd
        elif place < 5:
            corners[rng.randrange(len(corners))][rng.randrange(3)] = odd
        else:
            speed = odd
    moves = [f"LIN {{X {x},Y {y},Z {z},A 0,B 0,C 180}} ;p{k}" for k, (x, y, z) in enumerate(corners)]
    lines = [
        *(
            "DEF part()",
            "$BASE=BASE_DATA[1]",
            "$TOOL=TOOL_DATA[1]",
            "PTP {A1 0,A2 -90,A3 110,A4 0,A5 40,A6 0}",
        ),
        *(
            f"$VEL.CP={speed}",
            "LIN {X 0,Y 0,Z 50,A 0,B 0,C 180}",
            moves[0],
            f";FORCE {' '.join(force)} @base",
        ),
        *(*moves[1:], ";FORCE OFF", "LIN {X 0,Y 0,Z 80,A 0,B 0,C 180}", "END", ""),
    ]
    return "\r\n".join(lines)


def odd_words(rng: random.Random) -> list[str]:
    """Options, with an odd number now and then."""
    words = ["--force"]
    if rng.random() < 0.2:
        words = [f"--force={rng.choice(SIZES)},{rng.choice(SIZES)},50"]
    if rng.random() < 0.2:
        words += ["--gain", rng.choice((*SIZES, "0.5", "1.0000001"))]
    if rng.random() < 0.2:
        words.append("--no-insert")
    return words


def wrong(seed: int, folder: Path) -> str:
    """What is wrong with the run of a seed, or nothing."""
    rng = random.Random(seed)
    cell, text, words = odd_cell(rng), odd_program(rng), odd_words(rng)
    (folder / "cell.yaml").write_text(cell)
    program, output = folder / "part.src", folder / "compensated" / "part.src"
    program.write_text(text, newline="")
    output.unlink(missing_ok=True)
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            run([str(program), *words, "--json", "-"])
            code: object = "no exit"
        except SystemExit as end:
            code = end.code or 0
    said = f"{cell}{text}{words}\n{err.getvalue()}"
    if code not in (0, 1, 2, 3):
        return f"exit code {code}: {said}"
    if "Traceback" in said or "defect" in said:
        return f"traceback: {said}"
    if "FIL008" in err.getvalue():
        return f"the self-check failed: {said}"
    if output.exists() != (code in (0, 3)):
        return f"exit code {code} but the output {'is' if output.exists() else 'is not'} there: {said}"
    if code not in (0, 3):
        return ""
    result = json.loads(out.getvalue())
    stated = re.search(r"^max_correction: (\S+)$", cell, re.MULTILINE)
    allowed = float(stated.group(1)) if stated and stated.group(1) not in ("null", "~") else MAX_CORRECTION
    before, after = (
        {move[3]: move for move in _MOVE.findall(one)} for one in (text.replace("\r", ""), output.read_text())
    )
    if before.keys() != after.keys():
        return f"moves are lost: {said}"
    for number, place in before.items():
        new = after[number]
        if new[:3] == place[:3]:
            continue
        moved = sum((float(a) - float(b)) ** 2 for a, b in zip(new[:3], place[:3], strict=True)) ** 0.5
        if not moved <= allowed + 0.001:
            return f"p{number} is moved by {moved} mm, {allowed} are allowed: {said}"
    if code == 0 and result["error_before_mm"]["max"] is not None:
        worse = result["error_after_mm"]["max"] > result["error_before_mm"]["max"] + 1e-6
        if worse:
            return f"worse with exit 0: {result['error_before_mm']} {result['error_after_mm']} {said}"
    return ""


def main(count: int, first: int = 0) -> int:
    found = 0
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(first, first + count):
            problem = wrong(seed, Path(folder))
            if problem:
                found += 1
                print(f"seed {seed}: {problem}\n")
    print(f"{count} odd cells: {found} wrong")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main(*map(int, sys.argv[1:3] or ["2000"])))
