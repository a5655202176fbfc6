"""The rows of the benchmark, and one draw of each."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import zlib
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from postproc.learning.causes import CausePrediction, PriorKnowledge, force_causes, robot_causes, tool_causes
from postproc.learning.touched_points import touched_points

from .cutting import Surface, aligned_rms, cut, probe, surface_of, write_csv
from .mirrors import interpolated, smoothed
from .shop import AWAY, surface_points, write_shop
from .truth import HIDDEN, Truth, draw_forces, draw_truth, filed_compliances
from .visible import visible

POINTS = 140
"""Points of the surface at which parts are compared; the measured ones are some of them, or more are drawn."""

NOISE = 1e-5
OPTIONS: dict[str, dict[str, Any]] = {
    "same20": {"count": 20},
    "same50": {"count": 50},
    "same100": {"count": 100, "place": True},
    "planned30": {"count": 30, "planned": True},
    "same30": {"count": 30},
    "same300": {"count": 300},
    "noise03": {"count": 100, "noise": 3e-5},
    "noise06": {"count": 100, "noise": 6e-5},
    "outliers": {"count": 100, "outliers": 0.03},
    "smooth": {"count": 100, "smooth": 3e-5},
    "other": {"count": 100, "other": True},
    "third": {"count": 60, "parts": 4},
    "half": {"count": 60, "gain": 0.5},
    **{name: {"count": 120, "hidden": (name,)} for name in HIDDEN},
    "two": {"count": 120, "hidden": 2},
    "worn_hysteresis": {"count": 120, "hidden": ("hysteresis",), "worn": 4.0},
    "worn_backlash": {"count": 120, "hidden": ("backlash",), "worn": 4.0},
}


RARE = (
    "same30", "same300", "noise03", "noise06", "smooth", "other", "half", "base", "radial", "two",
)  # fmt: skip
"""Rows that are drawn every third time only."""


class Learner:
    """The other process."""

    def __init__(self) -> None:
        self.process = subprocess.Popen(
            [sys.executable, "-m", "tests.blind_parts.worker"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def ask(self, folder: Path, measured: Sequence[str], output: str, **options: Any) -> dict[str, Any]:
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        task = {"folder": str(folder), "measured": list(measured), "output": output, "options": options}
        self.process.stdin.write(json.dumps(task) + "\n")
        self.process.stdin.flush()
        line = self.process.stdout.readline()
        if not line:
            raise RuntimeError("the process that learns has ended")
        return json.loads(line)

    def close(self) -> None:
        assert self.process.stdin is not None
        self.process.stdin.close()
        self.process.wait(30)


def prepare_shops(folder: Path) -> tuple[Path, Path]:
    """Two shops with the same part at two places, each with its program compensated by the shipped robot file, and in
    the first one another part of other operations."""
    from postproc.workflows.preparation import Request
    from postproc.workflows.program import compensate

    places = []
    for name, base in (("home", None), ("away", AWAY)):
        program = write_shop(folder / name, **({} if base is None else {"base": base}))
        compensate(Request(program, force=""))
        places.append(program.parent)
    write_shop(places[0] / "other", pockets="DE")
    return places[0], places[1]


def draw(row: str, seed: int, shops: tuple[Path, Path], learner: Learner) -> dict[str, Any]:
    """One part of one truth, what is learnt of it, and the part after it; every row has truths of its own."""
    options = OPTIONS[row]
    rng = np.random.default_rng([seed, zlib.crc32(row.encode())])
    noise, count = options.get("noise", NOISE), options["count"]
    total = max(POINTS, count)
    point, normal, feature = surface_points(total, rng)
    home = surface_of(shops[0], point, normal, feature)
    operations = [name for name in home.program.operations.names if name != "tool 1"]
    hidden = options.get("hidden", ())
    if hidden == 2:
        hidden = tuple(rng.choice(HIDDEN, 2, replace=False).tolist())
    truth = draw_truth(rng, operations, hidden, options.get("smooth", 0.0), options.get("worn", 1.0))
    plant = truth.plant()
    shop = home.folder
    first = shop / "compensated" / "part.src"
    programs: list[Path] = [first]
    chosen = rng.choice(total, count, replace=False)
    if options.get("planned"):
        chosen = _planned(home, count)
    before = cut(home, truth, plant, first, rng)
    answer: dict[str, Any] = {
        "row": row,
        "seed": seed,
        "before": aligned_rms(home, before),
        "hidden": list(hidden),
    }
    deviation = probe(home, before, chosen, noise, rng)
    found = deviation.copy()
    if "outliers" in options:
        bad = rng.choice(count, max(1, round(options["outliers"] * count)), replace=False)
        deviation[bad] += 0.3e-3 * rng.choice([-1.0, 1.0], len(bad))
    name = f"{row}.csv"
    write_csv(shop / name, home, chosen, deviation, first, noise, found=found)
    out = f"learned_{row}"
    shutil.rmtree(shop / out, ignore_errors=True)
    asked = {"gain": options.get("gain", 1.0), "new_history": True}
    told = learner.ask(shop, [name], out, **asked)
    answer |= told
    if hidden:
        seen = visible(home, truth, programs[0], shop / name, chosen)
        answer |= {"labels": list(truth.names()), "visible": seen.gain, "ahead": seen.ahead}
    if told["refused"]:
        return answer
    answer["covered"] = _covered(told, truth)
    measured = [name]
    after, parts = before, []
    for number in range(2, options.get("parts", 2) + 1):
        following = shop / out / "part.src" if told["written"] else programs[-1]
        kept = shop / f"{row}_part{number}.src"
        programs.append(kept)
        shutil.copy(following, kept)
        after = cut(home, truth, plant, kept, rng)
        parts.append(aligned_rms(home, after))
        if number < options.get("parts", 2):
            name = f"{row}_{number}.csv"
            write_csv(shop / name, home, chosen, probe(home, after, chosen, noise, rng), kept, noise)
            measured.append(name)
            more = learner.ask(shop, measured, out, **asked)
            if more["refused"]:
                answer["later_refused"] = more["refused"]
                break
            told = more
    answer["after"], answer["parts"] = parts[-1], parts
    again = cut(home, truth, plant, programs[0], rng)
    answer |= _others(home, again, chosen, deviation, noise, told)
    if options.get("other"):
        answer |= _other_operations(shops[0], rng, truth, plant, out)
    if options.get("place"):
        answer |= _elsewhere(shops, (point, normal, feature), truth, plant, rng, told, out, learner)
    return answer


def _planned(home: Surface, count: int) -> np.ndarray:
    """(count,) the points that ``compensate learn --plan`` chooses from all."""
    from postproc.workflows.learn import LearnRequest
    from postproc.workflows.learn_plan import plan

    offered, measure = home.folder / "points.csv", home.folder / "measure.csv"
    rows = np.column_stack([home.point, home.normal])
    text = [",".join(f"{one:.7f}" for one in row) for row in rows]
    offered.write_text("\n".join(["X,Y,Z,NX,NY,NZ", *text]) + "\n")
    plan(LearnRequest(home.request, (offered,), csv=measure), count)
    places = np.array([line.split(",")[:3] for line in measure.read_text().splitlines()[7:]], float)
    return np.argmin(((places[:, None] - home.point[None]) ** 2).sum(axis=2), axis=1)


def _covered(told: dict[str, Any], truth: Truth) -> dict[str, list[int]]:
    """Kind of value -> whether the true ones lie in their intervals."""
    compliances = {
        f"joint_compliance.c{i}": float(np.log(c / filed))
        for i, (c, filed) in enumerate(zip(truth.compliance, filed_compliances(), strict=True), 1)
    }
    turns: dict[str, float] = {}
    for name, (lift, swing) in truth.turn.items():
        # the plant swings the other way round
        turns |= {f"lift of the force of {name}": lift, f"swing of the force of {name}": -swing}
    kinds = {
        "compliances of joints": (told["causes"], compliances),
        "balancer": (told["causes"], {"gravity_compensator.K_c": float(np.log(truth.spring))}),
        "tool": (told["causes"], {"radius of tool 1": truth.radius, "length of tool 1": truth.length}),
        "forces of operations": (told["forces"], {n: float(np.log(f)) for n, f in truth.factor.items()}),
        "directions of forces": (told["causes"], turns),
        "named effects": (told["sizes"], truth.names()),
    }
    return {
        kind: [
            int(abs(found[name][0] - value) <= 1.96 * found[name][1])
            for name, value in true.items()
            if name in found and np.isfinite(value)
        ]
        for kind, (found, true) in kinds.items()
    }


def _others(
    home: Surface, again: np.ndarray, chosen: np.ndarray, deviation: np.ndarray, noise: float,
    told: dict[str, Any],
) -> dict[str, float]:  # fmt: skip
    """RMS [m] of the next part with the mirror of the deviation and with the causes alone: what they would correct is
    taken off the errors ``again`` (K,) of another part that the same program cut."""
    place, normal = home.point[chosen], home.normal[chosen]
    return {
        "mirror": aligned_rms(home, again - interpolated(place, normal, deviation, home.point, home.normal)),
        "mirror_gp": aligned_rms(
            home, again - smoothed(place, normal, deviation, home.point, home.normal, noise)
        ),
        "alone": aligned_rms(home, again - _explained(home, told["alone"])),
    }


def _explained(home: Surface, alone: dict[str, float]) -> np.ndarray:
    """(K,) [m] what causes explain at all points of the surface."""
    prediction = predicted(home)
    return prediction.errors(np.array([alone.get(cause.name, 0.0) for cause in prediction.causes]))


def predicted(surface: Surface) -> CausePrediction:
    """Of all points of a surface, as the program that was compensated by the shipped robot file cuts them."""
    from .cutting import commands

    job = surface.program
    task = job.ready.task
    base = task.base[job.motions.rows[:1]]
    rotation = base.rotation[0]
    touched = (base.position + 1e-3 * surface.point @ rotation.T, surface.normal @ rotation.T)
    sent = commands(surface, surface.folder / "compensated" / "part.src")
    states = touched_points(task, job.spindle, (surface.row, surface.share), touched, sent)
    causes = robot_causes(job.ready.model)
    causes += force_causes(job.operations.which[surface.row], job.operations.names, PriorKnowledge())
    causes += tool_causes(states, job.tool[surface.row], job.ball, False)
    return CausePrediction(states, job.ready.model, tuple(causes))


def _elsewhere(
    shops: tuple[Path, Path], points: Any, truth: Any, plant: Any, rng: np.random.Generator, told: dict[str, Any],
    out: str, learner: Learner,
) -> dict[str, float]:  # fmt: skip
    """RMS [m] at another place: with the shipped robot file, and with what was learnt at home."""
    from postproc.workflows.preparation import Request
    from postproc.workflows.program import compensate

    away = surface_of(shops[1], *points)
    before = aligned_rms(away, cut(away, truth, plant, shops[1] / "compensated" / "part.src", rng))
    learned = list((shops[0] / out).glob("*_learned.yaml"))
    cell = shops[1] / "cell_learned.yaml"
    cell.write_text((shops[1] / "cell.yaml").read_text() + _lines_for_the_cell(shops[0] / out))
    request = Request(
        shops[1] / "part.src", force="", cell=cell, robot=str(learned[0]) if learned else None,
        output=shops[1] / "transferred" / "part.src",
    )  # fmt: skip
    compensate(request)
    after = aligned_rms(away, cut(away, truth, plant, shops[1] / "transferred" / "part.src", rng))
    return {"place_before": before, "place_after": after}


def _lines_for_the_cell(learned: Path) -> str:
    """Force factors and tool errors, where the part says something of a tool."""
    tool = learned / "part.tool_errors.yaml"
    return (learned / "part.force_factors.yaml").read_text() + (tool.read_text() if tool.is_file() else "")


def _other_operations(
    home: Path, rng: np.random.Generator, truth: Any, plant: Any, out: str
) -> dict[str, float]:
    """RMS [m] of another part, whose operations have forces of their own, with the shipped robot file and with what was
    learnt at home."""
    from postproc.workflows.preparation import Request
    from postproc.workflows.program import compensate

    folder = home / "other"
    other = surface_of(folder, *surface_points(POINTS, rng, "DE"))
    names = [name for name in other.program.operations.names if name != "tool 1"]
    truth = replace(truth, **draw_forces(rng, names))
    cell = folder / "cell_learned.yaml"
    cell.write_text((folder / "cell.yaml").read_text() + _lines_for_the_cell(home / out))
    learned = list((home / out).glob("*_learned.yaml"))
    sizes = {}
    for key, own, robot in (
        ("other_before", folder / "cell.yaml", None),
        ("other_after", cell, str(learned[0]) if learned else None),
    ):
        output = folder / key / "part.src"
        compensate(Request(folder / "part.src", force="", cell=own, robot=robot, output=output))
        sizes[key] = aligned_rms(other, cut(other, truth, plant, output, rng))
    return sizes
