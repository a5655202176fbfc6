"""What writing a motion costs: the plan, its edits, the bytes, and the whole with reading back."""

from postproc.base.document import Edits, apply, undone
from postproc.output.write import writing_settings


def edits_of(work):
    ready, plan = work["prepare"].result, work["planned"].result
    return ready.dialect.moved(ready.program, plan, writing_settings(ready.cell, "inline"))


def test_plan(work, measured):
    assert len(measured(work["planned"].again)) >= work.motions


def test_moved(work, measured):
    moved = measured(lambda: edits_of(work))
    assert not moved.unwritten
    assert len(Edits.joined(moved.edits)) >= work.motions


def test_apply(work, measured):
    document = work["prepare"].result.program.documents[0]
    edits = Edits.joined(edits_of(work).edits).of(0)
    assert measured(lambda: apply(document, edits)) != document.raw


def test_undone(work, measured):
    document = work["prepare"].result.program.documents[0]
    edits = Edits.joined(edits_of(work).edits).of(0)
    raw = apply(document, edits)
    assert measured(lambda: undone(raw, document.raw, edits))


def test_write_and_read_back(work, measured):
    assert measured(work["write"].again).result.corrected.any()
