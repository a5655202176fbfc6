"""Figures of the rows with 95 % intervals."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

SAMPLES = 2000

TELLING = float(np.log(100.0))
"""An effect can be identified where the truth itself would be so much likelier (logarithm)."""


def percent(value: float) -> str:
    return f"{100 * value:.0f}"


def median_interval(values: np.ndarray, share: float = 0.5) -> str:
    """A quantile with its 95 % interval by a bootstrap."""
    if not len(values):
        return "-"
    rng = np.random.default_rng(0)
    drawn = np.quantile(rng.choice(values, (SAMPLES, len(values))), share, axis=1)
    low, high = np.quantile(drawn, [0.025, 0.975])
    return f"{percent(float(np.quantile(values, share)))} ({percent(low)}..{percent(high)})"


def share_interval(count: int, of: int) -> str:
    """A share in percent with its 95 % interval (E. B. Wilson: J. Am. Stat. Assoc. 22, 1927)."""
    if not of:
        return "-"
    p, z = count / of, 1.96
    middle, half = p + z * z / (2 * of), z * np.sqrt(p * (1 - p) / of + z * z / (4 * of * of))
    low, high = ((middle + sign * half) / (1 + z * z / of) for sign in (-1, 1))
    return f"{percent(p)} ({percent(max(low, 0.0))}..{percent(high)})"


NAMES = {
    "hysteresis": "hysteresis",
    "backlash": "backlash",
    "corner_force": "corner_force",
    "base": "base_compliance",
    "radial": "tool_compliance",
}


def right_name(named: str, hidden: Sequence[str]) -> bool:
    return any(named.startswith(NAMES[one]) for one in hidden)


def lines_of(answers: Sequence[dict[str, Any]]) -> list[str]:
    """The table, one line a row of the benchmark."""
    text = [
        "| row | draws | before um | after um | removed %: median | 5th percentile | mirror | mirror, GP | causes alone"
        " | worse % | within the promise % | refused % |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for row in dict.fromkeys(one["row"] for one in answers):
        own = [one for one in answers if one["row"] == row]
        done = [one for one in own if "after" in one]
        refused = share_interval(sum(bool(one["refused"]) for one in own), len(own))
        if not done:
            text.append(f"| {row} | {len(own)} |" + " - |" * 9 + f" {refused} |")
            continue
        before, after = (np.array([one[key] for one in done]) for key in ("before", "after"))
        removed = 1 - after / before
        others = [
            1 - np.array([one[key] for one in done]) / before for key in ("mirror", "mirror_gp", "alone")
        ]
        worse = sum(after > before + 2e-6)
        kept = sum(one["promise"][2] <= one["parts"][0] <= one["promise"][3] for one in done)
        cells = [
            row, str(len(own)), f"{1e6 * np.median(before):.0f}", f"{1e6 * np.median(after):.1f}",
            median_interval(removed), median_interval(removed, 0.05), *(median_interval(one) for one in others),
            share_interval(int(worse), len(done)), share_interval(kept, len(done)), refused,
        ]  # fmt: skip
        text.append("| " + " | ".join(cells) + " |")
    return text + _place(answers) + _other(answers) + _parts(answers) + _names(answers) + _coverage(answers)


def _place(answers: Sequence[dict[str, Any]]) -> list[str]:
    done = [one for one in answers if "place_after" in one]
    if not done:
        return []
    removed = np.array([1 - one["place_after"] / one["place_before"] for one in done])
    worse = sum(bool(value < 0) for value in removed)
    return [
        "",
        f"another place, robot file and force factors only: {median_interval(removed)} % removed, 5th percentile"
        f" {median_interval(removed, 0.05)}, worse {share_interval(worse, len(done))} % ({len(done)} draws)",
    ]


def _other(answers: Sequence[dict[str, Any]]) -> list[str]:
    done = [one for one in answers if "other_after" in one]
    if not done:
        return []
    removed = np.array([1 - one["other_after"] / one["other_before"] for one in done])
    worse = sum(bool(value < 0) for value in removed)
    return [
        "",
        f"other operations, of which nothing is claimed: {median_interval(removed)} % removed, worse"
        f" {share_interval(worse, len(done))} % ({len(done)} draws)",
    ]


def _parts(answers: Sequence[dict[str, Any]]) -> list[str]:
    """Errors of the parts one after another."""
    text = []
    for row in dict.fromkeys(one["row"] for one in answers if len(one.get("parts", [])) > 1):
        own = [one for one in answers if one["row"] == row and len(one.get("parts", [])) > 1]
        most = max(len(one["parts"]) for one in own)
        sizes = np.array([[one["before"], *one["parts"]] for one in own if len(one["parts"]) == most])
        middle, high = 1e6 * np.median(sizes, axis=0), 1e6 * np.quantile(sizes, 0.95, axis=0)
        words = ", ".join(f"{m:.1f} ({h:.1f})" for m, h in zip(middle, high, strict=True))
        text += ["", f"{row}: parts 1 to {most + 1}, um RMS, median (95th percentile): {words}"]
    return text


def _kind(name: str) -> str:
    """The effect of a name, without its joint."""
    return next((one for one, effect in NAMES.items() if name.startswith(effect)), name)


def _names(answers: Sequence[dict[str, Any]]) -> list[str]:
    """What is named, by what is hidden: all draws, and those in which it can be identified at all."""
    seen = [one for one in answers if "named" in one]
    hidden = dict.fromkeys(tuple(one["hidden"]) for one in seen)
    heads = [*NAMES, "engagement", "drift"]
    text = [
        "",
        "| hidden | draws | can be identified % | of these right % | wrong name % of all | ambiguous % | unknown %"
        " | named: " + " | ".join(heads) + " |",
        "| --- |" + " --- |" * (6 + len(heads)),
    ]
    for kind in sorted(hidden):
        own = [one for one in seen if tuple(one["hidden"]) == kind]
        able = [one for one in own if one.get("visible", 0.0) > TELLING]
        right = sum(bool(one["named"]) and all(right_name(n, kind) for n in one["named"]) for one in able)
        wrong = sum(any(not right_name(n, kind) for n in one["named"]) for one in own)
        names = [{_kind(name) for name in one["named"]} for one in own]
        verdicts = [sum(one["verdict"] == word for one in own) for word in ("ambiguous", "unknown")]
        cells = [
            " and ".join(kind) or "nothing",
            str(len(own)),
            share_interval(len(able), len(own)) if kind else "-",
            share_interval(right, len(able)),
            share_interval(wrong, len(own)),
            *(percent(count / len(own)) for count in verdicts),
            *(str(sum(head in each for each in names)) for head in heads),
        ]
        text.append("| " + " | ".join(cells) + " |")
    return text


def _coverage(answers: Sequence[dict[str, Any]]) -> list[str]:
    inside = [hit for one in answers for hit in one.get("covered", [])]
    if not inside:
        return []
    return [
        "",
        f"true values inside of their 95 % intervals: {share_interval(sum(inside), len(inside))} % of {len(inside)}",
    ]
