"""What a search came to: its choice, its last linear step, and the alternatives."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from postproc.base.arrays import Floats
from postproc.diagnosis.candidates import Candidate
from postproc.diagnosis.decoys import AlternativeForm
from postproc.diagnosis.selection import (
    Explained,
    Problem,
    basis_of,
    outside,
)
from postproc.identification.fit import Fit
from postproc.identification.noise import Weighting

Key = tuple[str, str]
"""Label of an effect's form, and its joint."""


@dataclass(frozen=True, eq=False)
class Linear:
    """A search's last step.  candidates: what was evaluated, group by group of ``problem``; whitened and as they are:
    residual (n,) without what was chosen, common (n, k) columns that are explained anyway, columns (n, p) of each
    candidate; the last ``priors`` rows are no readings; ``weights`` that it was whitened with."""

    candidates: tuple[Candidate, ...]
    problem: Problem
    residual: Floats
    common: Floats
    columns: tuple[Floats, ...]
    priors: int
    weights: Weighting

    @cached_property
    def basis(self) -> Floats:
        """(n, r) of what is explained anyway."""
        return basis_of(self.common)

    def basis_with(self, groups: Sequence[int]) -> Floats:
        """(n, r) of what is explained anyway and by ``groups``."""
        if not groups:
            return self.basis
        more = np.concatenate([self.columns[g] for g in groups], axis=1)
        return np.concatenate([self.basis, basis_of(outside(self.basis, more))], axis=1)


@dataclass(frozen=True, eq=False)
class Alternative:
    """A ``candidate`` in the place of the choice ``of``: by how much -2 ln(likelihood) is ``worse``, and what it pays
    ``more`` for its parameters (negative: less); ``fitted``, or only linearly so; ``twin``: it predicts the same
    readings, and no price of parameters decides between the two."""

    of: Key
    candidate: Candidate
    worse: float
    more: float
    fitted: bool
    twin: bool = False

    @property
    def margin(self) -> float:
        """By how much it is the lesser explanation; negative: the better one."""
        return self.worse if self.twin else self.worse + self.more

    @property
    def priced(self) -> float:
        """The margin with twins ranked too: of them the one with fewer parameters is the better."""
        return self.worse + self.more

    @property
    def is_decoy(self) -> bool:
        """Whether it is never named itself."""
        return isinstance(self.candidate.effect, AlternativeForm)


@dataclass(frozen=True, eq=False)
class Search:
    """What a search came to.

    base: the model as it is, its own parameters refitted; final: with what was ``chosen``; untestable: candidates
    that these readings cannot show; linear, explained: the last choice; rivals: those of
    what was chosen, nearest first; whole: as ``final``, fitted to all readings where the search was in a part of them.
    """

    base: Fit
    final: Fit
    chosen: tuple[Candidate, ...]
    untestable: tuple[Candidate, ...]
    linear: Linear
    explained: Explained
    rivals: tuple[Alternative, ...]
    whole: Fit | None = None

    @property
    def confirmed(self) -> Fit:
        """What was chosen, fitted to all readings."""
        return self.final if self.whole is None else self.whole
