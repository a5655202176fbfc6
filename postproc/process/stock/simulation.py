"""A program run through the stock that its process file states: engagement, findings, forces for the main job."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.findings import Finding, Refusal
from postproc.base.units import MM
from postproc.cell import MotionFrames
from postproc.process.cut_checks import CheckedCut
from postproc.process.force_profiles import ForceProfiles
from postproc.process.spindle_checks import differing_speed, implausible_chips, speed_words, stopped_spindle
from postproc.process.stated_forces import BASE, FEED, StatedForces
from postproc.process.stock.blank import Blank, box_blank, corners_of, cylinder_blank, mesh_blank
from postproc.process.stock.contradictions import OF_STOCK, checked_cuts, contradictions
from postproc.process.stock.cutters import CUTTING, HOLDER, SHANK
from postproc.process.stock.distance import AXIS, CUTTER, REMOVES, STEP, TIP_POINT, TURN
from postproc.process.stock.engagement import EngagedMotions, engage, laws_of
from postproc.process.stock.misplaced_blank import misplaced_blank
from postproc.process.stock.motion_sweeps import MotionSweeps, find_sweeps
from postproc.process.stock.removal_order import unordered_removal
from postproc.process.stock.saved_stock import Removed, read_stock, stock_bytes
from postproc.process.stock.stl import read_stl
from postproc.process.stock.stock_place import (
    NO_NUMBER,
    is_same_place,
    stock_places,
    uncertain_base,
)
from postproc.process.stock.stock_section import FOOT, StockProcess, read_stock_process
from postproc.process.tool_comments import CommentedTool, read_named_diameters, read_tool_comments
from postproc.toolpath import Kind, Toolpath

_PARTS = {CUTTING: "the cutter", SHANK: "the shank", HOLDER: "the holder"}
_MOST_FINDINGS = 20
_NO_MOVE = 1e-7  # m
_SMALL = 10 * MM  # a blank that is no longer, or one of 10 m in metres


@dataclass(frozen=True, eq=False)
class StockRun:
    """A program in its stock.  before: what earlier programs removed; ci95 (N,): of the forces, as a share, NaN
    where not stated; base: number of that in which the stock lies, or ``NO_NUMBER``."""

    process: StockProcess
    toolpath: Toolpath
    blank: Blank
    before: Removed | None
    sweeps: MotionSweeps
    engagement: EngagedMotions
    ci95: Floats
    findings: tuple[Finding, ...]
    base: int

    def stock_file(self) -> bytes:
        """What the program leaves, as a stock file."""
        stock = self.engagement.stock
        return stock_bytes(self.blank, stock.sweeps, stock.cutters, self.base)


def simulate(path: Path, toolpath: Toolpath, frames: MotionFrames, program: str) -> StockRun:
    """Run a program through the stock of the process file ``path``.

    Refusal: of the file; STK002 to STK005, STK016: of the blank; STK006, STK007, STK010, STK035, STK036: of tools and
    frames; STK008: no motion reaches the stock; STK031: more memory is needed than is free.
    """
    commented = read_tool_comments(toolpath)
    process = read_stock_process(path, commented)
    blank, before = _blank(process)
    low, high = corners_of(blank)
    edges = process.edges
    base, sweeps, engagement = _placed(toolpath, frames, process, (blank, before), program)
    if not engagement.cuts.any():
        raise Refusal(_beside(process, sweeps, low, high, program, toolpath))
    ci95 = np.full(len(toolpath), np.nan)
    for index, cutter in enumerate(sweeps.cutters):
        material = edges[cutter.number].material
        if material is not None and material.ci95 is not None:
            ci95[sweeps.motion[sweeps.rows[:, CUTTER] == index]] = material.ci95
    checked = checked_cuts(process, sweeps, engagement)
    findings = [
        *_collisions(engagement, toolpath, program),
        *_not_simulated(sweeps, toolpath, program),
        *unordered_removal(toolpath, engagement.cuts, program),
        *_lengths(sweeps, process),
        *_commented(sweeps, commented, frames.diameters, str(process.path), toolpath, program),
        *_spindle(checked.values(), toolpath, program),
        *contradictions(process, sweeps, engagement, checked, toolpath, frames, program),
        *misplaced_blank(process, sweeps, engagement, toolpath),
    ]
    return StockRun(process, toolpath, blank, before, sweeps, engagement, ci95, tuple(findings), base)


def _placed(
    toolpath: Toolpath,
    frames: MotionFrames,
    process: StockProcess,
    stock: tuple[Blank, Removed | None],
    program: str,
) -> tuple[int, MotionSweeps, EngagedMotions]:
    """The number of the base in which the blank lies, and what is cut of it there: where nothing states it, the base of
    the first motion that cuts."""
    blank, before = stock
    low, high = corners_of(blank)
    places = stock_places(toolpath, frames, process, NO_NUMBER if before is None else before.base, program)
    tried: list[tuple[int, MotionSweeps, EngagedMotions]] = []
    for number, place in places:
        sweeps = find_sweeps(toolpath, frames, process, low, high, program, place)
        tried.append((number, sweeps, engage(blank, sweeps, toolpath, process.edges, before)))
        first = np.flatnonzero(tried[-1][2].cuts)[:1]
        if len(places) == 1 or (len(first) and is_same_place(frames.base_in_robot[first], place)):
            return tried[-1]
    if any(one.cuts.any() for _, _, one in tried):
        raise uncertain_base(process, [number for number, _ in places])
    return tried[0]


def _blank(process: StockProcess) -> tuple[Blank, Removed | None]:
    numbers = process.numbers
    if process.blank == "box":
        return box_blank(numbers[0], numbers[1]), None
    if process.blank == "cylinder":
        row = numbers[0]
        return cylinder_blank(row[:3], float(row[3]), float(row[4]), process.lengthwise), None
    file = process.path.parent if process.file is None else process.file
    if process.blank == "stl":
        return mesh_blank(read_stl(file, process.scale)), None
    return read_stock(file, process)


def stock_forces(
    path: Path, toolpath: Toolpath, frames: MotionFrames, program: str
) -> tuple[StatedForces, tuple[Finding, ...]]:
    """The forces of every motion that cuts, in the feed frame; where a motion has no feed across the spindle, in
    its base.

    Refusal: of ``simulate``; STK009 where the force of a cut is not known.
    """
    run = simulate(path, toolpath, frames, program)
    lost = unknown_forces(run, toolpath, program, "STK009")
    if lost:
        raise Refusal(*lost)
    cut = run.engagement
    rows = np.flatnonzero(cut.cuts)
    along = cut.along[rows]
    frame = np.full(len(rows) + 1, FEED)
    plunges = _along_spindle(run.sweeps, len(toolpath))[rows]
    frame[1:][plunges] = BASE
    turned = _to_base(run.sweeps, len(toolpath), rows[plunges])
    along[plunges] = np.einsum("nij,nskj->nski", turned, along[plunges].reshape(-1, 2, 2, 3)).reshape(
        -1, 2, 6
    )
    index = np.zeros(len(toolpath), np.int32)
    index[rows] = 1 + np.arange(len(rows))
    profiles = _framed(cut.profiles, rows[plunges], turned)
    nothing = np.zeros((1, 6))
    radius = np.full(len(toolpath), np.nan)
    numbers = np.array([cutter.radius for cutter in run.sweeps.cutters])
    radius[run.sweeps.motion] = numbers[run.sweeps.rows[:, CUTTER].astype(int)]
    peak = np.full(len(toolpath), np.nan)
    peak[rows] = np.linalg.norm(cut.largest[rows, :3], axis=1)
    stated = StatedForces(
        np.concatenate([nothing, along[:, 1]]),
        frame,
        index,
        start=np.concatenate([nothing, along[:, 0]]),
        ci95=run.ci95,
        peak=peak,
        radius=radius,
        profiles=profiles if len(profiles.motion) else None,
        stock=run,
    )
    return stated, (*_summaries(run, toolpath, path), *run.findings)


def _framed(profiles: ForceProfiles, plunges: Ints, turned: Floats) -> ForceProfiles:
    """The profiles, those of ``plunges`` (K,) turned by ``turned`` (K, 3, 3) into their base."""
    wrench = profiles.wrench.copy()
    at = np.flatnonzero(np.isin(profiles.motion, plunges))
    turns = turned[np.searchsorted(plunges, profiles.motion[at])]
    wrench[at] = np.einsum("nij,nkj->nki", turns, wrench[at].reshape(-1, 2, 3)).reshape(-1, 6)
    return replace(profiles, wrench=wrench)


def _along_spindle(sweeps: MotionSweeps, count: int) -> Bools:
    """(N,) motions within 1 deg of the spindle at some place."""
    step, axis = sweeps.rows[:, STEP : STEP + 3], sweeps.rows[:, AXIS : AXIS + 3]
    size = np.linalg.norm(step, axis=1)
    along = np.abs(np.einsum("mi,mi->m", step, axis)) >= np.cos(np.pi / 180) * size
    found = np.zeros(count, bool)
    found[sweeps.motion[along]] = True
    return found


def _to_base(sweeps: MotionSweeps, count: int, rows: Ints) -> Floats:
    """(K, 3, 3) from the frame in which the force of a plunge is computed to the programmed base of its motion."""
    last = np.zeros(count, np.int64)
    last[sweeps.motion] = np.arange(len(sweeps.motion))
    z, heading = sweeps.rows[last[rows], AXIS : AXIS + 3], sweeps.heading[last[rows]]
    x = heading - np.einsum("ni,ni->n", heading, z)[:, None] * z
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    axes = np.stack([x, np.cross(z, x), z], axis=2)
    return np.asarray(np.swapaxes(sweeps.in_stock[rows], 1, 2) @ axes)


def unknown_forces(run: StockRun, toolpath: Toolpath, program: str, code: str) -> list[Finding]:
    """One finding for each tool whose force is not known where it cuts, and what is missing."""
    findings = []
    cut = run.engagement
    unknown = cut.cuts & np.isnan(cut.mean[:, 0])
    for index, cutter in enumerate(run.sweeps.cutters):
        rows = np.unique(run.sweeps.motion[run.sweeps.rows[:, CUTTER] == index])
        rows = rows[unknown[rows]]
        if not len(rows):
            continue
        own = run.process.edges[cutter.number]
        turns = own.speed is not None or _turns(toolpath.spindle[rows]).all()
        stated = {
            "teeth": cutter.teeth,
            "helix": cutter.helix,
            "spindle (or S in the program)": turns or None,
            "material": own.material,
        }
        missing = [name for name, value in stated.items() if value is None] or ["feed in the program"]
        names = ", ".join(missing)
        message = f"tool {cutter.number} cuts in {len(rows)} motions, and its force is not known: no {names}"
        of_program = missing[0].startswith("feed")
        where = (program, int(toolpath.line[rows[0]])) if of_program else (str(run.process.path), cutter.line)
        findings.append(Finding(code, message, *where))
    return findings


def _turns(speed: Floats) -> Bools:
    """(K,) speeds of a program that are known and not zero."""
    return np.asarray(np.isfinite(speed) & (speed != 0))


def _summaries(run: StockRun, toolpath: Toolpath, path: Path) -> list[Finding]:
    cut, findings = run.engagement, []
    chip = laws_of(run.sweeps, toolpath, run.process.edges)[:, 0]
    for index, cutter in enumerate(run.sweeps.cutters):
        rows = np.unique(run.sweeps.motion[run.sweeps.rows[:, CUTTER] == index])
        rows = rows[cut.cuts[rows]]
        if not len(rows):
            continue
        size = np.linalg.norm(cut.largest[rows, :3], axis=1)
        own = (run.sweeps.which == index) & cut.cuts[run.sweeps.motion]
        material = run.process.edges[cutter.number].material
        name = "" if material is None else f"; {material.name}"
        if material is not None and material.ci95 is not None:
            name += f", +- {100 * material.ci95:.0f} %"
        message = (
            f"tool {cutter.number} cuts in {len(rows)} motions in lines {toolpath.line[rows[0]]} to "
            f"{toolpath.line[rows[-1]]}, removes {cut.volume[rows].sum() / MM**3:.0f} mm3, ap up to "
            f"{cut.most[rows, 0].max() / MM:.2f} mm, ae up to {cut.most[rows, 1].max() / MM:.2f} mm, feed per "
            f"tooth up to {chip[own].max() / MM:.3g} mm, mean force over a turn up to {size.max():.0f} N{name}"
        )
        findings.append(Finding("STK014", message, str(path), cutter.line))
    return findings


def _collisions(cut: EngagedMotions, toolpath: Toolpath, program: str) -> list[Finding]:
    findings = []
    for row, parts in sorted(cut.hits.items())[:_MOST_FINDINGS]:
        names = " and ".join(_PARTS[part] for part in parts)
        air = toolpath.kind[row] == Kind.PTP or CUTTING in parts
        code = "STK011" if air else "STK012"
        if air:
            message = f"{names} collides with the stock on a rapid motion"
            if len(parts) > 1:
                message = f"{names} collide with the stock on a rapid motion"
        else:
            message = f"{names} is in the stock" if len(parts) == 1 else f"{names} are in the stock"
        findings.append(Finding(code, message, program, int(toolpath.line[row])))
    more = len(cut.hits) - len(findings)
    if more > 0:
        row = sorted(cut.hits)[_MOST_FINDINGS]
        findings.append(Finding("STK012", f"{more} more motions collide", program, int(toolpath.line[row])))
    return findings


def _not_simulated(sweeps: MotionSweeps, toolpath: Toolpath, program: str) -> list[Finding]:
    on_path = np.isin(toolpath.kind, (Kind.LIN, Kind.CIRC, Kind.SPL))
    turns = np.zeros(len(toolpath), bool)
    turns[sweeps.motion[(sweeps.length < _NO_MOVE) & sweeps.rows[:, TURN : TURN + 3].any(axis=1)]] = True
    lost = np.flatnonzero((~sweeps.simulated | turns | (toolpath.kind == Kind.SPL)) & on_path)
    if not len(lost):
        return []
    message = (
        f"{len(lost)} motions are not simulated, or not exactly: start, end, tool or spindle axis is not known, "
        "the tool only turns, it is a drill cycle, or a spline is taken as a straight line"
    )
    return [Finding("STK013", message, program, int(toolpath.line[lost[0]]))]


def _lengths(sweeps: MotionSweeps, process: StockProcess) -> list[Finding]:
    free = [cutter for cutter in sweeps.cutters if cutter.length is None]
    return [
        Finding(
            "STK017", f"tool {cutter.number} states no length of its edges", str(process.path), cutter.line
        )
        for cutter in free
    ]


def _commented(
    sweeps: MotionSweeps,
    commented: Mapping[int, CommentedTool],
    diameters: Mapping[int, float],
    path: str,
    toolpath: Toolpath,
    program: str,
) -> list[Finding]:
    """What is taken from comments of the program, where the process file states other tools, and what only it states.

    diameters: of the cell's tools by number [m]."""
    findings = []
    named = read_named_diameters(toolpath)
    for cutter in sweeps.cutters:
        tool = commented.get(cutter.number)
        if (
            tool is None
            and cutter.number not in named
            and not np.isfinite(diameters.get(cutter.number, np.nan))
        ):
            message = (
                f"the diameter of tool {cutter.number}, {2 * cutter.radius / MM:g} mm, is stated here only"
            )
            findings.append(Finding("STK029", message, path, cutter.line))
        if tool is None:
            for one in named.get(cutter.number, ()):
                if not one.may_be(2 * cutter.radius):
                    message = (
                        f"this comment names {one.words} for tool {cutter.number}; the process file states"
                        f" {cutter.shape}, diameter {2 * cutter.radius / MM:g} mm, which is used"
                    )
                    findings.append(Finding("STK019", message, program, one.line))
                    break
            continue
        same = (cutter.shape, cutter.radius, cutter.corner) == (tool.shape, tool.radius, tool.corner)
        near = (
            cutter.shape == tool.shape
            and abs(cutter.radius - tool.radius) + abs(cutter.corner - tool.corner) < 1e-6
        )
        if same:
            message = f"tool {cutter.number} is {tool.words}, by this comment"
            findings.append(Finding("STK018", message, program, tool.line))
        elif not near:
            message = (
                f"by this comment tool {cutter.number} is {tool.words}; the process file states {cutter.shape},"
                f" diameter {2 * cutter.radius / MM:g} mm, which is used"
            )
            findings.append(Finding("STK019", message, program, tool.line))
    return findings


def _spindle(cuts: Iterable[CheckedCut], toolpath: Toolpath, program: str) -> list[Finding]:
    """Which speeds of the spindle are those of the program, where the process file states others, and where the feed
    per tooth is that of no cutter."""
    findings = []
    for cut in cuts:
        findings += implausible_chips(cut, toolpath, program, OF_STOCK.chip)
        spindle = toolpath.spindle[cut.rows]
        back = cut.rows[spindle < 0]
        if len(back):
            message = (
                f"the program turns the spindle counter-clockwise in {len(back)} motions that cut: {cut.name} is"
                " taken for one that cuts so"
            )
            findings.append(Finding("STK022", message, program, int(toolpath.line[back[0]])))
        findings += stopped_spindle(cut, toolpath, program, OF_STOCK.stopped)
        findings += differing_speed(cut, toolpath, program, OF_STOCK.speed)
        rows = cut.rows[_turns(spindle)]
        if cut.speed is None and len(rows):
            message = (
                f"the S of the program determines the speed of {cut.name}:"
                f" {speed_words(np.abs(toolpath.spindle[rows]))} 1/min in {len(rows)} motions"
            )
            findings.append(Finding("STK020", message, program, int(toolpath.line[rows[0]])))
    return findings


def _beside(
    process: StockProcess, sweeps: MotionSweeps, low: Floats, high: Floats, program: str, toolpath: Toolpath
) -> Finding:
    rows = sweeps.rows[sweeps.rows[:, REMOVES] > 0]
    points = np.concatenate(
        [rows[:, TIP_POINT : TIP_POINT + 3], (rows[:, TIP_POINT : TIP_POINT + 3] + rows[:, STEP : STEP + 3])]
    )

    def box(a: Floats, b: Floats) -> str:
        return ", ".join(f"{x} {u / MM:.5g}..{v / MM:.5g}" for x, u, v in zip("XYZ", a, b, strict=True))

    moves = (
        f"the tip moves in {box(points.min(axis=0), points.max(axis=0))}" if len(points) else "nothing cuts"
    )
    message = f"no motion cuts: the blank is in {box(low, high)}, and {moves} (mm)"
    small = float((high - low).max()) < _SMALL
    help = FOOT if process.blank == "cylinder" else ""
    help = "The blank is stated in mm: is it in metres?" if small else help
    swallowed = [cutter for cutter in sweeps.cutters if 2 * cutter.radius > float((high - low)[:2].max())]
    if swallowed and not small:
        wide = ", ".join(f"tool {one.number} {2 * one.radius / MM:.6g} mm" for one in swallowed)
        help = f"The diameter is larger than the blank ({wide}): is it in mm?"
    return Finding("STK008", message, str(process.path), process.line, help=help)
