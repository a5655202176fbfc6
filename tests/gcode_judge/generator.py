"""Programs for LinuxCNC, made up from a seed by this grammar (words of a block in any order; ``real``: expressions.py):

    program    = ["%"] {sub} preamble {step} [end {step}] ["M2" | "M30"] {sub} ["%"]
    step       = motion | arc | mode | unit | offset | setting | shift | machine | home | length | tool | cycles
               | thread | polar | spline | lathe | beside | spindle | assignment | flow | call | saved modes | noise
    block      = ["/"] ["N" number] {word | assignment | comment}; assignments and modes stand alone or join a motion
    word       = letter real, blanks and case free, "G 1", "g01", "G[0+1]", "G1.", also within numbers
    motion     = [G0 | G1] {X Y Z A B C} [G4 P], modal or stated, absolute or incremental (G90, G91)
    arc        = (G2 | G3) ends (centre by I J K of the plane, one that is 0 maybe without its word | R, also negative)
                 [third axis] [P turns], centres from the start or absolute (G91.1, G90.1), full circles without ends
    thread     = (G33 {X Y} | G33.1) Z K;  polar = G1 [@] [^]
    spline     = G5 (I J) P Q X Y, after one of its kind without I and J;  lathe = G7 {motion} G8
    beside     = (G41.1 | G42.1) D motion {motion} [G40] motion: beside the contour by the radius
    mode       = G17 | G18 | G19 | G90 | G91 | G90.1 | G91.1 | G61 | G61.1 | G64 [P [Q]] | G93 | G94 | G95 | G40 | G80
    unit       = G20 | G21
    offset     = G54 ... G59.3
    setting    = G10 L2 P0..9 {X Y Z} [R] | G10 L20 P0..9 {X Y Z} | G10 (L1 | L10 | L11) P1..4 Z
               | "#" (5221 ... 5383, a coordinate of an offset) "=" integer
    shift      = G92 {X Y Z} | G52 {X Y Z} | G92.1 | G92.2 | G92.3
    machine    = G53 (G0 | G1) {X Y Z};  home = (G28 | G30) [{X Y Z}] | G28.1 | G30.1
    length     = G43 [H] | G43.1 Z | G43.2 H | G49;  tool = T M6 | T, then M6
    cycles     = (G73 | G81 | G82 | G83 | G85 | G86 | G87 | G88 | G89) {X Y Z} R [L] [Q] [P] [G98 | G99] {more holes}
                 (G80 | a motion), in any plane, absolute or incremental
    assignment = "#" name "=" real, of values that later words use, parameters of the control (#5420, #<_x>) among them
    flow       = o if/elseif/else/endif | o while/endwhile | o do/while | o repeat/endrepeat; break and continue in
                 them, and of the loop around a repeat in it
    sub        = o sub ... [o return [real]] o endsub [real] | O number ... M99
    call       = o call {[real]} | o[real] call | M98 P [L]
    saved      = M70 | M72 | M73 | M71;  noise = F | S | M codes | comments of both kinds | G4 | G96 D S | G97
               | M62 ... M68 with their words

Each program has some of the features only, so that one reading that is wrong does not hide all others.
"""

from __future__ import annotations

from .blocks import Block, Made
from .flow import Flow


class Generator(Flow):
    """One program."""

    def preamble(self) -> None:
        codes = [code for code in ("21", "90", "17", "54", "94", "91.1", "40") if self.maybe(0.8)]
        if self.maybe(0.15):
            codes = []
        self.modes.fed = False
        self.pending = [self.code(code) for code in codes]
        if self.maybe(0.6) or not self.has("sparse"):
            self.flush()
        if self.maybe(0.8):
            self.anchor()
        self.flush()

    def made(self) -> Made:
        tape = self.maybe(0.3)
        if tape:
            self.blocks.append(Block(("%",)))
        self.late = late = self.maybe(0.15)
        start = len(self.blocks)
        if self.has("subs"):
            for _ in range(self.chance.randint(1, 2)):
                self.sub()
        subs = self.blocks[start:]
        if late:
            del self.blocks[start:]
        self.preamble()
        while len(self.blocks) < self.bound:
            if self.has("end") and self.maybe(0.1):
                self.flush()
                self.put(self.code(self.chance.choice(("2", "30")), "M"), plain=True)
            self.steps(1)
        self.flush()
        if not tape or late or self.maybe(0.5):
            self.put(self.code(self.chance.choice(("2", "30")), "M"), plain=True)
        if late:
            self.blocks += subs
        if tape:
            self.blocks.append(Block(("%",)))
        return Made(tuple(self.blocks), self.has("slash") and self.maybe(0.5), self.chance.randrange(1000))


def make(seed: int, without: tuple[str, ...] = ()) -> Made:
    """The program of a seed; ``without``: features that it must not have."""
    return Generator(seed, without).made()
