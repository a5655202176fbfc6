"""Looking through a file piece by piece finds what looking through all of it at once finds."""

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from postproc.base import byte_search
from postproc.base.byte_search import find_word, occurrences, occurs

PATTERNS = [rb"ab", rb"a+b", rb"(?<=a)b", rb"b(?!a)", rb"a[ab]*+(?!c)", rb"\bab\b", rb"c"]


@pytest.mark.parametrize("pattern", PATTERNS)
@given(st.lists(st.sampled_from([b"a", b"b", b"c", b" "]), max_size=40).map(b"".join), st.integers(1, 9))
def test_every_occurrence_is_found_once(pattern, raw, piece):
    compiled, before = re.compile(pattern), (byte_search.CHUNK, byte_search.MAX_LINE)
    byte_search.CHUNK, byte_search.MAX_LINE = piece, 40
    try:
        expected = [found.start() for found in compiled.finditer(raw)]
        assert list(occurrences(compiled, raw)) == expected
        assert occurs(compiled, raw) == bool(expected)
        for start in range(len(raw) + 1):
            assert find_word(raw, b"ab", start) == raw.find(b"ab", start)
    finally:
        byte_search.CHUNK, byte_search.MAX_LINE = before
