"""The house rules, read from the imports: a room sees lower rooms and itself, and nothing goes in circles."""

import ast
import re
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest
from sources import parse_file, walk

import postproc

ROOT = Path(postproc.__file__).parent

ROOMS = {
    "__main__": 13,
    "cli": 12,
    "api": 12,
    "api_place": 11,
    "api_robot": 11,
    "schemas": 11,
    "codes": 11,
    "batching": 11,
    "workflows": 10,
    "report": 9,
    "output": 8,
    "learning": 8,
    "part": 7,
    "diagnosis": 7,
    "verification": 7,
    "identification": 6,
    "experiments": 6,
    "placement": 6,
    "compensation": 6,
    "model": 5,
    "effects": 4,
    "process": 4,
    "cell": 3,
    "robot": 2,
    "languages": 2,
    "measurements": 1,
    "toolpath": 1,
    "posts": 0,
    "base": 0,
    "__init__": 0,
}
"""Room -> its floor.  A new room gets its floor here."""

ONE_FLOOR = {
    ("schemas", "batching"),
    ("batching", "codes"),
    ("codes", "batching"),
    ("experiments", "identification"),
}
"""Neighbours on one floor, from -> to."""

MOST_LINES = 449
"""Lines of a file of the package."""

MOST_PARAMETERS = 8
"""Parameters of a function that have no default."""

TEXT = {"languages", "base.document"}
PHYSICS = {"robot", "effects", "process"}
"""Neither side knows of the other; they meet in ``toolpath``."""


SAME_MODULE_NAMES = {
    "one part of each family of languages": {
        "arcs": {"languages/gcode", "languages/krl", "toolpath"},
        "lexing": {"languages/gcode", "languages/krl"},
        "motions": {"languages/gcode", "languages/krl"},
        "source_map": {"languages/gcode", "languages/krl"},
        "writer": {"languages/gcode", "languages/krl"},
    },
    "what the text says of these axes, and their kinematics": {
        "external_axes": {"languages/gcode", "languages/krl", "robot"},
    },
    "a command: its options, and the function that does it": {
        "batch": {"cli", "batching"},
        "diagnose": {"cli", "workflows"},
        "engage": {"cli", "workflows"},
        "identify": {"cli", "workflows"},
        "learn": {"cli", "workflows"},
        "map": {"cli", "workflows"},
        "place": {"cli", "workflows"},
        "plan": {"cli", "workflows"},
        "program": {"cli", "workflows"},
        "verify": {"cli", "workflows"},
    },
    "where a tool touches: the cells of a stock, a point of the surface": {
        "contact": {"process/stock", "part"},
    },
    "effects that a model may miss: of readings of a robot, of a part": {
        "candidates": {"diagnosis", "learning"}
    },
    "what a file of this kind says, in SI": {"description": {"cell", "robot"}},
    "each room has its own": {"codes": {"*"}},
}
"""Reason -> names that several modules may have, and the folders of these."""


def room_of(module):
    """``postproc.robot.chain`` -> ``robot``; the package itself is the room ``__init__``."""
    parts = module.split(".")
    return parts[1] if len(parts) > 1 else "__init__"


def modules(root):
    """Module name -> its syntax tree, for every file of the package."""
    found = {}
    for path in sorted(root.rglob("*.py")):
        parts = [root.name, *path.relative_to(root).with_suffix("").parts]
        if parts[-1] == "__init__":
            parts.pop()
        found[".".join(parts)] = parse_file(path)
    return found


def imports_of(module, tree, known):
    """Modules of the package that ``module`` imports, wherever in the file the import stands."""
    top = module.split(".")[0]
    for node in walk(tree):
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            if node.level:
                raise AssertionError(f"{module}, line {node.lineno}: relative import; write the full name")
            names = [
                f"{node.module}.{alias.name}" if f"{node.module}.{alias.name}" in known else str(node.module)
                for alias in node.names
            ]
        else:
            continue
        for name in names:
            if name.split(".")[0] == top and name != module:
                yield name


def arrows(root):
    """(importing module, imported module) of the whole package."""
    trees = modules(root)
    return [(name, target) for name, tree in trees.items() for target in imports_of(name, tree, trees)]


def offences(root):
    """What breaks the rules, in words."""
    told = [
        f"{name}: the room {room_of(name)!r} has no floor"
        for name in modules(root)
        if room_of(name) not in ROOMS
    ]
    pairs = arrows(root)
    for name, target in pairs:
        here, there = room_of(name), room_of(target)
        if here == there or here not in ROOMS or there not in ROOMS:
            continue
        if ROOMS[there] >= ROOMS[here] and (here, there) not in ONE_FLOOR:
            told.append(f"{name} ({ROOMS[here]}) imports {target} ({ROOMS[there]})")
        sides = [{room_of(one), one.partition(".")[2]} for one in (name, target)]
        if any(one & TEXT and other & PHYSICS for one, other in (sides, sides[::-1])):
            told.append(f"{name} imports {target}: text and physics do not meet here")
    graph: dict[str, set[str]] = {}
    for name, target in pairs:
        graph.setdefault(name, set()).add(target)
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        told.append("circle: " + " -> ".join(error.args[1]))
    return told


def test_the_table_of_rooms_has_these_floors():
    rows = re.findall(
        r"^\| (\d+) \| `(\w+)(?:/|\.py)` \|", (ROOT / "README.md").read_text(encoding="utf-8"), re.M
    )
    assert {room: int(floor) for floor, room in rows} == {r: f for r, f in ROOMS.items() if r != "__init__"}
    assert [int(floor) for floor, _ in rows] == sorted(ROOMS.values(), reverse=True)[: len(rows)]


def test_no_file_is_long():
    """A file that grows beyond this holds more than one subject."""
    lines = {
        path.relative_to(ROOT).as_posix(): len(path.read_text(encoding="utf-8").splitlines())
        for path in ROOT.rglob("*.py")
    }
    assert len(lines) > 300
    assert {name: count for name, count in lines.items() if count > MOST_LINES} == {}


def required(node: ast.FunctionDef) -> int:
    """Parameters of a function that have no default."""
    positional = [arg for arg in (*node.args.posonlyargs, *node.args.args) if arg.arg not in ("self", "cls")]
    return len(positional) - len(node.args.defaults) + sum(one is None for one in node.args.kw_defaults)


def test_no_function_takes_a_train_of_parameters():
    """What belongs together is a type.  Those with a default are named where they are given; what a command gets from
    its options is a list of them."""
    counts = {
        f"{module}, line {node.lineno}: {node.name}": required(node)
        for module, tree in modules(ROOT).items()
        for node in walk(tree)
        if isinstance(node, ast.FunctionDef) and not module.startswith("postproc.cli.")
    }
    assert max(counts.values()) > 4
    assert {name: count for name, count in counts.items() if count > MOST_PARAMETERS} == {}


def test_modules_of_one_name_are_of_one_kind():
    folders: dict[str, set[str]] = {}
    for path in ROOT.rglob("*.py"):
        if path.stem != "__init__":
            folders.setdefault(path.stem, set()).add(path.parent.relative_to(ROOT).as_posix())
    several = {name: places for name, places in folders.items() if len(places) > 1}
    defended = {name: places for group in SAME_MODULE_NAMES.values() for name, places in group.items()}
    defended["codes"] = folders["codes"]
    assert several == defended


@pytest.mark.slow
def test_no_two_classes_have_one_name():
    """Neither with an underscore before one of them: a reader who searches for a class finds one."""
    places: dict[str, list[str]] = {}
    for module, tree in modules(ROOT).items():
        for node in walk(tree):
            if isinstance(node, ast.ClassDef):
                places.setdefault(node.name.lstrip("_"), []).append(module)
    assert len(places) > 300
    assert {name: found for name, found in places.items() if len(found) > 1} == {}


@pytest.mark.slow
def test_imports_go_down_and_never_in_circles():
    assert offences(ROOT) == []


@pytest.mark.slow
def test_the_imports_are_seen():
    """The reading itself works: arrows that must be there are there."""
    pairs = set(arrows(ROOT))
    assert ("postproc.model.solve", "postproc.robot.chain") in pairs
    assert ("postproc.base.geometry", "postproc.base.arrays") in pairs
    assert ("postproc.compensation.mirror", "postproc.robot.inverse") in pairs
    assert len(pairs) > 60


@pytest.mark.parametrize(
    ("file", "text", "word"),
    [
        ("base/geometry.py", "from postproc.model import StiffnessModel\n", "base.geometry (0) imports"),
        ("base/geometry.py", "def f():\n    import postproc.model\n", "base.geometry (0) imports"),
        ("base/geometry.py", "from postproc import model\n", "base.geometry (0) imports"),
        ("robot/weight.py", "from postproc.cell import Cell\n", "robot.weight (2) imports"),
        ("cell.py", "import postproc.process.wrenches\n", "cell (3) imports"),
        ("languages/gcode.py", "from postproc.robot import chain\n", "text and physics"),
        ("effects/weight.py", "from postproc.base.document import Edit\n", "text and physics"),
        ("process/wrenches.py", "from postproc.languages.dialect import Program\n", "text and physics"),
        ("kitchen.py", "x = 1\n", "'kitchen' has no floor"),
        ("kitchen/sink.py", "x = 1\n", "'kitchen' has no floor"),
        ("robot/chain.py", "from postproc.robot.inverse import inverse\n", "circle"),
    ],
)
def test_each_offence_is_told(tmp_path, file, text, word):
    house = tmp_path / "postproc"
    files = {
        "__init__.py": "",
        "model.py": "",
        "cell.py": "",
        "base/document.py": "",
        "process/wrenches.py": "",
        "languages/dialect.py": "",
        "robot/__init__.py": "",
        "robot/chain.py": "",
        "robot/inverse.py": "from postproc.robot.chain import Chain\n",
    }
    for name, content in files.items():
        (house / name).parent.mkdir(parents=True, exist_ok=True)
        (house / name).write_text(content, encoding="utf-8")
    assert offences(house) == []
    (house / file).parent.mkdir(parents=True, exist_ok=True)
    (house / file).write_text(text, encoding="utf-8")
    told = offences(house)
    assert len(told) >= 1
    assert any(word in line for line in told)


def test_suffixes_of_a_language_are_known_to_it_alone():
    named = {
        path.relative_to(ROOT).as_posix()
        for path in sorted(ROOT.rglob("*.py"))
        for node in walk(parse_file(path))
        if isinstance(node, ast.Constant) and node.value in (".src", ".dat")
    }
    assert named
    assert all(name.startswith(("languages/krl/", "posts/")) for name in named), named
