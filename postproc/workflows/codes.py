"""The codes of the findings of the commands."""

from __future__ import annotations

from postproc.workflows import model_codes, program_codes

CODES = {**program_codes.CODES, **model_codes.CODES}
