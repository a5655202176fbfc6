"""What reading a motion costs: the text, its forces, all that predicts it, and the output read again."""

from postproc.base.document import Document


def read(ready, contents):
    """As if for the first time: a document remembers where its lines are."""
    documents = tuple(
        Document(document.path, raw if isinstance(raw, bytes) else b"".join(raw))
        for document, raw in zip(ready.program.documents, contents, strict=True)
    )
    return ready.dialect.read(documents, ready.settings)


def test_parse(work, measured):
    ready = work["prepare"].result
    contents = [document.raw for document in ready.program.documents]
    assert len(measured(lambda: read(ready, contents)).toolpath) >= work.motions


def test_read_again(work, measured):
    ready, contents = work["prepare"].result, work["write"].result.contents
    assert len(measured(lambda: read(ready, contents)).toolpath) >= work.motions


def test_prepare(work, measured):
    """Text, frames, forces, axes."""
    assert measured(work["prepare"].again).wrenches.any
