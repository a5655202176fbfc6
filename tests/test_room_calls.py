"""Calls go down through the rooms: what calls up was given a function, or rows, to ask for."""

from room_calls import count_calls
from test_design import ROOMS

CALLED_WITH_FUNCTIONS = {
    "base/arrays.py": "rows that are made when they are asked for",
    "base/batches.py": "work on each block",
    "base/document.py": "edits, a part at a time",
    "base/geometry.py": "poses that are made when they are asked for",
    "output/atomic_write.py": "contents of files, a part at a time",
    "output/write.py": "what the reading of the output lacks, as for the input",
    "report/report.py": "the check of the tests that every result is what its schema says",
    "workflows/program.py": "the name of the stage, for the terminal",
}
"""Files whose functions call functions of higher rooms, which gave them these."""


def test_only_what_was_given_a_function_calls_up(job, monkeypatch):
    monkeypatch.setenv("POSTPROC_THREADS", "1")
    counted = count_calls([str(job.program), "--force", "-q"], ROOMS)
    assert job.output.exists()
    assert not [pair for pair in counted.up if pair[0].split()[0] not in CALLED_WITH_FUNCTIONS]
    assert counted.up
    assert counted.calls.total() > 10 * counted.up.total()
    assert {room for pair in counted.calls for room in pair} <= set(ROOMS)
    assert counted.calls["compensation", "model"]
