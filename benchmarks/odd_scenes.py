"""Families of odd scenes: each draws, from a seed, what is there, what is asked, and what is known of it by construction."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from robosandbox.shapes.drawer import DrawerParts
from robosandbox.types import Pose, Scene, SceneObject

TABLE = 0.04
# Half of the way that the bundled hand opens, metres: what is wider between every two faces does not fit.
HALF_OPENING = 0.04
GRAVITY = 9.81
RED, BLUE, GREEN, GREY = (0.85, 0.1, 0.1, 1.0), (0.1, 0.2, 0.85, 1.0), (0.1, 0.6, 0.2, 1.0), (0.5, 0.5, 0.5, 1.0)
_NOUNS = {"box": "box", "cylinder": "can", "sphere": "ball"}

# Why a thing cannot be done, as the family knows it by construction.
Cause = Literal["too_wide", "too_heavy", "slippery", "blocked", "locked", "out_of_reach"]


@dataclass(frozen=True, kw_only=True)
class Odd:
    """An odd scene and what is asked there.

    Attributes:
        family: Which one.
        seed: The draw.
        prompt: What the agent is told.
        objects: What is there.
        subject: Id of what is to be moved.
        goal: "held", "on" (the target), "pushed" (so many metres along x), "opened" (so far, metres), "shut".
        target: Id of where to, for "on".
        along: For "pushed" and "opened".
        friction: Coefficients of sliding friction by id; others have the table's, 1.
        possible: Whether it can be done, where that is known; None leaves it to the oracle.
        causes: What may rightly be named as the cause where it is not done; empty where nothing is known.
        corner: Whether the subject lies in a corner of the bin.
        still: Ids of what may not move by 10 mm, besides what is not named.
    """

    family: str
    seed: int
    prompt: str
    objects: tuple[SceneObject, ...]
    subject: str
    goal: Literal["held", "on", "pushed", "opened", "shut"]
    target: str | None = None
    along: float = 0.0
    friction: dict[str, float] = field(default_factory=dict)
    possible: bool | None = None
    causes: frozenset[Cause] = frozenset()
    corner: bool = False
    still: tuple[str, ...] = ()

    @property
    def scene(self) -> Scene:
        """The scene with the bundled arm."""
        return Scene(objects=self.objects)

    @property
    def named(self) -> frozenset[str]:
        """Ids that the robot was told of."""
        return frozenset({self.subject} | ({self.target} if self.target else set()))

    def mass(self, name: str) -> float:
        """Return an object's mass, kg."""
        return next(item.mass for item in self.objects if item.id == name)


Draw = Callable[[int, np.random.Generator], Odd]
# Name -> the number that its draws are seeded with, and how it draws.
FAMILIES: dict[str, tuple[int, Draw]] = {}


def family(number: int) -> Callable[[Draw], Draw]:
    """Register a family by its function's name; a number of its own keeps its scenes whatever families come besides."""

    def register(draw: Draw) -> Draw:
        FAMILIES[draw.__name__] = number, draw
        return draw

    return register


def drawn(name: str, seed: int) -> Odd:
    """Return a family's scene of a seed: the same, whatever is drawn besides."""
    number, draw = FAMILIES[name]
    return draw(seed, np.random.default_rng([number, seed]))


def thing(
    name: str,
    kind: str,
    size: tuple[float, ...],
    xy: tuple[float, float],
    *,
    bottom: float = TABLE,
    yaw: float = 0.0,
    mass: float = 0.05,
    rgba: tuple[float, float, float, float] = RED,
) -> SceneObject:
    """Return an object that stands at a height, metres."""
    height = {"box": size[-1], "cylinder": size[-1], "sphere": size[0]}.get(kind, 0.0)
    pose = Pose(xyz=(*xy, bottom + height + 0.0005), quat_xyzw=(0.0, 0.0, math.sin(yaw / 2.0), math.cos(yaw / 2.0)))
    return SceneObject(id=name, kind=kind, size=size, pose=pose, mass=mass, rgba=rgba)


def _solid(rng: np.random.Generator, low: float, high: float) -> tuple[str, tuple[float, ...]]:
    """Return a kind and half-extents, each edge from `low` to `high` metres."""
    kind = str(rng.choice(["box", "box", "cylinder", "sphere"]))
    a, b, c = (float(rng.uniform(low, high)) / 2.0 for _ in range(3))
    return kind, {"box": (a, b, c), "cylinder": (a, c), "sphere": (a,)}[kind]


def _mass(rng: np.random.Generator, low: float = 0.005, high: float = 3.0) -> float:
    """Return a mass, kg, uniform in its logarithm."""
    return float(np.exp(rng.uniform(math.log(low), math.log(high))))


def _middle(rng: np.random.Generator) -> tuple[float, float]:
    return float(rng.uniform(0.05, 0.25)), float(rng.uniform(-0.2, 0.2))


def _picked(name: str, seed: int, red: SceneObject, *others: SceneObject, **more: object) -> Odd:
    prompt = f"pick up the red {_NOUNS[red.kind]}"
    return Odd(family=name, seed=seed, prompt=prompt, objects=(red, *others), subject=red.id, goal="held", **more)  # type: ignore[arg-type]


@family(6)
def sizes(seed: int, rng: np.random.Generator) -> Odd:
    """Things of 8 to 90 mm, alone."""
    kind, size = _solid(rng, 0.008, 0.09)
    red = thing(
        f"red_{_NOUNS[kind]}", kind, size, _middle(rng), yaw=float(rng.uniform(0, math.pi)), mass=_mass(rng, 0.005, 0.3)
    )
    fits = min(size) <= HALF_OPENING - 0.002
    return _picked(
        "sizes", seed, red, possible=None if fits else False, causes=frozenset() if fits else frozenset({"too_wide"})
    )


@family(11)
def weights(seed: int, rng: np.random.Generator) -> Odd:
    """Boxes of 5 g to 3 kg, smooth and rough."""
    a, b, c = (float(rng.uniform(0.03, 0.06)) / 2.0 for _ in range(3))
    red = thing("red_box", "box", (a, b, c), _middle(rng), yaw=float(rng.uniform(0, math.pi)), mass=_mass(rng))
    slip = float(rng.uniform(0.2, 2.0))
    return _picked("weights", seed, red, friction={red.id: slip}, causes=frozenset({"too_heavy", "slippery"}))


@family(1)
def edge(seed: int, rng: np.random.Generator) -> Odd:
    """Things at the table's edge, up to a third of them over it."""
    kind, size = _solid(rng, 0.02, 0.06)
    over = float(rng.uniform(-0.03, size[0] / 3.0 if kind == "box" else 0.0))
    side = float(rng.choice([-1.0, 1.0]))
    xy = (
        float(rng.uniform(-0.05, 0.2)),
        side * (0.5 - size[min(1, len(size) - 1)] + over if kind == "box" else 0.47 + over),
    )
    return _picked("edge", seed, thing(f"red_{_NOUNS[kind]}", kind, size, xy, mass=_mass(rng, 0.01, 0.3)))


@family(8)
def touching(seed: int, rng: np.random.Generator) -> Odd:
    """A box that touches one to three others."""
    a, b, c = (float(rng.uniform(0.02, 0.05)) / 2.0 for _ in range(3))
    x, y = _middle(rng)
    others = []
    for k in range(int(rng.integers(1, 4))):
        h, w = float(rng.uniform(0.015, 0.03)), float(rng.uniform(0.015, 0.03))
        gap = 0.0008
        place = [(x + a + w + gap, y), (x, y + b + w + gap), (x - a - w - gap, y)][k]
        others.append(thing(f"blue_{k}", "box", (w, w, h), place, mass=_mass(rng, 0.05, 0.5), rgba=BLUE))
    return _picked("touching", seed, thing("red_box", "box", (a, b, c), (x, y), mass=_mass(rng, 0.02, 0.3)), *others)


@family(7)
def stacked(seed: int, rng: np.random.Generator) -> Odd:
    """One thing on another; the upper or the lower one is asked for."""
    x, y = _middle(rng)
    low, high = (float(rng.uniform(0.015, 0.03)) for _ in range(2))
    lower_is_red = bool(rng.integers(2))
    first, second = ("red_box", RED), ("blue_box", BLUE)
    (a, shade), (b, other) = (first, second) if lower_is_red else (second, first)
    under = thing(a, "box", (max(low, high), max(low, high), low), (x, y), mass=_mass(rng, 0.05, 0.3), rgba=shade)
    upper = thing(
        b, "box", (high, high, high), (x, y), bottom=TABLE + 2.0 * low + 0.0005, mass=_mass(rng, 0.02, 0.2), rgba=other
    )
    red, blue = (under, upper) if lower_is_red else (upper, under)
    return _picked("stacked", seed, red, blue)


@family(0)
def corner(seed: int, rng: np.random.Generator) -> Odd:
    """A thing in the corner of a bin of a usual size."""
    kind, size = _solid(rng, 0.02, 0.05)
    half = float(rng.uniform(0.06, 0.1)), float(rng.uniform(0.06, 0.12))
    height = float(rng.uniform(0.04, 0.09))
    x, y = float(rng.uniform(0.1, 0.2)), float(rng.uniform(-0.12, 0.12))
    along, across = size[0], size[1] if kind == "box" else size[0]
    gap = float(rng.uniform(0.001, 0.006))
    sx, sy = float(rng.choice([-1.0, 1.0])), float(rng.choice([-1.0, 1.0]))
    xy = x + sx * (half[0] - along - gap), y + sy * (half[1] - across - gap)
    red = thing(f"red_{_NOUNS[kind]}", kind, size, xy, bottom=TABLE + 0.004, mass=_mass(rng, 0.01, 0.2))
    bin_ = thing("grey_bin", "bin", (*half, height), (x, y), mass=float(rng.uniform(0.2, 0.6)), rgba=GREY)
    return _picked("corner", seed, red, bin_, corner=True, still=("grey_bin",))


@family(3)
def leaning(seed: int, rng: np.random.Generator) -> Odd:
    """A plate of wood that leans on a block."""
    x, y = _middle(rng)
    half, thick, long = 0.02, float(rng.uniform(0.004, 0.01)), float(rng.uniform(0.04, 0.06))
    tilt = math.radians(float(rng.uniform(15.0, 35.0)))
    block = thing("blue_box", "box", (0.025, 0.025, 0.04), (x, y), mass=1.0, rgba=BLUE)
    s, c = math.sin(tilt), math.cos(tilt)
    # Its upper edge on the block's face, its lower edge on the table.
    middle = (x - 0.025 - long * s - thick * c - 0.001, y, TABLE + long * c + thick * s + 0.001)
    red = SceneObject(
        id="red_box", kind="box", size=(thick, half, long), mass=0.05, rgba=RED,
        pose=Pose(xyz=middle, quat_xyzw=(0.0, math.sin(tilt / 2.0), 0.0, math.cos(tilt / 2.0))),
    )  # fmt: skip
    return _picked("leaning", seed, red, block)


@family(9)
def under(seed: int, rng: np.random.Generator) -> Odd:
    """A thing under a bridge of a plank on two blocks."""
    x, y = _middle(rng)
    size = tuple(float(rng.uniform(0.01, 0.02)) for _ in range(3))
    height = float(rng.uniform(0.03, 0.045))
    blocks = [
        thing(f"blue_{k}", "box", (0.02, 0.015, height), (x, y + s * 0.06), mass=0.3, rgba=BLUE)
        for k, s in enumerate((-1, 1))
    ]
    plank = thing(
        "green_box", "box", (0.02, 0.09, 0.006), (x, y), bottom=TABLE + 2.0 * height + 0.0005, mass=0.1, rgba=GREEN
    )
    return _picked("under", seed, thing("red_box", "box", size, (x, y), mass=0.05), *blocks, plank)


@family(2)
def floor(seed: int, rng: np.random.Generator) -> Odd:
    """A thing on the floor beside the table."""
    kind, size = _solid(rng, 0.02, 0.06)
    xy = float(rng.uniform(-0.3, 0.1)), float(rng.choice([-1.0, 1.0])) * float(rng.uniform(0.56, 0.7))
    red = thing(f"red_{_NOUNS[kind]}", kind, size, xy, bottom=0.0, mass=_mass(rng, 0.01, 0.3))
    return _picked("floor", seed, red, causes=frozenset({"out_of_reach", "blocked"}))


def _pillar(rng: np.random.Generator, xy: tuple[float, float]) -> SceneObject:
    half = float(rng.uniform(0.012, 0.03))
    return thing("blue_box", "box", (half, half, float(rng.uniform(0.03, 0.07))), xy, mass=2.0, rgba=BLUE)


@family(4)
def pillar(seed: int, rng: np.random.Generator) -> Odd:
    """A can that is to stand on a pillar, which may be narrower than it."""
    x, y = _middle(rng)
    can = thing(
        "red_can",
        "cylinder",
        (float(rng.uniform(0.015, 0.03)), float(rng.uniform(0.02, 0.05))),
        (x, y - 0.13),
        mass=0.1,
    )
    return Odd(
        family="pillar", seed=seed, prompt="put the red can on the blue box", objects=(can, _pillar(rng, (x, y))),
        subject="red_can", goal="on", target="blue_box",
    )  # fmt: skip


def _push(
    name: str, seed: int, rng: np.random.Generator, mass: float, slip: float, *others: SceneObject, **more: object
) -> Odd:
    along = 0.01 * int(rng.integers(4, 11))
    half = tuple(float(rng.uniform(0.02, 0.045)) for _ in range(3))
    red = thing("red_box", "box", half, (float(rng.uniform(0.05, 0.12)), float(rng.uniform(-0.15, 0.15))), mass=mass)
    return Odd(
        family=name, seed=seed, prompt=f"push the red box {100 * along:.0f} cm forward", objects=(red, *others),
        subject="red_box", goal="pushed", along=along, friction={"red_box": slip, **{item.id: 1.0 for item in others}}, **more,
    )  # type: ignore[arg-type] # fmt: skip


@family(5)
def push(seed: int, rng: np.random.Generator) -> Odd:
    """Things of up to 12 kg that are to be pushed; what slides under half of 60 N can be, what takes twice of it cannot."""
    mass, slip = _mass(rng, 0.05, 12.0), float(rng.uniform(0.2, 2.0))
    takes = slip * mass * GRAVITY
    possible = True if takes < 30.0 else False if takes > 120.0 else None
    return _push("push", seed, rng, mass, slip, possible=possible, causes=frozenset({"too_heavy"}))


@family(10)
def wall(seed: int, rng: np.random.Generator) -> Odd:
    """A thing that is to be pushed against one of 60 kg."""
    odd = _push(
        "wall",
        seed,
        rng,
        _mass(rng, 0.05, 1.0),
        float(rng.uniform(0.3, 1.0)),
        possible=False,
        causes=frozenset({"blocked"}),
    )
    red = odd.objects[0]
    x, y, _ = red.pose.xyz
    gap = float(rng.uniform(0.001, 0.02))
    heavy = thing("blue_box", "box", (0.04, 0.06, 0.05), (x + red.size[0] + 0.04 + gap, y), mass=60.0, rgba=BLUE)
    return Odd(
        **{
            **{name: getattr(odd, name) for name in odd.__dataclass_fields__},
            "objects": (red, heavy),
            "still": ("blue_box",),
        }
    )


@family(12)
def drawers(seed: int, rng: np.random.Generator) -> Odd:
    """A drawer of 1 to 6 kg that is to be opened or shut: some are locked, some have a box before them that lets them open by a third."""
    case = str(rng.choice(["opened", "shut", "locked", "before"], p=[0.35, 0.35, 0.15, 0.15]))
    width, depth, height = (float(rng.uniform(*ends)) for ends in ((0.12, 0.25), (0.12, 0.2), (0.06, 0.12)))
    travel = float(rng.uniform(0.4, 0.7)) * depth
    x, y, yaw = float(rng.uniform(0.22, 0.32)), float(rng.uniform(-0.12, 0.12)), float(rng.uniform(-0.5, 0.5))
    drawer = SceneObject(
        id="drawer", kind="drawer", size=(width, depth, height, travel), mass=float(rng.uniform(1.0, 6.0)), rgba=GREY,
        pose=Pose(xyz=(x, y, TABLE), quat_xyzw=(0.0, 0.0, math.sin(yaw / 2.0), math.cos(yaw / 2.0))),
        open=float(rng.uniform(0.4, 1.0)) * travel if case == "shut" else 0.0, locked=case == "locked",
    )  # fmt: skip
    others = []
    if case == "before":
        gap = float(rng.uniform(0.1, 0.33)) * travel
        parts = DrawerParts.of(drawer.size)
        far = float(parts.grip[0] - parts.grip_centre[0]) + gap + 0.03
        front = x - far * math.cos(yaw), y - far * math.sin(yaw)
        half = (0.03, float(rng.uniform(0.02, 0.06)), float(rng.uniform(0.02, 0.05)))
        others.append(thing("blue_box", "box", half, front, yaw=yaw, mass=_mass(rng, 0.05, 1.0), rgba=BLUE))
    return Odd(
        family="drawers", seed=seed, prompt="close the drawer" if case == "shut" else "open the drawer",
        objects=(drawer, *others), subject="drawer", goal="shut" if case == "shut" else "opened", along=travel * 2.0 / 3.0,
        friction={"drawer": float(rng.uniform(0.4, 1.5))}, possible=False if case == "locked" else None,
        causes=frozenset({"locked"} if case == "locked" else ()), still=("drawer",),
    )  # fmt: skip
