"""CSV tables: dialects of spreadsheets are understood, mistakes are told with line and column."""

import csv
import hashlib
import math
import re
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tiers import examples

from postproc.base.findings import Finding, Refusal
from postproc.base.read_files import MAX_LINE
from postproc.base.tables import comments_above, finite_number, read_table
from postproc.base.tables.csv_cells import BLOCK, ROWS


def write(folder: Path, text: str | bytes) -> Path:
    path = folder / "file.csv"
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return path


def refused(path: Path, *columns: str) -> Finding:
    def read() -> None:
        table = read_table(path, "FRC003")
        for name in columns:
            table.numbers(name)

    with pytest.raises(Refusal) as caught:
        read()
    return caught.value.findings[0]


@pytest.mark.parametrize("first", ["sep=;", "SEP=;", '"sep=;"', "sep=;;;"])
def test_the_separator_that_excel_states_is_no_header(tmp_path, first):
    table = read_table(write(tmp_path, f"{first}\n# a note\nline;fx\n1;2,5\n"), "FRC003")
    assert (table.header_line, table.separator, table.comments) == (3, ";", ((2, "a note"),))
    np.testing.assert_array_equal(table.numbers("fx"), [2.5])


def test_a_separator_that_is_a_column_stays_one(tmp_path):
    table = read_table(write(tmp_path, "sep=x;fx\n1;2,5\n"), "FRC003")
    assert list(table.columns) == ["sep=x", "fx"]


@pytest.mark.parametrize(
    "text",
    [
        "line,fx\n3,1.5\n7,-2e1\n",
        "LINE ; Fx\n3;1.5\n7;-2e1\n",
        "line;fx\n3;1,5\n7;-2e1\n",
        "line\tfx\r\n3\t1,5\r\n7\t-2e1\r\n",
        "\ufeffline,fx\n3,1.5\n7,-2e1",
        '"line","fx"\n"3","1.5"\n"7", "-2e1"\n',
        'line;"fx"\n3;"1,5"\n7;-20\n',
    ],
)
def test_separators_quotes_and_decimal_commas(tmp_path, text):
    table = read_table(write(tmp_path, text), "FRC003")
    assert table.numbers("line").tolist() == [3.0, 7.0]
    assert table.numbers("fx").tolist() == [1.5, -20.0]
    assert table.lines.tolist() == [2, 3]
    assert len(table) == 2
    assert "fx" in table
    assert "fy" not in table


@pytest.mark.parametrize(
    ("text", "line", "column", "cell", "comma"),
    [
        ("line;fx;fy\n6;-170,5;1.000\n7;-170,5;355,2\n", 2, "fy", "'1.000'", "'-170,5' in line 2"),
        ("line;fx\n1;2\n2;1.5\n3;0,5\n", 3, "fx", "'1.5'", "'0,5' in line 4"),
        ("line\tfx\n1\t-1.5e2\n2\t0,5\n", 2, "fx", "'-1.5e2'", "'0,5' in line 3"),
        ('line;fx\n1;"1.000"\n2;"0,5"\n', 2, "fx", "'1.000'", "'0,5' in line 3"),
        ("line;fx;name\n1;2.5;x\n2;3;\u00fc\n3;0,5;\u00fc\n", 2, "fx", "'2.5'", "'0,5' in line 4"),
        ("line;fx;name\n1;0,5;x\n2;2.5;\u00fc\n", 3, "fx", "'2.5'", "'0,5' in line 2"),
        ("line;fx;fy\n" + "1;2;3\n" * 40000 + "1;2;.5\n1;2,5;3\n", 40002, "fy", "'.5'", "in line 40003"),
    ],
)
def test_a_point_beside_decimal_commas_is_refused(tmp_path, text, line, column, cell, comma):
    """1.000 is one or a thousand: the file that has commas elsewhere does not say which."""
    finding = refused(write(tmp_path, text), "line", "fx", *(["fy"] if "fy" in text else []))
    assert finding.line == line
    assert (
        f"column {column}: {cell} has a point, and the decimals of this file are after a comma"
        in finding.message
    )
    assert comma in finding.message
    assert "1000, not 1.000" in finding.help


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("line;fx;fy\n6;-170.5;1.000\n7;2;355.2\n", [-170.5, 2.0]),
        ("# spring 0,5 N\nline;fx\n1;1.5\n", [1.5]),
        ("# spring 0.5 N\nline;fx\n1;1,5\n", [1.5]),
        ("line;name;fx\n1;left, 2.0;1.5\n", [1.5]),
        ("line;name;fx\n1;wall 2.0;1,5\n2;p.src;2\n", [1.5, 2.0]),
        ('line,name,fx\n1,"2,5",1.5\n', [1.5]),
        ("line;fx\n1;1e3\n2;2,5e1\n", [1000.0, 25.0]),
    ],
)
def test_decimals_of_one_kind_are_read(tmp_path, text, values):
    assert read_table(write(tmp_path, text), "FRC003").numbers("fx").tolist() == values


def test_blank_and_comment_lines_are_skipped_and_counted(tmp_path):
    table = read_table(write(tmp_path, "# robot: kr\n\nline,fx\n1,2\n  # note\n,,\n;;\n 5 , 6 \n"), "FRC003")
    assert table.lines.tolist() == [4, 8]
    assert table.header_line == 3
    assert table.numbers("line").tolist() == [1.0, 5.0]
    assert table.comments == ((1, "robot: kr"), (5, "note"))


def test_old_mac_line_ends_and_latin_comment(tmp_path):
    table = read_table(write(tmp_path, b"# Fr\xe4sen\rline,fx\r1,2\r"), "FRC003")
    assert table.comments == ((1, "Fräsen"),)
    assert table.lines.tolist() == [3]


def test_comments_that_a_spreadsheet_put_in_quotes(tmp_path):
    text = '# robot: kr,,\n"# tool: 0, 0, 200",,\n#\nname,fx\n"#1",2\n#2,3\n'
    path = write(tmp_path, text)
    table = read_table(path, "FRC003")
    assert table.comments == ((1, "robot: kr"), (2, "tool: 0, 0, 200"), (3, ""), (6, "2,3"))
    assert table.texts("name") == ["#1"]
    assert comments_above(path) == table.comments[:3]


def test_comments_above_a_table_that_is_wrong(tmp_path):
    assert comments_above(write(tmp_path, "# a: 1\n\nx,x\n1\n# b\n")) == ((1, "a: 1"),)
    with pytest.raises(Refusal, match="FIL003"):
        comments_above(write(tmp_path, b"# a\0"))


def test_the_digest_is_that_of_the_file(tmp_path):
    path = write(tmp_path, "\ufeffa\r\n1\r\n")
    assert read_table(path, "FRC003").digest == hashlib.sha256(path.read_bytes()).hexdigest()


def test_missing_numbers(tmp_path):
    table = read_table(write(tmp_path, "a;b;c\n1,5;;2\n-;NaN;3\nn/a;nan;4\n-2;N/A;5\n"), "FRC003")
    assert np.array_equal(table.numbers_or_nan("a"), [1.5, np.nan, np.nan, -2.0], equal_nan=True)
    assert np.isnan(table.numbers_or_nan("b")).all()
    assert table.numbers_or_nan("c").tolist() == [2, 3, 4, 5]
    assert not table.numbers_or_nan("a").flags.writeable
    with pytest.raises(Refusal, match=r"file.csv:3: FRC003 column a: '-' is not a number"):
        table.numbers("a")


@pytest.mark.parametrize("cell", ["x", "--", "inf", "1_0", "na n", "1e999"])
def test_what_is_neither_number_nor_missing(tmp_path, cell):
    table = read_table(write(tmp_path, f"a,b\n,1\n\n1,1\n{cell},1\n"), "FRC003")
    with pytest.raises(Refusal) as caught:
        table.numbers_or_nan("a")
    assert caught.value.findings[0].line == 5


@pytest.mark.parametrize(
    ("text", "number"),
    [("1.5", 1.5), ("-2e1", -20.0), ("1,5", None), ("nan", None), ("1e999", None), ("", None)],
)
def test_finite_numbers(text, number):
    assert finite_number(text) == number


def test_arrays_are_read_only(tmp_path):
    numbers = read_table(write(tmp_path, "a\n1\n"), "FRC003").numbers("a")
    with pytest.raises(ValueError, match="read-only"):
        numbers[0] = 2


@pytest.mark.parametrize(
    ("text", "code", "line", "words"),
    [
        ("", "FIL002", 0, "no header"),
        ("# only\n\n", "FIL002", 0, "no header"),
        (b"a\0b", "FIL003", 0, "NUL"),
        ("line,fx\n", "FRC003", 1, "no rows"),
        ("line,fx\n1,2\n1\n", "FRC003", 3, "1 cells are found where the header has 2: column fx is missing"),
        ("line,fx\n1,2,5\n", "FRC003", 2, "3 cells are found where the header has 2"),
        ("line,fx\n\n1,x\n", "FRC003", 3, "column fx: 'x' is not a number"),
        ("line,fx\n1,nan\n", "FRC003", 2, "column fx: 'nan' is not a number"),
        ("line,fx\n1,inf\n", "FRC003", 2, "column fx: 'inf' is not a number"),
        ("line,fx\n1,1e999\n", "FRC003", 2, "column fx: '1e999' is too large"),
        ("line,fx\n1,1_0\n", "FRC003", 2, "'1_0' is not a number"),
        ("line,fx\n1,\u0663\n", "FRC003", 2, "is not a number"),
        ("line,fx\n1,\n", "FRC003", 2, "column fx: the cell is empty"),
        ('line,fx\n1,"1,5"\n', "FRC003", 2, "'1,5' is not a number"),
        ("line;fx\n1;1.234,5\n", "FRC003", 2, "'1.234,5' is not a number"),
        ("line;fx\n1;1,2,3\n", "FRC003", 2, "'1,2,3' is not a number"),
        ("line,fx,fx\n1,2,3\n", "FRC003", 1, "column 3 of the header repeats the name 'fx'"),
        ("line,fx,\n1,2,\n", "FRC003", 1, "column 3 of the header has no name"),
        ('line,fx\n1,2\n"3,4\n5,6\n', "FRC003", 3, "quote does not end"),
        ('line,fx\n1,"2"x\n', "FRC003", 2, "quotes"),
        ('line,fx\n1,2\n3,"4\n', "FRC003", 3, "quotes"),
    ],
)
def test_mistakes_are_told(tmp_path, text, code, line, words):
    finding = refused(write(tmp_path, text), "line", "fx")
    assert (finding.code, finding.line) == (code, line)
    assert words in finding.message
    assert finding.file.endswith("file.csv")


def test_decimal_comma_between_commas_gets_a_hint(tmp_path):
    assert "semicolons" in refused(write(tmp_path, "line,fx\n1,2,5\n"), "fx").help


def test_unknown_columns_name_the_nearest(tmp_path):
    table = read_table(write(tmp_path, "line,fxx\n1,2\n"), "FRC003")
    with pytest.raises(Refusal, match="column 'fxx' is unknown; did you mean 'fx'"):
        table.only("line", "fx")


def test_missing_file(tmp_path):
    assert refused(tmp_path / "none.csv").code == "FIL001"
    assert refused(tmp_path).code == "FIL001"


@given(
    st.lists(st.floats(allow_nan=False, allow_infinity=False), min_size=1, max_size=20),
    st.sampled_from([(",", "."), (";", "."), (";", ","), ("\t", ",")]),
)
def test_numbers_survive_every_dialect(tmp_path_factory, values, dialect):
    separator, point = dialect
    lines = [f"a{separator}b", *(f"{value!r}{separator}0".replace(".", point) for value in values)]
    path = write(tmp_path_factory.getbasetemp(), "\n".join(lines))
    assert np.array_equal(read_table(path, "FRC003").numbers("a"), values)


@given(st.one_of(st.binary(max_size=50), st.text('ab1,;\t"\n\r#. ', max_size=50).map(str.encode)))
def test_no_bytes_end_in_anything_but_a_refusal(tmp_path_factory, raw):
    path = write(tmp_path_factory.getbasetemp(), raw)
    with suppress(Refusal):
        table = read_table(path, "FRC003")
        for name in table.columns:
            assert len(table.numbers(name)) == len(table)


# many lines at a time, and the lines that are not common

CELLS = (
    *("1", "2.5", "-3", "+4.", ".5", "1e3", "-1.5E-2", " 8", "9 ", "\t10", "00012", "-0", "5e-324", "0.1"),
    *(
        "1,5",
        "",
        "-",
        "nan",
        "n/a",
        "x",
        "1 2",
        "1_0",
        "inf",
        "1e999",
        "0x10",
        "1-2",
        ".",
        "+",
        "1e",
        "1.2.3",
    ),
    *(
        '"3"',
        '"1,5"',
        '"a""b"',
        '"#2"',
        '"',
        'a"b',
        '"x"y',
        "'=1",
        "'x",
        "#1",
        "ä",
        "\xa07\xa0",
        "\u0663",
        "\x0b1",
    ),
    *("9007199254740993", "0.1234567890123456789", "1.7976931348623157e308", "0" * 40, "123456789.123456"),
)
NUMBER = re.compile(r"[-+]?([0-9]+(\.[0-9]*)?|\.[0-9]+)([eE][-+]?[0-9]+)?")


def cell_by_cell(text: str, separator: str):
    """Lines and cells of a table with a header, or the line that is wrong: by ``csv`` and line by line."""
    lines, rows = [], []
    for number, line in enumerate(re.split("\r\n|\n|\r", text), start=1):
        if line.lstrip().startswith("#") or not line.strip(' \t;,"'):
            continue
        try:
            (row,) = csv.reader([line], delimiter=separator, strict=True, skipinitialspace=True)
        except csv.Error:
            return number
        if rows and len(row) != len(rows[0]):
            return number
        lines.append(number)
        rows.append([cell.strip() for cell in row])
    return (lines[1:], rows[1:]) if len(rows) > 1 else lines[0]


def number_of(cell: str, separator: str):
    written = cell if separator == "," else cell.replace(",", ".", 1)
    return float(written) if NUMBER.fullmatch(written) and abs(float(written)) < math.inf else None


@settings(max_examples=examples(300), deadline=None)
@given(
    st.lists(
        st.one_of(
            st.lists(st.sampled_from(CELLS[:14]), min_size=3, max_size=3),
            st.lists(st.sampled_from(CELLS), min_size=3, max_size=3),
            st.lists(st.sampled_from(CELLS), max_size=5),
            st.sampled_from([["# note"], [""], ["", ""], ["  "]]),
        ),
        max_size=12,
    ),
    st.sampled_from(",;\t"),
    st.sampled_from(["\n", "\r\n", "\r"]),
    st.booleans(),
)
def test_many_lines_are_read_as_one_by_one(tmp_path_factory, rows, separator, end, closed):
    lines = [separator.join("abc"), *(separator.join(row) for row in rows)]
    text = end.join(lines) + end * closed
    path = tmp_path_factory.getbasetemp() / "many.csv"
    path.write_bytes(text.encode())
    expected = cell_by_cell(text, separator)
    if isinstance(expected, int):
        assert refused(path).line == expected
        return
    table = read_table(path, "FRC003")
    assert table.lines.tolist() == expected[0]
    rows = [[cell[1:] if re.match("'+[=+@-]", cell) else cell for cell in row] for row in expected[1]]
    commas = any("," in cell and NUMBER.fullmatch(cell.replace(",", ".", 1)) for row in rows for cell in row)
    for column, name in enumerate("abc"):
        shown = [row[column] for row in rows]
        assert table.texts(name) == shown
        assert [table.columns[name][row] for row in range(len(shown))] == shown
        numbers = [number_of(cell, separator) for cell in shown]
        pointed = [row for row, cell in enumerate(shown) if "." in cell and NUMBER.fullmatch(cell)]
        if commas and separator != "," and pointed:
            assert refused(path, name).line == expected[0][pointed[0]]
        elif None in numbers:
            assert refused(path, name).line == expected[0][numbers.index(None)]
        else:
            assert table.numbers(name).tobytes() == np.array(numbers).tobytes()


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_a_table_of_many_blocks(tmp_path, end):
    """Lines that are not common stand at both ends of blocks of bytes and of rows."""
    rows = [f"{number},{number / 7!r},{-number}.25" for number in range(5 * ROWS)]
    rows[ROWS - 1] = f'"{ROWS - 1}",1,-2'
    rows[ROWS] = f'{ROWS},"3",ä'
    rows[2 * ROWS] = "# note"
    rows[4 * ROWS] = f"{4 * ROWS},3,ö"
    text = "a,b,c" + end + end.join(rows)
    assert len(text) > 2 * BLOCK
    table = read_table(write(tmp_path, text), "FRC003")
    assert table.comments == ((2 * ROWS + 2, "note"),)
    kept = np.delete(np.arange(5 * ROWS), 2 * ROWS)
    assert np.array_equal(table.lines, kept + 2)
    assert np.array_equal(table.numbers("a"), kept)
    b = kept / 7
    b[ROWS - 1 : ROWS + 1], b[4 * ROWS - 1] = (1, 3), 3
    assert np.array_equal(table.numbers("b"), b)
    with pytest.raises(Refusal, match=f"file.csv:{ROWS + 2}: FRC003 column c: 'ä' is not a number"):
        table.numbers("c")
    assert table.columns["c"][4 * ROWS - 1] == "ö"
    assert table.texts("c")[ROWS - 1 : ROWS + 2] == ["-2", "ä", f"-{ROWS + 1}.25"]


@pytest.mark.parametrize("number", [2, 40_000])
def test_lines_that_are_too_long(tmp_path, number):
    rows = ["1,2"] * 40_000
    rows[number - 2] = "1," + " " * MAX_LINE + "2"
    for text in ("a,b\n" + "\n".join(rows), "a,b\n" + "\n".join(rows[: number - 1])):
        finding = refused(write(tmp_path, text))
        assert (finding.code, finding.line) == ("FRC003", number)
        assert "the line has more than" in finding.message
    rows[number - 2] = "1," + " " * 200_000 + "2"
    table = read_table(write(tmp_path, "a,b\n" + "\n".join(rows)), "FRC003")
    assert table.numbers("b").tolist() == [2.0] * 40_000


@pytest.mark.parametrize(
    "line",
    [
        *(
            "123456.7890123456789,2.5,-3.25e-100",
            "1.,.5,+7e-3",
            " 1 ,  2 , -3",
            '"1","2.5",-3',
            '1,"",""',
            '" 1 ",2,3',
        ),
        *("1;2,5;-3", '"1";"2,5";3', "1\t2,5\t-3.0"),
    ],
)
@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_common_lines_are_read_many_at_a_time(tmp_path, line, end):
    """None of them goes to the reader of single lines or, if it is a number, to that of single cells."""
    separator = next(letter for letter in ";\t," if letter in line)
    table = read_table(write(tmp_path, separator.join("abc") + end + (line + end) * 5), "FRC003")

    def one(row: int, cell: str) -> float:
        assert cell == "", f"{cell!r} is common"
        return 0.0

    for column in table.columns.values():
        assert column.cells.others == {}
        assert np.ptp(column.numbers(one, separator != ",")) == 0
