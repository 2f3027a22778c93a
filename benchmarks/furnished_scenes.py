"""Furnished scenes: from a seed an MJCF file of a table with shelf, cupboard or cabinet, button, walls and things, and what is asked there.

Only primitives. What the judge and the oracle have to know (where boards, cavities, joints are) is written down as it is drawn.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import mujoco
import numpy as np

Array = np.ndarray
Relation = Literal["on", "inside", "open", "closed", "pressed", "beside", "at"]
# Metres on either side of the middle that the bundled hand's fingers open to.
HALF_OPENING = 0.04
TABLE = "table"
_COLOURS = {
    "red": (0.85, 0.1, 0.1), "blue": (0.1, 0.2, 0.85), "green": (0.1, 0.6, 0.2), "yellow": (0.95, 0.8, 0.1),
    "purple": (0.5, 0.15, 0.6), "orange": (0.95, 0.5, 0.1),
}  # fmt: skip
_RUBBER = 'friction="0.9 0.01 0.001" condim="4"'
_WOOD, _WHITE, _STONE, _DARK = (f'rgba="{rgb} 1"' for rgb in ("0.7 0.55 0.36", "0.9 0.9 0.88", "0.55 0.55 0.6", "0.2 0.2 0.2"))  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Space:
    """A box in the frame of a body in which things stand: over a board, in a cavity or in a drawer; its floor is `low[2]`."""

    body: str
    low: tuple[float, float, float]
    high: tuple[float, float, float]


@dataclass(frozen=True, kw_only=True)
class Joint:
    """A part that turns or slides: its body, its joint there, the values shut and fully open, and whether it is locked."""

    body: str
    name: str
    shut: float
    far: float
    locked: bool = False


@dataclass(frozen=True, kw_only=True)
class Goal:
    """One thing that is asked: a relation of ids, a place for "at", a side for "beside", and the words in which it is said."""

    relation: Relation
    subject: str
    target: str = ""
    side: str = ""
    xy: tuple[float, float] = (0.0, 0.0)
    said: str


@dataclass(kw_only=True)
class Furnished:
    """A drawn scene.

    Attributes:
        seed: The draw.
        mjcf: The file.
        base: Where the arm stands, x, y, z, yaw; None leaves it to be inferred.
        height: Of the table's top, metres.
        things: Half extents of each thing's box, metres, by id.
        spaces: Where things can stand, by the id that a goal names; the table is one.
        joints: Parts by id.
        doors: Id of the part before each space, where there is one.
        goals: What is asked, one after the other.
    """

    seed: int
    mjcf: str = ""
    base: tuple[float, float, float, float] | None = None
    height: float = 0.0
    things: dict[str, tuple[float, float, float]] = field(default_factory=dict)
    spaces: dict[str, Space] = field(default_factory=dict)
    joints: dict[str, Joint] = field(default_factory=dict)
    doors: dict[str, str] = field(default_factory=dict)
    goals: tuple[Goal, ...] = ()

    def write(self, folder: Path) -> Path:
        """Write the file, and beside it the sidecar that says where the arm stands and how things start."""
        path = folder / f"furnished_{self.seed}.xml"
        path.write_text(self.mjcf)
        said = "keyframe: start\n"
        if self.base is not None:
            said += "robot_base: [" + ", ".join(f"{value:.3f}" for value in self.base) + "]\n"
        path.with_suffix(".robosandbox.yaml").write_text(said)
        return path


def drawn(seed: int) -> Furnished:
    """Return the scene of a seed: of the draws of that seed the first in which nothing starts inside another and all stays."""
    for attempt in range(200):
        room = _Draw(seed, np.random.default_rng([seed, attempt])).room()
        if room is not None and _stays(room):
            return room
    raise RuntimeError(f"seed {seed}: none of 200 draws stays where it is")


def _stays(room: Furnished) -> bool:
    model = mujoco.MjModel.from_xml_string(room.mjcf)
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_forward(model, data)
    if any(contact.dist < -0.001 for contact in data.contact):
        return False
    start = {name: data.body(name).xpos.copy() for name in room.things}
    while data.time < 1.5:
        mujoco.mj_step(model, data)
    return all(float(np.linalg.norm(data.body(name).xpos - at)) < 0.01 for name, at in start.items())


@dataclass(frozen=True)
class _Footprint:
    """A rectangle on the table: its middle, half extents and turn."""

    x: float
    y: float
    half: tuple[float, float]
    yaw: float = 0.0

    def corners(self) -> Array:
        axes = np.array([[math.cos(self.yaw), math.sin(self.yaw)], [-math.sin(self.yaw), math.cos(self.yaw)]])
        signs = np.array([(a, b) for a in (-1.0, 1.0) for b in (-1.0, 1.0)])
        return np.array([self.x, self.y]) + (signs * self.half) @ axes

    def is_apart(self, other: _Footprint, gap: float) -> bool:
        """Tell by the axis theorem whether two rectangles keep a gap."""
        a, b = self.corners(), other.corners()
        for yaw in (self.yaw, other.yaw):
            for axis in (np.array([math.cos(yaw), math.sin(yaw)]), np.array([-math.sin(yaw), math.cos(yaw)])):
                p, q = a @ axis, b @ axis
                if max(p.min() - q.max(), q.min() - p.max()) > gap:
                    return True
        return False


class _Draw:
    """One draw of a scene."""

    def __init__(self, seed: int, rng: np.random.Generator) -> None:
        self._room, self._rng = Furnished(seed=seed), rng
        self._bodies: list[str] = []
        self._extra: list[str] = []
        self._taken: list[_Footprint] = []
        self._starts: dict[str, float] = {}
        self._on_table: list[str] = []

    def _u(self, low: float, high: float) -> float:
        return float(self._rng.uniform(low, high))

    def _is(self, chance: float) -> bool:
        return bool(self._rng.random() < chance)

    def room(self) -> Furnished | None:
        """Return the scene; None where not everything found a place."""
        room = self._room
        half = self._u(0.42, 0.55), self._u(0.5, 0.7)
        middle = self._u(-0.3, 0.3), self._u(-0.3, 0.3)
        room.height = z = self._u(0.3, 0.8)
        self._half, self._middle = half, middle
        self._base = np.array([middle[0] - half[0] + 0.12, middle[1] + self._u(-0.1, 0.1)])
        if self._is(0.5):
            room.base = (float(self._base[0]), float(self._base[1]), z, 0.0)
        self._bodies.append(_body(TABLE, (*middle, 0.0), geoms=[_box((0, 0, z - 0.02), (*half, 0.02), _WOOD)]))
        room.spaces[TABLE] = Space(body=TABLE, low=(-half[0], -half[1], z), high=(*half, z + 1.0))
        # The arm's own place, and where its hand is at home.
        self._taken.append(_Footprint(float(self._base[0]) + 0.15, float(self._base[1]), (0.30, 0.14)))
        side = 1.0 if self._is(0.5) else -1.0
        placed = [
            self._shelf(side),
            self._storage(-side),
            self._bell(),
            *(self._wall(k) for k in range(1 + self._is(0.5))),
        ]
        placed += [self._thing(k) for k in range(int(self._rng.integers(3, 6)))]
        if not all(placed):
            return None
        room.goals = self._goals()
        self._write()
        return room

    # Furniture.

    def _place(self, half: tuple[float, float], reach: tuple[float, float], angle: tuple[float, float], *, faces: bool, gap: float = 0.03) -> _Footprint | None:  # fmt: skip
        """Return a free rectangle on the table whose middle is so far from the arm, in metres and radians from its front."""
        for _ in range(40):
            r, turn = self._u(*reach), self._u(*angle)
            x, y = self._base + r * np.array([math.cos(turn), math.sin(turn)])
            print_ = _Footprint(
                float(x), float(y), half, turn + self._u(-0.35, 0.35) if faces else self._u(0.0, math.pi)
            )
            inside = np.abs(print_.corners() - self._middle) < np.array(self._half)
            if inside.all() and all(print_.is_apart(other, gap) for other in self._taken):
                self._taken.append(print_)
                return print_
        return None

    def _shelf(self, side: float) -> bool:
        rng, room = self._rng, self._room
        depth, width, thick = self._u(0.08, 0.12), self._u(0.14, 0.2), 0.008
        at = self._place((depth, width), (0.5, 0.68), tuple(sorted((side * 0.35, side * 1.2))), faces=True)  # type: ignore[arg-type]
        if at is None:
            return False
        has_back, has_sides, is_one = self._is(0.5), self._is(0.6), self._is(0.3)
        levels, low, top = int(rng.integers(2, 4)), 0.0, self._u(0.02, 0.1)
        boards: list[tuple[float, list[str]]] = []
        for _ in range(levels):
            geoms = [_box((0, 0, top - thick), (depth, width, thick), _WOOD)]
            foot, tall = (low + top - 2 * thick) / 2.0, (top - 2 * thick - low) / 2.0
            if tall > 0.002:
                if has_sides or is_one:
                    geoms += [_box((0, s * (width - 0.006), foot), (depth, 0.006, tall), _WOOD) for s in (-1, 1)]
                else:
                    geoms += [
                        _box((a * (depth - 0.008), b * (width - 0.008), foot), (0.008, 0.008, tall), _WOOD)
                        for a in (-1, 1)
                        for b in (-1, 1)
                    ]
                if has_back or is_one:
                    geoms.append(_box((depth - 0.005, 0, foot), (0.005, width - 0.013, tall), _WOOD))
            boards.append((top, geoms))
            low, top = top, top + self._u(0.17, 0.28)
        heights = [*(height for height, _ in boards), math.inf]
        pos = (at.x, at.y, room.height)
        inner = depth - (0.01 if has_back or is_one else 0.0), width - 0.016
        if is_one:
            self._bodies.append(_body("shelf", pos, at.yaw, geoms=[one for _, geoms in boards for one in geoms]))
            # A goal that something be on it means its top, one that something be in it any of its levels that are covered.
            room.spaces["shelf"] = Space(
                body="shelf", low=(-depth, -width, heights[-2]), high=(depth, width, heights[-2] + 1.0)
            )
            for level in range(levels - 1):
                room.spaces[f"in shelf {level + 1}"] = Space(
                    body="shelf",
                    low=(-depth, -inner[1], heights[level]),
                    high=(inner[0], inner[1], heights[level + 1] - 2 * thick),
                )
            return True
        inside = "".join(_body(f"shelf_{k + 1}", (0, 0, 0), geoms=geoms) for k, (_, geoms) in enumerate(boards))
        self._bodies.append(_body("shelf", pos, at.yaw, geoms=[inside]))
        for level in range(levels):
            ceiling = min(heights[level + 1] - 2 * thick, heights[level] + 1.0)
            room.spaces[f"shelf_{level + 1}"] = Space(
                body=f"shelf_{level + 1}", low=(-depth, -width, heights[level]), high=(inner[0], width, ceiling)
            )
        return True

    def _storage(self, side: float) -> bool:
        """Place a cupboard with a door, or a cabinet of drawers."""
        deep, wide, wall = self._u(0.1, 0.14), self._u(0.13, 0.18), 0.007
        reach = (0.55, 0.7)
        at = self._place((deep, wide), reach, tuple(sorted((side * 0.3, side * 1.1))), faces=True)  # type: ignore[arg-type]
        if at is None:
            return False
        # What opens needs some way before it.
        ahead = 0.09
        self._taken.append(
            _Footprint(
                at.x - (deep + ahead) * math.cos(at.yaw),
                at.y - (deep + ahead) * math.sin(at.yaw),
                (ahead, wide * 0.8),
                at.yaw,
            )
        )
        (self._cupboard if self._is(0.55) else self._cabinet)(at, deep, wide, wall)
        return True

    def _cupboard(self, at: _Footprint, deep: float, wide: float, wall: float) -> None:
        room, tall, lift = self._room, self._u(0.11, 0.17), self._u(0.0, 0.12)
        shell = [
            _box((0, 0, lift + wall), (deep, wide, wall), _WHITE),
            _box((0, 0, lift + 2 * tall - wall), (deep, wide, wall), _WHITE),
            *(_box((0, s * (wide - wall), lift + tall), (deep, wall, tall - 2 * wall), _WHITE) for s in (-1, 1)),
            _box((deep - wall, 0, lift + tall), (wall, wide - 2 * wall, tall - 2 * wall), _WHITE),
        ]
        if lift > 0.02:
            shell.append(_box((0, 0, lift / 2.0), (deep * 0.9, wide * 0.9, lift / 2.0 - 1e-4), _WHITE))
        hinge = 1.0 if self._is(0.5) else -1.0
        is_locked = self._is(0.07)
        door = [
            _box((0, -hinge * wide, 0), (0.007, wide - 0.003, tall - 0.004), _WHITE, 'mass="0.6"'),
            _box((-0.042, -hinge * (2 * wide - 0.03), 0), (0.005, 0.005, 0.045), _DARK, 'mass="0.03"'),
            *(
                _box((-0.022, -hinge * (2 * wide - 0.03), s * 0.04), (0.016, 0.004, 0.004), _DARK, 'mass="0.01"')
                for s in (-1, 1)
            ),
        ]
        limits = (-1.75, 0.0) if hinge > 0 else (0.0, 1.75)
        far = limits[0] if hinge > 0 else limits[1]
        joint = f'<joint name="cupboard_hinge" axis="0 0 1" range="{limits[0]} {limits[1]}" damping="0.2" frictionloss="{self._u(0.02, 0.3):.3f}"/>'
        shell.append(_body("cupboard_door", (-deep - 0.009, hinge * wide, lift + tall), geoms=door, joint=joint))
        self._bodies.append(_body("cupboard", (at.x, at.y, room.height), at.yaw, geoms=shell))
        room.joints["cupboard.door"] = Joint(
            body="cupboard_door", name="cupboard_hinge", shut=0.0, far=far, locked=is_locked
        )
        if is_locked:
            self._extra.append(
                '<equality><joint joint1="cupboard_hinge" polycoef="0 0 0 0 0" solref="0.005 1"/></equality>'
            )
        elif self._is(0.3):
            self._starts["cupboard_hinge"] = far * self._u(0.6, 1.0)
        room.spaces["cupboard"] = Space(
            body="cupboard",
            low=(-deep - 0.002, -wide + 2 * wall, lift + 2 * wall),
            high=(deep - 2 * wall, wide - 2 * wall, lift + 2 * tall - 2 * wall),
        )
        room.doors["cupboard"] = "cupboard.door"

    def _cabinet(self, at: _Footprint, deep: float, wide: float, wall: float) -> None:
        room, number, each, plinth = (
            self._room,
            int(self._rng.integers(1, 4)),
            self._u(0.04, 0.055),
            self._u(0.006, 0.08),
        )
        tall = plinth + number * 2 * each + 2 * wall
        shell = [
            _box((0, 0, plinth / 2.0), (deep, wide, plinth / 2.0), _WHITE),
            _box((0, 0, tall - wall), (deep, wide, wall), _WHITE),
            *(
                _box((0, s * (wide - wall), (tall + plinth) / 2.0 - wall), (deep, wall, number * each - 1e-4), _WHITE)
                for s in (-1, 1)
            ),
            _box((deep - wall, 0, (tall + plinth) / 2.0 - wall), (wall, wide - 2 * wall, number * each - 1e-4), _WHITE),
        ]
        names = {1: ("drawer",), 2: ("bottom", "top"), 3: ("bottom", "middle", "top")}[number]
        travel, inner = 1.3 * deep, wide - 2 * wall - 0.004
        for k, name in enumerate(names):
            middle = plinth + each * (2 * k + 1)
            grip = min(0.045, 0.5 * inner)
            geoms = [
                _box((-deep + 0.004, 0, 0), (0.005, inner, each - 0.005), _WHITE, 'mass="0.2"'),
                _box((0, 0, -each + 0.008), (deep - 0.02, inner, 0.003), _WHITE, 'mass="0.2"'),
                *(
                    _box((0, s * (inner - 0.003), -0.004), (deep - 0.02, 0.003, each - 0.012), _WHITE, 'mass="0.1"')
                    for s in (-1, 1)
                ),
                _box((deep - 0.023, 0, -0.004), (0.003, inner - 0.006, each - 0.012), _WHITE, 'mass="0.1"'),
                _box((-deep - 0.034, 0, 0), (0.006, grip, 0.006), _DARK, 'mass="0.04"'),
                *(
                    _box((-deep - 0.015, s * (grip - 0.004), 0), (0.014, 0.004, 0.006), _DARK, 'mass="0.01"')
                    for s in (-1, 1)
                ),
            ]
            joint = f'<joint name="cabinet_{name}_slide" type="slide" axis="-1 0 0" range="0 {travel:.4f}" damping="{self._u(5, 50):.1f}" frictionloss="{self._u(0.2, 2.0):.2f}"/>'
            body = f"cabinet_{name}"
            shell.append(_body(body, (0, 0, middle), geoms=geoms, joint=joint))
            part = f"cabinet.{name}"
            room.joints[part] = Joint(body=body, name=f"cabinet_{name}_slide", shut=0.0, far=travel)
            room.spaces[part] = Space(
                body=body,
                low=(-deep + 0.009, -inner + 0.006, -each + 0.011),
                high=(deep - 0.026, inner - 0.006, each - 0.004),
            )
            room.doors[part] = part
        self._bodies.append(_body("cabinet", (at.x, at.y, room.height), at.yaw, geoms=shell))
        room.spaces["cabinet"] = Space(body="cabinet", low=(-deep, -wide, tall), high=(deep, wide, tall + 1.0))
        if self._is(0.3):
            self._starts[f"cabinet_{self._rng.choice(names)}_slide"] = travel * self._u(0.6, 1.0)

    def _bell(self) -> bool:
        at = self._place((0.045, 0.045), (0.35, 0.65), (-1.2, 1.2), faces=False)
        if at is None:
            return False
        room, lift = self._room, self._u(0.0, 0.15)
        # On a foot of some height, pressed from above or, on an upright, from the front.
        stiff = f'stiffness="{self._u(80, 250):.0f}" damping="3"'
        if self._is(0.7):
            geoms = [
                _can((0, 0, lift / 2.0 + 0.012), (0.04, lift / 2.0 + 0.012), _DARK),
                _body(
                    "bell_button",
                    (0, 0, lift + 0.042),
                    geoms=[_can((0, 0, 0), (0.018, 0.008), 'rgba="0.15 0.55 0.25 1"', 'mass="0.02"')],
                    joint=f'<joint name="bell_slide" type="slide" axis="0 0 -1" range="0 0.008" {stiff}/>',
                ),
            ]
            yaw = 0.0
        else:
            tall = 0.06 + lift / 2.0
            geoms = [
                _box((0.02, 0, tall), (0.012, 0.04, tall), _DARK),
                _body(
                    "bell_button",
                    (-0.014, 0, 2 * tall - 0.03),
                    geoms=[_box((0, 0, 0), (0.008, 0.018, 0.018), 'rgba="0.15 0.55 0.25 1"', 'mass="0.02"')],
                    joint=f'<joint name="bell_slide" type="slide" axis="1 0 0" range="0 0.008" {stiff}/>',
                ),
            ]
            yaw = math.atan2(at.y - self._base[1], at.x - self._base[0]) + self._u(-0.3, 0.3)
        self._bodies.append(_body("bell", (at.x, at.y, room.height), yaw, geoms=geoms))
        room.joints["bell.button"] = Joint(body="bell_button", name="bell_slide", shut=0.0, far=0.008)
        return True

    def _wall(self, number: int) -> bool:
        is_post = self._is(0.5)
        long = self._u(0.05, 0.16)
        thick = self._u(0.012, 0.03) if is_post else 0.01
        half = (thick, thick) if is_post else (thick, long)
        at = self._place(half, (0.35, 0.7), (-1.3, 1.3), faces=False)
        if at is None:
            return False
        tall = self._u(0.04, 0.25)
        name = f"post_{number + 1}" if is_post else f"wall_{number + 1}"
        geom = _can((0, 0, tall), (half[0], tall), _STONE) if is_post else _box((0, 0, tall), (*half, tall), _STONE)
        self._bodies.append(_body(name, (at.x, at.y, self._room.height), at.yaw, geoms=[geom]))
        return True

    # Things.

    def _thing(self, number: int) -> bool:
        rng, room = self._rng, self._room
        colour = list(_COLOURS)[number]
        rgba = 'rgba="{} {} {} 1"'.format(*_COLOURS[colour])
        kind = str(rng.choice(["box", "box", "can", "mug", "bowl"]))
        name = f"{colour}_{kind}"
        if kind == "box":
            half = self._u(0.014, 0.035), self._u(0.014, 0.045), self._u(0.018, 0.06)
            if self._is(0.08):
                half = self._u(0.043, 0.06), self._u(0.043, 0.06), self._u(0.043, 0.06)
            geoms = [_box((0, 0, half[2]), half, rgba, _RUBBER)]
        elif kind == "can":
            radius, tall = self._u(0.018, 0.036), self._u(0.025, 0.06)
            half, geoms = (radius, radius, tall), [_can((0, 0, tall), (radius, tall), rgba, _RUBBER)]
        else:
            outer, height = (self._u(0.03, 0.042), self._u(0.06, 0.1)) if kind == "mug" else (self._u(0.05, 0.075), self._u(0.035, 0.06))  # fmt: skip
            geoms, half = _staves(outer, height, rgba, 0.0 if kind == "mug" else 0.35), (outer, outer, height / 2.0)
            if kind == "mug":
                r, h = outer, height / 2.0
                geoms += [
                    _box((r + 0.013, 0, h + 0.02), (0.015, 0.004, 0.005), rgba, _RUBBER),
                    _box((r + 0.013, 0, h - 0.02), (0.015, 0.004, 0.005), rgba, _RUBBER),
                    _box((r + 0.025, 0, h), (0.004, 0.004, 0.0155), rgba, _RUBBER),
                ]
        foot = max(half[:2]) + (0.03 if kind == "mug" else 0.0)
        mass = self._u(0.04, 0.4)
        where = [name for name in room.spaces if name != TABLE]
        if self._is(0.45) and where:
            at = self._spot(str(rng.choice(where)), foot, half)
            pos = None if at is None else at
        else:
            free = self._place((foot, foot), (0.33, 0.72), (-1.3, 1.3), faces=False, gap=0.015)
            pos = None if free is None else (free.x, free.y, room.height)
            self._on_table.append(name)
        if pos is None:
            return False
        inertia = f'<inertial pos="0 0 {half[2]}" mass="{mass:.4f}" diaginertia="{_inertia(mass, half)}"/>'
        joint = inertia + f'<freejoint name="{name}_free"/>'
        pos = (pos[0], pos[1], pos[2] + 0.0008)
        self._bodies.append(_body(name, pos, self._u(-math.pi, math.pi), geoms=geoms, joint=joint))
        room.things[name] = half
        return True

    def _shut(self) -> set[str]:
        return {part for part, joint in self._room.joints.items() if joint.name not in self._starts}

    def _spot(self, space: str, foot: float, half: tuple[float, float, float]) -> tuple[float, float, float] | None:
        """Return a place in the world in one of the spaces where a thing of such a foot has room; drawers are left empty."""
        at = self._room.spaces[space]
        low, high = np.array(at.low), np.array(at.high)
        if space.startswith("cabinet.") or (high - low)[2] < 2 * half[2] + 0.01 or (high - low)[:2].min() < 2 * foot:
            return None
        x, y = (self._u(low[k] + foot, high[k] - foot) for k in range(2))
        owner = next(body for body in self._bodies if f'name="{at.body}"' in body)
        model = mujoco.MjModel.from_xml_string(f"<mujoco><worldbody>{owner}</worldbody></mujoco>")
        data = mujoco.MjData(model)
        mujoco.mj_kinematics(model, data)
        body = data.body(at.body)
        place = body.xpos + body.xmat.reshape(3, 3) @ np.array([x, y, low[2]])
        return float(place[0]), float(place[1]), float(place[2])

    # Goals.

    def _goals(self) -> tuple[Goal, ...]:
        room, rng = self._room, self._rng
        made: list[Goal] = [self._press()]
        things, shut = list(room.things), self._shut()
        for part in room.joints:
            if part != "bell.button":
                made.append(self._part(part, "open" if part in shut else "closed"))
        for name in things:
            is_raised = name not in self._on_table
            spaces = [one for one in room.spaces if one != TABLE]
            space = str(rng.choice(spaces))
            relation: Relation = "inside" if space in room.doors or space.startswith("in ") else "on"
            if space.startswith("in "):
                space = "shelf"
            made.append(self._put(name, relation, space))
            if is_raised:
                made.append(self._put(name, "on", TABLE))
            other = str(rng.choice([one for one in things if one != name]))
            if other in self._on_table and name in self._on_table:
                side = str(rng.choice(["left", "right", "front", "back"]))
                made.append(Goal(relation="beside", subject=name, target=other, side=side, said=f"beside({name}, {other}, {side})"))  # fmt: skip
            x, y = self._base + self._u(0.35, 0.6) * np.array([math.cos(t := self._u(-1.0, 1.0)), math.sin(t)])
            made.append(
                Goal(
                    relation="at",
                    subject=name,
                    xy=(round(float(x), 3), round(float(y), 3)),
                    said=f"at({name}, {x:.3f}, {y:.3f})",
                )
            )
        chosen: list[Goal] = []
        count = int(rng.integers(2, 4))
        kinds = list(dict.fromkeys(goal.relation for goal in made))
        for kind in rng.permutation(kinds)[:count]:
            alike = [goal for goal in made if goal.relation == kind]
            chosen.append(alike[int(rng.integers(len(alike)))])
        return tuple(chosen)

    def _press(self) -> Goal:
        said = "press the button" if self._is(0.5) else "press(part=bell.button)"
        return Goal(relation="pressed", subject="bell.button", said=said)

    def _part(self, part: str, relation: Relation) -> Goal:
        words = {"cupboard.door": "the cupboard", "cabinet.drawer": "the drawer of the cabinet"}
        called = words.get(part, f"the {part.rpartition('.')[2]} drawer of the cabinet")
        verb = "open" if relation == "open" else "close"
        return Goal(
            relation=relation, subject=part, said=f"{verb} {called}" if self._is(0.4) else f"{relation}({part})"
        )

    def _put(self, name: str, relation: Relation, space: str) -> Goal:
        called = f"the {name.replace('_', ' ')}"
        said = f"{relation}({name}, {space})"
        if self._is(0.4) and "." not in space and not space.startswith("shelf_"):
            said = f"put {called} {'in' if relation == 'inside' else 'on'} the {space}"
        return Goal(relation=relation, subject=name, target=space, said=said)

    def _write(self) -> None:
        head = (
            '<mujoco model="furnished"><compiler angle="radian"/>'
            '<option timestep="0.002" integrator="implicitfast" cone="elliptic" impratio="10"/>'
            '<worldbody><light pos="0 0 3" dir="0 0 -1"/><geom name="floor" type="plane" size="4 4 0.1"/>'
        )
        text = head + "\n" + "\n".join(self._bodies) + "\n</worldbody>" + "".join(self._extra)
        model = mujoco.MjModel.from_xml_string(text + "</mujoco>")
        qpos = model.qpos0.copy()
        for name, value in self._starts.items():
            qpos[model.jnt_qposadr[model.joint(name).id]] = value
        key = " ".join(f"{value:.6g}" for value in qpos)
        self._room.mjcf = text + f'<keyframe><key name="start" qpos="{key}"/></keyframe></mujoco>\n'


def _numbers(values: tuple[float, ...]) -> str:
    return " ".join(f"{value:.5g}" for value in values)


def _box(pos: tuple[float, ...], size: tuple[float, ...], *more: str) -> str:
    return f'<geom type="box" pos="{_numbers(pos)}" size="{_numbers(size)}" {" ".join(more)}/>'


def _can(pos: tuple[float, ...], size: tuple[float, ...], *more: str) -> str:
    return f'<geom type="cylinder" pos="{_numbers(pos)}" size="{_numbers(size)}" {" ".join(more)}/>'


def _body(name: str, pos: tuple[float, ...], yaw: float = 0.0, *, geoms: list[str], joint: str = "") -> str:
    quat = f"{math.cos(yaw / 2.0):.6f} 0 0 {math.sin(yaw / 2.0):.6f}"
    return f'<body name="{name}" pos="{_numbers(pos)}" quat="{quat}">{joint}{"".join(geoms)}</body>'


def _staves(outer: float, height: float, rgba: str, lean: float) -> list[str]:
    """Return a floor and sixteen walls around it, leaning outwards by so many radians; `outer` is the radius at the rim."""
    number, thick = 16, 0.003
    base = outer - height * math.tan(lean) if lean else outer
    geoms = [_can((0, 0, 0.003), (base - 0.002, 0.003), rgba, _RUBBER)]
    middle, long = (base + outer) / 2.0 - thick, height / 2.0 / math.cos(lean)
    for k in range(number):
        turn = 2.0 * math.pi * k / number
        q = _times((math.cos(turn / 2), 0, 0, math.sin(turn / 2)), (math.cos(lean / 2), 0, math.sin(lean / 2), 0))
        pos = (middle * math.cos(turn), middle * math.sin(turn), height / 2.0 + 0.002)
        size = (thick, (outer if lean else middle) * math.tan(math.pi / number) + 0.001, long - 0.002)
        geoms.append(_box(pos, size, rgba, _RUBBER, f'quat="{_numbers(q)}"'))
    return geoms


def _times(a: tuple[float, ...], b: tuple[float, ...]) -> tuple[float, ...]:
    found = np.zeros(4)
    mujoco.mju_mulQuat(found, np.array(a, dtype=float), np.array(b, dtype=float))
    return tuple(float(value) for value in found)


def _inertia(mass: float, half: tuple[float, float, float]) -> str:
    x, y, z = half
    return _numbers(tuple(mass / 3.0 * value for value in (y * y + z * z, x * x + z * z, x * x + y * y)))
