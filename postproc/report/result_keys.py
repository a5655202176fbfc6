"""What every machine-readable result carries, and the former names of its keys, which stay beside them for one version.

A result is built with its present keys only; ``complete_result`` adds the rest where it is written.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from postproc import __version__

SCHEMA_VERSION = 2
"""Counts up when a key changes its meaning or goes; version 1 had no such key."""

_UNCERTAINTY = {
    "lower_bound": "lower_bound",
    "without_interval": "without_interval",
    "ten_percent_mm": "effect_of_10_percent_mm",
    "level_unstated": "level_unstated",
    "blame": "budget",
    "unstable": "no_equilibrium",
}
_PROGRAM = {
    "": {
        "left": "uncorrected",
        "links": "transition_moves",
        "way_after_mm": "path_error_mm",
        "angle_way_after_deg": "path_error_deg",
        **{f"doubt.{former}": f"uncertainty.{present}" for former, present in _UNCERTAINTY.items()},
    },
    "transition_moves.*": {"mm": "length_mm"},
}


def _held_out(*quantities: str) -> dict[str, str]:
    return {
        f"heldout_{end}_{quantity}_mm": f"held_out_{end}_{quantity}_mm"
        for quantity in quantities
        for end in ("before", "after")
    }


FORMER_KEYS: Mapping[str, Mapping[str, Mapping[str, str]]] = {
    "program": _PROGRAM,
    "predict": _PROGRAM,
    "identify": {
        "": {"held": "fixed", "outliers_left_out": "outliers_excluded"},
        "validation": {"registered_anew": "registration_refitted"},
        "gap": _held_out("rms", "mean", "max"),
        "residuals.direction.*": _held_out("rms", "mean"),
        "residuals.joint.*.parts.*": _held_out("rms"),
        "residuals.load.parts.*": _held_out("rms"),
        "residuals.order.parts.*": _held_out("rms"),
    },
    "plan": {
        "": {
            "held": "fixed",
            "unseen": "unobservable",
            "weak": "weakly_observable",
            "left_out": "excluded",
            "random": "random_poses",
        }
    },
    "diagnose": {
        "": {
            "where": "residual_patterns",
            "where_refitted": "residual_patterns_refitted",
            "where_left": "residual_patterns_final",
            "lack": "reduced_chi2",
        },
        "gap": _held_out("rms"),
        "named.*": {
            "held": "fixed",
            "moves_rms_mm": "displacement_rms_mm",
            "moves_max_mm": "displacement_max_mm",
        },
        "named.*.evidence": {
            "gain": "likelihood_gain",
            "chance": "expected_by_chance",
            "heldout": "held_out_poses",
            "regions": "held_out_regions",
            "sessions": "held_out_sessions",
            "margin": "margin_to_next",
            "alias": "next",
        },
    },
    "map": {"": {"where": "extremes_at"}},
    "batch": {"": {"passed_over": "skipped_files"}, "programs.*": {"left": "uncorrected"}},
    "robots": {"robots.*.identified.*.gap": _held_out("rms")},
}
"""Command -> place in its result -> former key -> present key.  In a place ``*`` is every item of a list or mapping; a
key with a dot lies in the mapping before the dot."""


def complete_result(command: str, result: Mapping[str, object]) -> dict[str, object]:
    """The ``result`` of a command with what all results carry, and with the former names of its keys."""
    whole: dict[str, Any] = {
        "schema_version": SCHEMA_VERSION,
        "version": __version__,
        "command": command,
        **result,
    }
    for place, names in FORMER_KEYS.get(command, {}).items():
        for holder in _holders(whole, place.split(".") if place else []):
            for former, present in names.items():
                outer, dot, key = present.rpartition(".")
                source = holder.get(outer, {}) if dot else holder
                if key in source:
                    outer, dot, name = former.rpartition(".")
                    target = holder.setdefault(outer, {}) if dot else holder
                    target[name] = source[key]
    return whole


def _holders(value: Any, place: list[str]) -> Iterator[dict[str, Any]]:
    """The mappings at a place."""
    if not place:
        if isinstance(value, dict):
            yield value
        return
    step, *rest = place
    if step != "*":
        inner = [value[step]] if isinstance(value, dict) and step in value else []
    else:
        inner = list(value.values() if isinstance(value, dict) else value or ())
    for one in inner:
        yield from _holders(one, rest)
