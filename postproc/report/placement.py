"""Where a part should lie: the ranked places, what each freedom brings, and what was checked."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from rich.console import Console
from rich.markup import escape
from rich.table import Table
from rich.text import Text

from postproc.base.arrays import Floats
from postproc.base.findings import Finding
from postproc.base.units import DEG, MM
from postproc.placement.room import FREEDOMS, UNITS, Room
from postproc.report.formatting import in_decimals, known, known_mm
from postproc.report.placement_spin import WORTH as SPIN_WORTH
from postproc.report.placement_spin import SpinFigures, spin_sentence
from postproc.report.report import Spread
from postproc.report.result import Columns, Result
from postproc.report.result_keys import complete_result
from postproc.report.terminal import show_findings, show_rows

NOTHING = Spread(math.nan, math.nan, math.nan)

KEYS = ("x_mm", "y_mm", "z_mm", "turn_deg", "tool_turn_deg", "track_mm")
"""Of the freedoms, in their order."""

WORTH = 0.95
"""A turned feed is worth reporting where it leaves less than this share of the error."""

SHOWN_TURNS = 9
"""Of the whole path and of operations, in the table."""

CHECKED = (
    "reach, limits, singularities and configuration of every motion are checked; collisions are NOT checked"
)


@dataclass(frozen=True)
class CheckedShapes:
    """What collisions were checked by: file of the URDF, links that move and that stand still, and pairs that touch
    before the program starts and were not checked."""

    file: str
    moving: tuple[str, ...]
    fixed: tuple[str, ...]
    ignored: tuple[tuple[str, str], ...] = ()

    def as_json(self) -> dict[str, object]:
        return {
            "file": self.file,
            "moving": list(self.moving),
            "fixed": list(self.fixed),
            "ignored": [list(pair) for pair in self.ignored],
        }


def checked_words(shapes: CheckedShapes | None) -> str:
    """The first line of the result: what was checked, and what was not."""
    if shapes is None:
        return CHECKED
    fixed = f" and with {', '.join(shapes.fixed)}" if shapes.fixed else ""
    return (
        "reach, limits, singularities and configuration of every motion are checked, and collisions of the arm with"
        f" itself{fixed} by the shapes of {shapes.file}; collisions with part and fixtures are NOT checked"
    )


@dataclass(frozen=True, eq=False)
class PlacedFigures:
    """One place: place (6,) in the order of ``FREEDOMS`` [m, rad]; score [m]: the objective by the linear model on all
    motions, averaged as asked; error, across: as the main job predicts them; uncertainty [m]: what remains after a
    correction, 95 %, ``lower_bound``: at least that; distances [deg] from the next axis limit and singularity with
    their lines; regret: by what share the best place for a turned force is better, in the worst sense; exact: the
    figures are those of the main job, else only score and regret are known."""

    place: Floats
    error: Spread = NOTHING
    across: Spread = NOTHING
    uncertainty: float = math.nan
    lower_bound: bool = False
    limit_deg: float = math.nan
    limit_line: int = 0
    singular_deg: float = math.nan
    singular_line: int = 0
    score: float = math.nan
    regret: float = math.nan
    exact: bool = True

    def figure(self, objective: str) -> float:
        """[m] the figure that an objective names, as the main job predicts it."""
        named = {
            "across": self.across.max,
            "max": self.error.max,
            "p95": self.error.p95,
            "uncertainty": self.uncertainty,
        }
        return named[objective]

    def coordinates(self) -> dict[str, float]:
        """The freedoms in mm and deg."""
        values = np.round(self.place / UNITS, 6) + 0.0
        return dict(zip(KEYS, values.tolist(), strict=True))

    def as_json(self) -> dict[str, object]:
        return {
            **self.coordinates(),
            "score_mm": known_mm(self.score),
            "error_mm": self.error.as_mm(),
            "across_feed_mm": self.across.as_mm(),
            "uncertainty_mm": known_mm(self.uncertainty),
            "limit_margin_deg": known(self.limit_deg, 3),
            "limit_margin_line": self.limit_line,
            "singularity_margin_deg": known(self.singular_deg, 3),
            "singularity_margin_line": self.singular_line,
            "regret": known(self.regret, 4),
            "exact": self.exact,
        }


@dataclass(frozen=True)
class SingleFreedom:
    """What one freedom brings alone: value [m, rad] of its best place and the objective there over that of the present;
    NaN where none of its places is feasible."""

    name: str
    value: float
    ratio: float


@dataclass(frozen=True)
class FeedTurn:
    """What turning the feed about the vertical would change: of the whole path (``first`` 0) or of an operation, in
    lines first to last of a program; before [m], angle [rad] of the best direction, after [m]: by the linear model of
    the search, where listed places have the figures of the main job."""

    program: str
    operation: str
    first: int
    last: int
    before: float
    angle: float
    after: float


@dataclass(frozen=True, eq=False)
class ScoreGrid:
    """x (X,), y (Y,) [m] and value (X, Y) [m]: the objective there, NaN where a motion is not feasible."""

    x: Floats
    y: Floats
    value: Floats


@dataclass(frozen=True, repr=False)
class Placement(Result):
    """The result of ``compensate place``.  base: number of the one that moves; looked: placements scored; searched,
    checked: places on the paths that the search compared by, and that all listed placements were checked on; margins
    [deg] from limits and singularities; direction [deg]: half width over which the force's direction was averaged;
    spin [m]: the least that the objective could become if the tool turned about its spindle along the path, NaN where
    that is not asked for; spun: what such a turn brings, None where that is not asked for.  Where only the tool may
    turn there are no places, and the best one is the present.  shapes: by which collisions were checked, None where
    they were not."""

    headline = ("cell", "base", "objective", "present.score_mm", "best.score_mm", "exit")

    programs: tuple[str, ...]
    robot: str
    digest: str
    cell: str
    base: int
    objective: str
    motions: int
    checked: int
    room: Room
    margins: tuple[float, float]
    direction: float
    present: PlacedFigures
    looked: int = 0
    searched: int = 0
    places: tuple[PlacedFigures, ...] = ()
    alone: tuple[SingleFreedom, ...] = ()
    feed: tuple[FeedTurn, ...] = ()
    spin: float = math.nan
    spun: SpinFigures | None = None
    grid: ScoreGrid | None = None
    shapes: CheckedShapes | None = None
    findings: tuple[Finding, ...] = ()
    outputs: tuple[str, ...] = ()
    exit: int = 0

    @property
    def best(self) -> PlacedFigures:
        return self.places[0] if self.places else self.present

    @property
    def reduction(self) -> float:
        """Share of the objective's figure that the best place takes away."""
        return 1.0 - self.best.figure(self.objective) / self.present.figure(self.objective)

    def as_json(self) -> dict[str, object]:
        """The machine-readable result; the keys are public."""
        stated = self.room.stated.tolist()
        result = {
            "programs": list(self.programs),
            "robot": self.robot,
            "robot_digest": self.digest,
            "cell": self.cell,
            "base": self.base,
            "objective": self.objective,
            "collisions_checked": self.shapes is not None,
            "collision_shapes": None if self.shapes is None else self.shapes.as_json(),
            "motions": self.motions,
            "placements": self.looked,
            "searched_places": self.searched,
            "checked_places": self.checked,
            "room": {
                KEYS[i]: [round(float(end[i] / UNITS[i]), 6) for end in (self.room.lower, self.room.upper)]
                for i in stated
            },
            "polygon_mm": None if self.room.polygon is None else np.round(self.room.polygon / MM, 6).tolist(),
            "limit_margin_deg": self.margins[0],
            "singularity_margin_deg": self.margins[1],
            "direction_deg": self.direction,
            "present": self.present.as_json(),
            "best": self.best.as_json(),
            "reduction": known(self.reduction, 5),
            "places": [one.as_json() for one in self.places],
            "alone": {
                one.name: {"value": known(one.value / _unit(one.name), 4), "ratio": known(one.ratio, 4)}
                for one in self.alone
            },
            "feed_turns": [
                {
                    "program": one.program,
                    "operation": one.operation,
                    "first_line": one.first,
                    "last_line": one.last,
                    "before_mm": known_mm(one.before),
                    "turn_deg": round(one.angle / DEG, 3),
                    "after_mm": known_mm(one.after),
                }
                for one in self.feed
            ],
            "spin_bound_mm": known_mm(self.spin),
            "spin": None if self.spun is None else self.spun.as_json(),
            "findings": [finding.as_json() for finding in self.findings],
            "outputs": list(self.outputs),
            "exit": self.exit,
        }
        return complete_result("place", result)

    def table(self) -> Columns:
        """One row a place, best first."""
        rows = [one.as_json() for one in self.places]
        columns = {key: np.array([row[key] for row in rows], float) for key in KEYS}
        columns["score_mm"] = np.array([one.score / MM for one in self.places])
        columns["error_max_mm"] = np.array([one.error.max / MM for one in self.places])
        columns["error_rms_mm"] = np.array([one.error.rms / MM for one in self.places])
        columns["across_feed_max_mm"] = np.array([one.across.max / MM for one in self.places])
        columns["uncertainty_mm"] = np.array([one.uncertainty / MM for one in self.places])
        columns["limit_margin_deg"] = np.array([one.limit_deg for one in self.places])
        columns["singularity_margin_deg"] = np.array([one.singular_deg for one in self.places])
        columns["regret"] = np.array([one.regret for one in self.places])
        return columns


def _unit(name: str) -> float:
    return float(UNITS[FREEDOMS.index(name)])


def show_placement(console: Console, done: Placement, verbose: bool = False) -> None:
    """What was checked, the ranked places, what each freedom brings alone, and findings."""
    console.print(Text(checked_words(done.shapes), style="bold"), soft_wrap=True)
    show_rows(console, facts(done))
    for table in tables(done):
        if table.row_count:
            console.print(table)
    show_findings(console, done.findings, verbose)
    for path in done.outputs:
        console.print(Text(f"wrote {path}"), soft_wrap=True)


def verdict(done: Placement) -> str:
    """One sentence: from where to where, and what it brings."""
    here, best = (one.figure(done.objective) / MM for one in (done.present, done.best))
    if not done.places:
        return f"{OBJECTIVE_WORDS[done.objective]} {here:.3f} mm at the present place"
    if math.isnan(here):
        return f"{OBJECTIVE_WORDS[done.objective]} {best:.3f} mm at the best place; the present one cannot be predicted"
    share = f"{done.reduction:.0%} less" if done.reduction > 0 else "no better"
    return f"{OBJECTIVE_WORDS[done.objective]} {here:.3f} mm at the present place, {best:.3f} mm at the best: {share}"


OBJECTIVE_WORDS = {
    "across": "largest error across the feed",
    "max": "largest error",
    "p95": "95 % of the errors are below",
    "uncertainty": "uncertainty after compensation",
}


def facts(done: Placement) -> Iterator[tuple[str, str]]:
    """Keys and what belongs to them."""
    yield "programs", escape(", ".join(done.programs)) + f", {done.motions} motions"
    yield "robot", escape(done.robot)
    yield "part", escape(f"base {done.base} of {done.cell}")
    inside = (
        f", inside a polygon of {len(done.room.polygon)} corners" if done.room.polygon is not None else ""
    )
    ranges = ", ".join(_range(done.room, i) for i in done.room.stated)
    yield "room", f"{ranges}{inside}" if ranges else "the part stays where it is"
    yield (
        "margins",
        f"{done.margins[0]:g} deg from axis limits, {done.margins[1]:g} deg from singularities",
    )
    averaged = f", averaged over force directions within {done.direction:g} deg" if done.direction else ""
    yield "objective", OBJECTIVE_WORDS[done.objective] + averaged
    if done.places:
        words = f"{done.looked} placements by {done.searched} places of the paths"
        yield "search", f"{words}; the listed ones on all {done.checked}"
        yield (
            "regret",
            "share by which another place is better, in the worst sense, if the force is turned by 20 deg",
        )
    if words := spin_words(done):
        yield "tool turn", words
    yield "result", verdict(done)


def _range(room: Room, i: int) -> str:
    low, high = room.lower[i] / UNITS[i], room.upper[i] / UNITS[i]
    ends = f"{low:g} .. {high:g}" if low < high else f"{low:g}"
    return f"{FREEDOMS[i].replace('_', ' ')} {ends} {'deg' if UNITS[i] == DEG else 'mm'}"


def tables(done: Placement) -> list[Table]:
    """Ranked places, freedoms alone, feed directions."""
    return [_places(done), _alone(done), _feed(done)]


def _places(done: Placement) -> Table:
    stated = done.room.stated.tolist()
    table = Table(box=None, pad_edge=False)
    table.add_column("")
    heads = [FREEDOMS[i].replace("_", " ") for i in stated]
    heads += ["across mm", "max mm", "rms mm", "uncertain mm", "limit deg", "singular deg", "regret"]
    for head in heads:
        table.add_column(head, justify="right")
    rows = [("now", done.present), *((str(k + 1), one) for k, one in enumerate(done.places))]
    for name, one in rows:
        place = [in_decimals(one.place[i] / UNITS[i], 2 if UNITS[i] == DEG else 1) for i in stated]
        bound = ">" if one.lower_bound else ""
        rough = "-" if math.isnan(one.score) else f"~{one.score / MM:.3f}"
        cells = [
            in_decimals(one.across.max / MM, 3) if one.exact else rough,
            in_decimals(one.error.max / MM, 3),
            in_decimals(one.error.rms / MM, 3),
            bound + in_decimals(one.uncertainty / MM, 3),
            in_decimals(one.limit_deg, 1),
            in_decimals(one.singular_deg, 1),
            "-" if math.isnan(one.regret) else f"{one.regret:.0%}",
        ]
        table.add_row(name, *place, *cells)
    return table


def _alone(done: Placement) -> Table:
    table = Table(box=None, pad_edge=False)
    for head in ("freedom alone", "best at", "times the error"):
        table.add_column(head, justify="left" if head == "freedom alone" else "right")
    for one in done.alone:
        at = FREEDOMS.index(one.name)
        unit = "deg" if UNITS[at] == DEG else "mm"
        value = "-" if math.isnan(one.value) else f"{in_decimals(one.value / UNITS[at], 1)} {unit}"
        table.add_row(
            one.name.replace("_", " "), value, in_decimals(one.ratio, 2) if not math.isnan(one.ratio) else "-"
        )
    return table


def _feed(done: Placement) -> Table:
    table = Table(box=None, pad_edge=False)
    for head in ("feed direction at the best place", "turn deg", "now mm (linear)", "turned mm (linear)"):
        table.add_column(head, justify="left" if head.startswith("feed") else "right")
    for one in done.feed[:SHOWN_TURNS]:
        lines = f"lines {one.first} .. {one.last}"
        what = (
            (f"{one.operation.lower()}, {lines}" if one.operation else lines) if one.first else "whole path"
        )
        name = f"{one.program} " if one.first and len(done.programs) > 1 else ""
        if one.after > WORTH * one.before:
            table.add_row(escape(name + what), "-", f"{one.before / MM:.3f}", "not worth it")
        else:
            angle = f"{one.angle / DEG:+.0f}"
            table.add_row(escape(name + what), angle, f"{one.before / MM:.3f}", f"{one.after / MM:.3f}")
    return table


def spin_words(done: Placement) -> str:
    """What turning the tool about its spindle along the path could bring at the best place; "" where not asked for."""
    if done.spun is not None:
        return spin_sentence(done.spun)
    if math.isnan(done.spin):
        return ""
    if not math.isfinite(done.spin) or done.spin > SPIN_WORTH * done.best.score:
        return "a tool that turns about its spindle along the path is not worth it"
    least, now = done.spin / MM, done.best.score / MM
    return (
        f"a tool that turns about its spindle along the path could bring {now:.3f} to {least:.3f} mm at most"
    )
