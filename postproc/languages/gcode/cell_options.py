"""What a cell may state for G-code."""

from postproc.languages.dialect import DialectOption

INTEGER_WORDS = "integer_words"
"""What X10 means where a control may count in increments: mm or um."""

OPTIONS = (DialectOption(INTEGER_WORDS, "what X10 means [decided by the program]", choices=("mm", "um")),)
