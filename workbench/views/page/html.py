"""HTML snippets for the panels. All external text is escaped by `text`."""

from collections.abc import Iterable, Sequence
from html import escape

import numpy as np

from workbench.base.wording import readable
from workbench.report.blocks import Tone
from workbench.report.colours import BAD, CAREFUL, GOOD
from workbench.views.appearance.colours import SELECTED, css

MUTED = "var(--mantine-color-dimmed)"
LINE = "var(--mantine-color-default-border)"
FONT = "font-size:var(--words, 13px);line-height:1.45;color:var(--mantine-color-text)"
SMALLER = "font-size:calc(var(--words, 13px) - .5px)"
UNCHANGED = 5e-5
"""Smaller changes, as a share, are none."""
INKS = {Tone.PLAIN: MUTED, Tone.GOOD: GOOD, Tone.CAREFUL: CAREFUL, Tone.BAD: BAD}
"""Of a verdict."""


def text(value: object) -> str:
    """Any value, harmless in HTML."""
    return escape(readable(str(value)), quote=True)


def block(content: str, *, testid: str | None = None, style: str = "") -> str:
    """A block with the panels' type and margins."""
    name = f' data-testid="{testid}"' if testid else ""
    return f'<div{name} style="{FONT};padding:0 12px;{style}">{content}</div>'


def note(sentence: str, testid: str) -> str:
    """A sentence in place of a result, or above it."""
    return block(text(sentence), testid=testid, style=f"color:{MUTED};margin:4px 0")


def heading(title: str) -> str:
    return (
        f'<div style="font-weight:600;{SMALLER};color:{MUTED};letter-spacing:.02em;'
        f'margin:8px 0 3px">{text(title)}</div>'
    )


def folded(title: str, content: str) -> str:
    """Content below a heading that a click opens; nothing where there is none."""
    summary = f'<summary style="cursor:pointer">{text(title)}</summary>'
    style = f"margin:8px 0;{SMALLER};color:{MUTED}"
    inner = f'<div style="color:var(--mantine-color-text);margin-top:4px">{content}</div>'
    return f'<details style="{style}">{summary}{inner}</details>' if content else ""


def bullets(lines: Iterable[str], *, style: str = "margin:0") -> str:
    """A list of lines, which are HTML; nothing where there are none."""
    items = "".join(f"<li>{line}</li>" for line in lines)
    return f'<ul style="{style};padding-left:16px">{items}</ul>' if items else ""


def badge(title: str, colour: str) -> str:
    """A coloured dot and a word."""
    return (
        f'<span style="display:inline-block;width:9px;height:9px;border-radius:50%;background:{colour};'
        f'margin-right:6px"></span><span style="font-weight:600">{text(title)}</span>'
    )


def change(now: float, first: float, *, is_verdict: bool = True) -> str:
    """Change against the beginning in percent; one that judges is green if smaller, red if larger."""
    if not (np.isfinite(now) and np.isfinite(first)) or first == 0:
        return ""
    share = now / first - 1.0
    if abs(share) < UNCHANGED:
        return f' · <span style="color:{MUTED}">unchanged</span>'
    colour = MUTED if not is_verdict else BAD if share > 0 else GOOD
    shown = f"{100 * share:+.3g} %" if abs(share) < 9.995 else f"×{now / first:.0f}"
    return f' · <span style="color:{colour}">{shown.replace("-", "−")}</span>'


def sparkline(values: Sequence[float]) -> str:
    """A curve without numbers, as wide as its place; empty room where there are no two."""
    y, drawn = np.array(values), ""
    y = y[np.isfinite(y)]
    if len(y) > 1:
        low, span = y.min(), max(float(np.ptp(y)), 1e-12)
        places = zip(np.linspace(1.0, 99.0, len(y)), 22.0 - 20.0 * (y - low) / span, strict=True)
        points = " ".join(f"{a:.1f},{b:.1f}" for a, b in places)
        line = f'<polyline points="{points}" fill="none" stroke="{css(SELECTED)}" stroke-width="2"'
        drawn = f'{line} vector-effect="non-scaling-stroke"/>'
    return (
        '<svg viewBox="0 0 100 24" preserveAspectRatio="none" aria-hidden="true" '
        f'style="display:block;width:100%;height:24px">{drawn}</svg>'
    )
