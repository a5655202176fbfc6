"""The house rules, read from the imports: a room sees lower rooms and itself, and nothing goes in circles."""

import ast
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

import postproc

ROOT = Path(postproc.__file__).parent

ROOMS = {
    "__main__": 11,
    "cli": 10,
    "api": 9,
    "schemas": 9,
    "batch": 9,
    "workflows": 8,
    "report": 7,
    "writing": 7,
    "holding": 7,
    "diagnosis": 6,
    "verification": 6,
    "identification": 5,
    "experiments": 5,
    "workspace": 5,
    "compensation": 5,
    "model": 4,
    "effects": 3,
    "forces": 3,
    "cell": 3,
    "robot": 2,
    "dialects": 2,
    "measurements": 1,
    "toolpath": 1,
    "document": 1,
    "geometry": 1,
    "yamlfile": 1,
    "tables": 1,
    "publish": 1,
    "files": 1,
    "inputs": 1,
    "decimals": 1,
    "blocks": 0,
    "findings": 0,
    "units": 0,
    "printable": 0,
    "arrays": 0,
    "__init__": 0,
}
"""Room -> its floor.  A new room gets its floor here."""

ONE_FLOOR = {
    ("writing", "holding"),
    ("schemas", "batch"),
    ("forces", "cell"),
    ("experiments", "identification"),
    ("toolpath", "geometry"),
    ("measurements", "tables"),
    ("measurements", "geometry"),
    ("tables", "files"),
    ("tables", "decimals"),
    ("yamlfile", "files"),
    ("files", "inputs"),
}
"""Neighbours on one floor, from -> to."""

TEXT = {"dialects", "document"}
PHYSICS = {"robot", "effects", "forces"}
"""Neither side knows of the other; they meet in ``toolpath``."""


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
        found[".".join(parts)] = ast.parse(path.read_text(encoding="utf-8"), str(path))
    return found


def imports_of(module, tree, known):
    """Modules of the package that ``module`` imports, wherever in the file the import stands."""
    top = module.split(".")[0]
    for node in ast.walk(tree):
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
        if (here in TEXT and there in PHYSICS) or (here in PHYSICS and there in TEXT):
            told.append(f"{name} imports {target}: text and physics do not meet here")
    graph: dict[str, set[str]] = {}
    for name, target in pairs:
        graph.setdefault(name, set()).add(target)
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        told.append("circle: " + " -> ".join(error.args[1]))
    return told


def test_imports_go_down_and_never_in_circles():
    assert offences(ROOT) == []


def test_the_imports_are_seen():
    """The reading itself works: arrows that must be there are there."""
    pairs = set(arrows(ROOT))
    assert ("postproc.model", "postproc.robot.chain") in pairs
    assert ("postproc.geometry", "postproc.arrays") in pairs
    assert ("postproc.compensation.mirror", "postproc.robot.inverse") in pairs
    assert len(pairs) > 60


@pytest.mark.parametrize(
    ("file", "text", "word"),
    [
        ("geometry.py", "from postproc.model import StiffnessModel\n", "geometry (1) imports"),
        ("geometry.py", "def f():\n    import postproc.model\n", "geometry (1) imports"),
        ("geometry.py", "from postproc import model\n", "geometry (1) imports"),
        ("geometry.py", "from postproc import tables\n", "geometry (1) imports"),
        ("effects/weight.py", "from postproc.cell import Cell\n", "effects.weight (3) imports"),
        ("cell.py", "import postproc.forces.wrench\n", "cell (3) imports"),
        ("dialects/gcode.py", "from postproc.robot import chain\n", "text and physics"),
        ("effects/weight.py", "from postproc.document import Edit\n", "text and physics"),
        ("forces/wrench.py", "from postproc.dialects.dialect import Program\n", "text and physics"),
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
        "tables.py": "",
        "cell.py": "",
        "document.py": "",
        "forces/wrench.py": "",
        "dialects/dialect.py": "",
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
