"""Input that is made to hurt: bombs, endless lines, names that lead elsewhere, links in the place of outputs."""

from __future__ import annotations

import ast
import errno
import os
import resource
import shutil
import signal
from pathlib import Path

import pytest
from conftest import CELL, LINES
from faults import TEMPORARY, Child, once, there
from sources import parse, parse_file, walk

import postproc
from postproc.base.findings import Refusal
from postproc.base.read_files import MAX_BYTES, MAX_LINE, read_file
from postproc.base.tables import read_table
from postproc.base.yaml_section import MAX_NODES, parsed
from postproc.workflows.preparation import read_document

MB = 1_000_000
LONG = 50 * MB
MEMORY, SECONDS = 400 * MB, 20
"""What a run may take for input that is made to hurt, beside what this process has; seconds of the processor."""


def within_bounds(words: list[object], folder: Path) -> tuple[int, str]:
    """Exit code and words of a run that gets no more than that."""

    def bounds() -> None:
        pages = int(Path("/proc/self/statm").read_text().split()[0])
        resource.setrlimit(resource.RLIMIT_AS, (pages * resource.getpagesize() + MEMORY,) * 2)
        used = resource.getrusage(resource.RUSAGE_SELF)
        resource.setrlimit(resource.RLIMIT_CPU, (int(used.ru_utime + used.ru_stime) + SECONDS,) * 2)

    child = Child(words, folder, once(1, bounds))
    code = child.end()
    assert code not in (-signal.SIGXCPU, -signal.SIGKILL), "it takes too long"
    assert "MemoryError" not in child.said
    assert "Traceback" not in child.said, child.said[-2000:]
    return code, child.said


def refused(words: list[object], folder: Path, code: str, text: str = "") -> None:
    ended, said = within_bounds(words, folder)
    assert ended == 1, said
    assert code in said
    assert text in said
    assert "nothing is written" in said
    assert len(said) < 2000
    assert not (folder / "compensated").exists()


# YAML


@pytest.mark.slow
@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("a: [" + "1," * MAX_NODES + "1]", "values"),
        ("a: {" + ",".join(f"k{n}: 1" for n in range(MAX_NODES // 2 + 1)) + "}", "values"),
        ("a: " + "[" * 40 + "]" * 40, "deeper"),
        ("a: &a [x, x]\nb: &b [*a, *a]\nc: [*b, *b]\n", "aliases"),
        ("a: &a {x: 1}\nb:\n  <<: *a\n", "aliases"),
        ("a: !!python/object/apply:os.system ['true']\n", "tags"),
        ("!!python/object:os.system {}\n", "tags"),
        ("a: " + "x" * 4 * MB, "larger"),
    ],
)
def test_bombs_and_tags_in_a_cell(job, text, words):
    job.cell(text)
    refused([job.program, "--force"], job.folder, "YML001", words)


YAML_FILES = {
    "robot.yaml": ["part.src", "--force=0,0,9", "--robot", "robot.yaml"],
    "process.yaml": ["part.src", "--force", "process.yaml"],
    "jobs.yaml": ["batch", "jobs.yaml"],
    "shown.yaml": ["robots", "shown.yaml"],
    "mapped.yaml": [
        "map",
        "--robot",
        "mapped.yaml",
        "--x",
        "1500",
        "--y",
        "0",
        "--z",
        "900",
        "--force=0,0,9",
    ],
    "asked.yaml": [
        "plan",
        "--robot",
        "asked.yaml",
        "--effects",
        "joint_compliance",
        "--poses",
        "9",
        "-o",
        "p.csv",
    ],
}


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("a: &a [x, x]\nb: &b [*a, *a]\nc: [*b, *b]\n", "aliases"),
        ("a: !!python/object/apply:os.system ['touch evil']\n", "tags"),
        ("a: !!python/name:os.system\n", "tags"),
        ("a: " + "[" * 40 + "]" * 40, "deeper"),
        ("a: [" + "1," * MAX_NODES + "1]", "values"),
        ("name: x\nname: y\n", "twice"),
    ],
)
@pytest.mark.parametrize("name", YAML_FILES)
def test_bombs_and_tags_in_every_yaml_file(compensate, job, monkeypatch, name, text, words):
    monkeypatch.chdir(job.folder)
    (job.folder / name).write_text(text)
    before = tree(job.folder)
    done = compensate(*YAML_FILES[name])
    assert done.code == 1
    assert words in done.err
    assert tree(job.folder) == before


@pytest.mark.slow
def test_as_many_values_as_are_allowed():
    text = "a: [" + ",".join("1" * (MAX_NODES - 3)) + "]"
    assert parsed(text.encode(), Path("a.yaml")).length("a") == MAX_NODES - 3


def test_a_key_without_end(job):
    job.cell(CELL + "? " + "k" * 500_000 + "\n: 1\n")
    ended, said = within_bounds([job.program, "--force"], job.folder)
    assert ended == 1
    assert "YML" in said


# long lines, deep folds


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    "line", [b";", b";FORCE ", b"LIN {X ", b""], ids=["comment", "force", "number", "word"]
)
@pytest.mark.parametrize("name", ["part.src", "part.dat"])
def test_a_line_without_end_in_a_program(job, name, line):
    head = (
        b"\r\n".join(text.encode() for text in LINES[:9]) + b"\r\n"
        if name == "part.src"
        else b"DEFDAT part\r\n"
    )
    (job.folder / name).write_bytes(head + line + b"1 " * (LONG // 2) + b"\r\nEND\r\n")
    refused([job.program, "--force"], job.folder, "FIL003", f"{name}:{head.count(10) + 1}")


def test_a_line_without_end_in_g_code(job):
    path = job.folder / "part.nc"
    path.write_bytes(b"G21 G90\nT1\nG1 X0 Y0 Z0 F100\nG1" + b" X1" * (LONG // 3) + b"\nM30\n")
    refused([path, "--force=0,0,9"], job.folder, "FIL003", "part.nc:4")


@pytest.mark.sample(1)
@pytest.mark.parametrize("row", [b"10," + b"1" * LONG, b"10," * (LONG // 3), b'10,"' + b"1" * LONG])
def test_a_line_without_end_in_a_table(job, row):
    path = job.folder / "f.csv"
    path.write_bytes(b"line,fx,fy,fz\n" + row + b"\n")
    refused([job.program, "--force", path], job.folder, "FRC003", "f.csv:2")


@pytest.mark.parametrize(
    "header",
    [",".join(f"a{n}" for n in range(300_000)), "x" * 100_000, "line," * 300_000],
    ids=["many", "long", "same"],
)
def test_a_header_without_end(job, header):
    path = job.folder / "f.csv"
    path.write_text(header + "\n" + "1," * header.count(",") + "1\n")
    refused([job.program, "--force", path], job.folder, "FRC003", "f.csv:1")


@pytest.mark.parametrize("where", [0, 1, MAX_LINE // 2])
def test_how_long_a_line_may_be(tmp_path, where):
    """One of MAX_LINE bytes is read wherever it lies; one of more is not."""
    path = tmp_path / "a.src"
    for end in (b"\n", b"", b"\n" + b"y" * MAX_LINE):
        path.write_bytes(b"\n" * where + b"x" * MAX_LINE + end)
        assert read_document(path).raw == path.read_bytes()
        for more in (1, MAX_LINE):
            path.write_bytes(b"\n" * where + b"x" * (MAX_LINE + more) + end)
            with pytest.raises(Refusal) as refusal:
                read_document(path)
            finding = refusal.value.findings[0]
            assert (finding.code, finding.line) == ("FIL003", where + 1)


@pytest.mark.parametrize("end", [b"\n", b"\r", b"\r\n"])
@pytest.mark.parametrize("shift", [0, 1, 2])
def test_how_long_a_line_of_a_table_may_be(tmp_path, end, shift):
    """All of a table is there wherever its lines end in what is read at a time, and the long one has its number."""
    path = tmp_path / "a.csv"
    head = b"a" * (1 + shift) + end
    rows = (b" " * (MAX_LINE // 4) + b"1" + end) * 9
    path.write_bytes(head + rows)
    assert len(read_table(path, "FRC003")) == 9
    path.write_bytes(head + rows + b" " * MAX_LINE + b"1")
    with pytest.raises(Refusal) as refusal:
        read_table(path, "FRC003")
    finding = refusal.value.findings[0]
    assert (finding.code, finding.line) == ("FRC003", 11)


def test_what_is_no_text_is_told_where_and_only_in_text(tmp_path):
    """A NUL far behind is; a file that is not read as text may hold any, and has no lines."""
    path = tmp_path / "a.bin"
    path.write_bytes(b"x\n" * MAX_LINE + b"\0" + b"x" * (2 * MAX_LINE))
    with pytest.raises(Refusal) as refusal:
        read_document(path)
    assert refusal.value.findings[0].code == "FIL003"
    assert f"byte {2 * MAX_LINE} is NUL" in refusal.value.findings[0].message
    assert read_file(path) == path.read_bytes()


@pytest.mark.slow
@pytest.mark.parametrize("closed", [True, False])
def test_deep_folds(job, closed):
    """Twenty thousand folds, one in the other, about the cut: it is compensated, and not a byte of them changes."""
    deep = 20_000
    job.write([*LINES[:8], *[";FOLD x"] * deep, *LINES[8:-1], *[";ENDFOLD"] * (deep * closed), LINES[-1]])
    code, said = within_bounds([job.program, "--force", "-q"], job.folder)
    assert code in (0, 3), said
    done = job.output.read_bytes()
    assert done.count(b";FOLD x\r\n") == deep
    assert done.count(b";ENDFOLD\r\n") == deep * closed
    assert b"LIN {X 100.000,Y 0.000,Z -2.000" not in done


# what is no file


@pytest.mark.parametrize(
    "make", [os.mkfifo, lambda path: path.symlink_to("/dev/zero")], ids=["pipe", "device"]
)
@pytest.mark.parametrize("name", ["part.src", "part.force.csv"])
def test_pipes_and_devices_are_not_read(job, name, make):
    path = job.folder / name
    path.unlink(missing_ok=True)
    make(path)
    if name == "part.force.csv":
        job.write([line for line in LINES if "FORCE" not in line])
        refused([job.program, "--force", path], job.folder, "FIL001", "pipe or a device")
    else:
        refused([job.program, "--force"], job.folder, "FIL001", "pipe or a device")


def test_a_file_that_is_too_large_is_not_read(job):
    with job.program.open("r+b") as stream:
        stream.truncate(MAX_BYTES + 1)
    refused([job.program, "--force"], job.folder, "FIL001", "larger")


def test_a_name_with_nul():
    with pytest.raises(Refusal) as refusal:
        read_file(Path("a\0b.src"))
    assert refusal.value.findings[0].code == "FIL001"


@pytest.mark.parametrize(
    ("name", "content", "code"),
    [
        ("part.dat", b"DEFDAT part\r\n\0ENDDAT\r\n", "FIL003"),
        ("part.force.csv", b"line,fx,fy,fz\n10,0,\0,1\n", "FIL003"),
        ("cell.yaml", CELL.encode() + b"a: \0\n", "YML001"),
        ("cell.yaml", CELL.encode() + b'dialect: {name: "k\\0rl"}\n', "YML001"),
    ],
)
def test_nul_bytes(job, name, content, code):
    job.write([line for line in LINES if "FORCE" not in line])
    (job.folder / name).write_bytes(content)
    refused([job.program, "--force"], job.folder, code, name)


# names that lead elsewhere


def tree(folder: Path) -> set[str]:
    return {path.relative_to(folder).as_posix() for path in folder.rglob("*")}


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    "name", ["../../evil", "/evil", "..\\evil", "$(touch evil)", "`touch evil`", "a;touch evil"]
)
def test_names_in_a_program_lead_nowhere(job, name):
    """Whatever its module, its calls and its points are called, files appear in the folder of results alone."""
    shop = job.folder / "shop"
    shop.mkdir()
    job.folder.joinpath("cell.yaml").rename(shop / "cell.yaml")
    program = shop / "part.src"
    program.write_text(
        "\r\n".join(
            [f"DEF {name}()", f"{name}()", *LINES[1:-1], f"LIN {name}", "END", f"DEF {name}()", "END"]
        )
    )
    before = tree(job.folder)
    code, _ = within_bounds([program, "--force"], shop)
    assert code in (0, 1, 3)
    new = tree(job.folder) - before
    assert all(path.startswith("shop/compensated") for path in new)


@pytest.mark.parametrize("robot", ["../../evil", "../evil.yaml", "/dev/zero", "kuka_kr270/../kuka_kr270"])
def test_a_robot_elsewhere(job, robot):
    job.cell(CELL.replace("robot: kuka_kr270", f"robot: {robot}"))
    before = tree(job.folder)
    code, said = within_bounds([job.program, "--force"], job.folder)
    assert code == 1, said
    assert tree(job.folder) == before


# links in the place of outputs


NAMES = ("part.src", "part.report.json", "part.corrections.csv", "part.diff", "part.report.html")


@pytest.mark.parametrize("broken", [False, True])
def test_links_are_replaced_and_not_followed(compensate, job, broken):
    outside = job.folder / "outside"
    outside.mkdir()
    job.output.parent.mkdir()
    for name in NAMES:
        if not broken:
            (outside / name).write_text("precious")
        (job.output.parent / name).symlink_to(outside / name)
    assert compensate(job.program, "--force").code == 0
    assert there(outside) == ({} if broken else dict.fromkeys(NAMES, b"precious"))
    for name in NAMES:
        assert not (job.output.parent / name).is_symlink()
        assert (job.output.parent / name).stat().st_size > 0


@pytest.mark.slow
def test_links_stay_where_nothing_is_written(job):
    """The disk fails somewhere on the way: the links, which lead nowhere, are there again."""
    outside = job.folder / "outside"
    folder = job.output.parent

    def full() -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    failed = 0
    for at in range(12, 36, 3):
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir()
        for name in NAMES:
            (folder / name).symlink_to(outside / name)
        child = Child([job.program, "--force"], folder, once(at, full))
        code = child.end()
        failed += code == 1
        # where the request that failed was to take an old one away, that stays until the next run
        links = {
            path.name for path in folder.iterdir() if path.is_symlink() and not TEMPORARY.fullmatch(path.name)
        }
        assert links == (set(NAMES) if code == 1 else set()), at
        assert not outside.exists()
    assert failed > 1


def test_a_hard_link_of_the_input_keeps_the_input(compensate, job):
    before = job.program.read_bytes()
    job.output.parent.mkdir()
    os.link(job.program, job.output)
    compensate(job.program, "--force")
    assert job.program.read_bytes() == before
    assert job.output.read_bytes() != before


@pytest.mark.parametrize("which", ["force", "cell", "robot", "config", "process"])
def test_no_input_is_an_output(compensate, job, which):
    """A result of the name of any file that the run reads is refused."""
    (job.folder / "force.csv").write_text("line,fx,fy,fz\n10,0,9,9\n")
    (job.folder / "config.dat").write_text("DEFDAT $CONFIG\nENDDAT\n")
    robot = (Path(postproc.__file__).parent.parent / "robots" / "kuka_kr270.yaml").read_bytes()
    (job.folder / "robot.yaml").write_bytes(robot)
    (job.folder / "process.yaml").write_text("process: {}\n")
    named = {
        "force": ("force.csv", ["--force", job.folder / "force.csv"]),
        "cell": ("cell.yaml", ["--force"]),
        "robot": ("robot.yaml", ["--force", "--robot", job.folder / "robot.yaml"]),
        "config": ("config.dat", ["--force", "--config-dat", job.folder / "config.dat"]),
        "process": ("process.yaml", ["--force", job.folder / "process.yaml"]),
    }
    name, words = named[which]
    before = there(job.folder)
    done = compensate(job.program, *words, "-o", job.folder / name)
    assert done.code == 1
    assert which == "process" or "FIL007" in done.err
    assert there(job.folder) == before


# neither a network, nor a shell, nor objects out of files


BANNED = frozenset(
    [
        *(
            "pickle",
            "dill",
            "cloudpickle",
            "shelve",
            "marshal",
            "joblib",
            "subprocess",
            "pty",
            "ctypes",
            "code",
        ),
        *(
            "codeop",
            "socket",
            "socketserver",
            "ssl",
            "urllib.request",
            "http",
            "ftplib",
            "smtplib",
            "telnetlib",
        ),
        *("xmlrpc", "requests", "asyncio", "webbrowser", "distributed", "dask"),
    ]
)
CALLS = frozenset(["eval", "exec", "compile", "__import__"])
ATTRIBUTES = frozenset(
    [
        *("system", "popen", "spawnl", "spawnv", "execv", "execve", "execl"),
        *("unsafe_load", "full_load", "load_all", "import_module"),
    ]
)
ALLOWED = {
    ("batching/cluster.py", "distributed"),
    ("__init__.py", "import_module"),
    ("report/result.py", "import_module"),
    ("process/stock/borrowed.py", "import_module"),
    ("process/stock/compiled.py", "import_module"),
    ("base/memory.py", "ctypes"),
    ("base/array_memory.py", "ctypes"),
    ("base/paged_memory.py", "ctypes"),
    ("base/sized_bytes.py", "ctypes"),
    ("cli/main.py", "import_module"),
    ("posts/freecad/compensate_post.py", "subprocess"),
    ("posts/robodk/kuka_compensated.py", "subprocess"),
    ("posts/robodk/kuka_compensated.py", "import_module"),
}
"""The one way out, the cluster that the user names; the package's own names and commands, loaded when they are asked
for; pandas and numba; the C library of this process, which gives memory back, and numpy's handler of memory; and what
runs in a CAM system, and starts the command."""


def banned(module: str) -> set[str]:
    return {module, module.split(".")[0]} & BANNED


def misdeeds(tree: ast.AST) -> set[str]:
    found = set()
    for node in walk(tree):
        if isinstance(node, ast.Import):
            found |= {name for alias in node.names for name in banned(alias.name)}
        elif isinstance(node, ast.ImportFrom) and not node.level:
            found |= banned(node.module or "")
        elif isinstance(node, ast.Call):
            if isinstance(node.func, ast.Name) and node.func.id in CALLS:
                found.add(node.func.id)
            found |= {word.arg for word in node.keywords if word.arg in ("shell", "allow_pickle")}
        elif isinstance(node, ast.Attribute) and node.attr in ATTRIBUTES:
            found.add(node.attr)
    return found


@pytest.mark.slow
def test_no_network_no_shell_no_objects_out_of_files():
    root = Path(postproc.__file__).parent
    found = {
        (path.relative_to(root).as_posix(), what)
        for path in sorted(root.rglob("*.py"))
        for what in misdeeds(parse_file(path))
    }
    assert found == ALLOWED


@pytest.mark.parametrize(
    "text",
    [
        "import pickle", "from urllib.request import urlopen", "import socket as s", "eval('1')",
        "import os; os.system('x')",
        "f(shell=True)", "import numpy; numpy.load(f, allow_pickle=True)", "import yaml; yaml.unsafe_load(f)",
        "import subprocess", "def f():\n    import http.client",
    ],
)  # fmt: skip
def test_misdeeds_are_seen(text):
    assert misdeeds(parse(text))
