"""A RAPID file as modules, routines and statements.

Every token is consumed by a rule, or its statement is ``NotUnderstood``; a block that does not end where it must makes
its routine ``broken``.  Nothing raises on content.
"""

from __future__ import annotations

from codecs import BOM_UTF8

from postproc.languages.rapid.expression_syntax import RapidExpressionParser, SyntaxProblem
from postproc.languages.rapid.named_lines import NamedReader, NamesElsewhere
from postproc.languages.rapid.plain_lines import PlainReader
from postproc.languages.rapid.syntax_tree import (
    AssignmentStatement,
    Component,
    DataDeclaration,
    For,
    Goto,
    If,
    Index,
    Instruction,
    Label,
    Leave,
    Module,
    Name,
    NotUnderstood,
    RapidRoutine,
    Remark,
    RoutineParameter,
    Statement,
    Test,
    While,
)
from postproc.languages.rapid.tokens import END, NAME, Tokens

_KINDS = frozenset([b"CONST", b"PERS", b"VAR"])
_HANDLERS = frozenset([b"ERROR", b"BACKWARD", b"UNDO"])
_ENDS = frozenset([b"RAISE", b"EXIT", b"EXITCYCLE", b"RETRY", b"TRYNEXT"])
_CLOSING = frozenset(
    b"ENDPROC ENDFUNC ENDTRAP ENDIF ELSE ELSEIF ENDFOR ENDWHILE ENDTEST CASE DEFAULT ENDMODULE".split()
)
_OUTER = frozenset(b"PROC FUNC TRAP ENDPROC ENDFUNC ENDTRAP ENDMODULE LOCAL TASK".split()) | _HANDLERS
_ENDS_STATEMENTS = _OUTER | _CLOSING
_RESERVED = _CLOSING | frozenset(b"THEN DO FROM TO STEP WITH ENDRECORD MODULE RECORD ALIAS".split())
NOWHERE_ELSE = NamesElsewhere()
DEEPEST = 60
"""Blocks in each other."""


class ModuleParser(RapidExpressionParser):
    """Reads one file."""

    def __init__(self, raw: bytes, fast: bool = True, without: NamesElsewhere = NOWHERE_ELSE) -> None:
        """``fast``: runs of common lines as one statement; ``without``: names that are not taken in runs."""
        super().__init__(Tokens(raw, len(BOM_UTF8) if raw.startswith(BOM_UTF8) else 0))
        self.raw, self._without = raw, without
        self.module = Module()
        self._remarks = 0  # comments that are in the tree
        self._line_start = 0  # of the line of the last of them
        self._broken = -1
        self._plain = PlainReader(raw) if fast else None
        self._named = NamedReader(raw, without) if fast else None

    def file(self) -> Module:
        """All modules of the file as one."""
        module = self.module
        inside = False
        while self.next.kind != END:
            word = self._word()
            if word == b"MODULE" and not inside:
                inside = True
                module.unclosed = self.next.start
                self._header()
            elif word == b"ENDMODULE" and inside:
                inside, module.unclosed = False, -1
                self.take()
            elif word in (b"PROC", b"FUNC", b"TRAP", b"LOCAL", b"TASK") or word in _KINDS:
                self._item()
            elif word in (b"RECORD", b"ALIAS"):
                self._type()
            else:
                module.unread_statements.append(self._skip())
        module.remarks += self._drain(len(self.raw))
        if self._named is not None:
            module.targets = self._named.targets.starts
            elsewhere = self._named.elsewhere({one.name for one in module.declarations})
            if any(elsewhere):
                return ModuleParser(self.raw, True, elsewhere | self._without).file()
        return module

    def _header(self) -> None:
        """MODULE name(attributes)."""
        start = self.take().start
        try:
            self.name()
            if self.sign(b"("):
                while not self.sign(b")"):
                    self.name()
                    self.sign(b",")
            if self.module.name_stop < 0:
                self.module.name_stop = self.tokens.before
        except SyntaxProblem:
            self.module.unread_statements.append(self._skip(start))

    def _item(self) -> None:
        """A declaration or a routine."""
        start = self.next.start
        self.module.remarks += self._drain(start)
        end = -1 if self._named is None else self._named.declared(start)
        if end >= 0:
            self.tokens.jump(end)
            return
        local = False
        while self._word() in (b"LOCAL", b"TASK"):
            local = self.take().text == b"LOCAL" or local
        word = self._word()
        if word in _KINDS:
            try:
                self.module.declarations.append(self._declaration(start))
            except SyntaxProblem:
                self.module.unread_statements.append(self._skip(start))
        elif word in (b"PROC", b"FUNC", b"TRAP"):
            self._routine(local)
        else:
            self.module.unread_statements.append(self._skip(start))

    def _type(self) -> None:
        start, word = self.next.start, self.take().text
        try:
            name = self.name()
            if word == b"ALIAS":
                raise SyntaxProblem
            parts = []
            while self._word() != b"ENDRECORD":
                kind = self.name()
                parts.append((self.name(), kind))
                self.need(b";")
            self.take()
            self.module.records[name] = tuple(parts)
        except SyntaxProblem:
            self.module.unread_statements.append(self._skip(start))

    def _routine(self, local: bool) -> None:
        start, kind = self.next.start, self.take().text
        self._broken = -1
        parameters: tuple[RoutineParameter, ...] = ()
        name = b""
        try:
            if kind == b"FUNC":
                self.name()
            name = self.name()
            if kind != b"TRAP":
                parameters = self._parameters()
        except SyntaxProblem:
            self._broken = start
        handlers: list[Statement] = []
        body = self._block(0)
        while True:
            word = self._word()
            if word in _HANDLERS:
                handlers.append(Label(word, self.take().start))
                if self.sign(b"("):
                    while self.next.kind != END and not self.sign(b")"):
                        self.take()
                handlers += self._block(0)
            elif word in _CLOSING and word not in (b"ENDPROC", b"ENDFUNC", b"ENDTRAP", b"ENDMODULE"):
                self._break()
                self.take()
                body += self._block(0)
            else:
                break
        if self._word() == b"END" + kind:
            self.take()
        else:
            self._break()
        self.module.routines.append(
            RapidRoutine(kind, name, parameters, tuple(body), tuple(handlers), local, start, self._broken)
        )

    def _parameters(self) -> tuple[RoutineParameter, ...]:
        found: list[RoutineParameter] = []
        optional = either = False
        self.need(b"(")
        while not self.sign(b")"):
            optional = self.sign(b"\\") or (
                optional and either
            )  # one backslash is before all that exclude each other
            mode = self.take().text if self._word() in (b"INOUT", b"VAR", b"PERS") else b""
            if self._word() == b"SWITCH":
                self.take()
                found.append(RoutineParameter(b"", b"SWITCH", self.name(), True))
            else:
                kind = self.name()
                name = self.name()
                if self.sign(b"{"):
                    while not self.sign(b"}"):
                        self.need(b"*")
                        self.sign(b",")
                found.append(RoutineParameter(mode, kind, name, optional))
            either = self.sign(b"|")
            if either and (not optional or self.next.kind != NAME):
                raise SyntaxProblem
            if (
                not either
                and not self.sign(b",")
                and not (self.next.text == b"\\")
                and self.next.text != b")"
            ):
                raise SyntaxProblem
        return tuple(found)

    def _block(self, depth: int) -> list[Statement]:
        """Statements until a word that closes or opens another block."""
        found: list[Statement] = []
        while True:
            word = self._word()
            start = self.next.start
            found += self._drain(start)
            if self.next.kind == END or word in _CLOSING or word in _OUTER:
                return found
            if self.sign(b";"):  # a statement of nothing
                continue
            at = len(found)
            try:
                found.append(self._common(self._statement(word, depth)))
            except SyntaxProblem:
                found.append(self._skip(start))
            # A comment in the line of a statement is of that statement.
            for remark in self._drain(self.next.start):
                if b"\n" in self.raw[start : remark.start] or b"\r" in self.raw[start : remark.start]:
                    found.append(remark)
                else:
                    found.insert(at, remark)
                    at += 1

    def _common(self, statement: Statement) -> Statement:
        """A statement, or the run of common lines that it starts, which is passed."""
        if self._plain is None or self._named is None or not isinstance(statement, Instruction):
            return statement
        run = self._plain.run(statement) or self._named.run(statement)
        if run is None:
            return statement
        self.tokens.jump(run.end)
        return run

    def _statement(self, word: bytes, depth: int) -> Statement:
        start = self.next.start
        if self.sign(b";"):
            return Label(b"", start)
        if word in (b"IF", b"FOR", b"WHILE", b"TEST"):
            if depth >= DEEPEST:
                self._break()
                raise SyntaxProblem
            self.take()
            if word == b"IF":
                return self._if(start, depth + 1)
            if word == b"FOR":
                return self._for(start, depth + 1)
            if word == b"WHILE":
                condition = self.expression()
                self.word(b"DO")
                body = tuple(self._block(depth + 1))
                self._close(b"ENDWHILE")
                return While(condition, body, start)
            return self._test(start, depth + 1)
        if word in _KINDS:
            return self._declaration(start)
        if word == b"GOTO":
            self.take()
            label = self.name()
            self.need(b";")
            return Goto(label, start)
        if word == b"RETURN" or word in _ENDS:
            self.take()
            value = None if self.next.text == b";" else self.expression()
            self.need(b";")
            return Leave(value, word, start)
        return self._simple(start)

    def _simple(self, start: int) -> Statement:
        """An assignment, a label, or an instruction."""
        if self.sign(b"%"):  # the name of the procedure is computed
            self.expression()
            self.need(b"%")
            name_stop = self.tokens.before
            arguments = self.arguments(b";")
            self.need(b";")
            return Instruction(self.raw[start:name_stop], arguments, start, self.tokens.before)
        if self._word() == b"CONNECT":
            self.take()
            self.expression()
            self.word(b"WITH")
            self.name()
            self.need(b";")
            return Instruction(b"CONNECT", (), start, self.tokens.before)
        if self.next.kind != NAME or self.next.text in _RESERVED:
            raise SyntaxProblem
        name = self.take()
        if self.next.text == b":":
            self.take()
            return Label(name.text, start)
        if self.next.text in (b":=", b"{", b"."):
            target = self.suffixes(Name(name.text, name.start, name.stop))
            if not isinstance(target, Name | Index | Component):
                raise SyntaxProblem
            self.need(b":=")
            value = self.expression()
            self.need(b";")
            return AssignmentStatement(target, value, start, self.tokens.before)
        arguments = self.arguments(b";")
        self.need(b";")
        return Instruction(name.text, arguments, start, self.tokens.before)

    def declaration(self) -> DataDeclaration:
        """The one that comes, which is passed.  Raises SyntaxProblem where none does."""
        start = self.next.start
        while self._word() in (b"LOCAL", b"TASK"):
            self.take()
        return self._declaration(start)

    def _declaration(self, start: int) -> DataDeclaration:
        kind = self.take().text
        type_name = self.name()
        name = self.name()
        extent = []
        if self.sign(b"{"):
            extent.append(self.expression())
            while self.sign(b","):
                extent.append(self.expression())
            self.need(b"}")
        value = self.expression() if self.sign(b":=") else None
        self.need(b";")
        return DataDeclaration(kind, type_name, name, tuple(extent), value, start, self.tokens.before)

    def _if(self, start: int, depth: int) -> If:
        condition = self.expression()
        if self._word() != b"THEN":  # the short form: one statement
            if self._word() in (b"IF", b"FOR", b"WHILE", b"TEST") or self._word() in _KINDS:
                raise SyntaxProblem
            return If(((condition, (self._statement(self._word(), depth),)),), (), start)
        self.take()
        branches = [(condition, tuple(self._block(depth)))]
        while self._word() == b"ELSEIF":
            self.take()
            condition = self.expression()
            self.word(b"THEN")
            branches.append((condition, tuple(self._block(depth))))
        otherwise: tuple[Statement, ...] = ()
        if self._word() == b"ELSE":
            self.take()
            otherwise = tuple(self._block(depth))
        self._close(b"ENDIF")
        return If(tuple(branches), otherwise, start)

    def _for(self, start: int, depth: int) -> For:
        name = self.name()
        self.word(b"FROM")
        first = self.expression()
        self.word(b"TO")
        last = self.expression()
        step = None
        if self._word() == b"STEP":
            self.take()
            step = self.expression()
        self.word(b"DO")
        body = tuple(self._block(depth))
        self._close(b"ENDFOR")
        return For(name, first, last, step, body, start)

    def _test(self, start: int, depth: int) -> Test:
        value = self.expression()
        cases = []
        otherwise: tuple[Statement, ...] = ()
        while self._word() == b"CASE":
            self.take()
            values = [self.expression()]
            while self.sign(b","):
                values.append(self.expression())
            self.need(b":")
            cases.append((tuple(values), tuple(self._block(depth))))
        if self._word() == b"DEFAULT":
            self.take()
            self.need(b":")
            otherwise = tuple(self._block(depth))
        self._close(b"ENDTEST")
        return Test(value, tuple(cases), otherwise, start)

    def _close(self, word: bytes) -> None:
        if self._word() == word:
            self.take()
        else:
            self._break()

    def _break(self) -> None:
        if self._broken < 0:
            self._broken = self.next.start

    def _word(self) -> bytes:
        """The next token if it is a name, b"" for another one."""
        return self.next.text if self.next.kind == NAME else b""

    def _skip(self, start: int = -1) -> NotUnderstood:
        """Passes a statement that is not understood, to its semicolon or to where a block opens or ends."""
        start = self.next.start if start < 0 else start
        names = self.tokens.skip(start, _ENDS_STATEMENTS)
        stop = self.tokens.before
        word = Tokens(self.raw[start:stop]).next.text.upper()
        return NotUnderstood(frozenset(names), word, start, stop)

    def _drain(self, stop: int) -> list[Remark]:
        """The comments before ``stop`` that are not in the tree yet."""
        found = []
        comments = self.tokens.comments
        while self._remarks < len(comments) and comments[self._remarks][0] < stop:
            start, end = comments[self._remarks]
            ends = (self.raw.rfind(mark, self._line_start, start) for mark in (b"\n", b"\r"))
            self._line_start = max(self._line_start, max(ends) + 1)  # looked for from the last comment on
            line = self.raw[self._line_start : start]
            text = self.raw[start + 1 : end].decode("latin-1").strip()
            found.append(Remark(text, not line.removeprefix(BOM_UTF8).strip(), start))
            self._remarks += 1
        return found


def declaration_at(raw: bytes, at: int) -> DataDeclaration:
    """The declaration at a byte, which is one.  Raises SyntaxProblem where it is none: a defect of the caller."""
    parser = ModuleParser(raw, fast=False)
    parser.tokens.jump(at)
    return parser.declaration()
