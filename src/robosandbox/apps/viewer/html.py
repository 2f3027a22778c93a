"""Pieces of HTML for panels; whatever comes from outside is escaped."""

from __future__ import annotations

from collections.abc import Iterable
from html import escape

# Each has a contrast of at least 4.5 on white (WCAG 2.2, 1.4.3).
_INK, _GREY, _GREEN, _BLUE, _RED, _AMBER = "#1b1f24", "#646d78", "#1b7a43", "#205c9e", "#c62323", "#9a5b00"
COLOURS = {"ink": _INK, "grey": _GREY, "green": _GREEN, "blue": _BLUE, "red": _RED, "amber": _AMBER}


def number(value: float, digits: int) -> str:
    """Return a value with so many decimals; what rounds to nothing has no sign."""
    # Adding zero turns the negative zero that rounding leaves into the positive one.
    return f"{round(value, digits) + 0.0:.{digits}f}"


def block(*lines: str) -> str:
    """Return lines of HTML in the type that panels are set in."""
    return (
        '<div style="font-size:0.84em;line-height:1.45;padding:0 0.9em 0.6em;overflow-wrap:anywhere">'
        + "".join(lines)
        + "</div>"
    )


def line(text: str, colour: str | None = None, *, bold: bool = False, mark: str = "") -> str:
    """Return a line of plain text.

    Args:
        text: Escaped here.
        colour: A key of `COLOURS`.
        bold: Whether it stands out.
        mark: A sign before it, in a column of its own.
    """
    style = "display:flex;gap:0.5em;margin:0.1em 0;"
    style += f"color:{COLOURS[colour]};" if colour else ""
    style += "font-weight:600;" if bold else ""
    sign = f'<span style="flex:0 0 1.1em;text-align:center">{escape(mark)}</span>' if mark else ""
    return f'<div style="{style}">{sign}<span>{escape(text)}</span></div>'


def heading(text: str) -> str:
    """Return a small heading."""
    return (
        f'<div style="font-size:0.78em;letter-spacing:0.04em;text-transform:uppercase;color:{_GREY};'
        f'margin:0.5em 0 0.15em">{escape(text)}</div>'
    )


def gauge(name: str, value: float, low: float, high: float, text: str, *, limits: str = "", warn: bool = True) -> str:
    """Return a row with a name, a bar with where a value lies between its limits, and the value in words.

    Args:
        name: Escaped here.
        value: What is shown.
        low: The least.
        high: The most.
        text: The value in words; escaped here.
        limits: Least and most in words, shown when the bar is pointed at; escaped here.
        warn: Whether it turns red near a limit.
    """
    share = 50.0 if not high > low else max(0.0, min(100.0, 100.0 * (value - low) / (high - low)))
    near = warn and not 4.0 <= share <= 96.0
    colour = _RED if near else _BLUE
    return (
        '<div style="display:grid;grid-template-columns:8.2em 1fr 6.2em;gap:0.6em;align-items:center;margin:0.18em 0">'
        f'<span style="overflow:hidden;text-overflow:ellipsis;white-space:nowrap">{escape(name)}</span>'
        f'<span title="{escape(limits)}" style="position:relative;height:0.5em;background:#e4e8ec;border-radius:0.25em">'
        f'<span style="position:absolute;left:calc({share:.1f}% - 0.3em);top:-0.1em;width:0.6em;height:0.7em;'
        f'border-radius:0.2em;background:{colour}"></span></span>'
        f'<span style="text-align:right;font-variant-numeric:tabular-nums;color:{colour if near else "inherit"}">'
        f"{escape(text)}</span></div>"
    )


def rows(pairs: Iterable[tuple[str, str]]) -> str:
    """Return names and values in two columns."""
    return "".join(
        '<div style="display:grid;grid-template-columns:8.2em 1fr;gap:0.6em;margin:0.1em 0">'
        f'<span style="color:{_GREY}">{escape(name)}</span><span>{escape(value)}</span></div>'
        for name, value in pairs
    )
