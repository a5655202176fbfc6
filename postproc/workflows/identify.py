"""Identification of a robot's parameters, on paths."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from postproc.base.arrays import Bools, Floats
from postproc.base.findings import Finding, Refusal
from postproc.base.geometry import Poses
from postproc.base.input_files import place
from postproc.base.units import DEG, MM
from postproc.identification.campaign import Campaign
from postproc.identification.fit import Fit, fit
from postproc.identification.identifiable import strong_correlations
from postproc.identification.joint_scatter import with_scatter_of_joints
from postproc.identification.mounting import check_mounting
from postproc.identification.other_arm import check_arm
from postproc.identification.outliers import Outlier, outliers
from postproc.identification.sanity_checks import check_fit, check_numbers
from postproc.identification.unknowns import FitRequest, asked_for, with_gauge
from postproc.identification.validation import WIDER, Bootstrap, Validation, bootstrap, held_out, validated
from postproc.measurements import Readings, joined, not_fitted, read_measurements, robot_named
from postproc.measurements.header_comments import in_metres
from postproc.measurements.write_csv import pose_text
from postproc.model import StiffnessModel
from postproc.output.atomic_write import write_atomically
from postproc.report.identified import STRONG, Identified, identified_csv
from postproc.report.report import json_bytes
from postproc.robot.description import Robot, find_robot, load_robot, robot_files
from postproc.workflows.growth_reference import counted_from, growth_findings
from postproc.workflows.kinds import check_kind
from postproc.workflows.preparation import Stage, silent
from postproc.workflows.readings_request import ReadingsRequest, spare_inputs
from postproc.workflows.robot_files import new_robot_file

Progress = Callable[[str, int, int], None]
"""Receives the name of a stage, how many of its steps are done, and how many there are."""

FEW_POSES = 60
"""Up to so many poses intervals are checked by a bootstrap, unless it is asked for or not."""

DRAWS = 200

ROUNDS = 5
"""Of looking for outliers, each without those found before."""

PULLED = 3.0
"""Standard deviations of its prior by which the readings must move a parameter for that to be reported."""

SHOWN = 10


def no_progress(_stage: str, _done: int, _all: int) -> None:
    """Nobody watches."""


@dataclass(frozen=True)
class IdentifyRequest(ReadingsRequest):
    """What the user asked for.  ``effects``: names of effects or EFFECT.PARAMETER; ``bootstrap``: number of draws, None
    where few poses ask for it."""

    effects: tuple[str, ...] = ()
    priors: bool = False
    robust: bool = False
    drop_outliers: bool = False
    folds: int = 5
    bootstrap: int | None = None


@dataclass(frozen=True)
class Measured:
    """Readings with the robot that they are of."""

    robot: Robot
    model: StiffnessModel
    readings: Readings
    campaign: Campaign
    findings: tuple[Finding, ...]


def identify(request: IdentifyRequest, stage: Stage = silent, progress: Progress = no_progress) -> Identified:
    """Parameters of effects from readings.  Raises Refusal, and has then written nothing."""
    spare_inputs(request)
    stage("reading")
    measured = measured_of(request.data, request.robot, request.tool_mm_deg)
    _spare(request.output, measured.robot.path)
    campaign, model = measured.campaign, measured.model
    asked = asked_for(model, request.effects, request.priors)
    asked = replace(asked, unknowns=with_gauge(asked.unknowns))
    validating = validation_readings(request.validate, measured) if request.validate else None
    check_numbers(measured.readings, asked.unknowns, asked.model)
    stage("comparing")
    bad = check_fit(campaign, asked.model, asked.unknowns)
    if bad:
        check_arm(campaign, asked.model)
    findings = [*measured.findings, *bad, *(validating.findings if validating else ())]
    every = np.ones(len(campaign), bool)
    stage("registering")
    before = fit(campaign, model, (), every)
    given = before.point.nuisances
    stage("fitting")
    after = fit(campaign, asked.model, asked.unknowns, every, request.robust, nuisances=given)
    stage("looking for outliers")
    detected, rows = _outliers(after, request.drop_outliers)
    if request.drop_outliers and detected:
        before = fit(campaign, model, (), rows, nuisances=given)
        after = fit(campaign, asked.model, asked.unknowns, rows, request.robust, nuisances=given)
    if not after.unknowns:
        raise Refusal(_no_parameter_identified(measured, after))
    after = with_scatter_of_joints(after)
    folds = min(request.folds, campaign.poses)
    residuals: list[Floats | None] = [None, None]
    if folds > 1:
        stage(f"leaving poses out ({folds}-fold)")
        residuals = [
            held_out(before, folds),
            held_out(after, folds, lambda done, of: progress("leaving poses out", done, of)),
        ]
    draws = (DRAWS if campaign.poses <= FEW_POSES else 0) if request.bootstrap is None else request.bootstrap
    drawn = None
    if draws:
        stage("bootstrap")
        drawn = bootstrap(after, draws, lambda done, of: progress("bootstrap", done, of))
    validation = None
    if validating is not None:
        stage("validating")
        validation = _validated(validating, measured, before, after)
    predicted = () if validating is None else (validating,)
    findings += growth_findings(after.model, measured.readings, predicted)
    findings += _result(measured, asked, after, detected, request.drop_outliers, drawn, validation, residuals)
    result = Identified(
        robot=measured.robot.name,
        robot_file=measured.robot.path,
        robot_digest=measured.robot.digest,
        data=tuple(
            (p.name, d) for p, d in zip(measured.readings.files, measured.readings.digests, strict=True)
        ),
        effects=request.effects,
        before=before,
        after=after,
        fixed=asked.fixed,
        held_out_before=residuals[0],
        held_out_after=residuals[1],
        folds=folds if folds > 1 else 0,
        validation=validation,
        outliers=detected,
        outliers_excluded=request.drop_outliers,
        bootstrap=drawn,
        findings=tuple(findings),
        outputs=(),
        strict=request.strict,
    )
    return _published(request, measured, result, stage)


def measured_of(
    data: Sequence[Path], robot: str | None, tool_mm_deg: Sequence[float] | None = None
) -> Measured:
    """Readings of files, and the robot: the one named, or else the one that the first file names.  Raises Refusal."""
    for path in data:
        check_kind(path)
    named = robot_named(data[0])
    described = load_robot(find_robot(robot or _known(named, data[0])))
    joints = [(joint.name, joint.kind != "revolute") for joint in described.joints]
    several = [read_measurements(path, joints) for path in data]
    readings = joined(several)
    findings = list(readings.findings)
    if (
        robot is not None
        and readings.robot
        and readings.robot.casefold()
        not in (
            described.name.casefold(),
            described.path.stem.casefold(),
        )
    ):
        findings.append(
            Finding(
                "IDN016",
                f"the readings name the robot {readings.robot!r}, --robot is {described.name!r}",
                str(data[0]),
            )
        )
    tool = None
    if tool_mm_deg is not None:
        six = [*tool_mm_deg, 0.0, 0.0, 0.0][:6]
        findings += in_metres("--tool", six[:3], str(data[0]))
        tool = Poses.from_abc(np.array(six[:3]) * MM, np.array(six[3:]) * DEG)
        if readings.tool is not None and pose_text(readings.tool) != pose_text(tool):
            message = f"--tool is ignored: the readings state the tool {pose_text(readings.tool)}"
            findings.append(Finding("IDN036", message, str(data[0])))
    model = StiffnessModel.from_robot(described)
    readings = counted_from(readings, model)
    campaign = Campaign(readings, tool)
    mounting = check_mounting(campaign, model)
    if mounting.readings is not readings:
        readings, campaign = mounting.readings, Campaign(mounting.readings, tool)
    findings += mounting.findings
    return Measured(described, model, readings, campaign, tuple(findings))


def _known(named: str, path: Path) -> str:
    """The robot file's name that goes with how readings name the robot."""
    for name in robot_files():
        if named and name.casefold() == named.casefold():
            return name
    if not named:
        raise Refusal(
            Finding("CEL003", "the readings name no robot", str(path), help="use --robot NAME or FILE")
        )
    return named


def _spare(output: Path | None, robot: Path) -> None:
    """Robots that are named and not given as a path are inputs too."""
    if output is not None and place(output) == place(robot):
        raise Refusal(Finding("FIL007", "the output would replace the robot file of the run", str(output)))


def _outliers(after: Fit, exclude: bool) -> tuple[tuple[Outlier, ...], Bools]:
    """All outliers, and the rows that count.  Where outliers are excluded, those that they hid are looked for too."""
    rows = np.ones(len(after.campaign), bool)
    detected: tuple[Outlier, ...] = ()
    for _ in range(ROUNDS if exclude else 1):
        new, _robust = outliers(after, rows)
        if not new:
            break
        detected += new
        rest = rows.copy()
        rest[[outlier.row for outlier in new]] = False
        if exclude:
            rows = rest
            after = fit(after.campaign, after.start, after.asked, rows, nuisances=after.point.nuisances)
    return tuple(sorted(detected, key=lambda outlier: -outlier.sigmas)), rows


def _no_parameter_identified(measured: Measured, after: Fit) -> Finding:
    reasons = "; ".join(f"{dropped.name}: {dropped.why}" for dropped in after.dropped[:SHOWN])
    return Finding(
        "IDN017",
        f"these readings show none of the requested parameters ({reasons})",
        str(measured.readings.files[0]),
        help="`compensate plan` proposes poses and loads that do",
    )


def validation_readings(paths: Sequence[Path], measured: Measured) -> Readings:
    """Readings of files that a fit is to predict.  Raises Refusal MEA008 where they are those of ``measured``, of
    another robot, or of another kind."""
    for path in paths:
        check_kind(path)
    joints = list(measured.readings.joints)
    readings = not_fitted(joined([read_measurements(path, joints) for path in paths]), measured.readings)
    if readings.deflection != measured.readings.deflection:
        raise Refusal(Finding("MEA008", "the file is of another kind than the fitted data", str(paths[0])))
    return replace(readings, reference=measured.readings.reference, start=measured.readings.start)


def _validated(readings: Readings, measured: Measured, before: Fit, after: Fit) -> Validation:
    campaign = Campaign(readings, measured.campaign.stated_tool)
    check_numbers(readings, (), after.model)
    check_fit(campaign, after.model, ())
    return validated(before, after, campaign)


def _result(
    measured: Measured,
    asked: FitRequest,
    after: Fit,
    detected: Sequence[Outlier],
    excluded: bool,
    drawn: Bootstrap | None,
    validation: Validation | None,
    residuals: Sequence[Floats | None],
) -> list[Finding]:
    """What needs review about a fit."""
    file = str(measured.readings.files[0])
    findings = []
    for outlier in detected[:SHOWN]:
        what = (
            f"the reading is {outlier.distance / MM:.3g} mm off ({outlier.sigmas:.0f} sigma): {outlier.what}"
        )
        code = "IDN019" if excluded else "IDN018"
        findings.append(Finding(code, what, outlier.file, outlier.line))
    if len(detected) > SHOWN:
        findings.append(
            Finding(
                "IDN019" if excluded else "IDN018",
                f"{len(detected) - SHOWN} more readings are outliers",
                file,
            )
        )
    for dropped in after.dropped:
        frame_only = dropped.why.startswith("is observable only together") and not dropped.together
        findings.append(Finding("IDN021" if frame_only else "IDN020", f"{dropped.name}: {dropped.why}", file))
    for estimate in after.estimates:
        unknown = estimate.unknown
        if estimate.at_bound:
            findings.append(
                Finding(
                    "IDN022",
                    f"{unknown.name} is at its bound {estimate.value:g} {unknown.parameter.unit}",
                    file,
                )
            )
        if (
            unknown.prior is not None
            and not unknown.gauge
            and abs(estimate.value - unknown.value) > PULLED * unknown.prior
        ):
            findings.append(
                Finding(
                    "IDN023",
                    f"{unknown.name}: the readings give {estimate.value:.4g}, the robot file states"
                    f" {unknown.value:.4g} +- {1.96 * (unknown.prior or 0.0):.2g} {unknown.parameter.unit}",
                    file,
                )
            )
    if after.scatter_exceeded:
        findings.append(
            Finding(
                "IDN024",
                f"the residuals are {np.sqrt(after.factor):.1f} times the scatter, which is {after.noise.source};"
                " the intervals are wider by this factor",
                file,
            )
        )
    names = [unknown.name for unknown in after.unknowns]
    for one, other, size in strong_correlations(names, after.covariance, STRONG)[:SHOWN]:
        findings.append(Finding("IDN025", f"{one} and {other} have the correlation {size:+.3f}", file))
    if drawn is not None:
        ratio = drawn.deviation / np.sqrt(np.diag(after.covariance))
        for name, r in zip(names, ratio.tolist(), strict=True):
            if r > WIDER:
                findings.append(
                    Finding(
                        "IDN026",
                        f"{name}: the interval is {r:.2f} times as wide by a bootstrap of {drawn.draws}",
                        file,
                    )
                )
    if residuals[0] is not None and residuals[1] is not None:
        without, with_ = (np.sqrt(np.nanmean(h**2)) for h in (residuals[0], residuals[1]))
        if with_ > without:
            findings.append(
                Finding(
                    "IDN027",
                    f"the held-out poses are {np.sqrt(3) * with_ / MM:.3g} mm off with the fitted values,"
                    f" {np.sqrt(3) * without / MM:.3g} mm without",
                    file,
                )
            )
    if validation is not None and validation.registered_anew:
        findings.append(
            Finding("IDN028", "the tracker is at another place", str(validation.campaign.readings.files[0]))
        )
    if after.weights.shared > 0:
        code, message = (
            "IDN029",
            f"the readings of a pose share an error of {after.shared_error / MM:.3g} mm in each coordinate",
        )
        if after.times_stated:
            code = "IDN039"
            times = f"{after.times_stated:.1f} times the scatter, which is {after.noise.source}"
            message += f", and the residuals are {times}"
        findings.append(Finding(code, message, file))
    unstated = [u.name for u in asked.unknowns if u.prior is not None and u.stated and u.stated.level is None]
    if unstated:
        findings.append(
            Finding(
                "IDN030", f"the robot file states no level for the intervals of {', '.join(unstated)}", file
            )
        )
    again = _counted_before(measured, asked)
    if again:
        findings.append(
            Finding(
                "IDN031",
                f"the intervals of {', '.join(again)} come from these readings",
                str(measured.robot.path),
            )
        )
    return findings


def _counted_before(measured: Measured, asked: FitRequest) -> list[str]:
    """Unknowns of which the prior came from some of these readings."""
    digests = set(measured.readings.digests)
    runs = [run for run in measured.robot.identified if digests & {digest for _, digest in run.data}]
    names = {name for run in runs for name in run.names}
    return [u.name for u in asked.unknowns if u.prior is not None and u.name in names]


def _published(request: IdentifyRequest, measured: Measured, result: Identified, stage: Stage) -> Identified:
    files: dict[Path, bytes] = {}
    if result.exit == 1:  # a warning counts as an error: nothing is written
        return result
    if request.output is not None:
        stage("writing the robot file")
        files[request.output] = new_robot_file(
            "identify", measured.robot, result.after, result.effects, result.gap_mm(), request.output
        )
    if request.csv is not None:
        files[request.csv] = identified_csv(result)
    if request.picture is not None:
        from postproc.report.identified_picture import identified_picture

        stage("drawing")
        files[request.picture] = identified_picture(result, request.picture.suffix.lower().lstrip("."))
    reports = [path for path in (request.json, request.page) if path is not None]
    result = replace(result, outputs=tuple(str(path) for path in (*files, *reports)))
    if request.json is not None:
        files[request.json] = json_bytes(result)
    if request.page is not None:
        from postproc.report.page import beside
        from postproc.report.page_results import identified_page

        files[request.page] = identified_page(result, beside(request.page, _beside(request)))
    if files:
        write_atomically(files, last=request.output)
    return result


def _beside(request: IdentifyRequest) -> dict[str, Path | None]:
    """What a page leads to."""
    return {
        "new robot file": request.output,
        "residuals (CSV)": request.csv,
        "picture": request.picture,
        "result (JSON)": request.json,
    }
