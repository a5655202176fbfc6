"""Figures of the rows with 95 % intervals."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

SAMPLES = 2000

TELLING, AHEAD = float(np.log(100.0)), float(np.log(19.0))
"""An effect shows where the truth itself makes the deviations so much likelier, and can be named where it makes them so
much likelier than any other effect does (logarithms)."""


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
    return (
        text
        + _worse(answers)
        + _place(answers)
        + _other(answers)
        + _parts(answers)
        + _names(answers)
        + _coverage(answers)
    )


FEW = ("same20", "same30", "planned30")
"""Rows with less than 50 points."""


def _worse(answers: Sequence[dict[str, Any]]) -> list[str]:
    """Parts that were worse than before, and by how much."""
    done = [one for one in answers if "after" in one and one["row"] not in FEW]
    if not done:
        return []
    worse = sorted(
        ((one["after"] - one["before"], one) for one in done if one["after"] > one["before"]),
        key=lambda pair: -pair[0],
    )
    each = ", ".join(f"{1e6 * more:.1f} ({one['row']}, {1e6 * one['before']:.1f})" for more, one in worse)
    text = f"50 points or more: worse {len(worse)} of {len(done)}"
    return ["", text + (f", by um (row, before): {each}" if each else "")]


def _place(answers: Sequence[dict[str, Any]]) -> list[str]:
    done = [one for one in answers if "place_after" in one]
    if not done:
        return []
    removed = np.array([1 - one["place_after"] / one["place_before"] for one in done])
    worse = sum(bool(value < 0) for value in removed)
    return [
        "",
        f"another place, robot file, force factors and tool errors only: {median_interval(removed)} % removed,"
        f" 5th percentile {median_interval(removed, 0.05)}, worse {share_interval(worse, len(done))} %"
        f" ({len(done)} draws)",
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


HEADS = (
    "hysteresis",
    "backlash",
    "corner_force",
    "base_compliance",
    "tool_compliance",
    "engagement",
    "drift",
)


def _names(answers: Sequence[dict[str, Any]]) -> list[str]:
    """What is named, by what is hidden: all draws, and those in which it can be named at all."""
    seen = [one for one in answers if "named" in one]
    worn = {one["row"]: "worn: " for one in seen if one["row"].startswith("worn")}
    groups: dict[str, list[dict[str, Any]]] = {}
    for one in seen:
        groups.setdefault(worn.get(one["row"], "") + " and ".join(sorted(one["hidden"])), []).append(one)
    text = [
        "",
        "| hidden | draws | shows % | shows, of these named or in the set % | can be named % | of these named %"
        " | wrong name % of all | one of a set % | of these true % | no name % | named: "
        + " | ".join(HEADS)
        + " |",
        "| --- |" + " --- |" * (9 + len(HEADS)),
    ]
    for kind in sorted(groups):
        own = groups[kind]
        shows = [one for one in own if one.get("visible", 0.0) > TELLING]
        able = [one for one in shows if one["ahead"] > AHEAD]
        sets = [one for one in own if one["alternatives"]]
        cells = [
            kind or "nothing",
            str(len(own)),
            share_interval(len(shows), len(own)) if kind else "-",
            share_interval(sum(_met(one, one["named"] + one["alternatives"]) for one in shows), len(shows)),
            share_interval(len(able), len(own)) if kind else "-",
            share_interval(sum(_met(one, one["named"]) for one in able), len(able)),
            share_interval(
                sum(bool(set(one["named"]) - set(one.get("labels", ()))) for one in own), len(own)
            ),
            share_interval(len(sets), len(own)),
            share_interval(sum(_met(one, one["alternatives"]) for one in sets), len(sets)),
            share_interval(sum(not one["named"] and not one["alternatives"] for one in own), len(own)),
            *(str(sum(any(n.startswith(head) for n in one["named"]) for one in own)) for head in HEADS),
        ]
        text.append("| " + " | ".join(cells) + " |")
    hidden = [one for one in seen if one["hidden"]]
    wrong = sum(bool(set(one["named"]) - set(one.get("labels", ()))) for one in hidden)
    return [*text, "", f"a wrong name where something is hidden: {share_interval(wrong, len(hidden))} %"]


def _met(answer: dict[str, Any], names: Sequence[str]) -> bool:
    """Whether a hidden effect is among ``names``."""
    return bool(set(names) & set(answer.get("labels", ())))


def _coverage(answers: Sequence[dict[str, Any]]) -> list[str]:
    """Share of true values in their intervals of 95 %, of robots without and with hidden hardware."""
    kinds: dict[str, None] = {}
    hits: dict[tuple[str, bool], list[int]] = {}
    for one in answers:
        covered = dict(one.get("covered", {}))
        if "parts" in one:
            low, high = one["promise"][2:]
            covered["error of the next part"] = [int(low <= one["parts"][0] <= high)]
        for kind, inside in covered.items():
            kinds[kind] = None
            hits.setdefault((kind, bool(one["hidden"])), []).extend(inside)
    if not kinds:
        return []
    text = [
        "",
        "| 95 % interval of | nothing hidden: values | true value inside % | hidden: values | inside % |",
    ]
    text += ["| --- |" + " --- |" * 4]
    for kind in kinds:
        cells = [
            word
            for hidden in (False, True)
            for own in [hits.get((kind, hidden), [])]
            for word in (str(len(own)), share_interval(sum(own), len(own)))
        ]
        text.append(f"| {kind} | " + " | ".join(cells) + " |")
    return text
