"""What a cell may state for G-code."""

from postproc.languages.dialect import DialectOption

INTEGER_WORDS = "integer_words"
"""What X10 means where a control may count in increments: mm or um."""

ROTARY_WORDS, AT_TIP, TURN_PART = "rotary_words", "tip", "part"
"""What A, B, C do where no TCP code is in force: X, Y, Z are the tool's tip and they turn the tool against the part, as
in the kinematics of a LinuxCNC with five axes; or they turn the part, and X, Y, Z do not turn with it."""

OPTIONS = (
    DialectOption(INTEGER_WORDS, "what X10 means [decided by the program]", choices=("mm", "um")),
    DialectOption(
        ROTARY_WORDS,
        "what A, B, C do without a TCP code: X, Y, Z are the tip and they turn the tool, or they turn the part and"
        " X, Y, Z do not turn with it [not known]",
        choices=(AT_TIP, TURN_PART),
    ),
)
