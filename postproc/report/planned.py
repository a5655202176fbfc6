"""A plan of poses and loads, as tables and JSON; nothing is computed here."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from rich.console import Console
from rich.table import Table
from rich.text import Text

from postproc.base.arrays import Floats
from postproc.base.findings import Finding
from postproc.base.geometry import abc_from_rotation
from postproc.base.units import DEG, MM
from postproc.experiments.candidate_setups import CandidateSetups, Setups
from postproc.experiments.precision import Design, UnobservableParameter
from postproc.identification.unknowns import Unknown
from postproc.model import StiffnessModel
from postproc.report.formatting import fixed, shown_unit
from postproc.report.result import Columns, Result
from postproc.report.result_keys import complete_result
from postproc.report.terminal import short_names, show_findings

GOALS = {
    "minimax": "smallest worst ratio of an interval to the wanted one",
    "d": "smallest joint interval of all (D-optimal)",
    "test": "smallest error at the cuts of the program (test poses)",
    "discriminate": "largest difference between two effects, each refitted (T-optimal)",
}


@dataclass(frozen=True, repr=False)
class Planned(Result):
    """The result of ``compensate plan``.

    unknowns (P), ``wanted`` (P,) [SI] and where it is from.  setups: the poses of the plan in their order, of
    ``readings`` readings.  chosen: designs by number of poses; at_random: number of poses -> medians over random
    designs of the intervals (P,) [SI] and of their worst ratio; before (P,): as of ``Designs``; unobservable, excluded,
    weakly_observable: as unobservable, left_out, weak of ``Designs``.  rivals: two effects to be distinguished, and
    their ``separation`` by number of poses.  fixed: dimensions of hardware that are not fitted.
    """

    headline = ("robot", "poses", "readings", "exit")

    robot: str
    digest: str
    effects: tuple[str, ...]
    model: StiffnessModel
    unknowns: tuple[Unknown, ...]
    setups_offered: CandidateSetups
    seed: int
    criterion: str
    wanted: Floats
    wanted_source: str
    poses: int
    setups: Setups
    candidates: int
    chosen: dict[int, Design]
    at_random: dict[int, tuple[Floats, float]] = field(default_factory=dict)
    before: Floats | None = None
    unobservable: tuple[UnobservableParameter, ...] = ()
    excluded: tuple[UnobservableParameter, ...] = ()
    weakly_observable: tuple[UnobservableParameter, ...] = ()
    rivals: tuple[str, str] | None = None
    separation: dict[int, tuple[float, float]] = field(default_factory=dict)
    readings: int = 0
    fixed: tuple[str, ...] = ()
    findings: tuple[Finding, ...] = ()
    outputs: tuple[str, ...] = ()
    exit: int = 0

    @property
    def goal(self) -> str:
        """What the poses are for, in words."""
        if self.rivals is not None:
            return f"to distinguish {self.rivals[0]} from {self.rivals[1]}"
        return f"for {', '.join(self.effects)}, criterion {self.criterion}"

    @property
    def loads_in_words(self) -> str:
        """``each with 125 and 265 kg``"""
        loads = [f"{load:g}" for load in self.setups_offered.loads]
        if len(loads) == 1:
            return "each unloaded" if not self.setups_offered.loads[0] else f"each with {loads[0]} kg"
        some = "" if self.setups_offered.each_load else "one of "
        return f"each with {some}{', '.join(loads[:-1])} and {loads[-1]} kg"

    def table(self) -> Columns:
        """One row a pose, in their order: the axes in deg (mm for a linear one), and the loads hung there in kg."""
        joints = self.model.robot.joints
        units = [("mm", MM) if joint.kind == "prismatic" else ("deg", DEG) for joint in joints]
        axes = {
            f"{joint.name}_{name}": column / unit
            for joint, (name, unit), column in zip(joints, units, self.setups.q.T, strict=True)
        }
        loads = {f"load_{k + 1}_kg": column for k, column in enumerate(self.setups.load.T)}
        return {**axes, **loads}

    def as_json(self) -> dict[str, object]:
        """The machine-readable result; the keys are public.  Intervals in the unit that is with them."""
        offered = self.setups_offered
        random = {
            str(size): {**self._intervals(ci95), "worst_ratio": _number(worst)}
            for size, (ci95, worst) in self.at_random.items()
        }
        result = {
            "robot": self.robot,
            "robot_digest": self.digest,
            "effects": list(self.effects),
            "kind": "deflection" if offered.deflection else "absolute",
            "sigma_mm": round(offered.sigma / MM, 9),
            "loads_kg": offered.loads.tolist(),
            "each_load": offered.each_load,
            "criterion": self.criterion,
            "seed": self.seed,
            "candidates": self.candidates,
            "poses": self.poses,
            "readings": self.readings,
            "wanted": self._intervals(self.wanted),
            "before": None if self.before is None else self._intervals(self.before),
            "intervals": {str(size): self._intervals(one.ci95) for size, one in self.chosen.items()},
            "worst_ratio": {str(size): _number(one.worst) for size, one in self.chosen.items()},
            "test_rms_mm": {str(size): _number(one.test / MM) for size, one in self.chosen.items()},
            "random_poses": random,
            "unobservable": [{"name": one.name, "why": one.why} for one in self.unobservable],
            "excluded": [{"name": one.name, "why": one.why} for one in self.excluded],
            "weakly_observable": [{"name": one.name, "why": one.why} for one in self.weakly_observable],
            "discriminate": None if self.rivals is None else list(self.rivals),
            "separation": {str(size): [_number(v) for v in two] for size, two in self.separation.items()},
            "fixed": list(self.fixed),
            "findings": [finding.as_json() for finding in self.findings],
            "outputs": list(self.outputs),
            "exit": self.exit,
        }
        return complete_result("plan", result)

    def _intervals(self, ci95: Floats) -> dict[str, object]:
        """effect -> parameter -> half width, None of what is excluded."""
        intervals: dict[str, dict[str, object]] = {}
        for unknown, width in zip(self.unknowns, ci95.tolist(), strict=True):
            effect, _, name = unknown.name.partition(".")
            intervals.setdefault(effect, {})[name] = {"ci95": _number(width), "unit": unknown.parameter.unit}
        return dict(intervals)


def discrimination_words(alternatives: Sequence[str], separation: Sequence[float]) -> str:
    """How far apart the pair is that is harder to distinguish."""
    one, two = alternatives if separation[0] <= separation[1] else (alternatives[1], alternatives[0])
    return f"{one} can be mistaken for {two}: they differ by {min(separation):.1f} standard deviations"


def show_plan(console: Console, planned: Planned, verbose: bool = False) -> None:
    """The plan, the predicted intervals, findings."""
    head = Table(box=None, show_header=False, pad_edge=False)
    head.add_column(style="bold")
    head.add_column()
    for key, value in plan_facts(planned):
        head.add_row(key, Text(value))
    console.print(head)
    console.print(interval_table(planned))
    if planned.rivals is not None:
        console.print(separation_table(planned))
    show_findings(console, planned.findings, verbose)
    for path in planned.outputs:
        console.print(Text(f"wrote {path}"), soft_wrap=True)


def plan_facts(planned: Planned) -> Iterator[tuple[str, str]]:
    """What was asked for, and of what was chosen."""
    offered = planned.setups_offered
    yield "robot", f"{planned.robot}, effects: {', '.join(planned.effects)}"
    yield "plan", f"{planned.poses} poses, {planned.loads_in_words}: {planned.readings} readings"
    place = _list(
        np.concatenate([offered.tool.position / MM, abc_from_rotation(offered.tool.rotation) / DEG])
    )
    measures = ", ".join(offered.targets) + (" (approximate positions)" if offered.rough else "") or "the TCP"
    kind = "deflection, loaded minus unloaded" if offered.deflection else "position in the tracker's frame"
    yield "measured", f"{kind}, of {measures}; {offered.sigma / MM:g} mm per coordinate (1 sigma)"
    yield "load", f"at the TCP, {place} mm deg on the flange"
    if planned.fixed:
        yield (
            "fixed",
            f"{', '.join(short_names(planned.fixed))}: dimensions of hardware without an interval, from the robot file",
        )
    yield "goal", GOALS[planned.criterion] + ("" if planned.rivals is None else f": {planned.goal}")
    if planned.rivals is None:
        yield "wanted", planned.wanted_source
    sight = ""
    if offered.tracker is not None:
        cone = f"{offered.cone / DEG:g} deg of a reflector's axis"
        sight = f", visible from {_list(offered.tracker / MM)} mm within {cone}"
    yield (
        "chosen from",
        f"{planned.candidates} random poses within axis limits and box{sight}, and poses near the best",
    )


def interval_table(planned: Planned) -> Table:
    """One row a parameter: the predicted half widths by number of poses."""
    table = Table(
        title="predicted 95 % intervals", title_justify="left", title_style="bold", box=None, pad_edge=False
    )
    table.add_column("")
    sizes = list(planned.chosen)
    heads = ["value", "wanted", *(["now"] if planned.before is not None else [])]
    heads += [f"{size} poses" for size in sizes]
    heads += [f"{planned.poses} random poses"] if planned.at_random else []
    for head in heads:
        table.add_column(head, justify="right")
    widths = [planned.wanted]
    widths += [planned.before] if planned.before is not None else []
    widths += [planned.chosen[size].ci95 for size in sizes]
    widths += [planned.at_random[planned.poses][0]] if planned.at_random else []
    for row, unknown in enumerate(planned.unknowns):
        value = planned.model.terms[unknown.term].values[unknown.parameter.name]
        table.add_row(
            unknown.name,
            _value(unknown, value, float(planned.wanted[row])),
            *(_width(unknown, value, float(width[row])) for width in widths),
        )
    blank = [""] * (len(heads) - len(sizes) - bool(planned.at_random))
    if planned.rivals is None:
        ratios = [_ratio(planned.chosen[size].worst) for size in sizes]
        ratios += [_ratio(planned.at_random[planned.poses][1])] if planned.at_random else []
        table.add_row(Text("worst / wanted", style="bold"), *blank, *ratios)
    if any(np.isfinite(planned.chosen[size].test) for size in sizes):
        errors = [f"{planned.chosen[size].test / MM:.2g} mm" for size in sizes]
        table.add_row(Text("error at the cuts, rms", style="bold"), *blank, *errors)
    return table


def separation_table(planned: Planned) -> Table:
    """How far the two effects are apart, by number of poses."""
    assert planned.rivals is not None
    title = "expected separation, standard deviations"
    table = Table(title=title, title_justify="left", title_style="bold", box=None, pad_edge=False)
    table.add_column("")
    for size in planned.separation:
        table.add_column(f"{size} poses", justify="right")
    one, two = planned.rivals
    for row, words in enumerate((f"{one} against {two}", f"{two} against {one}")):
        table.add_row(words, *(f"{pair[row]:.1f}" for pair in planned.separation.values()))
    return table


def _value(unknown: Unknown, value: float, wanted: float) -> str:
    word, size = shown_unit(unknown.parameter.unit)
    return f"{fixed(value / size, wanted / size)} {word}".rstrip()


def _width(unknown: Unknown, value: float, width: float) -> str:
    """In per cent of a value, in its unit where there is none; - of what is excluded."""
    if not np.isfinite(width):
        return "-"
    if value:
        return f"{100 * width / abs(value):.2g} %"
    word, size = shown_unit(unknown.parameter.unit)
    return f"{fixed(width / size, width / size)} {word}".rstrip()


def _ratio(ratio: float) -> str:
    return f"{ratio:.2f}" if np.isfinite(ratio) else "-"


def _number(value: float) -> float | None:
    return float(f"{value:.6g}") if np.isfinite(value) else None


def _list(values: Floats) -> str:
    return ", ".join(f"{round(float(value), 6) + 0.0:g}" for value in values)
