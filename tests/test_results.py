"""Every machine-readable result is what its printed schema says, key by key; former keys hold what present ones do."""

from __future__ import annotations

import copy
import csv
import json
import re
import shutil
from functools import cache
from pathlib import Path

import jsonschema_rs
import pytest
from click.testing import CliRunner
from valid_results import complete_result, faults_of

import postproc
from postproc.cli.main import main, normalized
from postproc.cli.schema import FILES, RESULTS
from postproc.report.result_keys import FORMER_KEYS, SCHEMA_VERSION
from postproc.schemas import RESULT_SCHEMAS, SCHEMAS, schema_of

ROOT = Path(__file__).resolve().parent.parent
TAUGHT, CAMPAIGN, MISSING = "kr270_taught", "kr270_campaign", "kr270_missing_compensator"
PLAN = ["--robot", "kuka_kr270", "--loads", "265", "--tool", "0,500,300", "--poses", "4", "-o", "plan.csv"]
MAP = ["--robot", "kuka_kr270", "--x", "1500:2200", "--y", "0", "--grid", "3"]
RUNS = {
    "report": ["program", "taught.src", "--force"],
    "report, nothing to correct": ["taught.src", "--force", "0,0,0"],
    "predict": ["predict", "taught.src", "--force", "--report", "reports"],
    "check": ["check", "taught.src"],
    "verify": ["verify", "taught.src", "compensated/taught.src", "--force"],
    "map": ["map", *MAP, "--z", "500:900", "--force", "0,360,560"],
    "map, out of reach": ["map", *MAP, "--z", "9000", "--force", "0,360,560"],
    "place": ["place", "taught.src", "--force", "--x", "1400:1500", "--y=-150:-50", "--top", "2"],
    "assign": [
        "assign", "taught.src", "--force", "--at", "left=1400,-150,600", "--at", "far=4000,0,0", "--cells", "placed"
    ],
    "identify": [
        "identify", "loads.csv", "--effects", "joint_compliance,gravity_compensator", "--validate", "check.csv",
        "--bootstrap", "20",
    ],
    "identify, no folds": [
        "identify", "loads.csv", "--effects", "joint_compliance.c2", "--folds", "0", "--bootstrap", "0"
    ],
    "plan": ["plan", "--effects", "joint_compliance,gravity_compensator", *PLAN],
    "plan, two effects": [
        "plan", "--effects", "joint_compliance", "--discriminate", "gravity_compensator,link_compliance", *PLAN
    ],
    "diagnose": ["diagnose", "loads.csv", "--robot", "kr270_plain.yaml", "-o", "new.yaml"],
    "engage": ["engage", "part.ngc"],
    "learn": ["learn", "part.src", "part1.csv"],
    "batch": ["batch", ".", "--force", "-j", "1"],
    "watch": ["watch", ".", "--force", "--once", "--settle", "0"],
    "robots": ["robots"],
    "robots, one": ["robots", "kr270_shop.yaml"],
}  # fmt: skip
LONG = {"plan, two effects", "learn", "engage", "place", "diagnose", "map"}
SAMPLE = {"identify": CAMPAIGN, "diagnose": MISSING, "engage": "kr270_stock", "learn": "kr270_second_part"}
FAILING = {
    "report": ["none.src", "--force"],
    "predict": ["predict", "none.src"],
    "check": ["check", "none.src"],
    "verify": ["verify", "none.src", "none.src"],
    "map": ["map", *MAP, "--z", "0", "--force", "0,0,9", "--robot", "none.yaml"],
    "place": ["place", "none.src", "--force", "--x", "1400:1500"],
    "assign": ["assign", "none.src", "--force", "--at", "a=1400,0,600"],
    "identify": ["identify", "none.csv", "--effects", "backlash"],
    "plan": ["plan", "--effects", "none", *PLAN],
    "diagnose": ["diagnose", "none.csv"],
    "engage": ["engage", "none.ngc"],
    "learn": ["learn", "none.src", "none.csv"],
    "batch": ["batch", "none"],
    "robots": ["robots", "none"],
}


@cache
def schema(name: str):
    """The printed schema."""
    done = CliRunner().invoke(main, ["schema", name], catch_exceptions=False)
    assert done.exit_code == 0
    return json.loads(done.output)


def closed(described):
    """The schema without room for keys that it does not describe."""
    if isinstance(described, dict):
        tight = {key: closed(value) for key, value in described.items()}
        if "properties" in described and "additionalProperties" not in described:
            tight["additionalProperties"] = False
        return tight
    return [closed(value) for value in described] if isinstance(described, list) else described


def run(words: list[str], folder: Path):
    """The JSON that a command gives, run in a copy of its sample."""
    name = words[0] if words[0] in RESULTS else "report"
    shutil.copytree(ROOT / "samples" / SAMPLE.get(name, TAUGHT), folder, dirs_exist_ok=True)
    if name == "batch":
        (folder / "broken.src").write_text("DEF broken()\nLIN {X 0}\nEND\n")
        (folder / "notes.txt").write_text("no program\n")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        if name == "verify":
            CliRunner().invoke(main, normalized(["taught.src", "--force", "-q"]))
        if words == RUNS["robots, one"]:
            shutil.copy(ROOT / "samples" / CAMPAIGN / "loads.csv", folder)
            found = ["identify", "loads.csv", "--effects", "joint_compliance", "--bootstrap", "0"]
            CliRunner().invoke(main, [*found, "-o", "kr270_shop.yaml", "-q"])
        done = CliRunner().invoke(main, normalized([*words, "--json", "-"]), catch_exceptions=False)
    return json.loads(done.stdout)


@pytest.fixture(
    scope="module",
    params=[pytest.param(run, marks=pytest.mark.slow) if run in LONG else run for run in RUNS],
)
def ran(request, tmp_path_factory):
    """Name of a schema, and a result of its command."""
    folder = tmp_path_factory.mktemp("run") / "here"
    return request.param.partition(",")[0], run(RUNS[request.param], folder), folder


@pytest.mark.sample(6)
def test_a_result_is_what_its_schema_says(ran):
    name, result, _ = ran
    assert result["exit"] in (0, 3) or name == "batch", result["findings"]
    jsonschema_rs.validate(closed(schema(name)), result)
    command = "program" if name == "report" else name
    assert (result["schema_version"], result["command"], result["version"]) == (
        2,
        command,
        postproc.__version__,
    )
    wrong = copy.deepcopy(result)
    wrong["uncertain"] = 1
    jsonschema_rs.validate(schema(name), wrong)  # more keys may come
    with pytest.raises(jsonschema_rs.ValidationError):
        jsonschema_rs.validate(closed(schema(name)), wrong)


def test_former_keys_hold_what_the_present_ones_do(ran):
    _, result, _ = ran
    present = copy.deepcopy(result)
    for place, names in FORMER_KEYS.get(result["command"], {}).items():
        for holder in holders(present, place):
            for former in names:
                holder.pop(former.partition(".")[0], None)
    assert complete_result(result["command"], present) == result
    for place, names in FORMER_KEYS.get(result["command"], {}).items():
        for holder in holders(result, place):
            for former, key in names.items():
                assert value_of(holder, former) == value_of(holder, key)


def test_former_keys_of_the_contract():
    """The keys that scripts rely on, each with a value of its own."""
    present = {
        "uncorrected": 1,
        "transition_moves": [{"line": 7, "length_mm": 2.0}],
        "path_error_mm": {"max": 3.0},
        "path_error_deg": {"max": 4.0},
        "uncertainty": {
            "lower_bound": True,
            "without_interval": ["force"],
            "effect_of_10_percent_mm": {"force": 5.0},
            "level_unstated": ["a.b"],
            "budget": [{"parameter": "c.d", "share": 1.0}],
            "no_equilibrium": 6,
        },
    }
    told = complete_result("program", present)
    assert {key: told[key] for key in ("left", "way_after_mm", "angle_way_after_deg", "links")} == {
        "left": 1,
        "way_after_mm": {"max": 3.0},
        "angle_way_after_deg": {"max": 4.0},
        "links": [{"line": 7, "length_mm": 2.0, "mm": 2.0}],
    }
    assert told["doubt"] == {
        "lower_bound": True,
        "without_interval": ["force"],
        "ten_percent_mm": {"force": 5.0},
        "level_unstated": ["a.b"],
        "blame": [{"parameter": "c.d", "share": 1.0}],
        "unstable": 6,
    }
    assert complete_result("batch", {"programs": [{"uncorrected": 2}, {}]})["programs"] == [
        {"uncorrected": 2, "left": 2},
        {},
    ]
    gains = (
        "likelihood_gain",
        "expected_by_chance",
        "held_out_poses",
        "held_out_regions",
        "held_out_sessions",
    )
    evidence = dict(zip((*gains, "margin_to_next", "next"), range(7), strict=True))
    diagnosed = complete_result(
        "diagnose",
        {
            "residual_patterns": 1,
            "reduced_chi2": 2,
            "gap": {"held_out_after_rms_mm": 3},
            "named": [{"fixed": 4, "displacement_rms_mm": 5, "evidence": evidence}],
        },
    )
    assert (diagnosed["where"], diagnosed["lack"], diagnosed["gap"]["heldout_after_rms_mm"]) == (1, 2, 3)
    (named,) = diagnosed["named"]
    assert (named["held"], named["moves_rms_mm"]) == (4, 5)
    old = ("gain", "chance", "heldout", "regions", "sessions", "margin", "alias")
    assert [named["evidence"][key] for key in old] == list(range(7))
    assert complete_result("identify", {"fixed": [1]})["held"] == [1]
    planned = complete_result("plan", {"fixed": 1, "unobservable": 2, "weakly_observable": 3, "excluded": 4})
    assert [planned[key] for key in ("held", "unseen", "weak", "left_out")] == [1, 2, 3, 4]
    assert complete_result("map", {"extremes_at": 1})["where"] == 1


def holders(value, place):
    found = [value]
    for step in place.split(".") if place else ():
        inner = []
        for one in found:
            if step == "*":
                inner += one.values() if isinstance(one, dict) else one or []
            elif one and step in one:
                inner.append(one[step])
        found = inner
    return [one for one in found if isinstance(one, dict)]


def value_of(holder, key):
    for step in key.split("."):
        holder = holder.get(step, ...) if holder is not ... else ...
    return holder


@pytest.mark.slow
@pytest.mark.parametrize("name", FAILING)
def test_so_is_the_result_of_a_failure(name, tmp_path):
    result = run(FAILING[name], tmp_path)
    assert (result["exit"], result["outputs"]) == (1, [])
    assert result["findings"]
    jsonschema_rs.validate(closed(schema(name)), result)


def test_the_files_are_the_result(tmp_path):
    result = run(RUNS["report"], tmp_path)
    for written in (path for path in result["outputs"] if path.endswith(".json")):
        assert json.loads((tmp_path / written).read_bytes()) == result
    predicted = run(RUNS["predict"], tmp_path / "two")
    (written,) = (path for path in predicted["outputs"] if path.endswith(".json"))
    assert json.loads((tmp_path / "two" / written).read_bytes()) == predicted


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "file"),
    [("report", "compensated/taught.corrections.csv"), ("predict", "reports/taught.deflection.csv")],
)
def test_columns_of_corrections(words, file, tmp_path):
    run(RUNS[words], tmp_path)
    with (tmp_path / file).open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    described = schema("corrections")
    kinds = {key: one["type"] for key, one in described["items"]["properties"].items()}
    inserted = ("transition_moves", "intermediate_points", "path_error_mm")
    wanted = [key for key in kinds if words == "report" or key not in inserted]
    assert [key for key in rows[0] if not re.fullmatch("error_[0-9]+_mm", key)] == wanted
    read = [
        {
            key: None if cell == "" else cell if kinds.get(key) == "string" else float(cell)
            for key, cell in row.items()
        }
        for row in rows
    ]
    jsonschema_rs.validate(closed(described), read)
    assert len(read) == 26


# ------------------------------------------------------------------------------------------------ the schemas


def places(described, path=""):
    """Every schema in a schema with its path."""
    yield path, described
    for key, one in described.get("properties", {}).items():
        yield from places(one, f"{path}.{key}")
    for key, one in described.get("patternProperties", {}).items():
        yield from places(one, f"{path}.{key}")
    for key in ("items", "additionalProperties"):
        if isinstance(described.get(key), dict):
            yield from places(described[key], f"{path}.*")
    for one in described.get("anyOf", ()):
        yield from places(one, path)


@pytest.mark.parametrize("name", RESULT_SCHEMAS)
def test_every_key_says_what_it_is_and_every_number_its_unit(name):
    jsonschema_rs.meta.validate(schema(name))
    assert schema(name) == json.loads(json.dumps(schema_of(name)))
    for path, one in places(schema(name)):
        assert one.get("description") or path in ("", ".*"), path
        kinds = one.get("type", [])
        if {"number", "integer"} & set([kinds] if isinstance(kinds, str) else kinds):
            assert one.get("unit"), f"{name}{path} has no unit"
            ending = re.search("(?<!_per)_(mm|deg|kg)$", path)
            if ending and not one.get("deprecated"):
                assert one["unit"] in (ending[1], "as in name"), path


def test_a_result_that_its_schema_does_not_take_is_told(compensate, job):
    """Every test holds what it makes against the schemas (``valid_results``)."""
    result = compensate(job.program, "--force", "--json", "-").json
    assert faults_of(result) == []
    assert faults_of({key: value for key, value in result.items() if key != "motions"})
    assert faults_of({**result, "motions": "many"})


def test_names_of_schemas():
    assert tuple(SCHEMAS) == FILES
    assert tuple(RESULT_SCHEMAS) == RESULTS
    assert SCHEMA_VERSION == 2
