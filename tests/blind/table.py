"""What all runs came to: counts with intervals, rates an effect, confusion, picture."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from scipy.stats import binomtest

from .cases import POSES, ROWS, SNRS
from .hidden import EVERY, OUTSIDE
from .verdicts import named

Records = Sequence[dict]

SEPARATE = 5.2
"""Standard deviations between two explanations from which on a plan is said to distinguish them."""


def share(records: Records, holds: Callable[[dict], bool]) -> str:
    """Count, share and its 95 % interval (Wilson)."""
    n = len(records)
    if not n:
        return "-"
    k = sum(map(holds, records))
    low, high = binomtest(k, n).proportion_ci(method="wilson")
    return f"{k:4d} of {n:4d}  {100 * k / n:5.1f} %  ({100 * low:.1f} .. {100 * high:.1f})"


def share_of_runs(runs: Sequence[Sequence[bool | None]]) -> str:
    """Count, share and its 95 % interval of what holds in several runs, None does not count.

    What one run has goes together: as many independent ones count as have the variance that the runs show (Kish,
    Survey Sampling (1965), Sec. 8.2), and no more than there are; Wilson's interval of so many.
    """
    each = np.array([[sum(x is True for x in one), sum(x is not None for x in one)] for one in runs]).reshape(
        -1, 2
    )
    each = each[each[:, 1] > 0]
    k, n = each.sum(axis=0)
    if not n:
        return "-"
    count, away = float(n), each[:, 0] - k / n * each[:, 1]
    if len(each) > 1 and away.any():
        variance = len(each) / (len(each) - 1) * float(away @ away) / n**2
        count = min(count, k / n * (1 - k / n) / variance)
    z, p = 1.959964, k / n
    middle = (p + z**2 / (2 * count)) / (1 + z**2 / count)
    half = z / (1 + z**2 / count) * np.sqrt(p * (1 - p) / count + z**2 / (4 * count**2))
    low, high = max(0.0, middle - half), min(1.0, middle + half)
    return f"{k:4d} of {n:4d}  {100 * p:5.1f} %  ({100 * low:.1f} .. {100 * high:.1f})"


def is_right(record: dict) -> bool:
    return record["right"]


def is_named(record: dict) -> bool:
    """Whether any effect was said to be there."""
    return bool(record["answer"].get("named"))


def is_careful(record: dict) -> bool:
    """Whether nothing was named that is not there."""
    return record["outcome"] in ("exact", "ambiguous", "undecided", "missed", "unseen")


def has_true_sets(record: dict) -> bool:
    """Whether each set of equal explanations has one in it that is there."""
    truth = {tuple(pair) for pair in record["truth"]}
    sets = [{named(c["effect"], c["joint"] or "") for c in of} for of in record["answer"]["alternatives"]]
    return all(of & truth for of in sets)


def is_settled(record: dict) -> bool:
    """Whether the truth was named after more poses had been measured."""
    return record["later"]["outcome"] == "exact"


def is_wrong(record: dict) -> bool:
    return record["outcome"] == "wrong"


def of_fresh(records: Records) -> list[str]:
    """What new robot files leave at fresh poses, of cases that show at least twice as much as readings scatter."""
    both = [r["fresh"] for r in records if r.get("fresh") and r["snr"] >= 2 and r["reached"]]
    words = "fresh poses, RMS new over old, SNR >= 2", "  of who knows which effects are there"
    return [
        f"{name:46} {np.median(of):.3f} in the median, {max(of):.3f} at worst of {len(of)}"
        for name, of in zip(words, zip(*both, strict=True), strict=False)
    ]


def matrix(records: Records) -> list[str]:
    """The rows of the matrix."""
    by = {row: [r for r in records if r["row"] == row and r["reached"]] for row in ROWS}

    def at(rows: Sequence[str], low: float, high: float = np.inf) -> list[dict]:
        return [r for row in rows for r in by[row] if low <= r["snr"] <= high]

    lines = [
        ("null data given a name, clean", by["null_clean"], is_named),
        ("null data given a name, cluttered", by["null_cluttered"], is_named),
        ("null data: nothing missing, clean", by["null_clean"], is_right),
        ("null data: nothing missing, cluttered", by["null_cluttered"], is_right),
        ("single, right, SNR 0.5", at(["single"], 0.5, 0.5), is_right),
        ("single, right, SNR 1", at(["single"], 1.0, 1.0), is_right),
        ("single, right, SNR >= 2", at(["single"], 2.0), is_right),
        ("decoys, right, SNR 1", at(["decoy"], 1.0, 1.0), is_right),
        ("decoys, right, SNR >= 2", at(["decoy"], 2.0), is_right),
        ("pairs, right, SNR >= 2", at(["pair"], 2.0), is_right),
        ("triples, right, SNR >= 2", at(["triple"], 2.0), is_right),
        ("wrong name, SNR >= 2", at(["single", "decoy", "pair", "triple"], 2.0), is_wrong),
        ("outside: unknown, SNR >= 2", at(["outside"], 2.0), is_right),
        ("outside: misnamed, SNR >= 2", at(["outside"], 2.0), is_named),
        ("outside: given a name, SNR <= 1", at(["outside"], 0.0, 1.0), is_named),
        ("unidentifiable: ambiguous, or nothing claimed", by["unidentifiable"], is_right),
        (
            "not separable: truth in the set",
            [r for r in at(["single", "pair", "triple"], 1.0) if inseparable(r)],
            is_right,
        ),
        (
            "said to be ambiguous: truth in the set",
            [
                r
                for r in at(["single", "decoy", "pair", "triple"], 0.5)
                if r["answer"]["verdict"] == "ambiguous"
            ],
            lambda r: r["outcome"] in ("ambiguous", "undecided"),
        ),
        (
            "  a truth in each set, whatever else is missed",
            [
                r
                for r in at(["single", "decoy", "pair", "triple"], 0.5)
                if r["answer"]["verdict"] == "ambiguous"
            ],
            has_true_sets,
        ),
        (
            "compensator named, 15 poses, 0.05 mm",
            [r for r in by["compensator"] if r["poses"] == 15],
            is_right,
        ),
        ("compensator named, 40 poses, 0.1 mm", [r for r in by["compensator"] if r["poses"] == 40], is_right),
        ("the same without one: given a name", by["compensator_null"], is_named),
        ("the same, A2 within 20 deg: nothing else named", by["compensator_narrow"], is_careful),
    ]
    told = [f"{name:46} {share(chosen, holds)}" for name, chosen, holds in lines]
    for k, words in enumerate(("95 % intervals hold what no scatter gives", "  the true values themselves")):
        holds = [[both[k] for both in r["covered"].values()] for r in records if r["covered"]]
        told.append(f"{words:46} {share_of_runs(holds)}")
    again = [r for r in records if "again" in r]
    words = "named, then nothing missing with the new file"
    told.append(f"{words:46} {share(again, lambda r: r['again'] == 'nothing_missing')}")
    later = [r for r in records if "later" in r and r["outcome"] in ("ambiguous", "undecided")]
    narrow = [r for r in later if r["row"] == "compensator_narrow"]
    told.append(f"{'  of these ambiguous: right after 6 more poses':46} {share(narrow, is_settled)}")
    later = [r for r in later if r not in narrow]
    told.append(f"{'single and decoys, ambiguous: right after 6 more':46} {share(later, is_settled)}")
    hopeful = [r for r in later if all((s or 0) >= SEPARATE for s in r["answer"]["next_poses_separation"])]
    told.append(f"{'  of these, where the plan says that they do':46} {share(hopeful, is_settled)}")
    closed = [r["closed"] for r in records if r.get("closed") is not None and r["snr"] >= 2 and r["reached"]]
    if closed:
        told.append(
            f"{'gap closed of what an oracle closes, SNR >= 2':46} {100 * np.median(closed):.1f} % in the median,"
            f" {100 * np.mean(np.clip(closed, 0, 1)):.1f} % in the mean of {len(closed)}"
        )
    told += of_fresh(records)
    unreached = Counter(tuple(r["effects"]) for r in records if not r["reached"])
    if unreached:
        told.append(
            "can not be that large, left out: "
            + ", ".join(f"{'+'.join(k)} {v}" for k, v in unreached.items())
        )
    seconds = [r["answer"]["seconds"] for r in records]
    told.append(
        f"a diagnosis took {np.mean(seconds):.1f} s, {np.median(seconds):.1f} in the median, {max(seconds):.0f} at most"
    )
    return told


def of_intervals(records: Records) -> list[str]:
    """How often intervals hold the true values, by row and by kind of parameter."""
    held: dict[str, dict[str, list[bool]]] = {}
    for record in records:
        for name, (_, inside, *_) in (record["covered"] or {}).items():
            if inside is not None:
                for kind in (record["row"], name.partition(".")[0].partition(" ")[0]):
                    held.setdefault(kind, {}).setdefault(record["key"], []).append(inside)
    return [
        f"true values in intervals, {kind:20} {share_of_runs([*of.values()])}" for kind, of in held.items()
    ]


def inseparable(record: dict) -> bool:
    return any(of and of[0][2] < 10.0 for of in record["rivals"])


def per_effect(records: Records) -> list[str]:
    """Single effects right, by SNR and by poses (SNR >= 1)."""
    single = [r for r in records if r["row"] == "single" and r["reached"]]
    head = [f"SNR {snr:g}" for snr in SNRS] + [f"{poses} poses" for poses in POSES] + ["SNR >= 1"]
    lines = [f"{'right':22} " + " ".join(f"{h:>9}" for h in head)]
    for effect in EVERY:
        own = [r for r in single if r["effects"] == [effect]]
        parts = [[r for r in own if r["snr"] == snr] for snr in SNRS]
        seen = [r for r in own if r["snr"] >= 1]
        parts += [[r for r in seen if r["poses"] == poses] for poses in POSES] + [seen]
        cells = [f"{sum(map(is_right, part))}/{len(part)}" if part else "-" for part in parts]
        lines.append(f"{effect:22} " + " ".join(f"{cell:>9}" for cell in cells))
    return lines


def confusion(records: Records) -> tuple[list[str], list[str], np.ndarray]:
    """Names of rows (truth) and columns (what was said), and counts: of nulls, singles and outside at SNR >= 1."""
    truths = ["nothing", *EVERY, *OUTSIDE]
    said = ["nothing", *EVERY, "right effect, wrong joint", "several", "ambiguous", "unknown"]
    counts = np.zeros((len(truths), len(said)), int)
    for r in records:
        if r["row"] not in ("null_clean", "null_cluttered", "single", "outside") or not r["reached"]:
            continue
        if r["snr"] and r["snr"] < 1:
            continue
        counts[truths.index(r["effects"][0] if r["effects"] else "nothing"), said.index(_said(r))] += 1
    return truths, said, counts


def _said(record: dict) -> str:
    answer = record["answer"]
    word, names = answer["verdict"], answer.get("named", [])
    if word == "nothing_missing":
        return "nothing"
    if word in ("unknown", "refused"):
        return "unknown"
    if word == "ambiguous":
        return "ambiguous"
    effects = {one["effect"] for one in names}
    if len(effects) > 1:
        return "several"
    if list(effects) == record["effects"] and record["outcome"] not in ("exact", "partly"):
        return "right effect, wrong joint"
    return effects.pop()


def confusion_text(records: Records) -> list[str]:
    truths, said, counts = confusion(records)
    short = [f"{i:>4}" for i in range(len(said))]
    lines = [f"{'hidden':22} " + "".join(short)]
    for name, row in zip(truths, counts, strict=True):
        lines.append(f"{name:22} " + "".join(f"{n or '.':>4}" for n in row))
    return [*lines, "said: " + ", ".join(f"{i} {name}" for i, name in enumerate(said))]


def picture(records: Records, path: Path) -> None:
    """The confusion as shares of each truth."""
    from matplotlib.figure import Figure

    truths, said, counts = confusion(records)
    shares = counts / np.maximum(counts.sum(axis=1, keepdims=True), 1)
    figure = Figure(figsize=(11, 10), layout="constrained")
    axes = figure.add_subplot()
    axes.imshow(shares, cmap="Blues", vmin=0, vmax=1, aspect="auto")
    axes.set_xticks(range(len(said)), said, rotation=60, ha="right")
    axes.set_yticks(
        range(len(truths)), [f"{name} ({n})" for name, n in zip(truths, counts.sum(axis=1), strict=True)]
    )
    axes.set_xlabel("what the diagnosis said")
    axes.set_ylabel("what was hidden (runs)")
    for i, j in np.argwhere(counts > 0):
        dark = shares[i, j] > 0.6
        axes.text(
            j,
            i,
            f"{100 * shares[i, j]:.0f}",
            ha="center",
            va="center",
            size=8,
            color="white" if dark else "black",
        )
    axes.axhline(len(EVERY) + 0.5, color="grey", lw=0.8)
    axes.set_title("Hidden effects and verdicts, % of the runs with SNR 1, 2 and 5")
    figure.savefig(path, dpi=110)


def wrong_cases(records: Records, limit: int) -> list[str]:
    """Runs that are not right, worst first: truth, verdict, names, alternatives."""
    order = {"crashed": -1, "wrong": 0, "refused": 1, "unknown": 2, "missed": 3}
    bad = sorted(
        (r for r in records if not r["right"] and r["reached"]),
        key=lambda r: (order.get(r["outcome"], 4), -r["snr"]),
    )
    lines = []
    for r in bad[:limit]:
        answer = r["answer"]
        truth = " + ".join(" ".join(pair).strip() for pair in r["truth"]) or "nothing"
        names = "; ".join(
            f"{' '.join([one['effect'], *one['joints']])}{_evidence(one['evidence'])}"
            for one in answer.get("named", [])
        )
        kind = "deflection" if r["deflection"] else "absolute"
        sets = " | ".join(
            " = ".join(f"{c['effect']} {c['joint'] or ''}".strip() for c in one)
            for one in answer.get("alternatives", [])
        )
        lines.append(
            f"{r['key']:22} {truth}, SNR {r['snr']:g}, {r['poses']} poses, {kind}: {r['outcome']}: {answer['verdict']}"
            f" [{names}]{' alternatives ' + sets if sets else ''} lack {answer.get('lack') or 0:.2f}"
            + (f" rejected {answer['rejected']}" if answer.get("rejected") else "")
            + (f" oracle's nearest {r['rivals'][0][0]}" if r["rivals"] and r["rivals"][0] else "")
        )
    return lines


def _evidence(evidence: dict) -> str:
    if evidence["alias"] is None:
        return ""
    return f" (margin {evidence['margin']:.0f} to {evidence['alias']['effect']} {evidence['alias']['joint'] or ''})"
