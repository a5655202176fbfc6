"""What writing a corrected KRL program costs: edits, splicing, taking them out again.

    OMP_NUM_THREADS=1 python -m pytest tests/benchmarks/bench_krl_write.py

Time of this process.  Every target of a program of common lines moves; in one case each motion is divided in two.
"""

import time
import tracemalloc
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from postproc.dialects.dialect import Plan, Role, Writing
from postproc.dialects.krl import KrlDialect
from postproc.document import Document, apply, undone
from postproc.geometry import rotation_from_vector
from postproc.units import MM

MOVED_US = 4.0
"""Goal: microseconds a row for the edits of a million rows."""
HEAD = b"DEF part()\r\nBAS(#BASE,1)\r\nBAS(#TOOL,1)\r\n$VEL.CP=0.05\r\n"
KRL = KrlDialect()


@cache
def program(count):
    random = np.random.default_rng(3)
    position = np.cumsum(random.normal(0, 1, (count, 3)), axis=0)
    angles = np.cumsum(random.normal(0, 0.01, (count, 3)), axis=0) % 360 - 180
    line = "LIN {X %.3f,Y %.3f,Z %.3f,A %.3f,B %.3f,C %.3f} C_DIS\r\n"
    numbers = np.concatenate([position, angles], axis=1).ravel().tolist()
    text = HEAD + ((line * count) % tuple(numbers)).encode() + b"END\r\n"
    return KRL.read((Document(Path("part.src"), text),))


@cache
def plan(count, divided):
    path = program(count).toolpath
    random = np.random.default_rng(4)
    source = np.repeat(np.arange(count), 2) if divided else np.arange(count)
    shift = random.normal(0, 0.2 * MM, (len(source), 3))
    turn = rotation_from_vector(random.normal(0, 1e-4, (len(source), 3)))
    role = np.where(np.arange(len(source)) % 2 == 0, Role.PIECE, Role.OWN) if divided else np.zeros(count)
    way = (path.centre[source], path.normal[source], path.sweep[source])
    return Plan(source, role, path.position[source] + shift, turn @ path.rotation[source], *way)


def timed(name, count, work):
    begin = time.process_time()
    result = work()
    print(f"{name:36} {(time.process_time() - begin) / count * 1e6:8.2f} us a row")
    return result


@pytest.mark.parametrize("divided", [False, True], ids=["moved", "divided in two"])
@pytest.mark.parametrize("count", [10**5, 10**6])
def test_writing_a_program(count, divided, capsys):
    read, wanted = program(count), plan(count, divided)
    with capsys.disabled():
        print(f"\n{count} rows{', divided in two' if divided else ''}")
        moved = timed("edits", count, lambda: KRL.moved(read, wanted, Writing(3, 3)))
        document, edits = read.documents[0], moved.edits.of(0)
        assert not moved.held
        assert len(edits) > 5 * count
        written = timed("spliced", count, lambda: apply(document, edits))
        assert timed("taken out again", count, lambda: undone(written, document.raw, edits))
        if count == 10**5:
            tracemalloc.start()
            KRL.moved(read, wanted, Writing(3, 3))
            print(f"{'memory, largest':36} {tracemalloc.get_traced_memory()[1] / count:8.0f} bytes a row")
            tracemalloc.stop()
