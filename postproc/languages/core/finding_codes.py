"""Codes of findings as the tables of languages state them."""

from __future__ import annotations

from postproc.base.findings import Code

STAYS = "The motion is not corrected and stays as programmed."


def warning(title: str, meaning: str, consequence: str, action: str, example: str) -> Code:
    return Code("warning", title, meaning=meaning, consequence=consequence, action=action, example=example)
