"""Maps that share what they have in common, against plain dictionaries."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from postproc.languages.core.persistent_map import KeyNumbers, PersistentMap

CHANGES = st.lists(st.tuples(st.integers(0, 600), st.integers(0, 3) | st.none()), max_size=40)


def changed(start: PersistentMap, changes: list[tuple[int, int | None]]) -> PersistentMap:
    for key, value in changes:
        start = start.set(key, value)
    return start


@given(CHANGES, CHANGES, CHANGES)
def test_versions_and_their_merge(shared: list, one: list, other: list) -> None:
    start = changed(PersistentMap(KeyNumbers()), shared)
    left, right = changed(start, one), changed(start, other)
    plain = [dict(start.items()), dict(left.items()), dict(right.items())]
    for found, changes in zip(plain, ([], one, other), strict=True):
        wanted = {k: v for k, v in {**dict(shared), **dict(changes)}.items() if v is not None}
        assert found == wanted
    merged = left.merged(right, lambda key, a, b: a if a == b else -1)
    keys = plain[1].keys() | plain[2].keys()
    assert dict(merged.items()) == {
        key: plain[1].get(key) if plain[1].get(key) == plain[2].get(key) else -1 for key in keys
    }
    assert left.merged(left, lambda *_: -1) is left
    assert merged.merged(right, lambda key, a, b: a) is merged


def test_what_is_common_to_two_maps() -> None:
    """Of many keys, some with equal values, some in one map alone; the same object where nothing goes."""
    numbers = KeyNumbers()
    one = other = PersistentMap(numbers)
    for key in range(300):
        one = one.set(key, float(key))
        if key % 3:
            other = other.set(key, float(key) if key % 2 else -1.0)
    for key in range(1000, 1300):
        other = other.set(key, 1.0)
    assert dict(one.common(other).items()) == {key: float(key) for key in range(300) if key % 3 and key % 2}
    assert dict(other.common(one).items()) == dict(one.common(other).items())
    assert one.common(one) is one
    assert (few := PersistentMap(numbers).set(1, 1.0)).common(other) is few
