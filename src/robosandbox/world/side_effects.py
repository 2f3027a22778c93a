"""Side effects: things that moved while a skill was at work on others."""

from __future__ import annotations

from robosandbox.types import ObservedScene
from robosandbox.world.relations import contents, moved

# Metres; chosen as twice the 2.2 mm within which perception is in 95 of 100 cases (docs/measured.md), which half of it
# would report as a disturbance now and then.
_DISTURBED = 0.005


def disturbed(before: ObservedScene, after: ObservedScene, *named: str) -> tuple[str, ...]:
    """Return a sentence for each object that has moved but the named ones, what is on them as a part, and what lay in them."""
    vessels = [item for name in named if (item := before.find(name)) and item.shape.holds_things]
    expected = {*named, *(name for vessel in vessels for name, _ in contents(before.objects, vessel))}
    sentences = []
    for item in before.objects:
        now = after.find(item.id)
        if item.id in expected or item.id.rpartition(".")[0] in named:
            continue
        if now is None:
            sentences.append(f"{item.id} is no longer seen")
        elif (distance := moved(item, now)) > _DISTURBED:
            sentences.append(f"moved {item.id} by {distance * 1000:.0f} mm on the way")
    return tuple(sentences)
