"""Case files of languages: read as their dumps say, with the findings that they state, and left as they are."""

from __future__ import annotations

from pathlib import Path

import pytest
from case_files import RAPID_CASES, TP_CASES, CaseFiles

from postproc.base.document import Document
from postproc.base.findings import CODES
from postproc.languages import detect
from postproc.languages.dialect import WritingSettings
from postproc.toolpath import Plan

BOTH = [RAPID_CASES, TP_CASES]
GOOD = [pytest.param(cases, path, id=path.name) for cases in BOTH for path in cases.good]
BAD = [pytest.param(cases, path, id=path.name) for cases in BOTH for path in cases.bad]


@pytest.mark.parametrize(("cases", "path"), GOOD)
def test_a_case_reads_as_its_dump(cases: CaseFiles, path: Path) -> None:
    dump = path.with_suffix(".dump").read_text().splitlines()
    assert list(cases.read(path.read_bytes()).toolpath.dump()) == dump


@pytest.mark.parametrize(("cases", "path"), BAD)
def test_a_bad_case_gives_the_codes_of_its_first_line(cases: CaseFiles, path: Path) -> None:
    program = cases.dialect.read((Document(path, path.read_bytes()),))
    assert sorted({finding.code for finding in program.findings}) == cases.expected(path)
    for finding in program.findings:
        assert finding.file == str(path)
        assert finding.line > 0
        assert finding.help or CODES[finding.code].explanation


@pytest.mark.parametrize("cases", BOTH, ids=lambda cases: cases.name)
def test_every_code_has_a_case(cases: CaseFiles) -> None:
    told = {code for path in cases.bad for code in cases.expected(path)}
    assert {code for code in CODES if code.startswith(cases.codes)} - cases.without <= told
    assert len(cases.good) + len(cases.bad) >= cases.least


@pytest.mark.parametrize(("cases", "path"), [*GOOD, *BAD])
def test_every_case_is_claimed_and_stays_as_it_is(cases: CaseFiles, path: Path) -> None:
    raw = path.read_bytes()
    if path.stem != cases.unclaimed:
        assert detect(path, raw) is cases.dialect
    program = cases.read(raw)
    edits = cases.dialect.edit_targets(program, Plan.of(program.toolpath), WritingSettings(mm=3, deg=3))
    assert not len(edits.edits)
    assert not edits.unwritten
