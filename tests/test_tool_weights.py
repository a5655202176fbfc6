"""Weights that a cell or a program states of its tools: they act, or a finding says that they do not."""

from pathlib import Path

import numpy as np
import pytest

import postproc
from postproc.base.document import Document
from postproc.languages import DIALECTS

ARM = """name: arm
maker_name: test arm
about: test
geometry:
  source: test
  kuka: {unit: mm, d1: 750, a1: 350, a2: 1250, a3: -55, d4: 1100, d6: 230}
joints: {source: test, unit: deg, A1: [-185, 185], A2: [-146, 0], A3: [-119, 155], A4: [-350, 350], A5: [-125, 125],
  A6: [-350, 350]}
effects:
"""
COMPLIANCE = """  - effect: joint_compliance
    parameters: {c2: {value: 1.0e-6, unit: rad/(N m), ci95: 0.1e-6, source: test}}
"""
PAYLOAD = """  - effect: payload
    parameters: {mass: {value: 0, unit: kg, ci95: 1, source: test}}
"""
OFFSET = """  - effect: joint_offset
    parameters: {o2: {value: 0.01, unit: deg, ci95: 0.001, source: test}}
"""
POSE = "x: 120, y: 0, z: 250, a: 0, b: 30, c: 0, axis: +z"
KRL = """DEF p()
$BASE=BASE_DATA[1]
$TOOL={tool}
$VEL.CP=0.05
PTP {{A1 0,A2 -90,A3 90,A4 0,A5 45,A6 0}}
LIN {{X 0,Y 0,Z 0,A 0,B 0,C 180}}
LIN {{X 100,Y 50,Z 0,A 0,B 0,C 180}}
END
"""
JOINTS = "[9E9,9E9,9E9,9E9,9E9,9E9]"
RAPID = f"""MODULE p
PERS tooldata t1:=[TRUE,[[120,0,250],[0.9659258,0,0.2588190,0]],[MASS,[50,20,160],[1,0,0,0],0,0,0]];
PERS wobjdata w1:=[FALSE,TRUE,"",[[1450,-100,600],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];
PROC main()
MoveAbsJ [[0,-90,90,0,45,0],{JOINTS}],v1000,fine,t1;
MoveL [[0,0,0],[0,1,0,0],[0,0,0,0],{JOINTS}],v60,fine,t1\\WObj:=w1;
MoveL [[100,50,0],[0,1,0,0],[0,0,0,0],{JOINTS}],v60,fine,t1\\WObj:=w1;
ENDPROC
ENDMODULE
"""


def run(
    folder,
    tools,
    effects=COMPLIANCE,
    mode="absolute",
    program="TOOL_DATA[1]",
    compensated=False,
    more="",
    mass=None,
):
    """Exit code, messages of COR033, and the largest error [mm]."""
    folder.mkdir(exist_ok=True)
    (folder / "arm.yaml").write_text(ARM + effects)
    (folder / "cell.yaml").write_text(
        f"""robot: arm.yaml
tools: {{{tools}}}
bases: {{1: {{x: 1450, y: -100, z: 600, a: 0, b: 0, c: 0}}}}
start: [0, -90, 90, 0, 45, 0]
orientation: {{a: 0, b: 0, c: 180}}
correct: {mode}
controller: {{absolute_accuracy: false, gravity_compensated: {str(compensated).lower()}}}
{more}
"""
    )
    path = folder / ("p.src" if mass is None else "p.mod")
    path.write_text(KRL.format(tool=program) if mass is None else RAPID.replace("MASS", mass))
    report = postproc.compensate(path, force="0,0,-10@base" if mode == "process" else None, dry_run=True)
    found = [one for one in report.findings if one.code == "COR033"]
    error = float(np.nanmax(report.table()["error_before_mm"]))
    return report.exit, [(one.message, one.severity) for one in found], error


WEIGHED = f"1: {{{POSE}, mass: 100, com: [50, 20, 160]}}"
WITHOUT = f"1: {{{POSE}}}"


def test_a_mass_for_which_the_robot_file_has_no_payload_needs_review(tmp_path):
    exit_code, ((message, severity),), error = run(tmp_path, WEIGHED)
    assert (exit_code, severity) == (3, "warning")
    assert "tool 1, 100 kg" in message
    assert "no payload" in message
    assert error < 1e-9
    touched = run(tmp_path, WEIGHED, mode="touched_off", more="touch_points: [[0, 0, 0]]")
    assert len(touched[1]) == 1


def test_with_a_payload_the_robot_sags_in_proportion(tmp_path):
    one = run(tmp_path, WEIGHED, COMPLIANCE + PAYLOAD)
    other = run(tmp_path, WEIGHED.replace("100,", "50,"), COMPLIANCE + PAYLOAD)
    assert one[1] == other[1] == []
    assert one[2] > 0.5
    assert other[2] == pytest.approx(one[2] / 2, rel=2e-3)


def test_without_compliance_a_weight_deflects_nothing(tmp_path):
    exit_code, ((message, _),), _ = run(tmp_path, WEIGHED, OFFSET + PAYLOAD)
    assert exit_code == 3
    assert "no compliance" in message


def test_where_weights_are_not_corrected_here_nothing_is_missing(tmp_path):
    assert run(tmp_path, WEIGHED, mode="process")[:2] == (0, [])
    assert run(tmp_path, WEIGHED, compensated=True)[1] == []
    assert run(tmp_path, WITHOUT)[1] == []
    assert run(tmp_path, WEIGHED.replace("100,", "0,"))[1] == []
    assert run(tmp_path, f"{WITHOUT}, {WEIGHED.replace('1:', '2:', 1)}")[1] == []


@pytest.mark.parametrize("effects", [COMPLIANCE, COMPLIANCE + PAYLOAD])
def test_a_tool_that_the_cell_does_not_know_has_no_known_weight(tmp_path, effects):
    exit_code, ((message, _),), _ = run(tmp_path, WEIGHED, effects, program="{X 120,Y 0,Z 260,A 0,B 30,C 0}")
    assert exit_code == 3
    assert "weightless" in message
    own = run(tmp_path, WEIGHED, effects, program="{X 120,Y 0,Z 250,A 0,B 30,C 0}")
    assert not any("weightless" in message for message, _ in own[1])


@pytest.mark.parametrize("tools", [WITHOUT, f"2: {{{POSE.replace('250', '260')}, mass: 9, com: [0, 0, 50]}}"])
def test_the_load_of_tool_data_is_reported_where_the_cell_states_none(tmp_path, tools):
    exit_code, ((message, _),), _ = run(tmp_path, tools, COMPLIANCE + PAYLOAD, mass="100")
    assert exit_code == 3
    assert "100 kg" in message
    assert "not used" in message
    assert run(tmp_path, WITHOUT, COMPLIANCE + PAYLOAD, mass="0.001")[1] == []
    assert run(tmp_path, WITHOUT, COMPLIANCE + PAYLOAD, mass="100", mode="process")[:2] == (0, [])


def test_what_the_report_asks_for_makes_the_load_act(tmp_path):
    rapid = run(tmp_path, WEIGHED, COMPLIANCE + PAYLOAD, mass="100")
    assert rapid[1] == []
    assert rapid[2] > 0.5


CONFIG = """DEFDAT  $CONFIG
TOOL_DATA[1]={{X 120.0,Y 0.0,Z 250.0,A 0.0,B 30.0,C 0.0}}
LOAD_DATA[1]={{M {mass},CM {{X 50.0,Y 20.0,Z 160.0,A 0.0,B 0.0,C 0.0}},J {{X 0.0,Y 0.0,Z 0.0}}}}
LOAD_DATA[2]={{M 77.0,CM {{X 50.0,Y 20.0,Z 160.0,A 0.0,B 0.0,C 0.0}},J {{X 0.0,Y 0.0,Z 0.0}}}}
ENDDAT
"""


@pytest.mark.parametrize("tools", ["", WITHOUT])
def test_the_load_data_of_a_controller_are_reported_where_the_cell_states_none(tmp_path, tools):
    (tmp_path / "$config.dat").write_text(CONFIG.format(mass="100.0"))
    more = "dialect: {config_dat: $config.dat}"
    exit_code, ((message, _),), _ = run(tmp_path, tools, COMPLIANCE + PAYLOAD, more=more)
    assert exit_code == 3
    assert "100 kg of tool 1" in message
    assert run(tmp_path, WEIGHED, COMPLIANCE + PAYLOAD, more=more)[1] == []
    for mass in ("-1.0", "0.0"):  # as a controller has it before it is measured
        (tmp_path / "$config.dat").write_text(CONFIG.format(mass=mass))
        assert run(tmp_path, tools, COMPLIANCE + PAYLOAD, more=more)[1] == []


def loads(name, text):
    return DIALECTS[name].read((Document(Path(f"p.{name}"), text.encode()),)).toolpath.stated_loads


@pytest.mark.parametrize(
    ("statement", "mass", "entry"),
    [
        ("$LOAD={M 12.5,CM {X 0,Y 0,Z 90,A 0,B 0,C 0},J {X 0,Y 0,Z 0}}", 12.5, None),
        ("$load = { LOAD: m 1.2E+1 , CM {X 0}} ; part", 12.0, None),
        ("$LOAD.M=12", 12.0, None),
        ("$LOAD.M=12+i", None, None),
        ("$LOAD={M -1,CM {X 0}}", None, None),
        ("$LOAD=LOAD_DATA[3]", None, 3),
        ("$LOAD=LOAD_DATA[i]", None, None),
        ("$LOAD=part", None, None),
        ("$LOAD_A3={M 4,CM {X 0}}", 4.0, None),
        ("LOAD_DATA[3]={M 12,CM {X 0}}", 12.0, 3),
        ("LOAD_DATA[3].M=12", 12.0, 3),
        ("LOAD_DATA[3].CM.Z=12", None, 3),
        ("SLIN {X 1} WITH $LOAD=SLOAD(3), $TOOL=STOOL2(3)", None, 3),
    ],
)
def test_statements_of_krl_that_set_a_load(statement, mass, entry):
    ((line, said),) = [
        (one.line, (one.mass, one.entry)) for one in loads("krl", f"DEF p()\n{statement}\nEND\n")
    ]
    assert (line, *said) == (2, mass, entry)


@pytest.mark.parametrize(
    "statement",
    [";$LOAD={M 12}", "m=$LOAD.M", "IF $LOAD.M==12 THEN\nENDIF", "PAYLOAD=3", 'MSG("$LOAD=3")', "UNLOAD()"],
)
def test_what_reads_a_load_or_mentions_one_sets_none(statement):
    assert loads("krl", f"DEF p()\n{statement}\nEND\n") == ()


@pytest.mark.parametrize(
    ("statement", "said"),
    [
        ("GripLoad part;", [(12.0, True)]),
        ("GripLoad\n  PART ;", [(12.0, True)]),
        ("GripLoad [4,[0,0,1],[1,0,0,0],0,0,0];", [(4.0, True)]),
        ("GripLoad other;", [(None, True)]),
        ("GripLoad changed;", [(None, True)]),
        ("GripLoad load0;", []),
        ("! GripLoad part;", []),
        ('TPWrite "GripLoad part;";', []),
        ("MoveL p1,v60,fine,t1\\TLoad:=part\\WObj:=w1;", [(12.0, False)]),
    ],
)
def test_statements_of_rapid_that_set_a_load(statement, said):
    data = "PERS loaddata part:=[12,[0,0,90],[1,0,0,0],0,0,0];\nPERS loaddata changed:=[1,[0,0,1],[1,0,0,0],0,0,0];\n"
    text = f"MODULE p\n{data}PROC main()\nchanged.mass:=5;\n{statement}\nENDPROC\nENDMODULE\n"
    assert [(one.mass, one.gripped) for one in loads("rapid", text)] == said


@pytest.mark.parametrize(
    ("numbers", "count"), [(["1"], 0), (["1", "1: tool", " 1 "], 0), (["1", "2"], 2), (["R[1]"], 1)]
)
def test_a_tp_program_that_changes_its_payload_schedule(numbers, count):
    lines = "".join(f"   {n}:  PAYLOAD[{number}] ;\n" for n, number in enumerate(numbers, 1))
    assert len(loads("tp", f"/PROG  P\n/MN\n{lines}/POS\n/END\n")) == count


def at_run_time(folder, statement, tools=WEIGHED, **more):
    """Messages of COR033 of a program with a statement before its last motion."""
    text = KRL.replace("LIN {{X 100", statement.replace("{", "{{").replace("}", "}}") + "\nLIN {{X 100")
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(globals(), "KRL", text)
        return [message for message, _ in run(folder, tools, COMPLIANCE + PAYLOAD, **more)[1]]


def test_a_load_that_a_program_sets_is_compared_with_the_cell(tmp_path):
    (message,) = at_run_time(tmp_path, "$LOAD={M 12,CM {X 0}}")
    assert "line 7" in message
    assert "states a load of 12 kg; the cell states 100 kg" in message
    assert at_run_time(tmp_path, "$LOAD={M 100.05,CM {X 0}}") == []
    assert at_run_time(tmp_path, "$LOAD=LOAD_DATA[1]") == []
    (message,) = at_run_time(tmp_path, "$LOAD=LOAD_DATA[2]")
    assert "mass is not known" in message
    assert len(at_run_time(tmp_path, "LOAD_DATA[1].M=5\n$LOAD=LOAD_DATA[1]")) == 2
    assert at_run_time(tmp_path, "$LOAD={M 12,CM {X 0}}", compensated=True) == []
    assert at_run_time(tmp_path, "$LOAD={M 12,CM {X 0}}", mode="process") == []
    assert len(at_run_time(tmp_path, "$LOAD={M 12,CM {X 0}}", tools=WITHOUT)) == 1


def test_a_load_that_holds_for_motions_of_another_tool_is_not_theirs(tmp_path):
    """Tool 2 weighs what is set for it, tool 1 does not."""
    tools = f"{WEIGHED}, 2: {{{POSE}, mass: 40, com: [50, 20, 160]}}"
    own = "$TOOL=TOOL_DATA[2]\n$LOAD={M 40,CM {X 0}}"
    assert at_run_time(tmp_path, own, tools=tools) == []
    assert len(at_run_time(tmp_path, own.replace("M 40", "M 100"), tools=tools)) == 1


def test_a_load_that_is_gripped_weighs_nothing_here(tmp_path, monkeypatch):
    gripped = "GripLoad [4,[0,0,1],[1,0,0,0],0,0,0];\nMoveL [[100"
    monkeypatch.setitem(globals(), "RAPID", RAPID.replace("MoveL [[100", gripped))
    ((message, _),) = run(tmp_path, WEIGHED, COMPLIANCE + PAYLOAD, mass="100")[1]
    assert "a load of 4 kg besides the tool" in message


def test_another_mass_in_the_data_of_a_tool_is_reported(tmp_path):
    ((message, _),) = run(tmp_path, WEIGHED, COMPLIANCE + PAYLOAD, mass="80")[1]
    assert "state 80 kg for tool 1: the cell states 100 kg" in message
    assert run(tmp_path, WEIGHED, COMPLIANCE + PAYLOAD, mass="101")[1] == []
