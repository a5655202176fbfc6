"""YAML files: strict, every mistake with its place, and no input that ends in anything but a Refusal."""

from contextlib import suppress
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from postproc.base.findings import Finding, Refusal
from postproc.base.yaml_section import MAX_BYTES, MAX_DEPTH, YamlSection, load


def write(folder: Path, text: str | bytes) -> Path:
    path = folder / "file.yaml"
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return path


def section(folder: Path, text: str) -> YamlSection:
    return load(write(folder, text))


def refused(action) -> Finding:
    with pytest.raises(Refusal) as caught:
        action()
    return caught.value.findings[0]


def test_values_come_as_they_are_written(tmp_path):
    top = section(
        tmp_path, "n: 1e-6\nlist: [1, -.5, 2.]\nt: a word\nyes: True\nno: FALSE\nempty: Null\nsub: {x: 3}\n"
    )
    assert top.number("n") == 1e-6
    assert top.numbers("list", 3) == [1.0, -0.5, 2.0]
    assert top.text("t") == "a word"
    assert top.flag("yes", False) is True
    assert top.flag("no", True) is False
    assert top.flag("absent", True) is True
    assert "empty" not in top
    assert top.number("empty", 7.0) == 7.0
    assert top.section("sub").number("x") == 3.0
    assert list(top.section("absent", None)) == []
    assert top.is_list("list")
    assert not top.is_list("n")
    assert not top.is_list("absent")
    assert top.line_of("t") == 3


@pytest.mark.parametrize(
    ("text", "ask", "code", "line", "words"),
    [
        ("a: 1\nb: x1\n", lambda s: s.number("b", unit="mm"), "YML004", 2, "b: 'x1' is not a number"),
        ("a: 0.02 mm\n", lambda s: s.number("a", unit="mm"), "YML004", 1, "'0.02 mm' is not a number"),
        ("a: nan\n", lambda s: s.number("a"), "YML004", 1, "'nan' is not a number"),
        ("a: .inf\n", lambda s: s.number("a"), "YML004", 1, "'.inf' is not a number"),
        ("a: 1e999\n", lambda s: s.number("a"), "YML004", 1, "too large"),
        ("a: 1_0\n", lambda s: s.number("a"), "YML004", 1, "'1_0' is not a number"),
        ("a: \u0663\n", lambda s: s.number("a"), "YML004", 1, "is not a number"),
        ("a: '5'\n", lambda s: s.number("a"), "YML004", 1, "'5' is not a number"),
        ("a: [1]\n", lambda s: s.number("a"), "YML004", 1, "a list or mapping is not a number"),
        ("a: 3\n", lambda s: s.number("a", high=2), "YML004", 1, "3 is not within -inf .. 2"),
        ("a: [1, 2]\n", lambda s: s.numbers("a", 3), "YML004", 1, "a list of 3 numbers"),
        ("a: [1, ]\n", lambda s: s.text("a"), "YML004", 1, "a word or a text"),
        ("a: prozess\n", lambda s: s.text("a", choices=("process",)), "YML004", 1, "did you mean 'process'"),
        ("a: maybe\n", lambda s: s.flag("a", True), "YML004", 1, "true or false"),
        ("a: 'true'\n", lambda s: s.flag("a", True), "YML004", 1, "true or false"),
        ("a: 1\n", lambda s: s.section("a"), "YML004", 1, "keys and values"),
        ("a: 1\n", lambda s: s.sections("a"), "YML004", 1, "must be a list"),
        ("a: [1]\n", lambda s: s.sections("a"), "YML004", 1, "entry 1"),
        ("\na: 1\n", lambda s: s.number("b"), "YML003", 2, "the key 'b' is missing"),
        ("a: 1\nb:\n", lambda s: s.number("b"), "YML003", 2, "b: has no value"),
        ("a: 1\ntoll: 2\n", lambda s: s.only("a", "tool"), "YML002", 2, "did you mean 'tool'"),
    ],
)
def test_wrong_values_are_told_with_key_and_line(tmp_path, text, ask, code, line, words):
    finding = refused(lambda: ask(section(tmp_path, text)))
    assert (finding.code, finding.line) == (code, line)
    assert words in finding.message
    assert finding.file.endswith("file.yaml")


def test_a_number_with_its_unit_is_told_the_unit(tmp_path):
    finding = refused(lambda: section(tmp_path, "a: 0.02 mm\n").number("a", unit="mm"))
    assert finding.help == "write a number in mm, without the unit"


@pytest.mark.parametrize(
    ("raw", "code", "line", "words"),
    [
        (b"", "FIL002", 0, "empty"),
        (b"# nothing\n", "FIL002", 0, "empty"),
        (b"- 1\n", "YML001", 1, "keys and values"),
        (b"a: 1\nb: [1\n", "YML001", 3, ""),
        (b"a: 1\na: 2\n", "YML004", 2, "a is defined twice"),
        (b"s: {a: 1, a: 2}\n", "YML004", 1, "s.a is defined twice"),
        (b"a: 1\n? [x]\n: 2\n", "YML001", 2, "plain word"),
        (b"a: &x 1\nb: *x\n", "YML001", 2, "aliases"),
        (b"a: 1\nb: !!python/object:os.system x\n", "YML001", 2, "tags"),
        (b"a: \xff\n", "YML001", 0, "UTF-8"),
        (b"a: 1\nb: \x01\n", "YML001", 2, "unacceptable character"),
        (b'a: "\\UFFFFFFFF"\n', "YML001", 0, ""),
        (b'a: 1\nb: "\\0"\n', "YML001", 2, "NUL"),
        (b'a: "\\uD800"\n', "YML001", 1, "half a character"),
        (b"a: 1\n---\na: 2\n", "YML001", 2, ""),
        (b"a: " + b"[" * 200_000, "YML001", 1, f"deeper than {MAX_DEPTH}"),
        (b"a: b\n" * (MAX_BYTES // 5 + 1), "YML001", 0, "larger"),
    ],
)
def test_wrong_files_are_told(tmp_path, raw, code, line, words):
    path = write(tmp_path, raw)
    finding = refused(lambda: load(path).section("s"))
    assert (finding.code, finding.line) == (code, line)
    assert words in finding.message


def test_missing_file_and_folder(tmp_path):
    assert refused(lambda: load(tmp_path / "none.yaml")).code == "FIL001"
    assert refused(lambda: load(tmp_path)).code == "FIL001"


def test_byte_order_mark_and_crlf(tmp_path):
    top = load(write(tmp_path, b"\xef\xbb\xbfa: 1\r\nb: 2\r\n"))
    assert (top.number("a"), top.number("b"), top.line_of("b")) == (1.0, 2.0, 2)


@given(
    st.one_of(
        st.binary(max_size=60), st.text("ab:{}[],-?!&*|>'\"\\%@#~ \n\t0x.eU", max_size=60).map(str.encode)
    )
)
def test_no_bytes_end_in_anything_but_a_refusal(tmp_path_factory, raw):
    path = write(tmp_path_factory.getbasetemp(), raw)
    with suppress(Refusal):
        top = load(path)
        for key in top:
            for ask in (top.number, top.text, top.section, top.sections):
                with suppress(Refusal):
                    ask(key)
