"""Expressions of RAPID and the arguments of calls."""

from __future__ import annotations

import math
import re

from postproc.languages.rapid.syntax_tree import (
    AND_AFTER_NOT,
    Aggregate,
    Argument,
    Component,
    Expression,
    FunctionCall,
    Index,
    Name,
    NumberLiteral,
    OperatorExpression,
    Star,
    StringLiteral,
)
from postproc.languages.rapid.tokens import NAME, NUMBER, SIGN, TEXT, Token, Tokens

_RELATIONS = frozenset([b"=", b"<>", b"<", b">", b"<=", b">="])
_LEVELS: tuple[frozenset[bytes], ...] = (
    frozenset([b"OR", b"XOR"]),
    frozenset([b"AND"]),
    _RELATIONS,
    frozenset([b"+", b"-"]),
    frozenset([b"*", b"/", b"DIV", b"MOD"]),
)
_LEVEL_OF = {operator: level for level, operators in enumerate(_LEVELS) for operator in operators}
_SUM = 3
_NO_NAMES = frozenset(
    b"THEN DO FROM TO STEP WITH ENDIF ELSE ELSEIF ENDFOR ENDWHILE ENDTEST CASE DEFAULT ENDPROC ENDFUNC"
    b" ENDTRAP ENDMODULE PROC FUNC TRAP IF FOR WHILE TEST GOTO RETURN OR XOR AND NOT DIV MOD".split()
)
_DIGITS = rb"[-+]?(?:[0-9]++\.?+[0-9]*+|\.[0-9]++)(?:[eE][-+]?[0-9]++)?+"
NUMBER_LIST = re.compile(rb"\[" + _DIGITS + rb"(?:," + _DIGITS + rb")*+\]")
"""An aggregate of numbers without blanks, which is taken at once; the general rules give the same."""
_ITEM = re.compile(rb"[^\[\],]++")
DEEPEST = 40
"""Expressions in each other."""


class SyntaxProblem(Exception):
    """A token that no rule consumes."""


class RapidExpressionParser:
    """Takes expressions from tokens; raises SyntaxProblem where none is."""

    def __init__(self, tokens: Tokens) -> None:
        self.tokens = tokens
        self._depth = 0

    @property
    def next(self) -> Token:
        """The token that comes."""
        return self.tokens.next

    def take(self) -> Token:
        return self.tokens.take()

    def sign(self, text: bytes) -> bool:
        """Whether the next token is this sign, which is then passed."""
        token = self.tokens.next
        if token.text != text or token.kind != SIGN:
            return False
        self.tokens.take()
        return True

    def need(self, text: bytes) -> None:
        """Passes this sign.  Raises SyntaxProblem for another token."""
        if not self.sign(text):
            raise SyntaxProblem

    def word(self, text: bytes) -> None:
        """Passes this word.  Raises SyntaxProblem for another token."""
        if self.next.kind != NAME or self.next.text != text:
            raise SyntaxProblem
        self.take()

    def name(self) -> bytes:
        """A name, which is passed.  Raises SyntaxProblem for another token."""
        if self.next.kind != NAME or self.next.text in _NO_NAMES:
            raise SyntaxProblem
        return self.take().text

    def expression(self) -> Expression:
        """An expression of any kind.  Raises SyntaxProblem where none is."""
        if self._depth >= DEEPEST:
            raise SyntaxProblem
        self._depth += 1
        try:
            return self._level(0)
        finally:
            self._depth -= 1

    def _level(self, level: int) -> Expression:
        """An expression of operators of this level and of those that bind more."""
        start = self.next.start
        left = self._signed() if level <= _SUM else self._primary()
        while (token := self.tokens.next).kind == SIGN or token.kind == NAME:
            found = _LEVEL_OF.get(token.text, -1)
            if found < level:
                break
            operator = self.take().text
            if operator == b"AND" and _ends_with_not(left):
                operator = AND_AFTER_NOT
            right = self._level(found + 1)
            left = OperatorExpression(operator, (left, right), start, self.tokens.before)
        return left

    def _signed(self) -> Expression:
        """What a sum starts with, which may have a sign before it; that of a number belongs to the number."""
        token = self.tokens.next
        if token.kind != SIGN or token.text not in (b"+", b"-"):
            return self._primary()
        self.take()
        operand = self._level(_SUM + 1)
        if isinstance(operand, NumberLiteral):
            value = -operand.value if token.text == b"-" else operand.value
            return NumberLiteral(value, token.start, operand.stop)
        return OperatorExpression(token.text, (operand,), token.start, self.tokens.before)

    def _primary(self) -> Expression:
        token = self.next
        if token.kind == NUMBER:
            self.take()
            if (
                token.text[1:2].isalpha() and token.text[1:2] not in b"eE"
            ):  # its digits are none that can be written
                value = NumberLiteral(float(int(token.text, 0)), token.start, token.stop)
                return OperatorExpression(b"+", (value,), token.start, token.stop)
            if not math.isfinite(float(token.text)):
                raise SyntaxProblem
            return NumberLiteral(float(token.text), token.start, token.stop)
        if token.kind == TEXT:
            self.take()
            return StringLiteral(token.text[1:-1], token.start, token.stop)
        if token.kind == NAME and token.text == b"NOT":
            self.take()
            if self._depth >= DEEPEST:
                raise SyntaxProblem
            self._depth += 1
            operand = self._level(_LEVELS.index(_RELATIONS))
            self._depth -= 1
            return OperatorExpression(b"NOT", (operand,), token.start, self.tokens.before)
        if token.kind == NAME and token.text not in _NO_NAMES:
            self.take()
            if self.sign(b"("):
                arguments = self.arguments(b")")
                self.need(b")")
                call = FunctionCall(token.text, arguments, token.start, self.tokens.before)
                return self.suffixes(call)
            return self.suffixes(Name(token.text, token.start, token.stop))
        if self.sign(b"("):
            inner = self.expression()
            self.need(b")")
            return OperatorExpression(b"()", (inner,), token.start, self.tokens.before)
        numbers = self._numbers() if token.text == b"[" else None
        if numbers is not None:
            return numbers
        if self.sign(b"["):
            items = []
            if not self.sign(b"]"):
                items.append(self.expression())
                while self.sign(b","):
                    items.append(self.expression())
                self.need(b"]")
            return Aggregate(tuple(items), token.start, self.tokens.before)
        raise SyntaxProblem

    def _numbers(self) -> Aggregate | None:
        """An aggregate of numbers in the common spelling, which is passed; None for any other."""
        start = self.next.start
        found = NUMBER_LIST.match(self.tokens.raw, start)
        if found is None:
            return None
        items = tuple(
            NumberLiteral(float(item[0]), *item.span())
            for item in _ITEM.finditer(self.tokens.raw, start, found.end())
        )
        if not all(math.isfinite(item.value) for item in items):
            return None
        self.tokens.jump(found.end())
        return Aggregate(items, start, found.end())

    def suffixes(self, base: Expression) -> Expression:
        """``base`` with the indices and components after it.  Raises SyntaxProblem for too many."""
        start = base.start
        if self.tokens.next.text not in (b"{", b"."):
            return base
        for _ in range(DEEPEST):
            if self.sign(b"{"):
                indices = [self.expression()]
                while self.sign(b","):
                    indices.append(self.expression())
                self.need(b"}")
                base = Index(base, tuple(indices), start, self.tokens.before)
            elif self.sign(b"."):
                base = Component(base, self.name(), start, self.tokens.before)
            else:
                return base
        raise SyntaxProblem

    def arguments(self, end: bytes) -> tuple[Argument, ...]:
        """Arguments up to the sign ``end``, which is not passed.  Raises SyntaxProblem where they are none."""
        found: list[Argument] = []
        separated = True
        while not ((token := self.tokens.next).kind == SIGN and token.text == end):
            start = token.start
            if self.sign(b"\\"):
                name = self.name()
                value = None
                if self.sign(b":="):
                    value = self.expression()
                elif self.next.text == b"?":
                    raise SyntaxProblem
                found.append(Argument(name, value, start, self.tokens.before))
            else:
                if not separated:
                    raise SyntaxProblem
                if self.sign(b"*"):
                    found.append(Argument(b"", Star(token.start, token.stop), start, self.tokens.before))
                else:
                    found.append(Argument(b"", self.expression(), start, self.tokens.before))
            separated = self.sign(b",")
            if separated and self.next.kind == SIGN and self.next.text == end:
                raise SyntaxProblem
        return tuple(found)


def _ends_with_not(operand: Expression) -> bool:
    """Whether an operand is, or ends with, NOT and what it is of."""
    if not isinstance(operand, OperatorExpression):
        return False
    last = operand.operands[-1] if operand.operator in (b"AND", AND_AFTER_NOT) else operand
    return isinstance(last, OperatorExpression) and last.operator == b"NOT"
