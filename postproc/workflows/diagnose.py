"""Diagnosis of a robot, on paths."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from postproc import __version__
from postproc.base.findings import Finding, Refusal
from postproc.base.input_files import place
from postproc.base.units import MM
from postproc.diagnosis.accidents import are_accidents, far_readings, loaded_joint, poses_off
from postproc.diagnosis.approach_sides import diagnose_sides
from postproc.diagnosis.diagnosis import Diagnosis, diagnose
from postproc.diagnosis.search import model_unknowns
from postproc.identification.campaign import Campaign, sense_of
from postproc.identification.other_arm import check_arm
from postproc.identification.sanity_checks import check_fit, check_numbers
from postproc.identification.validation import held_out, validated
from postproc.measurements import Readings, measurements_csv
from postproc.output.atomic_write import write_atomically
from postproc.output.filled_tables import refuse_filled_plan
from postproc.report.diagnosed import HANGS, Diagnosed, ValidatedFile, diagnosed_csv
from postproc.report.report import json_bytes
from postproc.report.residuals import Sizes, lengths_of
from postproc.robot.description import Robot
from postproc.workflows.growth_reference import growth_findings
from postproc.workflows.identify import Measured, measured_of, validation_readings
from postproc.workflows.next_poses import hung_weights, next_poses, within_payload
from postproc.workflows.preparation import Stage, silent
from postproc.workflows.readings_request import ReadingsRequest, spare_inputs
from postproc.workflows.robot_files import new_robot_file

FOLDS = 5

POSE_OFF = "so are others of this pose, so the arm stood elsewhere: measure the pose again"
"""What it may be where a pose is off as a whole."""

GAVE_WAY = "so are others under the largest loads on {}, so something yielded there"
"""The same where what is off goes with the load on a joint."""

BESIDE_OTHERS = {"nothing_missing": "unknown", "named": "partly_named"}
"""Verdicts on all other readings -> on all, where those that are far off are no accidents, a pose is off as a whole, or
they go with the load: what opens under some loads alone looks like an accident."""


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
    to_predict = [validation_readings((path,), measured) for path in request.validate]
    own = model_unknowns(model)
    check_numbers(measured.readings, (), model)
    bad = check_fit(campaign, model, own)
    if bad and not campaign.readings.deflection:
        stage("checking the arm")
        check_arm(campaign, model)
    findings = [*measured.findings, *(finding for one in to_predict for finding in one.findings), *bad]
    diagnosis, sides = diagnose_sides(campaign, model, stage)
    findings += sides
    struck, wild = campaign_of(diagnosis), far_readings(diagnosis.final)
    ordered = np.array_equal(sense_of(struck.readings), sense_of(measured.readings))
    if wild and not are_accidents(struck, wild):
        diagnosis = _beside_others(diagnosis)
    elif wild:
        stage("once more without outliers")
        inliers = np.setdiff1d(np.arange(len(campaign)), [one.row for one in wild])
        rest = Campaign(struck.readings.part(inliers), campaign.stated_tool)
        whole, loaded = poses_off(struck, wild), loaded_joint(diagnosis.final, wild)
        diagnosis = diagnose(rest, model)
        if len(whole) or loaded:
            diagnosis = _beside_others(diagnosis)
        cause = GAVE_WAY.format(loaded) if loaded else ""
        findings += [
            Finding(
                "DIA002",
                f"the reading is {one.distance / MM:.3g} mm off ({one.sigmas:.0f} sigma): "
                + (POSE_OFF if struck.pose[one.row] in whole else cause or one.what),
                one.file,
                one.line,
            )
            for one in wild
        ]
        campaign = diagnosis.final.campaign
    findings += _searched(diagnosis, request.data[0])
    findings += growth_findings(diagnosis.final.model, measured.readings, to_predict)
    stage("leaving poses out")
    folds = min(FOLDS, campaign.poses)
    residuals = held_out(diagnosis.stated, folds), held_out(diagnosis.final, folds)
    planned = None
    if diagnosis.verdict.word == "ambiguous" and not diagnosis.agreed:
        stage("looking for poses that settle it")
        planned = next_poses(measured, diagnosis, heaviest(request, measured.robot), request.pulls)
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
        validation=tuple(
            _validated(path, readings, measured, diagnosis, ordered)
            for path, readings in zip(request.validate, to_predict, strict=True)
        ),
    )
    return _published(request, measured, result, stage)


def _beside_others(diagnosis: Diagnosis) -> Diagnosis:
    """The diagnosis of some readings where others are far off."""
    word = BESIDE_OTHERS.get(diagnosis.verdict.word, diagnosis.verdict.word)
    return replace(diagnosis, verdict=replace(diagnosis.verdict, word=word))


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


def _validated(
    path: Path, readings: Readings, measured: Measured, diagnosis: Diagnosis, ordered: bool
) -> ValidatedFile:
    """What the robot file and the final model predict of the readings of a file that was not diagnosed; ``ordered``:
    joints came to their places in the order of the rows."""
    if readings.direction is None:
        sides = sense_of(readings) if ordered else np.zeros_like(readings.q)
        readings = replace(readings, direction=sides)
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


def heaviest(request: DiagnoseRequest, robot: Robot) -> float:
    """[kg] the weight that may be hung at most, infinite where nobody states one."""
    stated = robot.rated_payload if request.payload_kg is None else request.payload_kg
    return np.inf if stated is None else stated


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
        refuse_filled_plan(plan)
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
