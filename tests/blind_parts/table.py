"""Figures of the rows with 95 % intervals."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

SAMPLES = 2000


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
    return f"{percent(p)} ({percent(low)}..{percent(high)})"


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
    return text + _place(answers) + _names(answers) + _coverage(answers)


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


def _names(answers: Sequence[dict[str, Any]]) -> list[str]:
    seen = [one for one in answers if "named" in one]
    null = [one for one in seen if not one["hidden"]]
    text = [
        "",
        "| hidden | draws | right name % | no name % | wrong name % |",
        "| --- | --- | --- | --- | --- |",
    ]
    kinds = dict.fromkeys(tuple(one["hidden"]) for one in seen if len(one["hidden"]) == 1)
    for kind in kinds:
        own = [one for one in seen if tuple(one["hidden"]) == kind]
        right = sum(bool(one["named"]) and all(right_name(n, kind) for n in one["named"]) for one in own)
        none = sum(not one["named"] for one in own)
        cells = [
            kind[0],
            str(len(own)),
            *(share_interval(n, len(own)) for n in (right, none, len(own) - right - none)),
        ]
        text.append("| " + " | ".join(cells) + " |")
    wrong = sum(bool(one["named"]) for one in null)
    text.append(
        f"| nothing | {len(null)} | - | {share_interval(len(null) - wrong, len(null))}"
        f" | {share_interval(wrong, len(null))} |"
    )
    return text


def _coverage(answers: Sequence[dict[str, Any]]) -> list[str]:
    inside = [hit for one in answers for hit in one.get("covered", [])]
    if not inside:
        return []
    return [
        "",
        f"true values inside of their 95 % intervals: {share_interval(sum(inside), len(inside))} % of {len(inside)}",
    ]
