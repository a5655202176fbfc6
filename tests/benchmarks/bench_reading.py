"""What reading a motion costs: the text, its forces, all that predicts it, and the output read again."""

from dataclasses import replace

from postproc.document import Document


def test_parse(work, measured):
    ready = work["prepare"].result
    again = measured(lambda: ready.dialect.read(ready.program.documents, ready.settings))
    assert len(again.toolpath) >= work.motions


def test_read_again(work, measured):
    ready = work["prepare"].result
    contents = work["write"].result.contents
    documents = tuple(
        replace(document, raw=raw) if isinstance(raw, bytes) else Document(document.path, b"".join(raw))
        for document, raw in zip(ready.program.documents, contents, strict=True)
    )
    again = measured(lambda: ready.dialect.read(documents, ready.settings))
    assert len(again.toolpath) >= work.motions


def test_prepare(work, measured):
    """Text, frames, forces, axes."""
    assert measured(work["prepare"].again).wrenches.any
