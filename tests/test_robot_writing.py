"""Robot files that the tool writes: what changed is read back, everything else is copied, and correlations count."""

import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from conftest import CELL
from hypothesis import example, given, settings
from hypothesis import strategies as st
from test_robot_files import BY_URDF, KUKA, URDF
from tiers import examples

from postproc.base.findings import Refusal
from postproc.base.yaml_section import parsed
from postproc.compensation.uncertain_inputs import input_uncertainties
from postproc.effects import EFFECTS
from postproc.model import StiffnessModel
from postproc.robot import write_robot_file as writing
from postproc.robot.description import COVERAGE, find_robot, load_robot, robot_files, robot_of
from postproc.robot.provenance import GAP, Identification
from postproc.robot.write_robot_file import WrittenEffect, WrittenParameter, robot_file

RUN = Identification(
    command="identify",
    version="1.2.3",
    date="2026-01-31",
    data=(("loads.csv", "0a" * 32), ("more loads.csv", "1" * 64)),
    robot_digest="f" * 64,
    effects=("joint_compliance",),
    poses=15,
    readings=45,
    gap={"before_rms_mm": 0.412345, "after_rms_mm": 0.0213, "held_out_after_rms_mm": 3e-5},
    names=(),
    correlation=np.zeros((0, 0)),
)


def correlated(names, correlation, run=RUN):
    return replace(run, names=tuple(names), correlation=np.array(correlation, float))


def as_written(model, changes=None, gone=()):
    """The effects of a model as they stand in its file, with ``changes``: (effect, parameter) -> (value, ci95)."""
    changes, effects = changes or {}, []
    for term in model.terms:
        parameters = []
        for parameter in term.effect.parameters:
            key = (term.effect.name, parameter.name)
            if key in changes:
                value, ci95 = changes[key]
                made = WrittenParameter(parameter.name, value, parameter.unit, ci95, source="identified")
                parameters.append(made)
            elif parameter.name in term.stated and key not in gone:
                stated = term.stated[parameter.name]
                parameters.append(WrittenParameter.of(parameter.name, parameter.unit, stated))
        if term.effect.name not in gone:
            effects.append(
                WrittenEffect(term.effect.name, term.effect.described(), tuple(parameters), term.line)
            )
    return effects


def model_of(raw, path):
    return StiffnessModel.from_robot(robot_of(raw, path))


def stated(model):
    return {
        f"{model.label(i)}.{name}": value
        for i, t in enumerate(model.terms)
        for name, value in t.stated.items()
    }


def refused(action):
    with pytest.raises(Refusal) as caught:
        action()
    (finding,) = caught.value.findings
    return finding


def saved(folder, text, name="arm.yaml"):
    path = folder / name
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return load_robot(path)


# files that are shipped


@pytest.mark.parametrize("name", sorted(robot_files()))
def test_with_the_same_effects_only_the_run_is_added(tmp_path, name):
    robot = load_robot(find_robot(name))
    raw = robot_file(robot, as_written(StiffnessModel.from_robot(robot)), RUN, tmp_path / "new.yaml")
    assert raw.startswith(robot.raw)
    assert raw[len(robot.raw) :].startswith(b"\nidentified:\n  - command: identify\n")
    back = robot_of(raw, tmp_path / "new.yaml")
    assert stated(StiffnessModel.from_robot(back)) == stated(StiffnessModel.from_robot(robot))
    (run,) = back.identified
    assert replace(run, gap={}, correlation=None) == replace(RUN, gap={}, correlation=None)
    assert run.gap == pytest.approx(RUN.gap)
    assert back.digest != robot.digest
    assert not (tmp_path / "new.yaml").exists()


def test_a_value_that_changed_is_written_on_one_line_and_nothing_else():
    robot = load_robot(find_robot("kuka_kr270"))
    changes = {
        ("joint_compliance", "c2"): (3.02123446e-7, 3.2e-9),
        ("gravity_compensator", "K_c"): (7.0123464321e6, 3.1234567e4),
        ("gravity_compensator", "s0"): (0.4581234567, 1e-4),
        ("gravity_compensator", "h"): (1.5e-3, 2e-5),
    }
    effects = as_written(StiffnessModel.from_robot(robot), changes)
    raw = robot_file(robot, effects, RUN, robot.path)
    old = robot.raw.decode().splitlines()
    lines = raw.decode().splitlines()
    lines = lines[: lines.index("identified:") - 1]
    begin = next(i for i, line in enumerate(old) if "K_c:" in line)
    old[begin : begin + 8] = [
        '      K_c: {value: 7.012346e6, unit: N/m, ci95: 0.031234e6, source: "identified"}'
    ]
    for i, line in enumerate(old):
        if "c2:" in line:
            old[i] = '      c2: {value: 0.3021234e-6, unit: rad/(N m), ci95: 0.0032e-6, source: "identified"}'
        if "s0:" in line:
            old[i] = '      s0: {value: 458.12345, unit: mm, ci95: 0.1, source: "identified"}'
    assert lines == [*old, '      h: {value: 1.5e-3, unit: m, ci95: 0.02e-3, source: "identified"}']


# layouts

ONE = "{value: 1.5e-6, unit: rad/(N m), ci95: 2e-7, source: made up}"
EFFECTS_BLOCK = f"""\
# what gives way
effects:  # in order

  # the joints
  - effect: joint_compliance  # linear
    # all of them
    parameters:  # by joint
      # the base turns
      c1: {ONE}  # stiff
      c2:
        # softer than the first
        value: 2e-6
        unit: rad/(N m)
        source: >-
          made
          up

      # the elbow
      c3:  # weak
        {ONE}
  # behind the joints
  - {{effect: base_offset, parameters: {{x: {{value: 1.00, unit:  mm, source: "a, b: {{c}}"}}}}}}  # one line
# below
"""
MASS = (
    "masses:  # links\n  source: made up\n  unit: kg\n  com_unit: mm\n  A2: {mass: 10, com: [1, 2, 3]}\n# end"
)
COMMENTED = KUKA + EFFECTS_BLOCK + MASS
JOINTS = f"effect: joint_compliance, parameters: {{c1: {ONE}, c2: {ONE}, c3: {ONE}}}"
BRACES = (
    "geometry: {source: s, kuka: {unit: mm, d1: 1, a1: 1, a2: 9, a3: 0, d4: 9, d6: 1}}, joints: {source: s, unit: deg, "
    + ", ".join(f"A{i}: [-9, 9]" for i in range(1, 7))
    + "}"
)

LAYOUTS = {
    "own comments": COMMENTED,
    "CRLF": COMMENTED.replace("\n", "\r\n"),
    "BOM": "\ufeff" + COMMENTED,
    "BOM and CRLF": "\ufeff" + COMMENTED.replace("\n", "\r\n"),
    "effects first": EFFECTS_BLOCK + MASS + "\n" + KUKA,
    "no line end": KUKA + f"effects:\n  - effect: joint_compliance\n    parameters: {{c1: {ONE}, c3: {ONE}}}",
    "list at the margin": KUKA + f"effects:\n- effect: joint_compliance\n  parameters:\n    c1: {ONE}\n    c3: {ONE}\n",
    "flow entry": KUKA + f"effects:\n  - {{{JOINTS}}}  # in one line\n\n",
    "flow entry, open": KUKA + "effects:\n  - {effect: joint_compliance}\n",
    "flow entry, null": KUKA + "effects:\n  - {effect: joint_compliance, parameters: }\n",
    "flow parameters": KUKA + f"effects:\n  - parameters: {{c2: {ONE}}} # here\n    effect: joint_compliance\n",
    "no parameters": KUKA + "effects:\n  - effect: joint_compliance # all rigid\n# end\n",
    "empty parameters": KUKA + "effects:\n  - effect: joint_compliance\n    parameters: {}\n",
    "null parameters": KUKA + "effects:\n  - effect: joint_compliance\n    parameters:  # none\n",
    "no effects": KUKA,
    "no effects, comment at the end": KUKA + "# end",
    "effects in brackets": KUKA + f"effects: [{{{JOINTS}}}]\n",
    "all in braces": f"{{name: arm, {BRACES}, effects: [{{effect: joint_compliance}}]}}",
    "empty effects": KUKA.replace("geometry:", "effects: []  # none yet\ngeometry:"),
    "null effects": KUKA.replace("geometry:", "effects:  # none yet\ngeometry:"),
    "null word": KUKA.replace("geometry:", "effects: ~\ngeometry:"),
    "a version": "%YAML 1.1\n---\n" + COMMENTED,
    "no runs": KUKA + "identified: []\n",
    "runs with null": "identified: null # none\n" + COMMENTED,
    "indented": "".join(f"  {line}\n" for line in COMMENTED.splitlines()),
    "dash in a comment": COMMENTED.replace("  - effect: joint", "  - # first - of two\n    effect: joint"),
    "anchors": COMMENTED.replace("effects:", "effects: &all").replace("- effect: joint", "- &one\n    effect: joint"),
    "quoted keys": COMMENTED.replace("effects:", '"effects":').replace("c3:", "'c3':"),
    "odd line ends": COMMENTED.replace("# stiff", "# stiff\u2028      # \u00e9"),
    "block of text last": KUKA.replace("name: arm\n", "") + "name: |\n  arm\n\n\n",
}  # fmt: skip


@pytest.mark.sample(11)
@pytest.mark.parametrize("layout", LAYOUTS)
def test_any_layout_keeps_what_did_not_change(tmp_path, layout):
    robot = saved(tmp_path, LAYOUTS[layout])
    model = StiffnessModel.from_robot(robot)
    changes = {("joint_compliance", "c2"): (3.0123e-6, 1e-8), ("joint_compliance", "c6"): (0.5e-6, 0.0)}
    effects = as_written(model, changes)
    if not model.terms:
        both = [
            WrittenParameter(n, v, "rad/(N m)", ci, None, "identified") for (_, n), (v, ci) in changes.items()
        ]
        effects.append(WrittenEffect("joint_compliance", {}, tuple(both)))
    effects.append(
        WrittenEffect(
            "backlash", {"friction": 30.0}, (WrittenParameter("b2", 1e-5, "rad", source="made up"),)
        )
    )
    destination = tmp_path / "new.yaml"
    raw = robot_file(robot, effects, correlated(["joint_compliance.c2"], [[1]]), destination)

    back = model_of(raw, destination)
    expected = {
        **stated(model),
        **{f"{e}.{n}": change for (e, n), change in changes.items()},
        "backlash.b2": None,
    }
    found = stated(back)
    assert found.keys() == expected.keys()
    for (effect, name), (value, ci95) in changes.items():
        told = found[f"{effect}.{name}"]
        assert (told.value, told.interval) == (pytest.approx(value, abs=1e-4 * ci95 + 1e-9 * value), ci95)
        assert (told.level, told.source) == (0.95, "identified")
    assert all(found[name] == value for name, value in stated(model).items() if name != "joint_compliance.c2")
    assert back.terms[-1].effect.described() == {"friction": 30.0}
    assert back.robot.identified[-1].names == ("joint_compliance.c2",)
    assert [mass.mass for mass in back.robot.masses] == [mass.mass for mass in robot.masses]

    # every other line is there, in order; those of the value that changed may be gone
    old, new = (re.split(r"\r?\n", text.decode()) for text in (robot.raw, raw))
    spoilt = ("c2:", "# softer", "value: 2e-6", "unit: rad/(N m)", "source: >-", "made", "up", "- {effect: joint_",
              "- parameters: {", "parameters: {", "effects: [", "{name: ", "effects: ~", "identified: []",
              "identified: null")  # fmt: skip
    # a file that is indented as a whole is laid out anew
    assert [
        line for line in lost(old, new) if not line.strip().startswith(spoilt)
    ] == [] or layout == "indented"
    assert ("identified" in LAYOUTS[layout] or layout == "all in braces") != bool(
        re.search(rb"\n\r?\n +identified:|\n\r?\nidentified:", raw)
    )
    assert raw.startswith(b"\xef\xbb\xbf") == LAYOUTS[layout].startswith("\ufeff")
    assert (raw.count(b"\n") == raw.count(b"\r\n")) == ("\r\n" in LAYOUTS[layout])


def lost(old, new):
    """Lines that are not there any more in their order."""
    gone, at = [], 0
    for line in old:
        if line in new[at:]:
            at = new.index(line, at) + 1
        else:
            gone.append(line)
    return gone


def test_what_is_not_named_stays(tmp_path):
    robot = saved(tmp_path, COMMENTED)
    c3 = WrittenParameter("c3", 3e-6, "rad/(N m)", 1e-8, source="identified")
    line = robot.effects[0].section.line
    effects = [WrittenEffect("joint_compliance", {}, (c3,), line)]
    found = stated(model_of(robot_file(robot, effects, RUN, robot.path), robot.path))
    assert found.pop("joint_compliance.c3").value == 3e-6
    before = stated(StiffnessModel.from_robot(robot))
    assert found == {name: value for name, value in before.items() if name != "joint_compliance.c3"}


def test_comments_stay_beside_what_they_tell_of(tmp_path):
    robot = saved(tmp_path, COMMENTED)
    changes = {("joint_compliance", "c2"): (3e-6, 1e-8), ("joint_compliance", "c1"): (2e-6, 1e-8)}
    effects = as_written(StiffnessModel.from_robot(robot), changes)
    text = robot_file(robot, effects, RUN, robot.path).decode()
    assert re.search(
        r'c1: {value: 2e-6, unit: rad/\(N m\), ci95: 0.01e-6, source: "identified"} +# stiff\n', text
    )
    assert text[text.index("\n      # the elbow") :].startswith(
        COMMENTED[COMMENTED.index("\n      # the elbow") :][:-5]
    )


def test_one_effect_twice_keeps_its_options_apart(tmp_path):
    robot = load_robot(find_robot("kuka_kr270"))
    effects = as_written(StiffnessModel.from_robot(robot))
    options = {"joint": "A3", "preload": "acting", "sign": "energy", "zero_deg": -12.345678901}
    effects.append(replace(effects[1], options=options, line=0))
    model = model_of(robot_file(robot, effects, RUN, robot.path), robot.path)
    assert [model.label(i) for i in range(3)][1:] == ["gravity_compensator", "gravity_compensator#2"]
    assert model.terms[1].effect.described()["joint"] == "A2"
    described = model.terms[2].effect.described()
    assert described == {**options, "zero_deg": pytest.approx(-12.345678901, rel=1e-11)}
    for name, value in model.terms[1].stated.items():
        assert replace(model.terms[2].stated[name], value=0, interval=0) == replace(
            value, value=0, interval=0
        )
        assert model.terms[2].values[name] == pytest.approx(value.value, rel=1e-9)


def test_options_of_every_effect_are_read_back(tmp_path):
    robot = saved(tmp_path, KUKA)
    effects = [
        EFFECTS["transmission_error"](robot.joints, (1.0, 60.5, 161.0)),
        EFFECTS["backlash"](robot.joints),
    ]
    written = [WrittenEffect(effect.name, effect.described(), ()) for effect in effects]
    model = model_of(robot_file(robot, written, RUN, robot.path), robot.path)
    assert [term.effect.described() for term in model.terms] == [effect.described() for effect in effects]
    assert not any(term.stated for term in model.terms)


def test_an_entry_that_is_not_there_is_a_defect(tmp_path):
    robot = saved(tmp_path, COMMENTED)
    for line, name in ((3, "joint_compliance"), (robot.effects[0].section.line, "backlash")):
        with pytest.raises(ValueError, match=f"line {line} of .* does not contain {name}"):
            robot_file(robot, [WrittenEffect(name, {}, (), line)], RUN, robot.path)


def test_what_ruamel_does_not_read_is_refused(tmp_path):
    robot = saved(tmp_path, "%YAML 1.3\n---\n" + KUKA)
    finding = refused(lambda: robot_file(robot, [], RUN, robot.path))
    assert (finding.code, finding.file) == ("ROB002", str(robot.path))
    assert "version" in finding.message


def test_what_is_not_read_back_is_not_written(tmp_path, monkeypatch):
    robot = saved(tmp_path, COMMENTED)
    effects = as_written(StiffnessModel.from_robot(robot), {("joint_compliance", "c2"): (3e-6, 1e-8)})
    spoil = {
        "a value": lambda text: text.replace("value: 3e-6", "value: 3.01e-6"),
        "another key": lambda text: text.replace("mass: 10", "mass: 11"),
        "a parameter": lambda text: re.sub(r" +c2:[^}]*}\n", "", text),
        "a run": lambda text: text.replace("poses: 15", "poses: 14"),
    }
    edited = writing.edited
    for how in spoil.values():
        monkeypatch.setattr(writing, "edited", lambda *given, how=how: how(edited(*given).decode()).encode())
        finding = refused(lambda: robot_file(robot, effects, RUN, tmp_path / "new.yaml"))
        assert (finding.code, finding.file) == ("ROB003", str(tmp_path / "new.yaml"))


# numbers and words


def parameter_text(parameter, word):
    fields = writing.parameter_fields(parameter, word).items()
    return "{" + ", ".join(f"{key}: {field}" for key, field in fields) + "}"


@settings(max_examples=examples(200), deadline=None)
@given(
    st.floats(1e-12, 1e12),
    st.one_of(st.none(), st.just(0.0), st.floats(1e-9, 1e3)),
    st.sampled_from(["mm", "m", "rad", "deg", "rad/(N m)", "N/m", "N/mm", "1"]),
    st.booleans(),
    st.sampled_from([-1.0, 1.0]),
)
@example(0.302e-6, 0.01, "rad/(N m)", True, 1.0)
@example(9.9999999999e-4, 1e-9, "mm", True, 1.0)
@example(99999.99999999, None, "1", False, 1.0)
@example(1e-5, 1e-5, "N/mm", False, -1.0)
def test_a_value_and_its_interval_keep_their_digits(size, share, word, of_95, sign):
    si = writing.UNITS[word][0]
    value, width = sign * size, None if share is None else share * size
    made = WrittenParameter("p", value, si, width if of_95 else None, None if of_95 else width, "made up")
    text = parameter_text(made, word)
    read = writing.parameter_value(parsed(f"p: {text}".encode(), Path("x")).section("p"), si)
    assert abs(read.value - value) <= max(1.001e-9 * size, 1e-4 * min(width or 0.0, size) * of_95)
    assert read.level == (0.95 if of_95 and width is not None else None)
    assert (read.interval is None) == (width is None)
    if width is not None:
        assert read.interval == pytest.approx(width, rel=1e-4 if of_95 else 1.1e-9)
    exponents = re.findall(r"(?:value|ci|ci95): (-?[0-9.]+)(?:e(-?[0-9]+))?,", text)
    assert all(not exponent or int(exponent) % 3 == 0 for _, exponent in exponents)
    mantissa, exponent = exponents[0]
    assert not exponent or 0.1 <= abs(float(mantissa)) < 100.0
    assert all(len(re.sub("[-.]", "", digits).strip("0")) <= 11 for digits, _ in exponents)
    # written once more it stays as it is
    again = WrittenParameter.of("p", si, read)
    assert parameter_text(again, word) == text


@pytest.mark.sample(1)
@pytest.mark.parametrize("side", ["lower", "upper"])
def test_a_value_at_its_bound_stays_within(tmp_path, side):
    """In the unit of the SI, and in the millimetres and degrees of a file that has those."""
    small, text, bounded = {"m": ("mm", 1e-3), "rad": ("deg", math.pi / 180)}, KUKA + "effects:\n", []
    joints = saved(tmp_path, KUKA).joints
    for name, kind in EFFECTS.items():
        parameters = [p for p in kind(joints).parameters if math.isfinite(getattr(p, side))]
        bounded.append([(p, getattr(p, side)) for p in parameters])
        text += f"  - effect: {name}\n"
        text += "    options: {joint: A2}\n" if name == "gravity_compensator" else ""
        text += "    parameters: {"
        for parameter, bound in bounded[-1]:
            if parameter.unit in small:
                word, factor = small[parameter.unit]
                text += f"{parameter.name}: {{value: {0.5 * bound / factor:.9g}, unit: {word}, source: made up}}, "
        text += "}\n"
    robot = saved(tmp_path, text)
    written = []
    for entry, parameters in zip(robot.effects, bounded, strict=True):
        fresh = [WrittenParameter(p.name, b, p.unit, 0.3 * abs(b), source="made up") for p, b in parameters]
        written.append(WrittenEffect(entry.name, {}, tuple(fresh), entry.section.line))
    raw = robot_file(robot, written, RUN, robot.path)
    assert raw.count(b"unit: mm, ci95") > 5
    model = model_of(raw, robot.path)
    assert sum(len(term.stated) for term in model.terms) == sum(map(len, bounded)) > 50


TEXTS = st.text(st.characters(exclude_categories=()), max_size=40)


@settings(max_examples=examples(60), deadline=None)
@given(TEXTS, TEXTS)
@example("quote \" and ' and \\ and #: {a: [1, *b]} & !x | > %", "# \n- a:\r\n\t'b' ")
@example("\0\ud800\x85\u2028\ufeff\ufffe\U0001f600\xa0\x7f\x1b", "\udcff.csv")
@example("", "null")
def test_any_text_comes_back(source, name):
    robot = load_robot(find_robot("ur5"))
    effect = WrittenEffect(
        "joint_compliance", {}, (WrittenParameter("c1", 1e-6, "rad/(N m)", source=source),)
    )
    run = replace(RUN, data=((name, "0" * 64),))
    raw = robot_file(robot, [effect], run, Path("nowhere") / "arm.yaml")
    back = robot_of(raw, Path("nowhere") / "arm.yaml")
    told = StiffnessModel.from_robot(back).terms[0].stated["c1"]
    assert told.source == re.sub("[\0\ud800-\udfff]", "\ufffd", source)
    assert back.identified[0].data[0][0] == re.sub("[\0\ud800-\udfff]", "\ufffd", name)
    assert raw.count(b"\n") == robot.raw.count(b"\n") + 17


# once more


def test_a_run_on_a_written_file_is_added_to_the_first(tmp_path):
    robot = load_robot(find_robot("kuka_kr270"))
    names = [f"joint_compliance.c{i}" for i in (2, 3, 4)]
    first = correlated(names, [[1, -0.9, 0.2], [-0.9, 1, 0.1], [0.2, 0.1, 1]])
    changes = {("joint_compliance", f"c{i}"): (3e-7 * i, 1e-8) for i in (2, 3, 4)}
    path = tmp_path / "one.yaml"
    path.write_bytes(robot_file(robot, as_written(StiffnessModel.from_robot(robot), changes), first, path))
    one = load_robot(path)

    second = correlated(["joint_compliance.c4", "joint_compliance.c6"], [[1, 0.5], [0.5, 1]])
    second = replace(second, robot_digest=one.digest, command="diagnose", date="2026-02-28")
    changes = {("joint_compliance", f"c{i}"): (2e-7 * i, 1e-8) for i in (4, 6)}
    raw = robot_file(one, as_written(StiffnessModel.from_robot(one), changes), second, path)
    assert len(lost(one.raw.splitlines(), raw.splitlines())) == 2
    two = robot_of(raw, path)
    assert [run.command for run in two.identified] == ["identify", "diagnose"]
    assert two.identified[1].robot_digest == one.digest
    found, matrix = two.correlation
    at = {name: i for i, name in enumerate(found)}
    assert sorted(at) == sorted({*names, "joint_compliance.c6"})
    assert matrix[at[names[0]], at[names[1]]] == -0.9
    assert matrix[at[names[2]], at["joint_compliance.c6"]] == 0.5
    assert matrix[at[names[2]], at[names[0]]] == matrix[at[names[2]], at[names[1]]] == 0.0
    assert np.linalg.eigvalsh(matrix).min() > 0


# files beside


@pytest.fixture
def with_urdf(tmp_path):
    folder = tmp_path / "arms" / "small"
    folder.mkdir(parents=True)
    (folder / "arm.urdf").write_text(URDF, encoding="utf-8")
    believed = "controller:\n  source: made up\n  urdf:\n    file: 'arm.urdf'  # as it is\njoints:"
    return saved(folder, BY_URDF.replace("joints:", believed))


def test_the_urdf_stays_where_it_is(tmp_path, with_urdf):
    robot, folder = with_urdf, with_urdf.path.parent
    raw = robot_file(robot, [], RUN, folder / "new.yaml")
    assert raw.startswith(robot.raw)
    raw = robot_file(robot, [], RUN, tmp_path / "new.yaml")
    assert raw.count(b'file: "arms/small/arm.urdf"') == 2
    back = robot_of(raw, tmp_path / "new.yaml")
    q = robot.limits.mean(axis=1)[None]
    one, other = (StiffnessModel.from_robot(r).chain.flange(q) for r in (robot, back))
    assert np.array_equal(one.position, other.position)


def test_a_urdf_that_would_be_lost_is_told(tmp_path, with_urdf):
    out = tmp_path / "out"
    out.mkdir()
    finding = refused(lambda: robot_file(with_urdf, [], RUN, out / "new.yaml"))
    assert (finding.code, finding.file, finding.line) == ("ROB001", str(with_urdf.path), 4)
    assert "arm.urdf is not in" in finding.message
    assert str(with_urdf.path.parent) in finding.help
    (out / "arm.urdf").write_text(URDF.replace("0.08 0 0", "0.09 0 0"), encoding="utf-8")
    assert refused(lambda: robot_file(with_urdf, [], RUN, out / "new.yaml")).code == "ROB001"
    (out / "arm.urdf").write_text(URDF, encoding="utf-8")
    raw = robot_file(with_urdf, [], RUN, out / "new.yaml")
    assert raw.startswith(with_urdf.raw)


# what a run says, checked

HEAD = f"""\
identified:
  - command: identify
    version: 1.2.3
    date: 2026-01-31
    data:
      - {{file: loads.csv, sha256: {"0a" * 32}}}
    robot_sha256: {"f" * 64}
    effects: [joint_compliance]
    poses: 15
    readings: 45
    gap: {{before_rms_mm: 0.4, after_rms_mm: 0.02}}
    correlation:
      joint_compliance.c1: [1]
      joint_compliance.c2: [-0.5, 1]
      joint_compliance.c3: [0.25, 0.5, 1]
"""
MISTAKES = {
    "not a list": ("  - command", "    command", "YML004", "must be a list", "identified:"),
    "the key is unknown": ("    poses: 15", "    posses: 15", "YML002", "did you mean 'poses'", "    posses"),
    "command": ("identify", "identifi", "YML004", "not one of identify, diagnose", "  - command"),
    "no version": ("    version: 1.2.3\n", "", "YML003", "'version' is missing", "  - command"),
    "no date": ("date: 2026-01-31", "date: 2026-01-32", "YML004", "not a date", "    date"),
    "short date": ("2026-01-31", "20260131", "YML004", "not a date", "    date"),
    "no digest": ("f" * 64, "f" * 63, "YML004", "not a SHA-256", "    robot_sha256"),
    "digest of data": ("0a0a", "0A0A", "YML004", "not a SHA-256", "      - {file"),
    "data": ("file: loads", "name: loads", "YML002", "the key is unknown", "      - {name"),
    "effects": ("[joint_compliance]", "joint_compliance", "YML004", "a list of words", "    effects"),
    "effects in effects": ("[joint_compliance]", "[{a: b}]", "YML004", "a list of words", "    effects"),
    "half a pose": ("poses: 15", "poses: 15.5", "YML004", "15.5 is not a whole number", "    poses"),
    "fewer than none": ("readings: 45", "readings: -1", "YML004", "not within", "    readings"),
    "gap": ("before_rms", "befor_rms", "YML002", "did you mean 'before_rms_mm'", "    gap"),
    "gap of less than none": ("after_rms_mm: 0.02", "after_rms_mm: -0.02", "YML004", "not within", "    gap"),
    "short row": ("[-0.5, 1]", "[1]", "YML004", "a list of 2 numbers", "      joint_compliance.c2"),
    "no one at the end": ("[-0.5, 1]", "[1, -0.5]", "YML004", "must end with 1", "      joint_compliance.c2"),
    "beyond one": ("[-0.5, 1]", "[-1.5, 1]", "YML004", "-1 .. 1", "      joint_compliance.c2"),
    "twice": (".c2: [-0.5, 1]", ".c1: [-0.5, 1]", "YML004", "is defined twice", "      joint_compliance.c1: [-"),
    "impossible": ("[0.25, 0.5, 1]", "[0.9, 0.9, 1]", "YML004", "the matrix is not a correlation"
    " matrix", "      joint_c"),
}  # fmt: skip


@pytest.mark.parametrize("case", MISTAKES)
def test_a_mistake_in_a_run_is_told_with_its_line(tmp_path, case):
    old, new, code, words, place = MISTAKES[case]
    assert len(saved(tmp_path, KUKA + HEAD).identified) == 1
    text = KUKA + HEAD.replace(old, new, 1)
    finding = refused(lambda: saved(tmp_path, text))
    assert (finding.code, finding.file) == (code, str(tmp_path / "arm.yaml"))
    assert words in finding.message
    at = text.rindex(place) if case == "twice" else text.index(place)
    assert finding.line == text[:at].count("\n") + 1


def test_six_decimals_of_a_singular_correlation_are_no_mistake(tmp_path):
    """What rounding made slightly indefinite is read as the nearest that is not."""
    rng = np.random.default_rng(4)
    roots = rng.normal(size=(12, 3))
    matrix = roots @ roots.T
    matrix /= np.sqrt(np.outer(np.diag(matrix), np.diag(matrix)))
    assert np.linalg.eigvalsh(np.round(matrix, 6)).min() < -1e-7
    robot = saved(tmp_path, KUKA)
    raw = robot_file(robot, [], correlated([f"link_geometry.dx{i}" for i in range(12)], matrix), robot.path)
    (run,) = robot_of(raw, robot.path).identified
    assert np.linalg.eigvalsh(run.correlation).min() > -1e-14
    assert np.abs(run.correlation - matrix).max() < 2e-6
    assert np.diag(run.correlation) == pytest.approx(1.0, abs=1e-14)
    assert np.array_equal(run.correlation, run.correlation.T)


# the covariance that the model has


def kr270(tmp_path, names, correlation, ci95=2e-8, more=()):
    robot = load_robot(find_robot("kuka_kr270"))
    model = StiffnessModel.from_robot(robot)
    changes = {}
    for name in names:
        effect, parameter = name.split(".")
        value = next(t.values[parameter] for t in model.terms if t.effect.name == effect)
        changes[effect, parameter] = (value, 0.05 * value if ci95 is None else ci95)
    effects = [*as_written(model, changes), *more]
    path = tmp_path / "own.yaml"
    path.write_bytes(robot_file(robot, effects, correlated(names, correlation), path))
    return path


C23 = ["joint_compliance.c2", "joint_compliance.c3"]
MINUS = [[1, -0.9], [-0.9, 1]]


def model_at(path):
    return StiffnessModel.from_robot(load_robot(path))


def test_standard_deviations_are_those_of_the_intervals(tmp_path):
    path = kr270(tmp_path, C23, MINUS)
    names, matrix = model_at(path).covariance
    assert list(names) == C23
    assert matrix == pytest.approx((2e-8 / COVERAGE) ** 2 * np.array(MINUS), rel=1e-12)
    known = input_uncertainties(model_at(path))
    place = [[entry.name for entry in known.entries].index(name) for name in C23]
    assert np.array_equal(known.covariance[np.ix_(place, place)], matrix)
    off = known.covariance - np.diag(np.diag(known.covariance))
    assert np.count_nonzero(off) == 2
    assert not set(C23) & set(known.level_unstated)
    assert StiffnessModel.from_robot(load_robot(find_robot("kuka_kr270"))).covariance is None


def test_an_interval_changed_by_hand_counts(tmp_path):
    path = kr270(tmp_path, C23, MINUS)
    text = path.read_text()
    assert text.count("ci95: 0.02e-6") == 2
    path.write_text(text.replace("ci95: 0.02e-6", "ci95: 0.04e-6", 1))
    scale = (2e-8 / COVERAGE) ** 2
    expected = [[4 * scale, -1.8 * scale], [-1.8 * scale, scale]]
    assert model_at(path).covariance[1] == pytest.approx(np.array(expected))
    # an interval of another level is none that was identified, and what has none is not in doubt
    for new in ("ci: 0.04e-6, ci_level: unstated", "#"):
        own = text.replace("ci95: 0.02e-6", new, 1) if new != "#" else text.replace(", ci95: 0.02e-6", "", 1)
        path.write_text(own)
        names, matrix = model_at(path).covariance
        assert (names, matrix.shape) == (tuple(C23[1:]), (1, 1))


def test_what_is_not_in_the_model_drops_out(tmp_path):
    names = [*C23, "gravity_compensator.K_c"]
    path = kr270(tmp_path, names, [[1, -0.9, 0.1], [-0.9, 1, 0.2], [0.1, 0.2, 1]], None)
    model = model_at(path)
    assert list(model.covariance[0]) == names
    alone = model.without_effects(["gravity_compensator"])
    assert list(alone.covariance[0]) == C23
    assert np.array_equal(alone.covariance[1], model.covariance[1][:2, :2])
    assert [entry.name for entry in input_uncertainties(alone).entries][:2] == C23
    assert model.without_effects(families=["elastic"]).covariance is None
    lines = path.read_text().splitlines(keepends=True)
    path.write_text("".join(line for line in lines if not line.startswith("      c2: {")))
    by_hand = model_at(path).covariance
    assert list(by_hand[0]) == names[1:]
    assert np.array_equal(by_hand[1], model.covariance[1][1:, 1:])


def test_a_second_effect_of_one_name_leaves_the_first_its_name(tmp_path):
    second = WrittenEffect(
        "gravity_compensator",
        {"joint": "A3"},
        (WrittenParameter("K_c", 1e6, "N/m", 1e5, source="s"), WrittenParameter("L", 0.1, "m", source="s")),
    )
    names = ["gravity_compensator.K_c", "gravity_compensator#2.K_c"]
    path = kr270(tmp_path, names[:1], [[1]], 1e5, [second])
    path.write_bytes(robot_file(load_robot(path), as_written(model_at(path)), correlated(names, MINUS), path))
    model = model_at(path)
    # in the order of the last run
    assert list(model.covariance[0]) == names
    assert model.covariance[1] == pytest.approx((1e5 / COVERAGE) ** 2 * np.array(MINUS))
    assert {*names} <= {entry.name for entry in input_uncertainties(model).entries}
    added = model_at(kr270(tmp_path, names[:1], [[1]], 1e5))
    twice = added.with_effect(added.terms[1].effect)
    assert "gravity_compensator.K_c" in [entry.name for entry in input_uncertainties(twice).entries]


@pytest.mark.slow
def test_correlation_counts_in_the_doubt_of_a_program(tmp_path, compensate, job):
    """An upward force bends A2 and A3 the same way: what one has too much the other has too little."""
    job.cell(CELL.replace("kuka_kr270", "own.yaml"))
    found = {}
    for relation in (-0.99, 0.0, 0.99):
        kr270(job.folder, C23, [[1, relation], [relation, 1]], 1e-7)
        found[relation] = compensate(job.program, "--force", "0,0,1000@base", "--json", "-").json
    before = {relation: report["error_before_mm"]["ci95"] for relation, report in found.items()}
    after = {relation: report["error_after_mm"]["ci95"] for relation, report in found.items()}
    for doubt in (before, after):
        assert doubt[-0.99] < 0.8 * doubt[0.0]
        assert doubt[0.99] > 1.15 * doubt[0.0]
    variance = {relation: value**2 for relation, value in before.items()}
    assert variance[-0.99] + variance[0.99] == pytest.approx(2 * variance[0.0], rel=1e-6)


# shown


def test_robots_command_shows_the_runs(tmp_path, compensate):
    path = kr270(tmp_path, C23, MINUS)
    done = compensate("robots", path)
    assert done.code == 0
    words = " ".join(done.out.split())
    assert "identified 2026-01-31 by identify 1.2.3: joint_compliance" in words
    assert (
        "45 readings at 15 poses, loads.csv (sha256 0a0a0a0a0a0a), more loads.csv (sha256 111111111111)"
        in words
    )
    assert "gap [mm, 3-D rms] before 0.412 after 0.0213 held out: after 3e-05" in words
    (run,) = compensate("robots", path, "--json", "-").json["robots"][0]["identified"]
    assert {key: value for key, value in run["gap"].items() if key in GAP} == RUN.gap
    assert run["data"][1] == {"file": "more loads.csv", "sha256": "1" * 64}
    assert run["correlation"] == {"parameters": C23, "rows": MINUS}
    assert "\nidentified " not in compensate("robots", "kuka_kr270").out
    assert compensate("robots", "kuka_kr270", "--json", "-").json["robots"][0]["identified"] == []


def test_former_names_of_the_gap_are_read(tmp_path):
    path = kr270(tmp_path, C23, MINUS)
    text = path.read_text()
    assert "held_out_after_rms_mm" in text
    former = tmp_path / "former" / path.name
    former.parent.mkdir()
    former.write_text(text.replace("held_out_after", "heldout_after"))
    (one,), (two,) = load_robot(former).identified, load_robot(path).identified
    assert one.gap == two.gap == RUN.gap
    both = text.replace("held_out_after_rms_mm:", "heldout_after_rms_mm: 1, held_out_after_rms_mm:")
    former.write_text(both)
    with pytest.raises(Refusal, match="former name of 'held_out_after_rms_mm'"):
        load_robot(former)
