"""The result of ``compensate identify``: parameters with intervals, and residuals; as JSON and CSV."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from pathlib import Path

import numpy as np

from postproc.base.arrays import Bools, Floats
from postproc.base.dataclass import dataclass
from postproc.base.findings import Finding
from postproc.identification.fit import Estimate, Fit
from postproc.identification.identifiable import strong_correlations
from postproc.identification.outliers import Outlier
from postproc.identification.validation import Bootstrap, Validation
from postproc.report.report import exit_code
from postproc.report.residuals import (
    ResidualVariable,
    Sizes,
    gap_of,
    joint_variables,
    lengths_of,
    mm,
    residuals_csv,
)
from postproc.report.result import Columns, Result, columns_of
from postproc.report.result_keys import complete_result
from postproc.robot.chain import generalized_force
from postproc.robot.provenance import GAP

STRONG = 0.9
"""Correlations above are reported."""

SAME_FORCE = 0.01
"""Share by which forces must differ before readings are sorted by them."""


@dataclass(frozen=True)
class Sum:
    """Parameters that only show together: ``of`` name -> weight, of which the first is identified and the others are
    fixed; ``value`` and ``ci95`` (SI) of their sum."""

    of: Mapping[str, float]
    value: float
    ci95: float
    unit: str


@dataclass(frozen=True, repr=False)
class Identified(Result):
    """The result of ``identify``.

    data: name and SHA-256 of each file; effects: as asked for; before, after: without and with the unknowns; fixed:
    dimensions of hardware that are not fitted; held_out_before, held_out_after (R, 3) [m]: residuals of each pose by
    fits without this pose; outliers: rows of the campaign, excluded from both fits or not.
    """

    headline = ("robot", "readings", "rank", "gap.before_rms_mm", "gap.after_rms_mm", "exit")

    robot: str
    robot_file: Path
    robot_digest: str
    data: tuple[tuple[str, str], ...]
    effects: tuple[str, ...]
    before: Fit
    after: Fit
    fixed: tuple[str, ...]
    held_out_before: Floats | None
    held_out_after: Floats | None
    folds: int
    validation: Validation | None
    outliers: tuple[Outlier, ...]
    outliers_excluded: bool
    bootstrap: Bootstrap | None
    findings: tuple[Finding, ...] = ()
    outputs: tuple[str, ...] = ()
    strict: bool = False

    @property
    def exit(self) -> int:
        return exit_code(self.findings, self.strict)

    # Residuals.

    @cached_property
    def counts(self) -> Bools:
        """(R,) readings that were fitted."""
        return np.asarray((self.after.plain_weights.weight[:, :3] > 0).any(axis=1))

    @cached_property
    def residuals(self) -> dict[str, Floats]:
        """(R, 3) [m] of all readings, under the names that ``gap`` starts with; NaN where nothing was measured."""
        known = {"before": self.before.residual, "after": self.after.residual}
        held_out = {"held_out_before": self.held_out_before, "held_out_after": self.held_out_after}
        return known | {name: values for name, values in held_out.items() if values is not None}

    @cached_property
    def lengths(self) -> dict[str, Floats]:
        """(R,) [m] of ``residuals``, NaN for readings that were not fitted."""
        measured = np.isfinite(self.after.campaign.readings.value)
        return {
            name: np.where(self.counts, lengths_of(values, measured), np.nan)
            for name, values in self.residuals.items()
        }

    @cached_property
    def validation_lengths(self) -> dict[str, Floats]:
        """(V,) [m] of the readings to validate with, before and after."""
        if self.validation is None:
            return {}
        measured = np.isfinite(self.validation.campaign.readings.value)
        residuals = {"before": self.validation.before, "after": self.validation.after}
        return {name: lengths_of(values, measured) for name, values in residuals.items()}

    @cached_property
    def validated_files(self) -> list[tuple[str, dict[str, Floats]]]:
        """Path of each file to validate with, and the lengths (V,) [m] of its readings before and after."""
        if self.validation is None:
            return []
        readings = self.validation.campaign.readings
        return [
            (
                str(path),
                {name: values[readings.file == k] for name, values in self.validation_lengths.items()},
            )
            for k, path in enumerate(readings.files)
        ]

    def gap_mm(self) -> dict[str, float]:
        """Root mean squares of residuals, and the scatter of the readings; what is not known is omitted."""
        return gap_of(self.lengths, self.after.noise)

    @property
    def sigma(self) -> float:
        """[m] one sigma of a coordinate: as stated or as repeats show, or else as the residuals do."""
        noise = self.after.noise
        return float(np.sqrt(np.mean(noise.sigma**2) * (1.0 if noise.known else self.after.factor)))

    @cached_property
    def joints(self) -> tuple[ResidualVariable, ...]:
        """The position of each joint."""
        return joint_variables(self.after.campaign.readings)

    @cached_property
    def load(self) -> ResidualVariable | None:
        """The force, or where that is always the same the largest torque on a joint; None where nothing acts."""
        campaign, model = self.after.campaign, self.after.model
        force = np.linalg.norm(campaign.readings.wrench[:, :3], axis=1)
        if np.ptp(force) > SAME_FORCE * force.max():
            return ResidualVariable("force", "N", force)
        if not campaign.readings.wrench.any():
            return None
        swept = model.state(campaign.q, campaign.wrench, campaign.tool, campaign.conditions).swept
        torque = generalized_force(swept, swept.position, campaign.wrench.T)[model.chain.motor_rows]
        turning = [not slides for _, slides in campaign.readings.joints]
        return ResidualVariable(
            "largest joint torque", "N m", np.abs(torque[turning]).max(axis=0, initial=0.0)[campaign.at]
        )

    @property
    def order(self) -> ResidualVariable:
        """The number of each reading, in the order of time."""
        return ResidualVariable("reading", "", np.arange(1.0, len(self.after.campaign) + 1.0))

    # Parameters.

    @cached_property
    def sums(self) -> tuple[Sum, ...]:
        """What is known of parameters that were dropped because they only show together with others.

        The columns of a dropped parameter d being the sum of w_i times those of identified parameters p_i, the
        model depends on each p_i + w_i d only.
        """
        after = self.after
        values = {u.name: after.model.terms[u.term].values[u.parameter.name] for u in after.asked}
        sums = []
        for estimate in after.estimates:
            name = estimate.unknown.name
            others = {
                dropped.name: weight
                for dropped in after.dropped
                for partner, weight in dropped.together
                if partner == name
            }
            if others:
                value = estimate.value + sum(weight * values[other] for other, weight in others.items())
                unit = estimate.unknown.parameter.unit
                sums.append(Sum({name: 1.0, **others}, value, estimate.ci95, unit))
        return tuple(sums)

    @cached_property
    def correlations(self) -> tuple[tuple[str, str, float], ...]:
        """Pairs of parameters above ``STRONG``, strongest first."""
        names = [unknown.name for unknown in self.after.unknowns]
        return strong_correlations(names, self.after.covariance, STRONG)

    @cached_property
    def bootstrap_ci95(self) -> dict[str, float]:
        """(SI) half widths by the bootstrap, from their deviations as the others; {} without."""
        if self.bootstrap is None:
            return {}
        wide = self.after.quantile * self.bootstrap.deviation
        return {u.name: w for u, w in zip(self.after.unknowns, wide.tolist(), strict=True)}

    def table(self) -> Columns:
        """One row a parameter: parameter, value, ci95, unit, before."""
        return columns_of([{"parameter": e.unknown.name, **self._parameter(e)} for e in self.after.estimates])

    def as_json(self) -> dict[str, object]:
        """The machine-readable result; the keys are public."""
        after, readings = self.after, self.after.campaign.readings
        effects: dict[str, dict[str, object]] = {}
        for estimate in after.estimates:
            effect, _, parameter = estimate.unknown.name.partition(".")
            effects.setdefault(effect, {})[parameter] = self._parameter(estimate)
        units = {unknown.name: unknown.parameter.unit for unknown in after.asked}
        values = {u.name: after.model.terms[u.term].values[u.parameter.name] for u in after.asked}
        result = {
            "robot": self.robot,
            "robot_file": str(self.robot_file),
            "robot_digest": self.robot_digest,
            "data": [{"file": name, "sha256": digest} for name, digest in self.data],
            "asked": list(self.effects),
            "measured": "deflection" if readings.deflection else "position",
            "readings": len(readings),
            "fitted_readings": int(self.counts.sum()),
            "poses": after.campaign.poses,
            "targets": len(after.campaign.targets),
            "sessions": len(readings.sessions),
            "effects": effects,
            "sums": [
                {
                    "of": [list(part) for part in one.of.items()],
                    "value": one.value,
                    "ci95": one.ci95,
                    "unit": one.unit,
                }
                for one in self.sums
            ],
            "gap": self._gap(),
            "folds": self.folds,
            "validation": self._validation(),
            "condition": float(after.condition),
            "rank": len(after.unknowns),
            "dropped": [
                {"name": one.name, "why": one.why, "value": values[one.name], "unit": units[one.name]}
                for one in after.dropped
            ],
            "fixed": list(self.fixed),
            "at_bound": [estimate.unknown.name for estimate in after.estimates if estimate.at_bound],
            "correlations": [[a, b, round(size, 6)] for a, b, size in self.correlations],
            "bootstrap": None if self.bootstrap is None else {"draws": self.bootstrap.draws},
            "noise": {
                "sigma_mm": mm(self.sigma),
                "source": after.noise.source,
                "exceeded": bool(after.scatter_exceeded),
                "shared_mm": mm(after.shared_error),
            },
            "residuals": self._residuals(),
            "outliers": [
                {
                    "file": one.file,
                    "line": one.line,
                    "distance_mm": mm(one.distance),
                    "sigmas": round(one.sigmas, 2),
                    "what": one.what,
                }
                for one in self.outliers
            ],
            "outliers_excluded": self.outliers_excluded,
            "findings": [finding.as_json() for finding in self.findings],
            "outputs": list(self.outputs),
            "exit": self.exit,
        }
        return complete_result("identify", result)

    def _parameter(self, estimate: Estimate) -> dict[str, object]:
        unknown = estimate.unknown
        entry: dict[str, object] = {
            "value": estimate.value,
            "ci95": estimate.ci95,
            "unit": unknown.parameter.unit,
            "before": None if unknown.stated is None else unknown.value,
        }
        if unknown.name in self.bootstrap_ci95:
            entry["bootstrap_ci95"] = self.bootstrap_ci95[unknown.name]
        if estimate.at_bound:
            entry["at_bound"] = True
        if unknown.prior is not None and not unknown.gauge:
            entry["prior"] = True
        return entry

    def _gap(self) -> dict[str, float | None]:
        known = self.gap_mm()
        gap: dict[str, float | None] = {key: known.get(key) for key in GAP}
        for name, lengths in self.lengths.items():
            size = Sizes.of(lengths)
            gap[f"{name}_mean_mm"] = mm(size.mean) if size else None
            gap[f"{name}_max_mm"] = mm(size.max) if size else None
        return gap

    def _validation(self) -> dict[str, object] | None:
        if self.validation is None:
            return None
        entry: dict[str, object] = {
            "data": [path.name for path in self.validation.campaign.readings.files],
            "readings": len(self.validation.campaign),
            "registration_refitted": self.validation.registered_anew,
        }
        entry |= _sizes(self.validation_lengths)
        entry["files"] = [
            {"file": file, "readings": len(lengths["before"]), **_sizes(lengths)}
            for file, lengths in self.validated_files
        ]
        return entry

    def _residuals(self) -> dict[str, object]:
        """Root mean squares by direction, and by parts of what the readings differ in."""
        directions: dict[str, dict[str, float | None]] = {}
        for k, axis in enumerate("xyz"):
            figures: dict[str, float | None] = {}
            for name, values in self.residuals.items():
                column = values[self.counts, k]
                column = column[np.isfinite(column)]
                figures[f"{name}_rms_mm"] = mm(np.sqrt(np.mean(column**2))) if len(column) else None
                figures[f"{name}_mean_mm"] = mm(column.mean()) if len(column) else None
            directions[axis] = figures
        return {
            "direction": directions,
            "joint": {variable.name: self._by(variable) for variable in self.joints},
            "load": None if self.load is None else {"what": self.load.name, **self._by(self.load)},
            "order": self._by(self.order),
        }

    def _by(self, variable: ResidualVariable) -> dict[str, object]:
        parts = []
        for rows in variable.parts():
            inside = variable.values[rows]
            part: dict[str, object] = {
                "from": round(float(inside.min()), 6),
                "to": round(float(inside.max()), 6),
                "readings": len(rows),
            }
            for name, lengths in self.lengths.items():
                size = Sizes.of(lengths[rows])
                part[f"{name}_rms_mm"] = mm(size.rms) if size else None
            parts.append(part)
        return {"unit": variable.unit, "parts": parts}


def identified_csv(result: Identified) -> bytes:
    """One row per reading: its place, its axes, its residual before, after, and of a fit without its pose."""
    residuals = {
        "before": result.before.residual,
        "after": result.after.residual,
        "held_out": result.held_out_after,
    }
    outlier = {one.row for one in result.outliers}
    more = {
        "outlier": [str(int(row in outlier)) for row in range(len(result.counts))],
        "fitted": [str(int(counts)) for counts in result.counts],
    }
    return residuals_csv(result.after.campaign, residuals, more)


def _sizes(named: Mapping[str, Floats]) -> dict[str, object]:
    """Root mean square, mean and largest [mm] of ``named`` lengths (R,) [m]."""
    entry: dict[str, object] = {}
    for name, lengths in named.items():
        size = Sizes.of(lengths)
        for key in ("rms", "mean", "max"):
            entry[f"{name}_{key}_mm"] = mm(getattr(size, key)) if size else None
    return entry
