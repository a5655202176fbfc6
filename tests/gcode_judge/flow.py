"""Flow, subprograms, and the steps that a program consists of."""

from __future__ import annotations

from collections.abc import Callable

from .expressions import Real, Scope
from .settings import Settings
from .spelling import Modes


class Flow(Settings):
    def next_label(self) -> str:
        self.label += 1
        if self.maybe(0.1):
            return f"o<part_{self.label}>"
        return f"{self.chance.choice('oO')}{' ' if self.maybe(0.1) else ''}{self.label}"

    def key(self, text: str) -> str:
        return text.upper() if self.maybe(0.2) else text

    def body(self, count: int, fixed: bool) -> None:
        """Blocks of a loop or a subprogram; ``fixed``: they set what their arcs need, in each pass."""
        self.depth += 1
        self.modes.lost()
        features = self.features
        if fixed:
            self.modes.plane, self.modes.absolute_centres = 17, False
            self.anchor("17", "91.1")
            self.features = features - {"inch"}
        else:
            self.features = features & {
                "parameters", "rich", "comments", "numbers", "loose", "inline", "sparse", "unordered", "flow",
                "incremental", "inch", "offsets", "shifts", "tools", "rotary", "arcs" if fixed else "",
            }  # fmt: skip
        self.steps(count)
        self.flush()
        self.features = features
        self.depth -= 1

    def flow(self) -> None:
        self.flush()
        if self.depth >= 2:
            return self.line()
        self.chance.choice((self.branch, self.branch, self.repeat, self.loop, self.loop))()

    def branch(self) -> None:
        label = self.next_label()
        text, taken = self.reals.truth(self.scope)
        self.flow_line(f"{label} {self.key('if')} {text}")
        self.depth += 1
        done = False
        arms = self.chance.choice((1, 1, 2, 3))
        for arm in range(arms):
            before = self.modes.copy()
            scope, self.scope = self.scope, self.copied()
            known = taken and not done
            self.steps(self.chance.randint(1, 3))
            self.flush()
            if not known:
                self.modes, self.scope = before, scope
            done |= taken
            if arm + 1 < arms:
                if arm + 2 < arms:
                    text, taken = self.reals.truth(self.scope)
                    self.flow_line(f"{label} {self.key('elseif')} {text}")
                else:
                    taken = True
                    self.flow_line(f"{label} {self.key('else')}")
        self.depth -= 1
        self.flow_line(f"{label} {self.key('endif')}")

    def copied(self) -> Scope:
        scope = Scope(dict(self.scope.shared))
        scope.own = dict(self.scope.own)
        return scope

    def repeat(self) -> None:
        label = self.next_label()
        self.flow_line(
            f"{label} {self.key('repeat')} [{self.reals.number(self.chance.randint(0, 4), 0).text}]"
        )
        self.scope.forget()
        before = self.modes.copy()
        self.body(self.chance.randint(1, 4), self.maybe(0.6))
        if self.loops and self.maybe(0.1):
            self.leave(self.loops[-1])
        self.flow_line(f"{label} {self.key('endrepeat')}")
        self.after(before)

    def leave(self, label: str) -> None:
        inner = self.next_label()
        text, _ = self.reals.truth(Scope())
        self.flow_line(f"{inner} if {text}")
        self.flow_line(f"{label} {self.key(self.chance.choice(('break', 'continue')))}")
        self.flow_line(f"{inner} endif")

    def after(self, before: Modes) -> None:
        """Behind a loop that may not have run: state again what arcs need."""
        self.scope.forget()
        self.modes = before
        self.modes.lost()
        self.modes.plane, self.modes.absolute_centres, self.modes.incremental = 17, False, False
        self.modes.inch = before.inch
        self.modes.motion, self.modes.spindle, self.modes.fed = "", False, False
        self.put(
            *(self.code(code) for code in ("17", "90", "91.1", "20" if before.inch else "21")), plain=True
        )

    def loop(self) -> None:
        label = self.next_label()
        counter = self.chance.choice(("20", "<n>", "40"))
        self.put(f"#{counter}={self.chance.choice(('0', '1', '.5'))}", plain=True)
        self.scope.forget()
        limit = self.chance.choice(("2", "3", "3.5", "[2+1]"))
        test = f"[#{counter} {self.chance.choice(('LT', 'lt', 'LE'))} {limit}]"
        do = self.maybe(0.4)
        self.flow_line(f"{label} {self.key('do')}" if do else f"{label} {self.key('while')} {test}")
        before = self.modes.copy()
        self.put(f"#{counter}=[#{counter}+1]", plain=True)
        self.scope.set(counter, None)
        self.loops.append(label)
        self.body(self.chance.randint(1, 4), self.maybe(0.6))
        self.loops.pop()
        if self.maybe(0.15):
            self.leave(label)
        self.flow_line(f"{label} {self.key('while')} {test}" if do else f"{label} {self.key('endwhile')}")
        self.after(before)

    def sub(self) -> None:
        """A subprogram; what is in force at its end is what a call leaves, None if it states nothing."""
        self.flush()
        label = self.next_label()
        if self.late and self.has("called") and label[1:].isdigit():
            return self.called_by_number(label)
        arguments = self.chance.randint(0, 3)
        modes, self.modes = self.modes, self.modes.copy()
        scope, self.scope = self.scope, Scope(self.scope.shared)
        for number in range(arguments):
            self.scope.set(str(number + 1), None)
        self.flow_line(f"{label} {self.key('sub')}")
        fixed = self.maybe(0.7)
        self.modes.fed = False
        self.body(self.chance.randint(1, 5), fixed)
        if self.maybe(0.15):
            inner = self.next_label()
            text, _ = self.reals.truth(Scope())
            self.flow_line(f"{inner} if {text}")
            self.flow_line(f"{label} {self.key('return')}{self.chance.choice(('', ' [2]'))}")
            self.flow_line(f"{inner} endif")
        self.flow_line(f"{label} {self.key('endsub')}{self.chance.choice(('', '', ' [1+2]'))}")
        self.subs.append((label, arguments, self.modes.copy()))
        self.modes, self.scope = modes, scope
        self.scope.forget()

    def called_by_number(self, label: str) -> None:
        """A subprogram from its O to M99, which M98 calls."""
        modes, self.modes = self.modes, self.modes.copy()
        scope, self.scope = self.scope, Scope(self.scope.shared)
        self.flow_line(label)
        self.modes.fed = False
        self.body(self.chance.randint(1, 5), True)
        self.put(self.key("m99"), plain=True)
        self.subs.append((label, -1, self.modes.copy()))
        self.modes, self.scope = modes, scope
        self.scope.forget()

    def call(self) -> None:
        if not self.subs:
            return self.line()
        self.flush()
        label, count, _ = self.chance.choice(self.subs)
        if count < 0:
            times = [self.word("L", Real(str(self.chance.randint(1, 3)), None))] if self.maybe(0.4) else []
            self.put(self.key("m98"), self.word("P", Real(label[1:], None)), *times, plain=True)
            return self.after(self.modes.copy())
        arguments = [
            f"[{self.reals.real(self.chance.uniform(-20, 20), self.scope).text}]" for _ in range(count)
        ]
        blank = self.chance.choice((" ", "  ", ""))
        number = label.lstrip("oO ")
        if self.has("computed calls") and number.isdigit():
            label = f"o[{int(number) - 1}+1]"
        self.flow_line(f"{label} {self.key('call')} {blank.join(arguments)}".rstrip())
        before = self.modes.copy()
        if self.maybe(0.7):
            self.after(before)
        else:
            self.modes.lost()
            self.scope.forget()
            self.modes.motion, self.modes.fed = "", False
            self.features -= {"arcs", "cycles"}

    def saved(self) -> None:
        self.flush()
        code = self.chance.choice(("70", "72", "71", "73") if self.depth else ("70", "70", "72", "71"))
        if code in ("72", "73") and not self.has("restored"):
            code = "70"
        self.features.add("restored")
        self.put(self.code(code, "M"))
        if code == "72":
            self.after(self.modes)

    def noise(self) -> None:
        options = ["F200.5", "S900", "M8", "M9", "G4 P0.1", "M3 S1000", "M1", "M48", "", "G40"]
        if self.has("comments"):
            options += ["(X5)", "; G91", "(MSG, G1 X5)", "(DEBUG, #1)", "(PRINT, x)", "  (a) (b)"]
        if self.has("signals"):
            options += [
                "M62 P1",
                "M63 P1",
                "M64 P0",
                "M65 P0",
                "M66 P0 L0",
                "M66 E0 L0",
                "M67 E0 Q1.5",
                "M68 E0 Q2",
            ]
            options += ["M7", "M49", "M50 P1", "M51", "M52 P1", "M53 P1", "M19 R90"]
        if self.has("surface"):
            options += ["G96 D2500 S300", "G97 S900"]
        choice = self.chance.choice(options)
        if choice == "M3 S1000":
            self.modes.spindle = True
        if self.modes.timed and choice.startswith("F"):
            choice = "M9"
        self.flush()
        self.put(*choice.split(" ", 1) if choice[:1] in "GMF" else [choice], plain=choice[:1] not in "GMFS")

    def assign(self) -> None:
        self.put(*(self.assignment() for _ in range(self.chance.choice((1, 1, 2)))), plain=True)

    def steps(self, count: int) -> None:
        table: list[tuple[Callable[[], None], float]] = [
            (self.line, 10),
            (self.arc, 8 * self.has("arcs")),
            (self.mode, 5),
            (self.unit, 2 * self.has("inch")),
            (self.offset, 1.5 * self.has("offsets")),
            (self.setting, 1.5 * self.has("settings")),
            (self.shift, 2 * self.has("shifts")),
            (self.machine, 1.5 * self.has("machine")),
            (self.home, 1.5 * self.has("home")),
            (self.tool, 1.5 * self.has("tools")),
            (self.tool_length, 2 * self.has("lengths")),
            (self.cycles, 3 * self.has("cycles")),
            (self.thread, 1.5 * self.has("threads")),
            (self.polar, 1.5 * self.has("polar")),
            (self.spline, 1.5 * self.has("splines")),
            (self.lathe, 1.5 * self.has("diameters")),
            (self.beside, 2 * self.has("compensated")),
            (self.assign, 3 * self.has("parameters")),
            (self.flow, 2 * self.has("flow")),
            (self.call, 3 * bool(self.subs and self.depth < 2)),
            (self.saved, 1 * self.has("saved")),
            (self.noise, 2),
        ]
        for _ in range(count):
            if len(self.blocks) >= self.bound:
                return
            steps, weights = zip(*table, strict=True)
            self.chance.choices(steps, weights)[0]()
