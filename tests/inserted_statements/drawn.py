"""The programs into which statements are put: drawn by the judges of the languages."""

from __future__ import annotations

from krl_judge.programs import Generator
from numpy.random import default_rng
from rapid_judge.programs import Writer
from tp_judge.programs import FurtherTpWriter, TpWriter

from .krl import KRL
from .rapid import RAPID
from .tp import TP

LANGUAGES = {language.name: language for language in (KRL, RAPID, TP)}


def drawn(language: str, seed: int) -> str:
    """The program of a seed."""
    if language == "krl":
        return Generator(seed).case().src
    if language == "rapid":
        return Writer(default_rng(seed)).program()
    return (TpWriter if seed % 2 else FurtherTpWriter)(default_rng(seed)).program()
