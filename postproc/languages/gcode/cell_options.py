"""What a cell may state for G-code."""

from postproc.languages.dialect import DialectOption

INTEGER_WORDS = "integer_words"
"""What X10 means where a control may count in increments: mm or um."""

ROTARY_WORDS, AT_TIP, TURN_PART, SWITCHED = "rotary_words", "tip", "part", "m428"
"""What A, B, C do where no TCP code is in force: X, Y, Z are the tool's tip and they turn the tool against the part, as
in the kinematics of a LinuxCNC with five axes; or they turn the part, and X, Y, Z do not turn with it; or X, Y, Z are
the tip from M428 to M429, as in the configurations that LinuxCNC comes with."""

TIP_ON_M, TIP_OFF_M, OTHER_M = 428, 429, 430
"""Codes of these configurations: a program with one of them is not at the tip all along."""

OPTIONS = (
    DialectOption(INTEGER_WORDS, "what X10 means [decided by the program]", choices=("mm", "um")),
    DialectOption(
        ROTARY_WORDS,
        "what A, B, C do without a TCP code: X, Y, Z are the tip and they turn the tool (tip; m428: from M428 to M429),"
        " or they turn the part and X, Y, Z do not turn with it (part) [not known]",
        choices=(AT_TIP, TURN_PART, SWITCHED),
    ),
)
