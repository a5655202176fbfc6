"""Frozen dataclasses of ``base/dataclass.py`` are those of the standard library."""

from __future__ import annotations

import dataclasses
import inspect
import pickle
from collections.abc import Callable
from dataclasses import field, fields, replace
from typing import Any

import pytest

from postproc.base.dataclass import dataclass

Decorator = Callable[..., Any]


def classes(define: Decorator) -> dict[str, type]:
    """The same classes by one decorator or the other."""

    @define(frozen=True)
    class Plain:
        """Fields, of which one has the name of a local variable, and defaults."""

        own: int
        name: str = "a"
        several: tuple[int, ...] = (1, 2)

    @define(frozen=True)
    class Made:
        """Fields that are made, not compared, not shown, or named in calls only."""

        made: list[int] = field(default_factory=list)
        line: int = field(default=0, compare=False)
        hidden: int = field(default=1, repr=False)
        named: int = field(default=2, kw_only=True)

    @define(frozen=True, eq=False, repr=False)
    class Identical:
        """By identity, with a check."""

        value: float

        def __post_init__(self) -> None:
            if self.value < 0:
                raise ValueError("below zero")
            object.__setattr__(self, "value", float(self.value))

    @define(frozen=True)
    class Own:
        """Methods of its own."""

        value: float

        def __eq__(self, other: object) -> bool:
            return True

        def __repr__(self) -> str:
            return "own"

    @define(frozen=True)
    class Derived(Plain):
        """A field more."""

        last: float = 0.5

    @define(frozen=True)
    class Empty:
        """Nothing."""

    @define(frozen=True)
    class Cyclic:
        """Of itself."""

        parts: list[Any]

    return {kind.__name__: kind for kind in (Plain, Made, Identical, Own, Derived, Empty, Cyclic)}


OURS, THEIRS = classes(dataclass), classes(dataclasses.dataclass)
CALLS: list[tuple[str, tuple[Any, ...], dict[str, Any]]] = [
    ("Plain", (1,), {}),
    ("Plain", (1, "b"), {"several": ()}),
    ("Plain", (), {}),
    ("Plain", (1, 2, 3, 4), {}),
    ("Plain", (float("nan"),), {}),
    ("Made", (), {}),
    ("Made", ([1], 5), {"hidden": 3, "named": 4}),
    ("Made", ([1], 5, 3, 4), {}),
    ("Identical", (1,), {}),
    ("Identical", (-1,), {}),
    ("Own", (2.0,), {}),
    ("Derived", (1,), {"last": 2.0}),
    ("Empty", (), {}),
    ("Cyclic", ([],), {}),
]


def outcome(act: Callable[[], Any]) -> Any:
    try:
        return act()
    except (TypeError, ValueError, AttributeError) as error:
        return type(error), str(error).replace("classes.<locals>.", "")


@pytest.mark.parametrize("name", OURS)
def test_the_same_signature_and_fields(name):
    ours, theirs = OURS[name], THEIRS[name]
    arguments = [
        [(one.name, one.kind, "made" if one.name == "made" else one.default) for one in listed]
        for listed in (inspect.signature(kind).parameters.values() for kind in (ours, theirs))
    ]
    assert arguments[0] == arguments[1]
    assert [str(one) for one in fields(ours)] == [str(one) for one in fields(theirs)]
    assert (ours.__hash__ is None) == (theirs.__hash__ is None)
    assert (ours.__hash__ is object.__hash__) == (theirs.__hash__ is object.__hash__)


@pytest.mark.parametrize(("name", "given", "named"), CALLS)
def test_the_same_instances(name, given, named):
    results = []
    for kinds in (OURS, THEIRS):
        kind = kinds[name]

        def make(kind: type = kind) -> Any:
            return kind(*given, **named)

        def repeated(kind: type = kind) -> Any:
            one, other = kind(*given, **named), kind(*given, **named)
            return one == other, hash(one) == hash(other), one == (1,), one != other

        def replaced(kind: type = kind) -> str:
            one = kind(*given, **named)
            return vars(replace(one, **{f.name: 9 for f in fields(kind)}))

        results.append([outcome(lambda make=make: vars(make())), outcome(repeated), outcome(replaced)])
        results[-1].append(outcome(lambda make=make: repr(make()) if name != "Identical" else None))
    assert results[0] == results[1]


@pytest.mark.parametrize("define", [dataclass, dataclasses.dataclass])
def test_nothing_is_assigned(define):
    one = classes(define)["Plain"](1)
    with pytest.raises(dataclasses.FrozenInstanceError, match="cannot assign to field 'own'"):
        one.own = 2
    with pytest.raises(dataclasses.FrozenInstanceError, match="cannot delete field 'own'"):
        del one.own


@pytest.mark.parametrize("kinds", [OURS, THEIRS])
def test_what_counts_in_a_comparison(kinds):
    made, plain = kinds["Made"], kinds["Plain"]
    assert made([1], 2) == made([1], 3) != made([2], 3)
    assert plain(1, "a") != plain(1, "b")
    assert hash(plain(1, "a")) != hash(plain(1, "b"))
    assert plain(1) != kinds["Derived"](1)
    assert kinds["Derived"](1, last=2.0) != kinds["Derived"](1)


def test_what_is_made_is_made_anew():
    assert OURS["Made"]().made is not OURS["Made"]().made


def test_a_loop_is_shown():
    one = OURS["Cyclic"]([])
    one.parts.append(one)
    assert repr(one).endswith("Cyclic(parts=[...])")


@dataclass(frozen=True)
class Picklable:
    """Goes to another process."""

    value: int
    more: tuple[int, ...] = ()


def test_pickled():
    one = Picklable(1, (2,))
    assert pickle.loads(pickle.dumps(one)) == one
    assert Picklable(1) != one


def test_a_base_of_the_other_kind_is_refused():
    with pytest.raises(TypeError, match="cannot inherit"):

        @dataclasses.dataclass(frozen=True)
        class Other(Picklable):
            last: int = 0


def test_other_options_are_those_of_the_library():
    @dataclass(frozen=True, slots=True)
    class Slots:
        value: int

    @dataclass
    class Mutable:
        value: int

    assert not hasattr(Slots(1), "__dict__")
    changed = Mutable(1)
    changed.value = 2
    assert changed == Mutable(2)
