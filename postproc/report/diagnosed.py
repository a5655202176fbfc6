"""The result of ``compensate diagnose``: a verdict, its evidence, and residuals; as JSON and CSV."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from postproc.base.arrays import Bools, Floats
from postproc.base.findings import Finding
from postproc.diagnosis.candidates import Candidate, names_of
from postproc.diagnosis.diagnosis import Diagnosis
from postproc.diagnosis.effect_sizes import Gains, Smallest, detection_limits, gains, moved, smallest
from postproc.diagnosis.residual_patterns import ResidualPattern, residual_patterns
from postproc.diagnosis.search_result import Key
from postproc.diagnosis.selection import explained
from postproc.diagnosis.verdict import Evidence, Named, Verdict, more_remains, reduced_chi2_of
from postproc.identification.fit import Estimate, Fit
from postproc.measurements import Readings
from postproc.model import STANDARD_GRAVITY
from postproc.report.placed import Placed, stations, targets, tracker_scale
from postproc.report.report import exit_code
from postproc.report.residuals import Sizes, gap_of, joint_variables, lengths_of, mm, residuals_csv
from postproc.report.result import Columns, Result, columns_of
from postproc.report.result_keys import complete_result
from postproc.robot.provenance import GAP

CLEAR = ("named", "nothing_missing")
"""Verdicts that need no review."""

NEARLY_ALL = 0.9
"""Share of the candidates that would have shown at the reported size."""

REFITTED = 0.9
"""Share of the residual of held-out poses that refitted parameters leave where a new file is worth writing."""

USUAL = 10.0
"""An effect that only shows beyond so many times its usual size was hardly tested."""


HANGS = 0.996
"""Cosine of a force with straight down from which on it is a weight that hangs: 5 degrees."""


@dataclass(frozen=True, eq=False)
class NextPoses:
    """Poses worth measuring next: they distinguish the explanations ``between``.  readings: still to be taken;
    separation: standard deviations by which they show that the first is no case of the second, and vice
    versa; ``beyond``: the axes that leave the ranges measured so far, because within these nothing distinguishes
    them."""

    readings: Readings
    between: tuple[Candidate, Candidate]
    separation: tuple[float, float]
    beyond: tuple[str, ...] = ()

    @property
    def poses(self) -> list[dict[str, float]]:
        """Axes [deg, mm] and weight [kg] of each, the force [N] where it is a pull, and the sense in which each axis
        comes there, where that counts."""
        readings = self.readings
        table = {axis.name: axis.values.round(4) for axis in joint_variables(readings)}
        force = readings.wrench[:, :3]
        size = np.linalg.norm(force, axis=1)
        hangs = -force[:, 2] >= HANGS * size
        table["load_kg"] = np.where(hangs, size / STANDARD_GRAVITY, 0.0).round(4)
        if not hangs.all():
            pull = np.where(hangs[:, None], 0.0, force).round(2)
            table |= dict(zip(("pull_x_n", "pull_y_n", "pull_z_n"), pull.T, strict=True))
        if readings.direction is not None:
            table |= {f"DIR{i}": column for i, column in enumerate(readings.direction.T, 1)}
        rows = np.column_stack(list(table.values())) + 0.0
        _, first = np.unique(rows, axis=0, return_index=True)
        return [dict(zip(table, rows[row].tolist(), strict=True)) for row in np.sort(first)]


@dataclass(frozen=True)
class ValidatedFile:
    """Readings of a file that were not diagnosed, by the robot file as it is and by the final model: RMS, mean and
    maximum [m]; ``registered_anew``: their tracker was elsewhere."""

    file: str
    before: Sizes
    after: Sizes
    registered_anew: bool

    def as_json(self) -> dict[str, object]:
        """The keys are public."""
        entry: dict[str, object] = {"file": self.file, "readings": self.after.readings}
        for name, size in (("before", self.before), ("after", self.after)):
            entry |= {
                f"{name}_rms_mm": mm(size.rms),
                f"{name}_mean_mm": mm(size.mean),
                f"{name}_max_mm": mm(size.max),
            }
        return entry | {"registration_refitted": self.registered_anew}


@dataclass(frozen=True, eq=False, repr=False)
class Diagnosed(Result):
    """The result of ``diagnose``.

    data: name and SHA-256 of each file; held_out_before, held_out_after (R, 3) [m]: residuals of each pose by fits
    without this pose, of the robot file as it is and of the final model; load_limits: which loads next poses do not
    propose, in words; robot_file, next_poses_file: as written, None
    where not; outputs: all files written.
    """

    headline = ("robot", "verdict", "gap.before_rms_mm", "gap.after_rms_mm", "exit")

    robot: str
    robot_digest: str
    robot_path: Path
    data: tuple[tuple[str, str], ...]
    diagnosis: Diagnosis
    held_out_before: Floats
    held_out_after: Floats
    next_poses: NextPoses | None
    findings: tuple[Finding, ...] = ()
    robot_file: str | None = None
    next_poses_file: str | None = None
    outputs: tuple[str, ...] = ()
    strict: bool = False
    validation: tuple[ValidatedFile, ...] = ()
    load_limits: tuple[str, ...] = ()

    @property
    def verdict(self) -> Verdict:
        return self.diagnosis.verdict

    @property
    def final(self) -> Fit:
        """The final model."""
        return self.diagnosis.final

    @property
    def exit(self) -> int:
        """As of the findings; 3 where the verdict needs review."""
        code = exit_code(self.findings, self.strict)
        return code if code == 1 or self.verdict.word in CLEAR else 3

    @property
    def improves(self) -> bool:
        """Whether a new robot file would be better than the old one."""
        word = self.verdict.word
        if word == "ambiguous":
            return self.diagnosis.agreed or (bool(self.clear) and self.diagnosis.clear_is_better)
        if word == "nothing_missing":
            return bool(self.verdict.refitted) or self._is_refitted
        return word in ("named", "partly_named")

    @property
    def _is_refitted(self) -> bool:
        """Whether the robot file's own parameters, refitted, predict poses that were left out clearly better, although
        no single one of them has clearly moved."""
        before, after = self.rms["held_out_before"], self.rms["held_out_after"]
        return bool(after < REFITTED * before)

    @cached_property
    def clear(self) -> tuple[Named, ...]:
        """The named effects without those that another explanation fits as well."""
        ambiguous = {alternatives[0].key for alternatives in self.verdict.alternatives}
        return tuple(named for named in self.verdict.named if named.candidate.key not in ambiguous)

    @property
    def scatter_exceeded(self) -> bool:
        """Whether the residual clearly exceeds the scatter, with all effects found."""
        remainder = self.verdict.remainder
        return more_remains(self.diagnosis.search, remainder) or (
            bool(remainder) and self.verdict.word == "unknown"
        )

    @property
    def needs_effects(self) -> bool:
        """Whether the residual clearly exceeds the scatter without any effect that was found."""
        search = self.diagnosis.search
        return reduced_chi2_of(search, explained(search.linear.problem, ()))[1]

    # Residuals.

    @cached_property
    def counts(self) -> Bools:
        """(R,) readings that were fitted."""
        return np.asarray((self.final.plain_weights.weight[:, :3] > 0).any(axis=1))

    @cached_property
    def lengths(self) -> dict[str, Floats]:
        """(R,) [m] lengths of residuals: under the names that ``gap`` starts with, and of two more fits.  ``refitted``:
        the robot file's own parameters refitted; ``explained``: with all that was chosen, named or not."""
        measured = np.isfinite(self.final.campaign.readings.value)
        residuals = {
            "before": self.diagnosis.stated.residual,
            "after": self.final.residual,
            "held_out_before": self.held_out_before,
            "held_out_after": self.held_out_after,
            "refitted": self.diagnosis.base.residual,
            "explained": self.diagnosis.search.confirmed.residual,
        }
        return {
            name: np.where(self.counts, lengths_of(values, measured), np.nan)
            for name, values in residuals.items()
        }

    @cached_property
    def rms(self) -> dict[str, float]:
        """[m] Root mean squares of ``lengths``, NaN of nothing."""
        sizes = {name: Sizes.of(lengths) for name, lengths in self.lengths.items()}
        return {name: size.rms if size else np.nan for name, size in sizes.items()}

    @property
    def scatter(self) -> float:
        """[m] length of the scatter of a position, root mean square: as stated or as repeats show, or else as the final
        residuals do."""
        noise = self.final.noise
        return float(np.sqrt(3 * np.mean(noise.sigma**2) * (1.0 if noise.known else self.final.factor)))

    def gap_mm(self) -> dict[str, float]:
        """Root mean squares of residuals, and the scatter of the readings; what is not known is omitted."""
        gap = gap_of(self.lengths, self.final.noise)
        return {key: gap[key] for key in GAP if key in gap}

    # Sizes of effects.

    @cached_property
    def gains(self) -> Gains:
        """What each candidate that was tried explains."""
        return gains(self.diagnosis.search)

    @cached_property
    def moved(self) -> dict[Key, Sizes | None]:
        """How much of what was measured each named effect moves, by the key of its candidate."""
        measured = np.isfinite(self.final.campaign.readings.value)
        several = {
            named.candidate.key: moved(self.diagnosis.search.confirmed, named) for named in self.verdict.named
        }
        return {
            key: Sizes.of(np.where(self.counts, lengths_of(one, measured), np.nan))
            for key, one in several.items()
        }

    @cached_property
    def smallest(self) -> tuple[Smallest, ...]:
        """What each candidate that was not found had to be to show."""
        return smallest(self.diagnosis.search)

    @cached_property
    def detection_limits(self) -> tuple[Smallest, ...]:
        """The same at the size itself, of the verdict that nothing is missing."""
        return detection_limits(self.diagnosis.search) if self.verdict.word == "nothing_missing" else ()

    @property
    def detectable(self) -> float | None:
        """[m] Root mean square from which on ``NEARLY_ALL`` candidates that were not found would have been found."""
        shown = sorted(one.rms for one in self.smallest if np.isfinite(one.rms))
        return float(np.quantile(shown, NEARLY_ALL)) if shown else None

    @property
    def hardly_tested(self) -> tuple[str, ...]:
        """Effects that would have to be ``USUAL`` times as large as usual to show, on whatever joint."""
        best: dict[str, float] = {}
        for one in self.smallest:
            best[one.candidate.name] = min(one.usual, best.get(one.candidate.name, np.inf))
        chosen = {*names_of(self.diagnosis.search.chosen), *(named.effect for named in self.verdict.named)}
        return tuple(name for name, usual in best.items() if usual > USUAL and name not in chosen)

    @property
    def tried(self) -> tuple[str, ...]:
        """Names of the effects that were looked for."""
        return names_of(self.diagnosis.search.linear.candidates)

    @cached_property
    def patterns(self) -> tuple[ResidualPattern, ...]:
        """Patterns in the residuals of the robot file with its own parameters refitted: signs of a missing effect."""
        return residual_patterns(self.diagnosis.base, self.diagnosis.search.confirmed)

    def table(self) -> Columns:
        """One row a parameter of the named effects: effect, joints, parameter, value, ci95, unit."""
        return columns_of(
            [
                {
                    "effect": named.effect,
                    "joints": " ".join(named.joints),
                    "parameter": estimate.unknown.parameter.name,
                    **_parameter(estimate),
                }
                for named in self.clear
                for estimate in named.estimates
            ]
        )

    def as_json(self) -> dict[str, object]:
        """The machine-readable result; the keys are public."""
        verdict, campaign = self.verdict, self.final.campaign
        gap = self.gap_mm()
        result = {
            "robot": self.robot,
            "robot_path": str(self.robot_path),
            "robot_digest": self.robot_digest,
            "data": [{"file": name, "sha256": digest} for name, digest in self.data],
            "measured": "deflection" if campaign.readings.deflection else "position",
            "readings": len(campaign),
            "poses": campaign.poses,
            "targets": len(campaign.targets),
            "sessions": len(campaign.readings.sessions),
            "verdict": verdict.word,
            "conditional": verdict.conditional,
            "named": [self._named(named) for named in self.clear],
            "ambiguous": _once([list(names_of(one)) for one in verdict.alternatives]),
            "largest_disagreement_mm": mm(max(self.diagnosis.disagreement))
            if self.diagnosis.disagreement and np.isfinite(max(self.diagnosis.disagreement))
            else None,
            "same_correction": self.diagnosis.agreed,
            "alternatives": [[_candidate(c) for c in one] for one in verdict.alternatives],
            "rejected": [{**_candidate(candidate), "why": why} for candidate, why in verdict.rejected],
            "tried": list(self.tried),
            "not_testable": list(verdict.not_testable),
            "hardly_testable": list(self.hardly_tested),
            "detectable_rms_mm": None if self.detectable is None else mm(self.detectable),
            "detection_limits": [_limit(one) for one in self.detection_limits],
            "refitted": [_refitted(estimate) for estimate in verdict.refitted],
            "residual_patterns": [_where(one) for one in self.diagnosis.where],
            "residual_patterns_refitted": [_where(one) for one in self.patterns],
            "residual_patterns_final": [_where(one) for one in verdict.remainder],
            "gap": {key: gap.get(key) for key in GAP} | {"refitted_rms_mm": mm(self.rms["refitted"])},
            "reduced_chi2": None if verdict.conditional else _finite(self.final.variance),
            "next_poses": None if self.next_poses is None else self.next_poses.poses,
            "next_poses_file": self.next_poses_file,
            "next_poses_between": None
            if self.next_poses is None
            else [_candidate(candidate) for candidate in self.next_poses.between],
            "next_poses_separation": None
            if self.next_poses is None
            else [_finite(separation) for separation in self.next_poses.separation],
            "next_poses_beyond": None if self.next_poses is None else list(self.next_poses.beyond),
            "stations": [_placed(one, "session") for one in stations(self.final)],
            "target_places": [_placed(one, "target") for one in targets(self.final)],
            "tracker_scale": None if (scale := tracker_scale(self.final)) is None else scale[0],
            "tracker_scale_ci95": None if scale is None else scale[1],
            "validation": [one.as_json() for one in self.validation],
            "robot_file": self.robot_file,
            "findings": [finding.as_json() for finding in self.findings],
            "outputs": list(self.outputs),
            "exit": self.exit,
        }
        return complete_result("diagnose", result)

    def _named(self, named: Named) -> dict[str, object]:
        size = self.moved[named.candidate.key]
        return {
            "effect": named.effect,
            "joints": list(named.joints),
            "options": named.candidate.effect.described(),
            "parameters": {e.unknown.parameter.name: _parameter(e) for e in named.estimates},
            "fixed": dict(named.fixed),
            "displacement_rms_mm": mm(size.rms) if size else None,
            "displacement_max_mm": mm(size.max) if size else None,
            "evidence": _evidence(named.evidence),
        }


def diagnosed_csv(result: Diagnosed) -> bytes:
    """One row per reading: its place, its axes, its residual by the robot file, by the final model, and by a fit of the
    latter without its pose."""
    residuals = {
        "before": result.diagnosis.stated.residual,
        "after": result.final.residual,
        "held_out": result.held_out_after,
    }
    fitted = [str(int(counts)) for counts in result.counts]
    return residuals_csv(result.final.campaign, residuals, {"fitted": fitted})


def _placed(one: Placed, kind: str) -> dict[str, object]:
    entry: dict[str, object] = {kind: one.name}
    entry |= {axis: float(v) for axis, v in zip("xyz", one.position, strict=True)}
    entry |= {f"{axis}_ci95": float(v) for axis, v in zip("xyz", one.ci95, strict=True)}
    if one.angles is not None and one.angles_ci95 is not None:
        entry |= {axis: float(v) for axis, v in zip("abc", one.angles, strict=True)}
        entry |= {f"r{axis}_ci95": float(v) for axis, v in zip("xyz", one.angles_ci95, strict=True)}
    if kind == "target":
        entry["on_base"] = one.on_base
    return entry


def _candidate(candidate: Candidate) -> dict[str, object]:
    return {
        "effect": candidate.name,
        "joint": candidate.joint or None,
        "options": candidate.effect.described(),
        "label": candidate.label,
    }


def _limit(one: Smallest) -> dict[str, object]:
    """What would have been found from these sizes on; null where no size shows."""
    sizes = {
        u.parameter.name: {"smallest": _finite(size), "unit": u.parameter.unit}
        for u, size in zip(one.candidate.shown, one.parameters, strict=True)
    }
    rms = mm(one.rms) if np.isfinite(one.rms) else None
    return {**_candidate(one.candidate), "displacement_rms_mm": rms, "parameters": sizes}


def _parameter(estimate: Estimate) -> dict[str, object]:
    entry: dict[str, object] = {
        "value": estimate.value,
        "ci95": _finite(estimate.ci95),
        "unit": estimate.unknown.parameter.unit,
    }
    return entry | ({"at_bound": True} if estimate.at_bound else {})


def _refitted(estimate: Estimate) -> dict[str, object]:
    return {"parameter": estimate.unknown.name, "before": estimate.unknown.value, **_parameter(estimate)}


def _evidence(evidence: Evidence) -> dict[str, object]:
    return {
        "likelihood_gain": _finite(evidence.gain),
        "expected_by_chance": _finite(evidence.chance),
        "held_out_poses": _finite(evidence.heldout),
        "held_out_regions": _finite(evidence.regions),
        "held_out_sessions": _finite(evidence.sessions),
        "margin_to_next": _finite(evidence.margin),
        "next": None if evidence.alias is None else _candidate(evidence.alias),
    }


def _where(one: ResidualPattern) -> dict[str, object]:
    return {"variable": one.variable, "pattern": one.pattern, "share": round(one.share, 4)}


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _once(lists: list[list[str]]) -> list[list[str]]:
    """Each list once."""
    return [one for k, one in enumerate(lists) if one not in lists[:k]]
