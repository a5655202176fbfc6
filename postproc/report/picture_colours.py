"""A picture (SVG) of a page in the colours of the page: light, or dark where the reader's screen is."""

from __future__ import annotations

import re

GROUND, INK = (0x14, 0x16, 0x1A), (0xE9, 0xEB, 0xEF)
"""Of a dark page (``page.css``)."""
GREY = 24
"""A colour whose channels differ by less has no hue."""
CONTRAST = 4.5
"""Of a hue against the dark ground, at least (WCAG 2)."""
SCALE = 16
"""So many hues are a colour scale, which means the same on every ground."""

ON_DATA = "on-data"
"""Start of the names (gid) of what is drawn on a colour scale: it keeps its colours, as the scale does."""

_STATED = re.compile(r"(fill|stroke): #([0-9a-f]{6})")

Colour = tuple[int, int, int]


def follow_colours(svg: bytes) -> bytes:
    """The picture with a style sheet for dark screens: greys are turned over, dark hues are lightened.  On paper it
    stays as it is."""
    text = svg.decode("utf-8")
    stated = sorted(set(_STATED.findall(text)))
    hues = {name for _, name in stated if not _is_grey(_colour(name))}
    rules = [f"svg {{ fill: {_name(INK)}; background: {_name(GROUND)} }}"]
    for attribute, name in stated:
        colour = _colour(name)
        if _is_grey(colour) or len(hues) < SCALE:
            rules.append(
                f'*[style*="{attribute}: #{name}"]:not([id^={ON_DATA}] *)'
                f" {{ {attribute}: {_name(dark_colour(colour))} !important }}"
            )
    sheet = "<style>@media screen and (prefers-color-scheme: dark) {\n" + "\n".join(rules) + "\n}</style>"
    start = re.search(r"<svg\b[^<>]*>", text)
    return svg if start is None else (text[: start.end()] + sheet + text[start.end() :]).encode()


def dark_colour(colour: Colour) -> Colour:
    """What replaces a colour of a light page on a dark one."""
    if _is_grey(colour):
        share = sum(colour) / 765.0
        return _mixed(INK, GROUND, share)
    share = 0.0
    while contrast(_mixed(colour, (255, 255, 255), share), GROUND) < CONTRAST:
        share += 0.05
    return _mixed(colour, (255, 255, 255), share)


def contrast(one: Colour, other: Colour) -> float:
    """The ratio of the relative luminances of two sRGB colours (WCAG 2.1, 1.4.3), from 1 to 21."""
    low, high = sorted(map(_luminance, (one, other)))
    return (high + 0.05) / (low + 0.05)


def _luminance(colour: Colour) -> float:
    channels = [value / 255.0 for value in colour]
    linear = [value / 12.92 if value <= 0.04045 else ((value + 0.055) / 1.055) ** 2.4 for value in channels]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def _is_grey(colour: Colour) -> bool:
    return max(colour) - min(colour) < GREY


def _mixed(one: Colour, other: Colour, share: float) -> Colour:
    red, green, blue = (round(a + (b - a) * share) for a, b in zip(one, other, strict=True))
    return red, green, blue


def _colour(name: str) -> Colour:
    return int(name[:2], 16), int(name[2:4], 16), int(name[4:], 16)


def _name(colour: Colour) -> str:
    return "#" + "".join(f"{value:02x}" for value in colour)
