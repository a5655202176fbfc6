"""Statements of drawn programs: none differs in what was written, and every one that is changed there is reported."""

import random
import re

import pytest
import written_paths
from written_paths import FORCE, WRITERS

import postproc
from postproc.verification.motion_ends import MotionEnds
from postproc.verification.pairing import Different, pair_motions
from postproc.verification.simulator import Simulator
from postproc.workflows.preparation import Request, prepare
from postproc.workflows.stated_differences import mark_findings, statement_findings

STATEMENTS = {
    "krl": [
        "$OUT[1]=TRUE", "WAIT SEC 0.5", "$ACC.CP=1.5", "HALT", "$OV_PRO=50", ";NOTE 7", "BAS(#VEL_PTP,20)",
        "$LOAD.M=5", "TRIGGER WHEN DISTANCE=0 DELAY=0 DO $OUT[2]=FALSE",
    ],
    "gcode": ["M8", "M9", "S4000", "G4 P0.5", "(NOTE 7)", "M3 S2000", "M5", "M1"],
    "rapid": [
        "SetDO do1,1;", "WaitTime 0.5;", "Stop;", 'TPWrite "note 7";', "reg1:=5;", "! NOTE 7", "AccSet 50,50;",
    ],
    "tp": ["  DO[1]=ON ;", "  WAIT    .50(sec) ;", "  R[1]=5 ;", "  !NOTE 7 ;", "  DO[2]=PULSE,0.5sec ;"],
}  # fmt: skip
"""What programs state between their motions, by language."""

FURTHER = {
    "krl": ["SPINDLE_OFF()", "$ADVANCE=0", "$TOOL=TOOL_DATA[2]", "SWITCH 1"],
    "gcode": ["M98 P100", "G55", "G0 Z100", "G43 H2"],
    "rapid": ["SpindleOff;", "TriggIO t1,0\\DOp:=do1,1;", "VAR speeddata vel:=[5,5,5,5];"],
    "tp": ["  CALL SPINDLE ;", "  UTOOL_NUM=2 ;", "  JMP LBL[1] ;"],
}
"""What else is put into an output."""

MOTIONS = {"krl": r"(?:LIN|CIRC) ", "gcode": r"G[12] ", "rapid": r"Move[LC] ", "tp": r" *\d+:[LC] .*;"}
WORDS = {
    "krl": [(r"\s*$", " C_ORI"), (r"\s*$", " ;NOTE"), (r"\s*$", " C_VEL")],
    "gcode": [(r"\s*$", " M8"), (r"(?= X)", " S500"), (r"\s*$", " H2"), (r"(?= X)", " T3")],
    "rapid": [("v50", "v60"), (r"\\WObj", r"\\NoEOffs\\WObj"), (",fine,|,z0,", ",z5,")],
    "tp": [("50mm/sec", "60mm/sec"), (" *;", " ACC50    ;"), (" *;", " TB .50sec,DO[1]=OFF    ;")],
}
"""Words of a motion: what is replaced, and by what."""

NUMBERED = re.compile(r"( *\d+:)(.*)")


def stated(random_numbers, language, text):
    """A program with drawn statements between its motions."""
    lines = []
    motions = re.compile(MOTIONS[language])
    seen = False
    for line in text.split("\n"):
        if seen and motions.match(line):
            lines += random_numbers.choices(STATEMENTS[language], k=random_numbers.choice([0, 1, 1, 2]))
        seen = seen or motions.match(line) is not None
        lines.append(line)
    return "\n".join(lines)


def numbered(language, text):
    """Lines of TP are counted."""
    if language != "tp":
        return text
    lines, count = [], 0
    head, main, points = re.split(r"(?<=/MN\n)|(?=/POS\n)", text)
    for line in main.split("\n"):
        if re.match(r" *\d+:|  [A-Z!]", line):
            count += 1
            found = re.match(r" *\d+:(.*)", line)
            line = f"{count:4d}:{found[1] if found else line}"
        lines.append(line)
    return re.sub(r"(LINE_COUNT\t= )\d+", rf"\g<1>{count}", head) + "\n".join(lines) + points


def program(folder, seed, language):
    """A drawn program with statements, and its cell: corrections divide its motions."""
    folder.mkdir(parents=True)
    numbers = random.Random(f"{seed} {language}")
    writer = WRITERS[language]
    text = stated(numbers, language, writer.write(written_paths.draw(seed)))
    text = numbered(language, text)
    path = folder / f"part{writer.suffix}"
    path.write_bytes(text.replace("\n", numbers.choice(["\n", "\r\n"])).encode())
    cell = written_paths.CELL.replace("tolerance: 0.05", "tolerance: 0.005").replace(
        "max_growth: 6", "max_growth: 40"
    )
    (folder / "cell.yaml").write_text(cell)
    return path, numbers


def findings(path, output):
    """What the comparison of the statements and of the marks finds."""
    one = prepare(Request(path, force=FORCE))
    two = prepare(Request(output, cell=path.parent / "cell.yaml"))
    paths = one.task.toolpath, two.task.toolpath
    try:
        pairing = pair_motions(one.task, two.task)
    except Different:  # what is put in there may be a motion
        ends = None
    else:
        simulator = Simulator.of(one.task, pairing)
        ends = MotionEnds.of(simulator, two.task, simulator.run(two.task, pairing.start, pairing.stop))
    found = statement_findings(one.dialect.family, (one.program, two.program), paths, ends)
    return found + mark_findings(two.program, one.program, one.robot)


def plant(numbers, language, text):
    """An output with one statement more, less, or another one, or with another word of a motion."""
    lines = text.split("\n")
    motions = [k for k, line in enumerate(lines) if re.match(MOTIONS[language], line)]
    own = set(STATEMENTS[language])
    statements = [k for k in range(motions[0], motions[-1]) if bare(language, lines[k].rstrip("\r")) in own]
    kind = numbers.choice(["insert", "insert", "delete", "alter", "word"])
    if kind == "insert" or (kind in ("delete", "alter") and not statements):
        at = numbers.choice(motions[1:])
        new = numbers.choice(STATEMENTS[language] + FURTHER[language])
        lines.insert(at, (f"{at:4d}:" if language == "tp" else "") + new)
    elif kind == "delete":
        del lines[numbers.choice(statements)]
    elif kind == "alter":
        at = numbers.choice(statements)
        digit = re.search(r"\d(?!.*\d)", bare(language, lines[at]))
        old, new = (
            (digit[0], str((int(digit[0]) + 1) % 10)) if digit else (";" if language == "rapid" else "", "_")
        )
        place = lines[at].rindex(old)
        lines[at] = lines[at][:place] + new + lines[at][place + len(old) :] if old else lines[at] + new
    else:
        at = numbers.choice(motions)
        old, new = numbers.choice(WORDS[language])
        changed = re.sub(old, new, lines[at].rstrip("\r"), count=1)
        assert changed != lines[at].rstrip("\r"), lines[at]
        lines[at] = changed
    return "\n".join(lines), (kind, at if kind != "delete" else -1)


def move(numbers, language, text):
    """An output in which a statement is moved past one to three motions, and from where to where; None without one."""
    lines = text.split("\n")
    motions = [k for k, line in enumerate(lines) if re.match(MOTIONS[language], line)]
    own = set(STATEMENTS[language])
    statements = [k for k in range(motions[0], motions[-1]) if bare(language, lines[k].rstrip("\r")) in own]
    if not statements:
        return None
    at, count = numbers.choice(statements), numbers.choice([1, 1, 2, 3])
    before, after = [k for k in motions if k < at][1:], [k for k in motions if k > at]
    if numbers.random() < 0.5 and len(before) >= count:
        to = before[-count]
    elif len(after) >= count:
        to = after[count - 1]
        while language == "tp" and re.match(" *:", lines[to + 1]):  # an arc has two lines
            to += 1
    else:
        return None
    lines.insert(to, lines.pop(at))
    return "\n".join(lines), (at, to)


def bare(language, line):
    found = NUMBERED.fullmatch(line) if language == "tp" else None
    return found[2] if found else line


def check(tmp_path, seed, language, plants):
    path, numbers = program(tmp_path / f"{language}{seed}", seed, language)
    report = postproc.compensate(path, force=FORCE)
    output = path.parent / "compensated" / path.name
    assert findings(path, output) == []
    clean = output.read_bytes().decode()
    for _ in range(plants):
        text, what = plant(numbers, language, clean)
        output.write_bytes(text.encode())
        assert findings(path, output), (what, seed, language)
    for _ in range(plants):
        moved = move(numbers, language, clean)
        if moved is not None:
            output.write_bytes(moved[0].encode())
            assert findings(path, output), (moved[1], seed, language)
    output.write_bytes(clean.encode())
    return report.to_dict()["inserted"]


@pytest.mark.parametrize("language", WRITERS)
def test_a_changed_statement_is_reported(tmp_path, language):
    """In drawn programs of which motions are divided."""
    inserted = [check(tmp_path, seed, language, 8) for seed in (2, 4)]
    assert min(inserted) > 0


@pytest.mark.slow
@pytest.mark.parametrize("language", WRITERS)
@pytest.mark.parametrize("seed", range(10, 40))
def test_changed_statements_of_many_programs_are_reported(tmp_path, language, seed):
    check(tmp_path, seed, language, 20)


def test_verify_reports_them_and_another_original_or_robot(tmp_path):
    path, _ = program(tmp_path / "part", 2, "krl")
    postproc.compensate(path, force=FORCE)
    output = path.parent / "compensated" / path.name
    clean, original = output.read_bytes(), path.read_bytes()

    def verified():
        done = postproc.verify(path, output, force=FORCE)
        return done.exit, {one.code for one in done.findings}

    assert not {"VER005", "VER009"} & verified()[1]
    lines = clean.split(b"\n")
    at = [k for k, line in enumerate(lines) if line.startswith(b"LIN ")][2]
    output.write_bytes(b"\n".join([*lines[:at], b"SPINDLE_OFF()", *lines[at:]]))
    done = postproc.verify(path, output, force=FORCE)
    first = next(one for one in done.findings if one.code.startswith("VER"))
    assert (done.exit, first.code, first.line) == (3, "VER005", at + 1)
    assert "'SPINDLE_OFF()'" in first.message
    output.write_bytes(re.sub(rb"kuka_kr270 sha256:....", b"kuka_kr270 sha256:0000", clean))
    code, codes = verified()
    assert code == 3
    assert "VER009" in codes
    output.write_bytes(clean)
    path.write_bytes(original + b"\n; LATER\n")
    code, codes = verified()
    assert code == 3
    assert {"VER005", "VER009"} <= codes


DIVIDED = """\
DEF part()
$VEL.CP=0.05
$BASE=BASE_DATA[1]
$TOOL=TOOL_DATA[1]
PTP {A1 0,A2 -90,A3 90,A4 0,A5 45,A6 0}
LIN {X 0,Y 0,Z 50,A 0,B 0,C 180}
LIN {X 0,Y 0,Z -5,A 0,B 0,C 180}
LIN {X 150,Y 0,Z -5,A 0,B 0,C 180}
$OUT[1]=TRUE
LIN {X 150,Y 150,Z -5,A 0,B 0,C 180}
LIN {X 0,Y 150,Z -5,A 0,B 0,C 180}
LIN {X 0,Y 150,Z 50,A 0,B 0,C 180}
END
"""


def test_a_statement_past_motions_with_the_same_words(tmp_path):
    """Wherever in the cut it is moved to: an output that is switched at a corner alone has its only place there."""
    path = tmp_path / "part.src"
    path.write_text(DIVIDED)
    (tmp_path / "cell.yaml").write_text(
        written_paths.CELL.replace("tolerance: 0.05", "tolerance: 0.001").replace("6\n", "40\n")
    )
    postproc.compensate(path, force=FORCE)
    output = tmp_path / "compensated" / path.name
    lines = output.read_text().split("\n")
    at = lines.index("$OUT[1]=TRUE")
    own = lines.pop(at)
    places = [k for k, line in enumerate(lines) if line.startswith("LIN ")][1:]
    assert len(places) > 8
    for to in places:
        output.write_text("\n".join([*lines[:to], own, *lines[to:]]))
        done = postproc.verify(path, output, force=FORCE)
        found = [one for one in done.findings if one.code == "VER005"]
        assert bool(found) is (to != at), to
        if found and "follows another motion" in found[0].message:
            assert found[0].message == "'$OUT[1]=TRUE' follows another motion than in the original, line 9"
            assert found[0].line == to + 1
