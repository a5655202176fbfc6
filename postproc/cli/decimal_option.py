"""Numbers on the command line."""

from __future__ import annotations

import math
import re
from typing import Any

import click

_PERCENT = re.compile(r"(\d+(?:\.\d*)?)\s*%\Z")
_COMMA = re.compile(r"[-+]?\d*,\d+\Z")


class Decimal(click.FloatRange):
    """A finite number within a range; a decimal comma is named as such."""

    name = "number"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if isinstance(value, str) and _COMMA.match(value.strip()):
            point = value.strip().replace(",", ".")
            self.fail(f"{value!r} has a decimal comma; write {point}", param, ctx)
        if isinstance(value, str) and (percent := _PERCENT.match(value.strip())):
            share = float(percent[1]) / 100.0
            self.fail(f"{value!r} is a percentage; write {share:g}", param, ctx)
        number = super().convert(value, param, ctx)
        if not math.isfinite(number):
            self.fail(f"{value!r} is not a number", param, ctx)
        return number
