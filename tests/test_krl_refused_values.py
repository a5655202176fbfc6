"""KRL: what a finding names of values that are refused."""

from __future__ import annotations

from pathlib import Path

from postproc.base.document import Document
from postproc.languages import DIALECTS


def messages(*lines: str) -> list[str]:
    head = ("DEF part()", "DECL FRAME F", "$TOOL=TOOL_DATA[1]")
    text = "\n".join([*head, *lines, "LIN {X 1,Y 2,Z 3,A 0,B 0,C 180}", "END\n"])
    return [
        one.message for one in DIALECTS["krl"].read((Document(Path("part.src"), text.encode()),)).findings
    ]


def test_a_frame_of_the_controller_on_the_right_of_a_product_is_named() -> None:
    frame = "{X 10,Y 0,Z 0,A 0,B 0,C 0}"
    found = messages(f"$BASE={frame}:BASE_DATA[1]")
    assert any("frame of the controller on its right" in one for one in found)
    assert not any("KRL012" in one or "right" in one for one in messages(f"$BASE=BASE_DATA[1]:{frame}"))


def test_an_aggregate_within_another_one_is_named() -> None:
    found = messages("DECL S V", "V={F {X 1,Y 2,Z 3,A 0,B 0,C 180},N 4}", "$BASE=BASE_DATA[1]", "LIN V.F")
    assert any("within another one" in one for one in found)
    assert not any("braces" in one for one in found)


def test_words_of_the_language_are_no_names_and_an_aggregate_is_not_called() -> None:
    for word in ("ELSE", "ENDIF", "CASE", "UNTIL", "ENDFOR"):
        assert any("is not understood" in one for one in messages(f"DECL INT {word}"))
    aggregate = "{X 1,Y 2,Z 3,A 0,B 0,C 0}"
    assert any("is not understood" in one for one in messages(f"F={aggregate}(2)"))
    assert not any("is not understood" in one for one in messages(f"F={aggregate}", "DECL INT ELSES"))
