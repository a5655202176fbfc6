"""A schema takes what the reader takes, and refuses what it refuses: every key, every kind of value, one at a time."""

from __future__ import annotations

import copy
import json
from pathlib import Path

import jsonschema_rs
import pytest
import yaml
from conftest import CELL

from postproc.base.findings import Refusal
from postproc.base.yaml_section import parsed
from postproc.batching.job_file import FORMER_KEYS, JOB_KEYS, PROGRAM_KEYS, jobs_of
from postproc.cell import KEYS, load_cell
from postproc.effects import EFFECTS
from postproc.model import StiffnessModel
from postproc.robot.description import load_robot
from postproc.schemas import SCHEMAS, schema_of
from postproc.schemas.cell_schema import CELL as CELL_KEYS
from postproc.schemas.job_schema import BATCH, PROGRAM

ROOT = Path(__file__).resolve().parent.parent
CELLS = sorted((ROOT / "samples").rglob("cell.yaml"))
ROBOTS = sorted(
    [
        *(ROOT / "robots").glob("*.yaml"),
        *(path for path in (ROOT / "samples").rglob("*.yaml") if path.name.startswith("kr")),
    ]
)

FULL_CELL = """\
robot: kuka_kr270
robot_base: {x: 0, y: 1.5, z: 0, a: 1, b: 2, c: 3}
tools:
  1: {x: 1, y: 2, z: 3, a: 0, b: 90, c: 0, axis: -X, mass: 42, com: [1, 2, 3], diameter: 12}
  2: {x: 1, y: 2, z: 3, axis: [0, 0, 2]}
bases:
  12: {x: 1, y: 2, z: 3}
force: 0,360,560@base
force_ci95: {scale: 0.2, direction_deg: 10, fx: 20, fy: 20, fz: 30}
force_ramp: 6
correct: touched_off
touch_points: {1: [[0, 0, 0], [900, 0, 0]], 2: [[0, 0, 0], [900, 0, 0], [0, 600, 0]]}
temperature: 24
start: [0, -90, 90, 0, 90, 0]
orientation: {a: 0, c: 180}
tolerance: 0.02
tolerance_deg: 1e-2
max_correction: 10
min_segment: 1.0
max_growth: 2
room: {x: [850, 1650], turn: [-90, 90], polygon: [[0, 0], [900, 0], [0, 900]]}
controller: {absolute_accuracy: true, gravity_compensated: false, cycle_ms: 4}
dialect: {integer_words: um}
"""

FULL_ROBOT = """\
name: rich
maker_name: none
about: all keys
geometry:
  source: made up
  base: {unit: mm, angle_unit: deg, x: 1, c: 90}
  flange: {unit: m, angle_unit: rad, z: 0.1}
  mdh:
    unit: mm
    angle_unit: deg
    rows:
      - {a: 0, alpha: 0, d: 400}
      - {a: 25, alpha: -90, d: 0, theta: -90}
      - {a: 455, alpha: 0, d: 0}
      - {a: 35, alpha: -90, d: 420}
      - {a: 0, alpha: 90, d: 0}
      - {a: 0, alpha: -90, d: 80, theta: 180}
joints:
  source: made up
  unit: deg
  J1: [-170, 170]
  J2: {limits: [-190, 45], kind: revolute, unit: deg, sign: -1, offset: 5}
  J3: [-120, 156]
  J4: [-185, 185]
  J5: [-120, 120]
  J6: [-350, 350]
masses:
  source: made up
  unit: kg
  com_unit: mm
  J2: {mass: 20, com: [200, 0, 10]}
effects:
  - effect: joint_compliance
    parameters:
      c1: {value: 1e-6, unit: rad/(N m), ci95: 1e-8, source: made up}
      c6: {value: 1e-6, unit: rad/(N m), ci: 1e-8, ci_level: unstated, source: made up}
  - effect: gravity_compensator
    options: {joint: J2, preload: acting, sign: energy, zero_deg: 10}
    parameters:
      K_c: {value: 5, unit: N/mm, source: made up}
      s0: {value: 450, unit: mm, source: made up}
      L: {value: 200, unit: mm, source: made up}
      a_x: {value: 600, unit: mm, source: made up}
  - effect: backlash
    options: {friction: 30}
    parameters: {b2: {value: 0.001, unit: deg, source: made up}}
  - effect: thermal_growth
    options: {variable: time}
    parameters: {g3: {value: 1e-9, unit: m/s, source: made up}}
  - effect: transmission_error
    options: {harmonics: [1, 2.5]}
    parameters:
      s1_1: {value: 0.001, unit: deg, source: made up}
      c2_2.5: {value: 0.001, unit: deg, source: made up}
mechanisms:
  - name: balancer
    kind: spring
    joint: J2
    about: seen
    source: photo
    length: {value: 450, unit: mm, source: rule}
    place: {value: [1, 2, 3], unit: mm}
identified:
  - command: identify
    version: 0.1.0
    date: "2026-01-31"
    data: [{file: loads.csv, sha256: SHA}]
    robot_sha256: SHA
    effects: [joint_compliance]
    poses: 15
    readings: 45
    gap: {before_rms_mm: 0.5, after_rms_mm: 0.1}
    correlation: {joint_compliance.c1: [1.0], joint_compliance.c6: [0.5, 1.0]}
""".replace("SHA", "ab" * 32)

KUKA_ROBOT = """\
name: railed
geometry:
  source: made up
  kuka: {unit: mm, d1: 750, a1: 350, a2: 1250, a3: -55, d4: 1100, d6: 230}
  rail: +y
controller:
  source: made up
  kuka: {unit: mm, d1: 751, a1: 350, a2: 1250, a3: -55, d4: 1100, d6: 230}
  rail: +y
joints:
  source: made up
  unit: deg
  E1: {limits: [0, 3], kind: prismatic, unit: m}
  A1: [-185, 185]
  A2: [-146, 0]
  A3: [-119, 155]
  A4: [-350, 350]
  A5: [-125, 125]
  A6: [-350, 350]
"""

FULL_JOB = """\
programs: [a.src, '*.src']
exclude: b.src
cell: cell.yaml
robot: kuka_kr270
force: true
gain: 0.5
strict: false
allow_compensated: true
config_dat: cell.yaml
tare: false
no_insert: true
shared_points: copy-dat
output: out
overrides:
  a.src: {force: '0,1,2', gain: 1, cell: cell.yaml, robot: ur5, strict: true, allow_compensated: false, output: x.src}
"""


def value_of(node):
    """A node as YAML 1.2 reads it, which is how the readers here do."""
    if isinstance(node, yaml.MappingNode):
        return {str(key.value): value_of(value) for key, value in node.value}
    if isinstance(node, yaml.SequenceNode):
        return [value_of(item) for item in node.value]
    if node.style is None:
        if node.value in ("true", "false"):
            return node.value == "true"
        try:
            number = float(node.value)
        except ValueError:
            return node.value
        return int(number) if number.is_integer() else number
    return node.value


def loaded(path: Path):
    return value_of(parsed(path.read_bytes(), path).node)


@pytest.fixture
def readers(tmp_path):
    """Kind -> function that has the reader read a document; raises Refusal."""
    (tmp_path / "cell.yaml").write_text(CELL)
    for name in ("a.src", "b.src"):
        (tmp_path / name).write_text("DEF a()\nEND\n")
    path = tmp_path / "document.yaml"

    def read_cell():
        load_cell(path)

    def read_robot():
        StiffnessModel.from_robot(load_robot(path))

    def read_job():
        jobs_of([str(path)], {})

    return path, {"cell": read_cell, "robot": read_robot, "job": read_job}


@pytest.mark.slow
def test_the_schemas_are_schemas():
    for name in SCHEMAS:
        jsonschema_rs.meta.validate(schema_of(name))
        assert schema_of(name)["$schema"].endswith("2020-12/schema")


@pytest.mark.parametrize("path", CELLS, ids=str)
def test_cells_of_the_samples_are_valid(path):
    jsonschema_rs.validate(schema_of("cell"), loaded(path))


@pytest.mark.parametrize("path", ROBOTS, ids=str)
def test_robot_files_are_valid(path):
    jsonschema_rs.validate(schema_of("robot"), loaded(path))


def test_the_job_file_of_the_samples_is_valid():
    path = ROOT / "samples" / "night.yaml"
    jsonschema_rs.validate(schema_of("job"), loaded(path))
    jobs = jobs_of([str(path)], {})
    assert [job.name for job in jobs.jobs] == ["kr270_panel/panel.src", "kr270_taught/taught.src"]
    assert [job.request.gain for job in jobs.jobs] == [1.0, 0.5]


def test_every_key_is_described():
    assert set(CELL_KEYS) == set(KEYS)
    assert set(BATCH) == {*JOB_KEYS, *FORMER_KEYS}
    assert set(PROGRAM) == set(PROGRAM_KEYS)
    named = schema_of("robot")["properties"]["effects"]["items"]["oneOf"]
    assert [one["properties"]["effect"]["const"] for one in named] == list(EFFECTS)


def places(value, path=()):
    """Every place in a document: path of keys and indices."""
    yield path
    if isinstance(value, dict):
        for key in value:
            yield from places(value[key], (*path, key))
    elif isinstance(value, list):
        for index in range(len(value)):
            yield from places(value[index], (*path, index))


def changed(document, path, change):
    """A copy with ``change(holder, key)`` done to the place."""
    document = copy.deepcopy(document)
    holder = document
    for step in path[:-1]:
        holder = holder[step]
    change(holder, path[-1])
    return document


def at(document, path):
    for step in path:
        document = document[step]
    return document


def mutants(document):
    """(what was done, document): unknown keys, keys taken away, values of another kind."""
    for path in places(document):
        here = at(document, path)
        if isinstance(here, dict):
            yield (
                ("unknown", path),
                changed({"": document}, ("", *path, "zzz"), lambda h, k: h.update({k: {"z": "z"}}))[""],
            )
        if not path:
            continue
        if isinstance(path[-1], str):
            yield ("without", path), changed(document, path, lambda h, k: h.pop(k))
        for other in ({"zzz": "z"}, ["zzz"], True, 5.5, "zzz"):
            if type(other) is not type(here) and not (
                isinstance(here, int | float) and isinstance(other, float)
            ):
                yield (
                    ("as " + type(other).__name__, path),
                    changed(document, path, lambda h, k, other=other: h.__setitem__(k, other)),
                )


def only_the_reader(what, path):
    """What goes together with another key: joints and the geometry that has them, a correlation and those above it,
    options and the parameters that they bring along, a pattern and the programs that it matches."""
    if "correlation" in path or path[:1] == ("overrides",):
        return True
    if what == "without":
        of_effect = path[:1] == ("effects",) and path[-1] in ("options", "variable", "harmonics")
        return path[-1] == "rail" or of_effect or (path[0] == "joints" and len(path) == 2)
    return what == "unknown" and path in (("joints",), ("masses",))


def lenient(what, here):
    """A reader takes any scalar for a text."""
    return isinstance(here, str) and what in ("as bool", "as float")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "text"),
    [("cell", FULL_CELL), ("robot", FULL_ROBOT), ("robot", KUKA_ROBOT), ("job", FULL_JOB)],
    ids=["cell", "robot", "railed robot", "job"],
)
def test_schema_and_reader_agree(readers, kind, text):
    path, read = readers
    path.write_text(text)
    read[kind]()
    document = value_of(parsed(text.encode(), path).node)
    validator = jsonschema_rs.Draft202012Validator(schema_of(kind))
    validator.validate(document)
    count, wrong = 0, []
    for (what, place), mutant in mutants(document):
        path.write_text(json.dumps(mutant))
        try:
            read[kind]()
            refusal = None
        except Refusal as refused:
            refusal = refused.findings[0]
        valid = validator.is_valid(mutant)
        count += 1
        told = refusal is not None and refusal.code.startswith("YML")  # other codes say what a text names
        if told and valid and not only_the_reader(what, place):
            wrong.append(f"{what} {place}: only the reader refuses: {refusal}")
        if refusal is None and not valid and not lenient(what, at(document, place)):
            wrong.append(f"{what} {place}: only the schema refuses")
    assert not wrong, "\n".join(wrong)
    assert count > 60


@pytest.mark.sample(5)
@pytest.mark.parametrize(
    ("kind", "text", "old", "new"),
    [
        ("cell", FULL_CELL, "correct: touched_off", "correct: relative"),
        ("cell", FULL_CELL, "correct: touched_off", "correct: absolute"),
        ("cell", FULL_CELL, "fz: 30", "fz: -30"),
        ("cell", FULL_CELL, "direction_deg: 10", "direction_deg: 91"),
        ("cell", FULL_CELL, "{scale: 0.2, direction_deg: 10, fx: 20, fy: 20, fz: 30}", "{}"),
        ("cell", FULL_CELL, "{1: [[0, 0, 0], [900, 0, 0]], 2: [[0, 0, 0], [900, 0, 0], [0, 600, 0]]}", "[]"),
        ("cell", FULL_CELL, "[900, 0, 0]]", "[900, 0]]"),
        ("cell", FULL_CELL, "force_ramp: 6", "force_ramp: -1"),
        ("cell", FULL_CELL, "cycle_ms: 4", "cycle_ms: 0"),
        ("cell", FULL_CELL, "temperature: 24", "temperature: 297"),
        ("cell", FULL_CELL, "diameter: 12", "diameter: 0"),
        ("cell", FULL_CELL, "axis: -X", "axis: up"),
        ("cell", FULL_CELL, "scale: 0.2", "scale: 1.2"),
        ("cell", FULL_CELL, "tolerance: 0.02", "tolerance: 0"),
        ("cell", FULL_CELL, ", com: [1, 2, 3]", ""),
        ("cell", FULL_CELL, "  12: {", "  x12: {"),
        ("robot", FULL_ROBOT, "unit: N/mm", "unit: mm"),
        ("robot", FULL_ROBOT, "effect: backlash", "effect: slack"),
        ("robot", FULL_ROBOT, "c6: {", "d6: {"),
        ("robot", FULL_ROBOT, "preload: acting", "preload: none"),
        ("robot", FULL_ROBOT, "ci_level: unstated", "ci_level: 95"),
        ("robot", FULL_ROBOT, "friction: 30", "friction: 0"),
        ("robot", FULL_ROBOT, "sign: -1", "sign: 2"),
        ("robot", KUKA_ROBOT, "rail: +y", "rail: up"),
        ("robot", KUKA_ROBOT, "d4: 1100", "d4: -1100"),
        ("robot", KUKA_ROBOT, "  rail: +y\ncon", "  rail: +y\n  base: {unit: mm, angle_unit: deg}\ncon"),
        ("job", FULL_JOB, "gain: 0.5", "gain: 1.5"),
    ],
)
def test_wrong_values_are_refused_by_both(readers, kind, text, old, new):
    path, read = readers
    assert old in text
    path.write_text(text.replace(old, new))
    with pytest.raises(Refusal):
        read[kind]()
    document = value_of(parsed(path.read_bytes(), path).node)
    assert not jsonschema_rs.Draft202012Validator(schema_of(kind)).is_valid(document)


@pytest.mark.parametrize("name", ["cell", "robot", "job"])
def test_the_command_prints_it(compensate, name):
    done = compensate("schema", name)
    assert (done.code, done.json) == (0, schema_of(name))
    assert compensate("schema", "program").code == 2
