"""A stock that needs more memory than is free is refused with an estimate before it is taken."""

import json
import tracemalloc

import numpy as np
import pytest

pytest.importorskip("numba")

from benchmarks.stock import ball_program, path_through, program
from click.testing import CliRunner
from stock_cases import BALL, FLAT, block, run, sweeps_of
from test_engage_command import STOCK, TOOLS, folder, refused, state

from postproc.base.memory import free_memory
from postproc.cli.main import main
from postproc.process.stock import memory_need
from postproc.process.stock.cell_lists import build_stock

__all__ = ["folder"]


def limited(monkeypatch, free):
    monkeypatch.setattr(memory_need, "free_memory", lambda: free)


def zigzag(count, five):
    points, kinds = program(count)
    return path_through(*ball_program(count)) if five else path_through(points, kinds=kinds)


def test_the_system_says_what_is_free():
    assert free_memory() is None or free_memory() > 1 << 20


def test_parts_of_motions_are_counted_before_they_are_made(folder, monkeypatch):
    """A tool of a tenth of a millimetre divides every motion into hundreds of parts."""
    state(folder, STOCK + TOOLS.replace("diameter: 16", "diameter: 0.1"))
    limited(monkeypatch, 600_000)
    finding = refused(
        folder, "STK031", "GB of memory for", "parts of motions", "0.0006 GB are free", "diameter"
    )
    assert finding["file"].endswith("part.ngc")


def test_the_main_job_writes_nothing(folder, monkeypatch):
    limited(monkeypatch, 10_000)
    before = sorted(folder.iterdir())
    result = CliRunner().invoke(main, ["program", str(folder / "part.ngc"), "--force=", "--json", "-"])
    assert result.exit_code == 1
    assert [one["code"] for one in json.loads(result.stdout)["findings"]] == ["STK031"]
    assert sorted(folder.iterdir()) == before


def test_lists_of_the_cells_are_counted_before_they_are_made(folder, monkeypatch):
    """The blank is divided finely for a ball of 1 mm: its motions fit, their lists do not."""
    state(folder, STOCK + TOOLS.replace("16", "1").replace("spindle: 12000", "spindle: 60000"))
    limited(monkeypatch, 5_000_000)
    finding = refused(folder, "STK031", "entries of their lists")
    entries = int(finding["message"].split(" entries")[0].split()[-1].replace(",", ""))
    assert entries > 10_000


def test_where_the_system_does_not_say_nothing_is_refused(folder, monkeypatch):
    limited(monkeypatch, None)
    memory_need.check_memory(10**12)


@pytest.mark.parametrize("five", [False, True])
def test_the_estimate_is_that_of_a_run(five):
    """Not below what a run takes at its peak, and at most twice as much."""
    count = 4000 if five else 20_000
    path, cutter = zigzag(count, five), BALL if five else FLAT
    blank = block([0, 0, -60], [200, 100, 0])
    run(zigzag(50, five), blank, cutter)  # compiles
    sweeps, _ = sweeps_of(path, blank, cutter)
    tracemalloc.start()
    run(path, blank, cutter)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    stock, _ = build_stock(blank, sweeps.rows, np.array([one.numbers for one in sweeps.cutters]))
    need = len(sweeps.rows) * memory_need.OF_A_SWEEP + len(stock.near) * memory_need.OF_AN_ENTRY
    need += (len(stock.first) - 1) * memory_need.OF_A_CELL + stock.planes.shape[1] * memory_need.OF_A_PLANE
    print(f"{count} motions: estimate {need / 1e6:.1f} MB, peak {peak / 1e6:.1f} MB")
    assert peak < need < 2 * peak
