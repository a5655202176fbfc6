"""Runs cases, keeps what they came to, prints it."""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, ProcessPoolExecutor, wait
from contextlib import suppress
from itertools import islice
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from postproc.measurements.write_csv import measurements_csv
from postproc.model import StiffnessModel
from postproc.robot.description import load_robot

from . import measured, table
from .cases import ROWS, Case, cases, made
from .verdicts import judged, outcome_of
from .worker import ROOMS


class Diagnosing:
    """A process that runs ``compensate diagnose``, time and again."""

    def __init__(self) -> None:
        self.process = subprocess.Popen(
            [sys.executable, "-W", "ignore", str(Path(__file__).with_name("worker.py"))],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def __call__(self, folder: Path, data: Sequence[str], robot: str, new: str) -> dict:
        """What it says, in ``folder``, of the readings ``data`` and a ``robot`` file, ``new``.yaml beside it."""
        words = ["diagnose", *data, "--robot", robot, "-o", f"{new}.yaml", "--json", f"{new}.json", "--quiet"]
        assert self.process.stdin
        assert self.process.stdout
        self.process.stdin.write(json.dumps([str(folder), words]) + "\n")
        self.process.stdin.flush()
        line = self.process.stdout.readline()
        if not line:
            raise RuntimeError(f"the diagnosing process ended with {self.process.wait()}")
        ended = json.loads(line)
        told = folder / f"{new}.json"
        answer = json.loads(told.read_text(encoding="utf-8")) if told.exists() else {}
        answer.setdefault("verdict", "crashed" if ended["exit"] == -1 else "refused")
        return {**answer, "seconds": ended["seconds"], "told": ended["told"]}

    def close(self) -> None:
        assert self.process.stdin
        assert self.process.stdout
        self.process.stdin.close()
        self.process.wait()
        self.process.stdout.close()


FURTHER = 150
"""So many runs of a row are followed further."""

SETTLED = ("decoy", "compensator_narrow")
"""Rows of which the proposed poses are measured too, beside the single ones."""

PREDICTED = ("single", "decoy", "pair", "triple")
"""Rows of which fresh poses are predicted with the new robot file."""

_own: list[Diagnosing] = []
"""The process that diagnoses for this one."""


def record_of(case: Case, diagnosing: Diagnosing, more: bool = True) -> dict:
    """Makes a case, lets it be diagnosed, and judges that.

    ``more``, of single effects: also the gap that is closed, what is said of the same readings with the new robot file,
    and, as well of what can not be told apart, what is said when the poses are measured that were proposed.
    """
    run, more = made(case), more and case.number < FURTHER
    alone = more and case.row == "single"
    with (
        TemporaryDirectory(prefix=f"{ROOMS}data-") as data,
        TemporaryDirectory(prefix=f"{ROOMS}truth-") as truth,
    ):
        folder = Path(data)
        (folder / "data.csv").write_bytes(measurements_csv(run.readings))
        (folder / "robot.yaml").write_bytes(run.robot)
        Path(truth, "truth.json").write_text(
            json.dumps([[h.effect, h.joint, h.true(s)] for h, s in run.hidden])
        )
        answer = diagnosing(folder, ["data.csv"], "robot.yaml", "new")
        new = folder / "new.yaml"
        found = StiffnessModel.from_robot(load_robot(new)) if new.exists() else None
        record = judged(run, answer, found, alone, more and case.row in PREDICTED)
        if alone and found and answer["verdict"] == "named":
            record["again"] = diagnosing(folder, ["data.csv"], "new.yaml", "again")["verdict"]
        plan = folder / "new.next_poses.csv"
        if (alone or (more and case.row in SETTLED)) and plan.exists():
            rng = np.random.default_rng([case.number, case.seed, 4])
            text = measured.filled(run.scene, run.design, plan.read_text(encoding="utf-8"), rng)
            (folder / "next.csv").write_text(text, encoding="utf-8")
            later = diagnosing(folder, ["data.csv", "next.csv"], "robot.yaml", "later")
            record["later"] = {key: later.get(key) for key in ("verdict", "named", "alternatives", "told")}
            record["later"]["outcome"] = outcome_of(run, later, [[] for _ in run.hidden])
    return record


def _record_of(case: Case) -> dict:
    if not _own:
        _own.append(Diagnosing())
    return record_of(case, _own[0])


def main(argv: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.blind", description=__doc__)
    parser.add_argument("--runs", type=int, default=300, help="of each row [300]")
    parser.add_argument("--rows", default=",".join(ROWS), help=f"some of {', '.join(ROWS)} [all]")
    parser.add_argument("--first", type=int, default=0, help="number of the first run [0]")
    parser.add_argument("--seed", type=int, default=1, help="[1]")
    parser.add_argument("--workers", type=int, default=2, help="processes [2]")
    parser.add_argument(
        "--out",
        type=Path,
        help="JSON lines, one a run: appended to; what is there counts, whatever its seed, and is not run again",
    )
    parser.add_argument("--minutes", type=float, default=np.inf, help="start no run after so many [no limit]")
    parser.add_argument("--picture", type=Path, help="the confusion as a PNG")
    parser.add_argument("--wrong", type=int, default=40, help="runs that were not right to list [40]")
    parser.add_argument("--only", default="", help="cases with this effect only")
    given = parser.parse_args(argv)
    rows, count = given.rows.split(","), given.first + given.runs
    wanted = [case for row in rows for case in cases(row, count, given.seed)[given.first :]]
    # all rows grow alike, whenever it is stopped
    wanted = sorted((c for c in wanted if given.only in ("", *c.effects)), key=lambda c: c.number)
    records = [
        record
        for record in kept_records(given.out)
        if record["row"] in rows and given.only in ("", *record["effects"])
    ]
    known = {record["key"] for record in records}
    left = [case for case in wanted if case.key not in known]
    begun, done = time.monotonic(), 0
    for record in _run(left, given.workers, begun + 60.0 * given.minutes):
        records.append(record)
        done += 1
        if given.out:
            with given.out.open("a", encoding="utf-8") as file:
                file.write(json.dumps(record) + "\n")
        if sys.stderr.isatty():
            print(f"\r{len(records)} of {len(wanted)}", end="", file=sys.stderr)
    if not records:
        return 0
    spent = time.monotonic() - begun
    seeds = ", ".join(sorted({record["key"].split("/")[2] for record in records}))
    print(f"seed {seeds}, {len(records)} runs; {done} of them now, {spent / max(1, done):.1f} s each\n")
    print("\n".join(table.matrix(records)) + "\n")
    print("\n".join(sorted(table.of_intervals(records))) + "\n")
    print("\n".join(table.per_effect(records)) + "\n")
    print("\n".join(table.confusion_text(records)) + "\n")
    print("\n".join(table.wrong_cases(records, given.wrong)))
    if given.picture:
        table.picture(records, given.picture)
    return 0


def _run(left: Sequence[Case], workers: int, until: float) -> Iterator[dict]:
    """The records of cases, in the order in which they are done; none is begun after ``until`` [s]."""
    if workers <= 1:
        for case in left:
            if time.monotonic() > until:
                return
            yield _record_of(case)
        return
    with ProcessPoolExecutor(workers) as pool:
        coming = iter(left)
        running = {pool.submit(_record_of, case) for case in islice(coming, workers)}
        while running:
            done, running = wait(running, return_when=FIRST_COMPLETED)
            for one in done:
                if time.monotonic() < until:
                    running |= {pool.submit(_record_of, case) for case in islice(coming, 1)}
                yield one.result()


def kept_records(path: Path | None) -> list[dict]:
    """What earlier calls came to; a last line that was cut off does not count."""
    records: dict[str, dict] = {}
    if path is not None and path.exists():
        for line in path.read_text(encoding="utf-8").splitlines():
            with suppress(json.JSONDecodeError):
                record = json.loads(line)
                records[record["key"]] = record
    return list(records.values())
