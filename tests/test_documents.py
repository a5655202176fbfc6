"""The READMEs print what their commands print, lead where they say, and their examples of files are read."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import documents
import jsonschema_rs
import pytest
import yaml
from documents import ROOT, Workplace, find_drifts, read_blocks, rewrite

from postproc.cell import load_cell
from postproc.effects import EFFECTS
from postproc.process.process_file import read_process
from postproc.robot.description import find_robot, load_robot

DOCUMENTS = documents.list_documents()
BLOCKS = {path: read_blocks((ROOT / path).read_text(encoding="utf-8")) for path in DOCUMENTS}
LONGEST = 200
"""Lines of the front page."""


def with_blocks(slow: bool) -> list[Path]:
    return [path for path, blocks in BLOCKS.items() if any(b.compared and b.slow == slow for b in blocks)]


def test_every_readme_of_the_repository_is_a_document():
    found = {
        path for top in ("samples", "robots", "postproc", "tests") for path in (ROOT / top).rglob("README.md")
    }
    assert set(DOCUMENTS) == {path.relative_to(ROOT) for path in found} | {Path("README.md")}


@pytest.mark.sample(1)
@pytest.mark.parametrize("document", with_blocks(slow=False), ids=str)
def test_a_document_prints_what_its_commands_print(document):
    assert not (found := find_drifts(document, slow=False)), "\n".join(map(str, found))


@pytest.mark.slow
@pytest.mark.parametrize("document", with_blocks(slow=True), ids=str)
def test_a_document_with_long_runs_prints_what_its_commands_print(document):
    assert not (found := find_drifts(document, slow=True)), "\n".join(map(str, found))


SMALL = """\
# A document

```console
$ echo one && sleep 0.01 && echo "done in 1.5 s"
one
done in 0.3 s
$ echo \\
>   "$PWD/samples"; exit 3
samples
(exit code 3)
```

```pycon
>>> for number in range(2):
...     number
0
1
>>> number + 1
2
```

*Not compared with a run: it depends on the machine.*

```console
$ echo 5
6
```
"""


@pytest.mark.parametrize(
    ("right", "wrong"),
    [("\none\n", "\n0ne\n"), ("(exit code 3)\n", ""), ("\nsamples\n", "\n"), ("\n2\n", "\n3\n")],
)
def test_a_block_that_has_drifted_is_found_and_rewritten(tmp_path, right, wrong):
    assert SMALL.count(right) == 1
    document = tmp_path / "README.md"
    document.write_text(SMALL)
    # durations differ, and what is not compared may say anything
    assert find_drifts(Path("README.md"), slow=False, root=tmp_path) == []
    document.write_text(SMALL.replace(right, wrong))
    (drift,) = find_drifts(Path("README.md"), slow=False, root=tmp_path)
    assert (
        drift.block.line
        == SMALL.count("\n", 0, SMALL.index("```pycon" if "2" in right else "```console")) + 1
    )
    assert "README.md" in str(drift)
    rewrite(Path("README.md"), [drift], root=tmp_path)
    # what a masked figure alone changes is not touched
    assert document.read_text() == SMALL
    with pytest.raises(ValueError, match="edited while its commands ran"):
        rewrite(Path("README.md"), [drift], root=tmp_path)


def test_a_slow_block_waits_for_the_slow_tests(tmp_path):
    (tmp_path / "README.md").write_text("```console slow\n$ echo 1\n2\n```\n")
    assert find_drifts(Path("README.md"), slow=False, root=tmp_path) == []
    (drift,) = find_drifts(Path("README.md"), slow=True, root=tmp_path)
    assert drift.printed == "$ echo 1\n1\n"


@pytest.mark.parametrize(
    ("text", "words"),
    [("```\n1\n```\n", "no kind of block"), ("```console later\n$ echo\n```\n", "no kind of block")],
)
def test_a_block_of_no_kind_is_refused(text, words):
    with pytest.raises(ValueError, match=words):
        read_blocks(text)


def test_output_without_a_command_is_refused(tmp_path):
    (tmp_path / "README.md").write_text("```console\n1\n```\n")
    with pytest.raises(ValueError, match="begins with a command"):
        find_drifts(Path("README.md"), slow=False, root=tmp_path)


def test_the_commands_of_a_document_are_those_of_this_package(tmp_path):
    work = Workplace.create(tmp_path)
    printed = work.run(
        ["bash", "-c", "python -c 'import postproc; print(postproc.__file__)'; compensate --version"]
    )
    assert printed.startswith("postproc/__init__.py\n")  # below the repository, whose path is left out
    assert len(printed.splitlines()) == 2
    assert not list(work.folder.glob("samples/**/compensated"))


def anchors(document: Path) -> set[str]:
    """The anchors of a document's headings, as hosts of repositories make them."""
    text = documents.FENCE.sub("", document.read_text(encoding="utf-8"))
    headings = re.findall(r"^#+ (.*)$", text, re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("document", DOCUMENTS, ids=str)
def test_every_link_leads_somewhere(document):
    text = documents.FENCE.sub("", (ROOT / document).read_text(encoding="utf-8"))
    for link in re.findall(r"\]\(([^)\s]+)\)", text):
        if link.startswith("https://"):
            continue
        name, _, anchor = link.partition("#")
        target = (ROOT / document).parent / name if name else ROOT / document
        assert target.exists(), link
        if anchor:
            assert anchor in anchors(target), link


def test_the_front_page_is_short():
    assert len((ROOT / "README.md").read_text(encoding="utf-8").splitlines()) <= LONGEST


EXAMPLES = [
    pytest.param(block.text, id=f"{path}:{block.line}")
    for path, blocks in BLOCKS.items()
    for block in blocks
    if block.kind == "yaml"
]


@pytest.mark.parametrize("text", EXAMPLES)
def test_an_example_of_a_file_is_read(tmp_path, text, compensate):
    name = re.match(r"# (\S+)\.yaml\n", text)
    assert name, "a yaml block begins with its name: # cell.yaml"
    path = tmp_path / f"{name[1]}.yaml"
    path.write_text(text, encoding="utf-8")
    if name[1] == "cell":
        (tmp_path / "$config.dat").write_text("DEFDAT $CONFIG\nENDDAT\n")
        load_cell(path)
    elif name[1] == "milling":
        assert read_process(path)
    elif name[1] == "my_arm":
        assert load_robot(path).effects
    else:
        assert name[1] == "job"
        jsonschema_rs.validate(json.loads(compensate("schema", "job").out), yaml.safe_load(text))


def test_the_table_of_effects_names_every_parameter():
    """Effect, parameters with their units, and options, as the classes have them."""
    text = (ROOT / "robots" / "README.md").read_text(encoding="utf-8")
    rows = {row[0]: row[1] for row in re.findall(r"^\| `(\w+)`[^|]*\|[^|]*\|([^|]*)\|", text, re.MULTILINE)}
    rows = {name: cell for name, cell in rows.items() if name in EFFECTS}
    assert rows.keys() == EFFECTS.keys()
    joints = load_robot(find_robot("kuka_kr270")).joints
    for name, cell in rows.items():
        patterns = [
            (re.sub(r"<\w>", r"\\d", pattern), group.rsplit("`", 1)[1].strip(" ,"))
            for group in cell.split(";")
            for pattern in re.findall(r"`([^`]+)`", group)
        ]
        used = set()
        for parameter in EFFECTS[name](joints).parameters:
            (hit,) = (one for one in patterns if re.fullmatch(one[0], parameter.name))
            assert hit[1].split(" (")[0] == parameter.unit or hit[1].startswith(parameter.unit), (
                parameter.name
            )
            used.add(hit)
        assert used == set(patterns), name


def test_every_module_that_is_named_exists():
    text = (ROOT / "postproc" / "README.md").read_text(encoding="utf-8")
    package = ROOT / "postproc"
    names = set(re.findall(r"`([\w/]+\.py)`", text))
    assert len(names) > 30
    missing = [name for name in names if not (ROOT / name).exists() and not list(package.rglob(name))]
    assert not missing


@pytest.mark.slow
def test_the_picture_of_the_front_page_can_be_drawn_again(tmp_path):
    folder = ROOT / "samples" / "kr270_panel"
    drawn = tmp_path / "drawn.svg"
    subprocess.run([sys.executable, folder / "draw_before_after.py", drawn], check=True, capture_output=True)
    assert drawn.read_text() == (folder / "before_after.svg").read_text()
