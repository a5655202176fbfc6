"""What a batch is to do: matched, checked, and refused before anything begins."""

from __future__ import annotations

import inspect
import os
from dataclasses import fields

import pytest
from conftest import CELL, LINES

from postproc.api import compensate
from postproc.base.findings import Refusal
from postproc.batching.job_file import PROGRAM_KEYS, jobs_of
from postproc.cli.batch import batch
from postproc.workflows.preparation import Request

PROGRAM = "\r\n".join(LINES)


@pytest.fixture
def shop(tmp_path):
    """A folder with programs in folders, and a function that writes its job file."""

    class Shop:
        folder = tmp_path / "shop"

        def add(self, *names: str) -> None:
            for name in names:
                path = self.folder / name
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_text(PROGRAM)

        def file(self, text: str):
            path = self.folder / "night.yaml"
            path.write_text(text)
            return path

        def jobs(self, text: str, **more):
            return jobs_of([str(self.file(text))], more.pop("said", {}), **more)

        def refused(self, text: str, **more):
            with pytest.raises(Refusal) as refusal:
                self.jobs(text, **more)
            return refusal.value.findings

    shop = Shop()
    shop.add("a.src", "b.src", "sub/c.src", "sub/deep/d.src")
    (shop.folder / "cell.yaml").write_text(CELL)
    (shop.folder / "a.dat").write_text("DEFDAT A\nENDDAT\n")
    (shop.folder / "notes.txt").write_text("nothing\n")
    return shop


def names(jobs):
    return [job.name for job in jobs.jobs]


def targets(jobs):
    return [str(job.target.relative_to(jobs.root)) for job in jobs.jobs]


@pytest.mark.parametrize(
    ("words", "found"),
    [
        ("a.src", ["a.src"]),
        ("'*.src'", ["a.src", "b.src"]),
        ("'**/*.src'", ["a.src", "b.src", "sub/c.src", "sub/deep/d.src"]),
        ("sub", ["sub/c.src"]),
        ("[sub/*.src, '*.src']", ["sub/c.src", "a.src", "b.src"]),
        ("['*.src', a.src]", ["a.src", "b.src"]),
        ("'[ab].s?c'", ["a.src", "b.src"]),
    ],
)
def test_programs_by_files_folders_and_patterns(shop, words, found):
    jobs = shop.jobs(f"programs: {words}\n")
    assert names(jobs) == found
    assert jobs.root == shop.folder / "compensated"
    assert targets(jobs) == found


def test_a_folder_passes_over_what_is_no_program(shop):
    jobs = shop.jobs("programs: .\n")
    assert names(jobs) == ["a.src", "b.src"]
    assert {path.name for path in jobs.passed_over} == {"notes.txt", "night.yaml"}


def test_results_of_an_earlier_run_are_no_programs(shop):
    shop.add("compensated/a.src", "out/a.src", "sub/compensated/c.src", ".hidden/e.src")
    assert names(shop.jobs("{programs: '**/*.src', output: out}")) == [
        "a.src",
        "b.src",
        "sub/c.src",
        "sub/deep/d.src",
    ]
    assert names(shop.jobs("programs: sub/compensated/*.src")) == ["sub/compensated/c.src"]


def test_exclude(shop):
    assert names(shop.jobs("{programs: '**/*.src', exclude: [sub/**/*.src]}")) == ["a.src", "b.src"]
    (finding,) = shop.refused("{programs: '*.src', exclude: ['?.src']}")
    assert finding.code == "BAT001"


def test_options_and_overrides(shop):
    (shop.folder / "f.csv").write_text("line,fx,fy,fz\n")
    jobs = shop.jobs(
        "programs: '**/*.src'\nforce: true\ngain: 0.5\nrobot: kuka_kr270\ncell: cell.yaml\nstrict: true\n"
        "overrides:\n  sub/**/*.src: {force: '0,1,2@tool', gain: 0.25}\n  sub/c.src: {force: f.csv}\n"
        "  a.src: {force: false}\n"
    )
    requests = {job.name: job.request for job in jobs.jobs}
    assert {name: request.force for name, request in requests.items()} == {
        "a.src": None,
        "b.src": "",
        "sub/c.src": str(shop.folder / "f.csv"),
        "sub/deep/d.src": "0,1,2@tool",
    }
    assert [request.gain for request in requests.values()] == [0.5, 0.5, 0.25, 0.25]
    assert all(request.strict and request.cell == shop.folder / "cell.yaml" for request in requests.values())
    assert all(request.program.is_absolute() for request in requests.values())


def test_every_option_of_the_main_job_is_there():
    """In a job file, on the command line of a batch, and in the package's function."""
    own = {"program", "output", "report", "json", "dry_run", "keep_table", "stream", "beside", "learned"}
    wanted = {field.name for field in fields(Request)} - own
    assert set(PROGRAM_KEYS) == wanted
    assert wanted <= {parameter.name for parameter in batch.params}
    assert wanted <= set(inspect.signature(compensate).parameters)


def test_the_command_line_wins(shop, tmp_path):
    jobs = shop.jobs(
        "{programs: '*.src', gain: 0.5, output: out, overrides: {a.src: {gain: 0.1}}}",
        said={"gain": 0.75},
        output=tmp_path / "else",
    )
    assert [job.request.gain for job in jobs.jobs] == [0.75, 0.75]
    assert jobs.root == tmp_path / "else"


@pytest.mark.parametrize(
    ("output", "target"),
    [("x.src", "x.src"), ("more/", "more/a.src"), ("more", "more/a.src"), ("more/x.src", "more/x.src")],
)
def test_an_output_of_its_own(shop, output, target):
    jobs = shop.jobs(f"{{programs: a.src, overrides: {{a.src: {{output: {output}}}}}}}")
    assert targets(jobs) == [target]


@pytest.mark.parametrize(
    ("text", "code", "line", "column", "words"),
    [
        ("programs: '*.src'\nforse: true\n", "YML002", 2, 1, ("forse", "did you mean 'force'")),
        (
            "programs: '*.src'\noverrides:\n  a.src: {gian: 1}\n",
            "YML002",
            3,
            11,
            ("gian", "did you mean 'gain'"),
        ),
        ("programs:\n  - a.src\n  - x*.src\n", "BAT001", 3, 5, ("'x*.src' matches nothing",)),
        ("programs: [notes.*]\n", "BAT001", 1, 12, ("none is a program (",)),
        ("programs: '*.src'\noverrides: {c.src: {gain: 1}}\n", "BAT001", 2, 13, ("matches no program",)),
        ("force: true\n", "YML003", 1, 1, ("'programs' is missing",)),
        ("programs: []\n", "YML004", 1, 1, ("empty list",)),
        ("programs: {a: 1}\n", "YML004", 1, 1, ("programs",)),
        ("programs: a.src\ngain: 2\n", "YML004", 2, 1, ("within 0 .. 1",)),
        ("programs: a.src\ngain: half\n", "YML004", 2, 1, ("not a number",)),
        ("programs: a.src\nforce: 1,2\n", "FRC002", 2, 1, ("2 numbers",)),
        ("programs: a.src\nforce: [1, 2, 3]\n", "FRC002", 2, 1, ("force",)),
        ("programs: a.src\nforce: none.csv\n", "YML004", 2, 1, ("does not exist",)),
        ("programs: a.src\ncell: none.yaml\n", "YML004", 2, 1, ("does not exist",)),
        ("programs: a.src\nrobot: kuka_kr27\n", "CEL003", 2, 1, ("did you mean 'kuka_kr270'",)),
        ("programs: a.src\nstrict: perhaps\n", "YML004", 2, 1, ("true or false",)),
        ("programs: *.src\n", "YML001", 1, 12, ("expected alphabetic",)),
        ("programs: ../other/*.src\n", "BAT003", 1, 11, ("outside",)),
        ("programs:\n- ../e.src\n", "BAT003", 2, 3, ("outside",)),
        ("programs: /etc/hostname\n", "BAT003", 1, 11, ("outside",)),
        ("programs: a.src\noutput: ../out\n", "BAT003", 2, 1, ("outside",)),
        ("programs: a.src\noverrides: {a.src: {output: ../../a.src}}\n", "BAT003", 2, 1, ("outside",)),
        ("", "FIL002", 0, 0, ("empty",)),
        ("- a.src\n", "YML001", 1, 1, ("keys and values",)),
    ],
)
def test_a_wrong_job_file_is_told_with_its_place(shop, text, code, line, column, words):
    (shop.folder.parent / "e.src").write_text(PROGRAM)
    finding = shop.refused(text)[0]
    assert (finding.code, finding.line, finding.column) == (code, line, column), finding
    assert finding.file == str(shop.folder / "night.yaml")
    for word in words:
        assert word in finding.message


def test_a_star_wants_quotes(shop):
    for text in ("programs: *.src", "programs: [a.src, *]", "programs: **/*.src"):
        assert '"*.src"' in shop.refused(text)[0].help


def test_what_lies_outside_can_be_allowed(shop):
    (shop.folder.parent / "e.src").write_text(PROGRAM)
    jobs = shop.jobs("{programs: [a.src, ../e.src], output: ../out}", outside=True)
    assert [job.target for job in jobs.jobs] == [jobs.root / "a.src", jobs.root / "e.src"]
    assert jobs.root == shop.folder.parent / "out"


def test_a_link_leads_outside_too(shop, tmp_path):
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "elsewhere" / "f.src").write_text(PROGRAM)
    os.symlink(tmp_path / "elsewhere", shop.folder / "link")
    assert shop.refused("programs: link/*.src")[0].code == "BAT003"
    assert shop.refused("{programs: a.src, output: link/out}")[0].code == "BAT003"


@pytest.mark.parametrize(
    "text",
    [
        "{programs: [a.src, b.src], overrides: {b.src: {output: a.src}}}",
        "{programs: [a.src, b.src], overrides: {'*.src': {output: x.src}}}",
        "{programs: [a.src, sub/c.src], overrides: {sub/c.src: {output: sub/../a.src}}}",
        "{programs: [a.src, b.src], overrides: {b.src: {output: A.SRC}}}",
        "{programs: [a.src, b.src], overrides: {b.src: {output: a.nc}}}",
    ],
)
def test_two_programs_with_one_output(shop, text):
    (finding,) = shop.refused(text)
    assert finding.code == "BAT002"
    assert "a.src and " in finding.message


def test_a_program_is_never_an_output(shop):
    findings = shop.refused("{programs: '*.src', output: .}")
    assert {finding.code for finding in findings} == {"FIL007"}
    assert len(findings) == 2


def test_words_of_the_command_line(shop, monkeypatch):
    monkeypatch.chdir(shop.folder.parent)
    jobs = jobs_of(["shop"], {"force": ""})
    assert (names(jobs), jobs.root) == (["a.src", "b.src"], shop.folder / "compensated")
    jobs = jobs_of(["shop/**/*.src"], {})
    assert (names(jobs)[-1], jobs.root) == ("sub/deep/d.src", shop.folder / "compensated")
    jobs = jobs_of(["shop/a.src", "shop/sub/c.src"], {}, shop.folder.parent / "out")
    assert targets(jobs) == ["a.src", "sub/c.src"]
    for words in (["nothing/*.src"], ["shop/a.src", "shop/x.src"], ["shop/notes.*"]):
        with pytest.raises(Refusal) as refusal:
            jobs_of(words, {})
        assert refusal.value.findings[0].code == "BAT001"
    with pytest.raises(Refusal) as refusal:
        jobs_of([str(shop.file("programs: a.src")), "shop"], {})
    assert "only argument" in refusal.value.findings[0].message


def test_nothing_starts_where_the_job_file_is_wrong(compensate, shop):
    before = sorted(shop.folder.rglob("*"))
    done = compensate("batch", shop.file("{programs: '*.src', forse: true}"), "--json", "-")
    assert done.code == 1
    assert "night.yaml:1:" in done.err
    assert done.json["findings"][0]["code"] == "YML002"
    assert sorted(shop.folder.rglob("*")) == sorted({*before, shop.folder / "night.yaml"})
    assert compensate("batch").code == 2
    lost = compensate("batch", "--force", shop.folder / "night.yaml")
    assert (lost.code, "as its value" in lost.err) == (2, True)
