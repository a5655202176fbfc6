"""Diagnosis of a robot, on paths."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from postproc import __version__
from postproc.base.arrays import Floats
from postproc.base.findings import Finding, Refusal
from postproc.base.input_files import place
from postproc.base.units import DEG, MM
from postproc.diagnosis.approach_sides import diagnose_sides
from postproc.diagnosis.candidate_fits import composed
from postproc.diagnosis.candidates import Candidate
from postproc.diagnosis.diagnosis import Diagnosis, diagnose
from postproc.diagnosis.search import model_unknowns
from postproc.experiments.candidate_setups import CandidateSetups, readings_of, spacings, usable_limits
from postproc.experiments.discrimination import apart
from postproc.experiments.measuring_order import measuring_order
from postproc.identification.campaign import Campaign
from postproc.identification.fit import Fit, lengths, spread_of
from postproc.identification.outliers import Outlier, outliers
from postproc.identification.sanity_checks import check_fit, check_numbers
from postproc.identification.unknowns import Unknown
from postproc.identification.validation import held_out, validated
from postproc.measurements import Readings, measurements_csv, read_measurements
from postproc.model import STANDARD_GRAVITY, approach
from postproc.output.atomic_write import write_atomically
from postproc.report.diagnosed import HANGS, Diagnosed, NextPoses, ValidatedFile, diagnosed_csv
from postproc.report.diagnosed_words import SETTLES
from postproc.report.report import json_bytes
from postproc.report.residuals import Sizes, lengths_of
from postproc.robot.description import Robot
from postproc.workflows.identify import Measured, measured_of
from postproc.workflows.preparation import Stage, silent
from postproc.workflows.readings_request import ReadingsRequest, spare_inputs
from postproc.workflows.robot_files import new_robot_file

FOLDS = 5

NEXT = 6
"""Poses proposed to distinguish two explanations."""

HARDLY = 0.5
"""Standard deviations between two explanations below which poses are not worth measuring."""

LOADS = 3
"""Of the weights that were hung, so many different ones are proposed again."""

USUAL_SIGMA = 0.03 * MM
"""Scatter that poses are proposed for where nothing states one."""

WILD, FEW = 10.0, 0.05
"""Standard deviations from which on a reading is an accident, and the share of all that may be."""

TRIED = 2
"""Explanations of a set that the first is distinguished from."""

WIDER = 0.05
"""Share of the range of an axis by which next poses may leave what was measured."""

CANDIDATES = 300
"""Poses to choose from."""

SPREAD = 0.15
"""Share of the ranges of the axes, in the mean, by which two proposed poses differ at least: what is repeated at one
pose repeats its errors too.  Of two random poses it is a third."""


@dataclass(frozen=True)
class DiagnoseRequest(ReadingsRequest):
    """What the user asked for.  ``next_poses``: where a plan goes that distinguishes explanations, beside ``output``
    without it; ``payload_kg``: the heaviest weight to be hung, None that of the robot file; ``pulls``: forces can be
    pulled with, in any direction and as large as those measured."""

    next_poses: Path | None = None
    payload_kg: float | None = None
    pulls: bool = False

    @property
    def written(self) -> list[Path]:
        """The files that are to be written."""
        return [*super().written, *([] if self.next_poses is None else [self.next_poses])]


def diagnose_robot(request: DiagnoseRequest, stage: Stage = silent) -> Diagnosed:
    """What is missing in the robot file, by its name.  Raises Refusal, and has then written nothing."""
    spare_inputs(request)
    stage("reading")
    measured = measured_of(request.data, request.robot, request.tool_mm_deg)
    campaign, model = measured.campaign, measured.model
    own = model_unknowns(model)
    check_numbers(measured.readings, (), model)
    findings = [*measured.findings, *check_fit(campaign, model, own)]
    diagnosis, sides = diagnose_sides(campaign, model, stage)
    findings += sides
    wild = gross_errors(diagnosis.final)
    if wild:
        stage("once more without outliers")
        inliers = np.setdiff1d(np.arange(len(campaign)), [one.row for one in wild])
        rest = Campaign(campaign_of(diagnosis).readings.part(inliers), campaign.stated_tool)
        diagnosis = diagnose(rest, model)
        findings += [
            Finding(
                "DIA002",
                f"the reading is {one.distance / MM:.3g} mm off ({one.sigmas:.0f} sigma): {one.what}",
                one.file,
                one.line,
            )
            for one in wild
        ]
        campaign = diagnosis.final.campaign
    findings += _searched(diagnosis, request.data[0])
    stage("leaving poses out")
    folds = min(FOLDS, campaign.poses)
    residuals = held_out(diagnosis.stated, folds), held_out(diagnosis.final, folds)
    planned = None
    if diagnosis.verdict.word == "ambiguous" and not diagnosis.agreed:
        stage("looking for poses that settle it")
        planned = _next_poses(request, measured, diagnosis)
    result = Diagnosed(
        robot=measured.robot.name,
        robot_digest=measured.robot.digest,
        robot_path=measured.robot.path,
        data=tuple(
            (p.name, d) for p, d in zip(measured.readings.files, measured.readings.digests, strict=True)
        ),
        diagnosis=diagnosis,
        held_out_before=residuals[0],
        held_out_after=residuals[1],
        next_poses=planned,
        findings=tuple(findings),
        robot_file=None,
        outputs=(),
        strict=request.strict,
        load_limits=_load_limits(request, measured),
        validation=tuple(_validated(path, measured, diagnosis) for path in request.validate),
    )
    return _published(request, measured, result, stage)


def _searched(diagnosis: Diagnosis, file: Path) -> list[Finding]:
    """What part of the readings effects were searched for in, where that is not all."""
    some, every = diagnosis.search.base.campaign, campaign_of(diagnosis)
    if len(some) == len(every):
        return []
    message = (
        f"effects were searched for in {len(some)} of {len(every)} readings ({some.poses} of {every.poses} poses, at"
        " random); what was found is fitted to all of them"
    )
    return [Finding("DIA004", message, str(file))]


def _load_limits(request: DiagnoseRequest, measured: Measured) -> tuple[str, ...]:
    """Why weights or pulls that were measured with are not planned with again."""
    readings, payload = measured.readings, heaviest(request, measured.robot)
    hung = hung_weights(readings)
    words = []
    if len(within_payload(hung, payload)) < len(hung):
        words.append(f"weights above the payload of {payload:g} kg are not proposed again")
    force = np.linalg.norm(readings.wrench[:, :3], axis=1)
    pulled = (force > 0) & (-readings.wrench[:, 2] < HANGS * force)
    if pulled.any() and not request.pulls:
        words.append("pulls are proposed with --pulls only")
    return tuple(words)


def _validated(path: Path, measured: Measured, diagnosis: Diagnosis) -> ValidatedFile:
    """What the robot file and the final model predict of the readings of a file that was not diagnosed."""
    readings = read_measurements(path, list(measured.readings.joints))
    if readings.deflection != measured.readings.deflection:
        raise Refusal(Finding("MEA008", "the file is of another kind than the diagnosed data", str(path)))
    if readings.direction is None:
        readings = replace(readings, direction=np.zeros_like(readings.q))
    campaign = Campaign(readings, measured.campaign.stated_tool)
    check_numbers(readings, (), measured.model)
    check_fit(campaign, diagnosis.final.model, ())
    done = validated(diagnosis.stated, diagnosis.final, campaign)
    known = np.isfinite(readings.value)
    before, after = (Sizes.of(lengths_of(one, known)) for one in (done.before, done.after))
    if before is None or after is None:
        raise Refusal(Finding("MEA002", "no reading of the file can be predicted", str(path)))
    return ValidatedFile(str(path), before, after, done.registered_anew)


def campaign_of(diagnosis: Diagnosis) -> Campaign:
    """The readings as they were diagnosed, sides of approach and all."""
    return diagnosis.final.campaign


def gross_errors(final: Fit) -> tuple[Outlier, ...]:
    """Readings so far off that they would decide; none where there are so many that they are no accidents."""
    length = lengths(final.point.residual, final.plain_weights)
    if length.max(initial=0.0) < 0.5 * WILD * spread_of(length, final.noise.known):
        return ()
    detected, _ = outliers(final, np.ones(len(length), bool))
    wild = tuple(one for one in detected if one.sigmas > WILD)
    at_pose = np.bincount(final.campaign.pose[[one.row for one in wild]]) if wild else np.zeros(1)
    # an accident strikes one reading, or one pose: where several poses are off as a whole, the arm was there
    by_accident = len(wild) <= FEW * len(length) and (at_pose > 1).sum() <= 1
    return wild if by_accident else ()


def _next_poses(request: DiagnoseRequest, measured: Measured, diagnosis: Diagnosis) -> NextPoses | None:
    """Poses, of those loads and targets that were used, at which the explanations disagree most; None where none do."""
    candidates = _candidate_setups(request, measured, diagnosis.search.base)
    # where the arm was it can go again
    narrow = replace(candidates, limits=_measured_ranges(measured.readings.q, candidates.limits))
    if measured.readings.deflection and not len(candidates.loads) + len(candidates.pulls):
        return None  # what can be hung or pulled with is not known
    pairs = [(first, other) for first, *others in diagnosis.verdict.alternatives for other in others[:TRIED]]
    # poses that differ less are better than none
    for offered in (narrow, candidates, replace(candidates, spread=0.0)):
        tried = [_discriminating_poses(measured, diagnosis, offered, one, other) for one, other in pairs]
        plans = [plan for plan in tried if plan]
        best = max(plans, key=lambda plan: min(plan.separation), default=None)
        if best is not None and (min(best.separation) >= SETTLES or offered is not narrow):
            return replace(best, beyond=_beyond(measured, best, narrow.limits))
    return None


def _measured_ranges(q: Floats, limits: Floats) -> Floats:
    """(n, 2) [rad, m] the ranges of ``q`` (R, n), a little widened, within the ``limits`` (n, 2)."""
    low, high = q.min(axis=0), q.max(axis=0)
    wider = WIDER * (high - low)
    return np.stack(
        [np.clip(low - wider, *limits.T), np.maximum(np.clip(high + wider, *limits.T), limits[:, 0])], axis=1
    )


def _beyond(measured: Measured, plan: NextPoses, ranges: Floats) -> tuple[str, ...]:
    """Names of the joints that a plan moves out of ``ranges`` (n, 2) [rad, m]."""
    q = plan.readings.q
    out = np.flatnonzero(((q < ranges[:, 0] - 1e-9) | (q > ranges[:, 1] + 1e-9)).any(axis=0))
    return tuple(measured.robot.joints[i].name for i in out)


def _discriminating_poses(
    measured: Measured, diagnosis: Diagnosis, candidates: CandidateSetups, one: Candidate, other: Candidate
) -> NextPoses | None:
    base = diagnosis.search.base
    model, first = composed(base.model, [one])
    model, second = composed(model, [other])
    # the first has its fitted values; the second those of its usual size
    model = model.with_values(_values(diagnosis.search.final, first, one))
    common = [u for u in base.unknowns if u.prior is None]
    try:
        poses = apart(model, first, second, common, candidates, (NEXT,), candidates=CANDIDATES)
    except Refusal:
        return None
    if min(poses.separation[NEXT]) < HARDLY:
        return None
    setups = poses.chosen[NEXT]
    setups = setups[measuring_order(setups.q, spacings(measured.robot, candidates.spacing))]
    return NextPoses(
        _like(measured, readings_of(model, candidates, setups)), (one, other), poses.separation[NEXT]
    )


def _like(measured: Measured, planned: Readings) -> Readings:
    """The plan with the columns that the readings so far have, so that both can be read as one: time and temperature
    are to be filled in, senses of approach follow from the order."""
    before, empty = measured.readings, np.full(len(planned), np.nan)
    direction = planned.direction
    if before.direction is None:
        direction = None
    elif direction is None:
        direction = approach(planned.q)
    return replace(
        planned,
        in_robot_frame=before.in_robot_frame,
        tool=before.tool,
        places={name: place for name, place in before.places.items() if name not in before.on_base},
        time=None if before.time is None else empty,
        temperature=None if before.temperature is None else empty,
        direction=direction,
    )


def _values(final: Fit, unknowns: Sequence[Unknown], candidate: Candidate) -> dict[tuple[int, str], float]:
    """The fitted values of a candidate's parameters, as values of a model in which they are ``unknowns``."""
    wanted = (candidate.name, candidate.effect.described())
    fitted = next(
        (t.values for t in final.model.terms if (t.effect.name, t.effect.described()) == wanted), {}
    )
    return {u.key: fitted[u.parameter.name] for u in unknowns if u.parameter.name in fitted}


def _candidate_setups(request: DiagnoseRequest, measured: Measured, base: Fit) -> CandidateSetups:
    """What was measured with: targets, weights within the payload, scatter; and pulls where there can be such."""
    readings, campaign = measured.readings, measured.campaign
    in_flange = campaign.tool.rotation @ base.point.nuisances.places[:, :, None]
    moving = ~campaign.on_base
    loads = within_payload(hung_weights(readings), heaviest(request, measured.robot))
    pulls = pulls_like(readings) if request.pulls else np.zeros((0, 3))
    if len(loads) > LOADS:
        loads = loads[np.linspace(0, len(loads) - 1, LOADS).round().astype(int)]
    return CandidateSetups(
        tool=campaign.tool,
        targets=tuple(name for name in readings.targets if name not in readings.on_base),
        places=(in_flange[:, :, 0] + campaign.tool.position)[moving],
        rough=campaign.tracked,
        loads=loads if len(loads) or readings.deflection else np.zeros(1),
        pulls=pulls,
        each_load=False,
        deflection=readings.deflection,
        sigma=float(np.median(base.noise.sigma)) if base.noise.known else USUAL_SIGMA,
        limits=usable_limits(measured.robot, {}),
        box=_box(),
        tracker=None,
        cone=np.pi,
        spacing=5 * DEG,
        spread=SPREAD,
    )


def hung_weights(readings: Readings) -> Floats:
    """(L,) [kg] weights that were hung: forces straight down, not pulls; 0 too where places without a load are
    measured."""
    force = readings.wrench[:, :3]
    size = np.linalg.norm(force, axis=1)
    down = -force[:, 2] >= HANGS * size
    loads = np.unique(np.round(size[down] / STANDARD_GRAVITY, 1))
    return loads[loads > 0] if readings.deflection else loads


def heaviest(request: DiagnoseRequest, robot: Robot) -> float:
    """[kg] the weight that may be hung at most, infinite where nobody states one."""
    stated = robot.rated_payload if request.payload_kg is None else request.payload_kg
    return np.inf if stated is None else stated


def within_payload(loads: Floats, payload: float) -> Floats:
    """(K,) [kg] those of ``loads`` (L,) that the robot may carry."""
    return loads[loads <= payload]


def pulls_like(readings: Readings) -> Floats:
    """(6, 3) [N] along and against each axis of the robot base, as large as the largest force that was measured with;
    none where there was none."""
    size = float(np.linalg.norm(readings.wrench[:, :3], axis=1).max(initial=0.0))
    return size * np.concatenate([np.eye(3), -np.eye(3)]) if size > 0 else np.zeros((0, 3))


def _box() -> Floats:
    """Nothing below the floor that the robot is on."""
    return np.array([[-np.inf, np.inf], [-np.inf, np.inf], [0.0, np.inf]])


def _published(request: DiagnoseRequest, measured: Measured, result: Diagnosed, stage: Stage) -> Diagnosed:
    if result.exit == 1:  # a warning counts as an error: nothing is written
        return result
    files: dict[Path, bytes] = {}
    if request.output is not None and result.improves:
        stage("writing the robot file")
        names = tuple(dict.fromkeys(named.effect for named in result.diagnosis.verdict.named))
        files[request.output] = new_robot_file(
            "diagnose", measured.robot, result.diagnosis.final, names, result.gap_mm(), request.output
        )
        result = replace(result, robot_file=str(request.output))
    plan = request.next_poses
    if plan is None and request.output is not None:
        plan = request.output.with_name(request.output.stem + ".next_poses.csv")
    if result.next_poses is not None and plan is not None:
        if place(plan) in {place(path) for path in request.data}:  # an earlier plan, filled in
            raise Refusal(
                Finding(
                    "FIL007", "the output would replace an input", str(plan), help="use --next-poses FILE.csv"
                )
            )
        files[plan] = measurements_csv(result.next_poses.readings, _about(result))
        result = replace(result, next_poses_file=str(plan))
    if request.csv is not None:
        files[request.csv] = diagnosed_csv(result)
    if request.picture is not None:
        from postproc.report.diagnosed_picture import diagnosed_picture

        stage("drawing")
        files[request.picture] = diagnosed_picture(result, request.picture.suffix.lower().lstrip("."))
    reports = [path for path in (request.json, request.page) if path is not None]
    result = replace(result, outputs=tuple(str(path) for path in (*files, *reports)))
    if request.json is not None:
        files[request.json] = json_bytes(result)
    if request.page is not None:
        from postproc.report.page import beside
        from postproc.report.page_results import diagnosed_page

        files[request.page] = diagnosed_page(result, beside(request.page, _beside(request, result)))
    if files:
        write_atomically(files, last=request.output)
    return result


def _beside(request: DiagnoseRequest, result: Diagnosed) -> dict[str, Path | None]:
    """What a page leads to."""
    files = {"new robot file": result.robot_file, "poses to measure next": result.next_poses_file}
    return {
        **{word: Path(path) if path else None for word, path in files.items()},
        "residuals (CSV)": request.csv,
        "picture": request.picture,
        "result (JSON)": request.json,
    }


def _about(result: Diagnosed) -> list[str]:
    assert result.next_poses is not None
    one, other = result.next_poses.between
    planned = result.next_poses.readings
    asked = [name for name, of in (("T", planned.time), ("TEMP", planned.temperature)) if of is not None]
    also = f", {' and '.join(asked)}" if asked else ""
    return [
        f"plan of compensate {__version__}, robot file sha256 {result.robot_digest[:16]}",
        f"poses that separate {one.label} from {other.label}",
        f"fill in the readings{also} and pass them to `compensate diagnose` together with the earlier ones",
        "collisions with the surroundings are not checked: move slowly to every pose for the first time",
    ]
