"""Runs the trials of ``real_worlds``: python -m tests.blind.real_command [--rows a,b] [--runs N] [--append FILE]"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from collections import Counter, defaultdict
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryDirectory

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parent.parent))

import numpy as np
from scipy.stats import binomtest

from blind import measured
from blind.arm import model_of
from blind.command import Diagnosing
from blind.design import poses
from blind.other_trials import arms, unknown
from blind.real_worlds import TRIALS, Trial
from blind.stated_scatter import sigma
from blind.worker import ROOMS
from postproc.identification.campaign import Campaign
from postproc.identification.registration import registered

FRESH = 20
"""Poses that were not measured."""

LITTLE = 0.5
"""Standard deviations of a coordinate: where less shows at the fresh poses, there is nothing to predict."""

WORST = 3
"""Cases that are printed."""

NEW_OVER_OLD = "fresh poses, RMS new over old"

LARGE = 1e-3
"""[m, rad] from which on a shift or zero that is not there would send a mechanic to work."""


def loss_of(answer: dict, accept, needed) -> int:
    """How little an answer is worth against the truth: 0 it names what is there, or rightly nothing; 1 that stands in a
    set of explanations; 2 it does not occur; 3 something is named, or is all that a set has, that is not there.  That
    more remains than could be named is a statement of its own, and is no loss."""
    names, sets = pairs(answer), sets_of(answer)
    false = [one for one in sets if not any(fits(pair, accept) for pair in one)]
    if false or any(not fits(name, accept) for name in names):
        return 3
    if not needed:
        return 0 if answer["verdict"] == "nothing_missing" or (names and not sets) else 2
    if any(fits(name, needed) for name in names):
        return 0
    return 1 if any(fits(pair, needed) for one in sets for pair in one) else 2


ALL = {**TRIALS, "sigma": sigma, "arms": arms, "unknown": unknown}
"""Row -> what makes its trials."""


def fresh_gap(trial: Trial, model) -> float:
    """[m] root mean square at poses that were not measured, tracker and targets found anew."""
    if trial.fresh:
        return trial.fresh(model)
    rng = np.random.default_rng([trial.number, 9])
    old = trial.design
    q = poses(model_of(trial.files["robot.yaml"]), FRESH, old.tool, rng)
    design = replace_design(old, q, rng)
    seen = Campaign(measured.readings(design, measured.observed(trial.scene, design), trial.sigma))
    at = seen.predicted(model)
    given = registered(seen, at, np.ones(len(seen), bool))
    return float(np.sqrt(3 * np.mean(seen.residual(at, given)[:, :3] ** 2)))


def replace_design(old, q, rng):
    from dataclasses import replace

    rows = rng.integers(0, len(old.wrench), len(q))
    senses = None if old.senses is None else rng.choice([-1.0, 1.0], q.shape)
    return replace(old, q=q, wrench=old.wrench[rows], time=None, temperature=None, senses=senses, told=True)


def pairs(answer: dict) -> set[tuple[str, str]]:
    return {(one["effect"], joint) for one in answer.get("named", ()) for joint in one["joints"] or [""]}


def sets_of(answer: dict) -> list[set[tuple[str, str]]]:
    return [{(c["effect"], c["joint"] or "") for c in one} for one in answer.get("alternatives", ())]


def fits(pair: tuple[str, str], accepted) -> bool:
    return pair in accepted or (pair[0], "*") in accepted


def judge(trial: Trial, answer: dict, new: Path) -> dict[str, bool | float]:
    """What is counted of a run."""
    word = answer["verdict"]
    names = pairs(answer)
    sets = sets_of(answer)
    held: dict[str, bool | float] = {"refused": word in ("refused", "crashed"), "crashed": word == "crashed"}
    held["a name that is wrong"] = any(not fits(name, trial.accept) for name in names)
    if sets:
        everything = names.union(*sets)
        held["truth in the set"] = any(fits(pair, trial.needed or trial.accept) for pair in everything)
    held["a set without truth"] = any(not any(fits(pair, trial.accept) for pair in one) for one in sets)
    if trial.needed:
        everything = names.union(*sets)
        held["named or in the set"] = any(
            fits(pair, trial.needed) or (pair[1] == "all joints" and (pair[0], "*") in
            {(n, "*") for n, _ in trial.needed}) for pair in everything
        )  # fmt: skip
    else:
        held["nothing named"] = not names and not held["refused"]
    if trial.row == "twin":
        held["one of two named"] = bool(names & set(trial.accept))
    held["file written"] = new.exists()
    if new.exists() and trial.row != "sigma":
        from postproc.model import StiffnessModel
        from postproc.robot.description import load_robot, robot_of

        found = StiffnessModel.from_robot(load_robot(new))
        values = [
            (f"{t.effect.name}.{p}", v)
            for t in found.terms
            if t.effect.name in ("link_geometry", "joint_offset")
            for p, v in t.values.items()
        ]
        if trial.row in ("length", "twist", "scale"):
            held["shift or zero above 1 mm, 1 mrad"] = any(abs(v) > LARGE for _, v in values)
        before = fresh_gap(
            trial, StiffnessModel.from_robot(robot_of(trial.files["robot.yaml"], Path("r.yaml")))
        )
        after = fresh_gap(trial, found)
        held["gap closed"] = 1.0 - after / before if before > 1e-9 else 1.0
        solved = (
            held.get("named or in the set", word == "nothing_missing") and not held["a name that is wrong"]
        )
        if solved and before > LITTLE * trial.sigma:
            held[NEW_OVER_OLD] = after / before
        stated = answer.get("largest_disagreement_mm")
        if trial.row == "twin" and stated is not None:
            held["stated disagreement is true"] = after * 1e3 <= stated + 3 * trial.sigma * 1e3
    return held


def run(trial: Trial, diagnosing: Diagnosing) -> tuple[dict[str, bool | float], dict]:
    with TemporaryDirectory(prefix=f"{ROOMS}data-") as data:
        folder = Path(data)
        for name, content in trial.files.items():
            (folder / name).write_bytes(content)
        answer = diagnosing(folder, trial.data, "robot.yaml", "new")
        held = judge(trial, answer, folder / "new.yaml")
        if trial.also:
            for name, content in trial.also.items():
                (folder / name).write_bytes(content)
            other = diagnosing(folder, trial.data, "robot.yaml", "other")
            losses = [loss_of(one, trial.accept, trial.needed) for one in (answer, other)]
            held["worse with the scatter stated"] = losses[0] > losses[1]
            held["better with the scatter stated"] = losses[0] < losses[1]
            held["wrong name, scatter not stated"] = any(
                not fits(name, trial.accept) for name in pairs(other)
            )
            answer["other"] = other["verdict"]
    return held, answer


def share(values: Sequence[bool]) -> str:
    k, n = sum(values), len(values)
    low, high = binomtest(k, n).proportion_ci(method="wilson")
    return f"{k:4d} of {n:4d}  {100 * k / n:5.1f} %  ({100 * low:.1f} .. {100 * high:.1f})"


def record_of(trial: Trial, seed: int, diagnosing: Diagnosing) -> dict:
    """What one line of the file of runs holds."""
    held, answer = run(trial, diagnosing)
    told = (
        answer["told"].strip()[-300:].replace("\n", " ")
        if answer["verdict"] in ("refused", "crashed")
        else ""
    )
    return {
        "row": trial.row,
        "number": trial.number,
        "seed": seed,
        "words": trial.words,
        "verdict": answer["verdict"],
        "named": [" ".join([one["effect"], *one["joints"]]) for one in answer.get("named", ())],
        "sets": [[c["label"] for c in one] for one in answer.get("alternatives", ())],
        "held": {key: bool(v) if isinstance(v, bool | np.bool_) else float(v) for key, v in held.items()},
        "seconds": answer["seconds"],
        "told": told,
    }


def line_of(record: dict) -> str:
    """A run in one line."""
    sets = " | ".join(" = ".join(one) for one in record["sets"])
    flags = ", ".join(
        f"{k} {v:.3f}" if isinstance(v, float) else k for k, v in record["held"].items() if v is not False
    )
    return (
        f"{record['row']} {record['number']}: {record['words']}: {record['verdict']}"
        f" [{'; '.join(record['named'])}] {sets} <{flags}> {record['told']}"
    )


def table_of(records: Sequence[dict]) -> list[str]:
    """Verdicts, shares with intervals and medians of each row."""
    lines = []
    for row in dict.fromkeys(record["row"] for record in records):
        own = [record for record in records if record["row"] == row]
        words = Counter(record["verdict"] for record in own)
        lines.append(f"{row}: " + ", ".join(f"{n} {word}" for word, n in sorted(words.items())))
        counts: dict[str, list] = defaultdict(list)
        for record in own:
            for key, value in record["held"].items():
                counts[key].append(value)
        for key, values in counts.items():
            if key == NEW_OVER_OLD:
                told = f"{np.median(values):.3f} in the median, {max(values):.3f} at worst, {len(values)}"
            elif any(isinstance(v, float) for v in values):
                middle, mean = 100 * np.median(values), 100 * np.mean(values)
                told = f"{middle:.1f} % in the median, {mean:.1f} in the mean of {len(values)}"
            else:
                told = share(values)
            lines.append(f"  {key:36} {told}")
        seconds = [record["seconds"] for record in own]
        lines.append(f"  seconds {np.median(seconds):.1f} in the median, {max(seconds):.1f} at most")
    return [*lines, of_all(records)]


def main(argv: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.blind.real_command", description=__doc__)
    parser.add_argument("--rows", default=",".join(ALL), help="[all]")
    parser.add_argument("--runs", type=int, default=300, help="of each row [300]")
    parser.add_argument("--first", type=int, default=0, help="number of the first run [0]")
    parser.add_argument("--seed", type=int, default=1, help="[1]")
    parser.add_argument("--minutes", type=float, default=np.inf, help="start no run after so many [no limit]")
    parser.add_argument(
        "--append",
        type=Path,
        help="JSON lines, one a run: what is there counts, whatever its seed, and is not run again",
    )
    parser.add_argument("--verbose", action="store_true", help="a line for every run")
    given = parser.parse_args(argv)
    rows, begun = given.rows.split(","), time.monotonic()
    records = [one for one in kept(given.append) if one["row"] in rows]
    known = {(one["row"], one["number"], one["seed"]) for one in records}
    # all rows grow alike, whenever it is stopped
    wanted = [(row, n) for n in range(given.first, given.first + given.runs) for row in rows]
    diagnosing = Diagnosing()
    for row, number in wanted:
        if (row, number, given.seed) in known:
            continue
        if time.monotonic() - begun > 60.0 * given.minutes:
            break
        records.append(record_of(ALL[row](number, given.seed), given.seed, diagnosing))
        if given.append:
            with given.append.open("a", encoding="utf-8") as file:
                file.write(json.dumps(records[-1]) + "\n")
        if given.verbose:
            print(line_of(records[-1]), flush=True)
    diagnosing.close()
    print("\n".join(table_of(sorted(records, key=lambda one: rows.index(one["row"])))))
    return 0


def kept(path: Path | None) -> list[dict]:
    """What earlier calls came to; a last line that was cut off does not count."""
    if path is None or not path.exists():
        return []
    records = []
    for line in path.read_text(encoding="utf-8").splitlines():
        with suppress(json.JSONDecodeError):
            records.append(json.loads(line))
    return records


def of_all(records: Sequence[dict]) -> str:
    """What the robot files that were written leave of the gap at poses that were not measured."""
    ratios = [
        (one["held"][NEW_OVER_OLD], f"{one['row']} {one['number']}")
        for one in records
        if NEW_OVER_OLD in one["held"]
    ]
    if not ratios:
        return f"{NEW_OVER_OLD}: no case"
    values = [ratio for ratio, _ in ratios]
    worst = ", ".join(f"{name} {ratio:.2f}" for ratio, name in sorted(ratios, reverse=True)[:WORST])
    return (
        f"{NEW_OVER_OLD}, {len(values)} cases that were solved: {np.median(values):.3f} in the median,"
        f" {sum(ratio <= 0.5 for ratio in values)} at most 0.5; worst {worst}"
    )


if __name__ == "__main__":
    raise SystemExit(main())
