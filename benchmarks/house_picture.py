"""The package as a picture: a box for each room, in layers, and arrows for who imports whom, drawn from the source text."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from html import escape

from house_rooms import ROOMS, arrows, room_of
from house_sources import Source

VALUES = "core"

# Fewer importing files than these are not drawn, but for a room that has no stronger arrow.
FEWEST = 3
# Pixels.
BOX, ROW, GAP, MARGIN, FOOT = (290, 58), 118, 40, 20, 40


@dataclass(frozen=True)
class House:
    """The rooms and who imports whom.

    Attributes:
        files: How many files a room has.
        lines: How many lines these have.
        imports: How many files of a room import from another: (importing, imported) -> files.
    """

    files: Mapping[str, int]
    lines: Mapping[str, int]
    imports: Mapping[tuple[str, str], int]

    def rows(self) -> list[list[str]]:
        """Return the rooms in layers, those that import no other first; rooms that import each other share a layer."""
        below = {room: {to for at, to in self.imports if at == room} for room in self.files}
        reach = {room: _reached(below, room) for room in below}
        level: dict[str, int] = {}
        for room in sorted(below, key=lambda room: len(reach[room] - {room})):
            lower = [level[to] + 1 for to in reach[room] if room not in reach[to]]
            together = [level[to] for to in reach[room] if room in reach[to] and to in level]
            level[room] = max([*lower, *together], default=0)
        return [[room for room in sorted(level) if level[room] == k] for k in range(max(level.values()) + 1)]


def house(files: list[Source]) -> House:
    """Return the rooms of the package's files; imports for type checkers alone do not count."""
    counts, lines, imports = Counter[str](), Counter[str](), Counter[tuple[str, str]]()
    for source in files:
        room = room_of(source.module)
        counts[room] += 1
        lines[room] += source.lines
    drawn = {(arrow.at, arrow.to, arrow.where.split(":")[0]) for arrow in arrows(files) if arrow.when != "for types"}
    imports.update((at, to) for at, to, _ in drawn)
    return House(counts, lines, imports)


def _reached(below: Mapping[str, set[str]], room: str) -> set[str]:
    seen: set[str] = set()
    waiting = list(below[room])
    while waiting:
        other = waiting.pop()
        if other not in seen:
            seen.add(other)
            waiting += below[other]
    return seen


def picture(drawn: House) -> str:
    """Return the rooms and the arrows between them as an SVG text."""
    places, width, height = _places(drawn)
    arrows = _arrows(drawn)
    text = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" font-family="sans-serif" font-size="12">',
        '<defs><marker id="tip" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="7" markerHeight="7" orient="auto" '
        'markerUnits="userSpaceOnUse"><path d="M0 0 L8 4 L0 8 z" fill="#5b7083"/></marker></defs>',
        f'<rect width="{width}" height="{height}" fill="#ffffff"/>',
    ]
    labels: list[str] = []
    for (at, to), files in sorted(arrows.items(), key=lambda arrow: arrow[1]):
        line, label = _arrow(drawn, places, at, to, files)
        text.append(line)
        labels.append(label)
    text += [_box(drawn, room, *place) for room, place in places.items()]
    hidden = sum(1 for at, to in drawn.imports if to != VALUES) - len(arrows)
    note = (
        f"An arrow: so many files of a room import from another. The number in a box's corner: files that import from "
        f"“{VALUES}”. Not drawn: {hidden} arrows of fewer than {FEWEST} files."
    )
    text += [*labels, f'<text x="{MARGIN}" y="{height - 14}" fill="#5b7083">{escape(note)}</text>', "</svg>"]
    return "\n".join(text) + "\n"


def _places(drawn: House) -> tuple[dict[str, tuple[float, float]], int, int]:
    """Return the middle of each box, and the picture's size, pixels; each row is ordered by what it imports."""
    rows = drawn.rows()
    width = max(len(row) for row in rows) * (BOX[0] + GAP) - GAP + 2 * MARGIN
    height = len(rows) * ROW - (ROW - BOX[1]) + 2 * MARGIN + FOOT
    places: dict[str, tuple[float, float]] = {}
    for number, row in enumerate(rows):
        wish = {room: _wished(drawn, places, room, width) for room in row}
        step = (width - 2 * MARGIN) / len(row)
        for column, room in enumerate(sorted(row, key=lambda room: (wish[room], room))):
            y = height - FOOT - MARGIN - BOX[1] / 2 - number * ROW
            places[room] = (MARGIN + step * (column + 0.5), y)
    return places, width, height


def _wished(drawn: House, places: Mapping[str, tuple[float, float]], room: str, width: int) -> float:
    """Return where a room would stand: in the middle of what it imports, weighed by how much."""
    weights = {to: files for (at, to), files in drawn.imports.items() if at == room and to in places and to != VALUES}
    return sum(places[to][0] * files for to, files in weights.items()) / sum(weights.values()) if weights else width / 2


def _arrows(drawn: House) -> dict[tuple[str, str], int]:
    """Return the arrows to draw: the strong ones, and each room's strongest."""
    among = {pair: files for pair, files in drawn.imports.items() if pair[1] != VALUES}
    strongest = {max((pair for pair in among if pair[0] == room), key=among.__getitem__) for room, _ in among}
    return {pair: files for pair, files in among.items() if files >= FEWEST or pair in strongest}


def _arrow(drawn: House, places: Mapping[str, tuple[float, float]], at: str, to: str, files: int) -> tuple[str, str]:
    """Return an arrow and the number beside its beginning."""
    (x0, y0), (x1, y1) = places[at], places[to]
    half = BOX[1] / 2
    # Arrows of a box leave and reach it side by side, those to the left on the left.
    start = x0 + 0.4 * BOX[0] * max(-1.0, min(1.0, (x1 - x0) / 500))
    end = x1 + 0.4 * BOX[0] * max(-1.0, min(1.0, (x0 - x1) / 500))
    if y0 == y1:
        side = half if x1 > x0 else -half
        curve = f"M{start:.0f} {y0 + side:.0f} C{start:.0f} {y0 + 2.2 * side:.0f} {end:.0f} {y1 + 2.2 * side:.0f} {end:.0f} {y1 + side:.0f}"
        label = (x0 + x1) / 2, y0 + 2.1 * side
    else:
        bend = 0.5 * (y1 - y0)
        curve = f"M{start:.0f} {y0 + half:.0f} C{start:.0f} {y0 + bend:.0f} {end:.0f} {y1 - bend:.0f} {end:.0f} {y1 - half:.0f}"
        label = start + 0.12 * (end - start), y0 + half + 16
    stroke = min(5.0, 0.8 + 0.3 * files)
    line = (
        f'<path d="{curve}" fill="none" stroke="#5b7083" stroke-opacity="0.55" stroke-width="{stroke:.1f}" '
        f'marker-end="url(#tip)"><title>{files} files of {at} import from {to}</title></path>'
    )
    number = (
        f'<text x="{label[0]:.0f}" y="{label[1]:.0f}" text-anchor="middle" font-size="10" fill="#22303c" '
        f'stroke="#ffffff" stroke-width="3" paint-order="stroke">{files}</text>'
    )
    return line, number


def _box(drawn: House, room: str, x: float, y: float) -> str:
    width, height = BOX
    left, top = x - width / 2, y - height / 2
    values = drawn.imports.get((room, VALUES))
    corner = f'<text x="{left + width - 8:.0f}" y="{top + 16:.0f}" text-anchor="end" fill="#7a5c00">{values}</text>'
    return (
        f'<rect x="{left:.0f}" y="{top:.0f}" width="{width}" height="{height}" rx="6" fill="#e8f1f5" stroke="#2b6777"/>'
        f'<text x="{left + 8:.0f}" y="{top + 18:.0f}" font-weight="bold" fill="#12333c">{escape(room)}</text>'
        f'<text x="{left + 8:.0f}" y="{top + 34:.0f}" font-size="11" fill="#22303c">{escape(ROOMS[room])}</text>'
        f'<text x="{left + 8:.0f}" y="{top + 50:.0f}" font-size="11" fill="#5b7083">'
        f"{drawn.files[room]} files, {drawn.lines[room]:,} lines</text>" + (corner if values else "")
    )
