"""Perception of a scene whose file is known, from colour and depth: how far its parts are open, and where its things are.

The file says what everything is and looks like; where it has things and how far parts are open is no more than a first guess. Each look
lays the file on the pictures: parts by the value of their joint at which the cameras would see what they see, things by their surfaces on what
stands before that. What the file does not explain is told.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from math import degrees
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from robosandbox.driver import Driver, require
from robosandbox.errors import InputError, SensorError
from robosandbox.motion.planning_scene import PlanningScene, PlanningScenes
from robosandbox.motion.scene_depths import SceneDepths
from robosandbox.perception.calibration import Calibration
from robosandbox.perception.colour import colour_name
from robosandbox.perception.factory import Setup
from robosandbox.perception.frame import TablePrior, check_frame, make_frame
from robosandbox.perception.frames import FrameSet, SegmentedFrame, segmented_by
from robosandbox.perception.holding import HoldTracker
from robosandbox.perception.known_parts import KnownParts
from robosandbox.perception.known_things import KnownThings, pieces
from robosandbox.perception.quantiles import MAD, median
from robosandbox.perception.robot_mask import RobotMask
from robosandbox.perception.sensed import SensedDriver
from robosandbox.perception.tolerances import TOLERANCES
from robosandbox.perception.visualize import draw
from robosandbox.robots.loader import robots_of
from robosandbox.sim.objects import place
from robosandbox.sim.populated import populated
from robosandbox.sim.scene_file import read_scene_file
from robosandbox.sim.states import object_truth
from robosandbox.sim.world import build_world
from robosandbox.types import (
    ArmState,
    Array,
    DetectedObject,
    ObservedScene,
    RgbdFrame,
)
from robosandbox.values import frozen

# Pixels from one to the next that are compared with what the file would show, first everywhere, then where something may stand: 8 and
# 4 mm on a table at 1 m.
_COARSE, _STRIDE = 4, 2
# Depth, metres, by which something stands before what the file shows at the least, and the same in standard deviations of depth.
_BEFORE, _DEVIATIONS = 0.004, 3.5
# Metres from which something is elsewhere than in the file, so that it is told.
_MOVED = 0.02
# Metres beside the robot's reach within which something may be of the scene.
_AROUND = 0.3


@frozen(eq=False)
class _ShownPart:
    """A part as it is drawn."""

    item: DetectedObject
    hidden: bool = False

    def detected(self) -> DetectedObject:
        """Return it in the planner's words."""
        return self.item


class KnownScenePerception:
    """Measures the state of a scene whose file is known.

    Of the simulated state it reads nothing: it has the file, the robot's model and joints, and the cameras' pictures and calibration.

    Args:
        setup: What is known before the first look; its scene names the file.
        cameras: Which to look through; all that the driver declares when left out.
        calibration: A file that `robo-sandbox calibrate` wrote.

    Attributes:
        frames: The last look's views.
        notes: What the last look did not show, and what differs from the file.
    """

    def __init__(
        self, *, setup: Setup, cameras: tuple[str, ...] | None = None, calibration: Path | None = None
    ) -> None:
        if setup.scene.world is None:
            raise InputError("scene.world: names no file, and a known scene is one of a file")
        scene = populated(setup.scene)
        told = {item.id for item in scene.objects}
        others = [item.id for item in setup.declared if item.id not in told]
        if others:
            raise InputError(
                f"scene.objects: {', '.join(others)}: with {setup.scene.world.name} rgbd knows what is in the file; add "
                "it there, or use --perception ground_truth"
            )
        self._scene = scene
        self._cameras = cameras
        self._calibration = Calibration.load(calibration) if calibration else None
        self._scenes = PlanningScenes.exact(setup.scene)
        self._world = build_world(scene, robots_of(scene))
        self._depths = SceneDepths(self._world)
        for item in scene.objects:
            place(scene, item, self._depths.data)
        self._depths.place()
        self._robot = RobotMask(self._scenes.robot_shapes())
        self._table = TablePrior(scene.table_height, scene.table_area)
        self._things = KnownThings(self._world, self._depths)
        self._parts = KnownParts(self._world, self._depths, self._things)
        self._file = read_scene_file(setup.scene.world).path.name
        self._start = self._depths.data.qpos.copy()
        self._hands: dict[str, HoldTracker] = {}
        self._episode = -1
        self._last: ObservedScene | None = None
        self._fresh = False
        self.frames = FrameSet({}, self._table)
        self.notes: tuple[str, ...] = ()

    def view(self, driver: Driver) -> Driver:
        """Return the driver without its truth."""
        return SensedDriver(driver)

    def planning(self, driver: Driver, seen: ObservedScene) -> PlanningScene:
        """Return the robot among what was seen; what is not seen anywhere is not there."""
        del driver
        names = {item.id for item in seen.objects}
        world = self._world if names >= self._things.by_id.keys() else self._scenes.world_of(seen)
        return PlanningScene(world, seen, believed=self._scenes.world_of)

    def perceive(self, driver: Driver) -> ObservedScene:
        """Return what the cameras show now, put together with what they showed before.

        Raises:
            UnsupportedError: The driver declares no camera.
            SensorError: No camera delivers a usable frame.
            RenderingError: Nothing renders here.
        """
        self._begin(driver)
        if self._fresh and self._last is not None and driver.time == self._last.time:
            return self._last
        self._feel(driver)
        require(driver, "cameras", "perception from colour and depth looks through them")
        cameras = self._cameras or tuple(driver.capabilities.cameras)
        self._look([driver.senses.capture(camera) for camera in cameras], driver)
        self._fresh = True
        self._last = self._believed(driver)
        return self._last

    def glance(self, driver: Driver, names: Sequence[str]) -> ObservedScene:
        """Return what is believed now, having looked at these things alone; without any, what is remembered and felt.

        Args:
            driver: As for `perceive`.
            names: Ids. What the hand holds is felt, not looked at.
        """
        held = {hand.hold.id for hand in self._hands.values() if hand.hold is not None}
        if driver.episode != self._episode or any(name not in held for name in names):
            return self.perceive(driver)
        if self._last is not None and driver.time == self._last.time:
            return self._last
        self._feel(driver)
        self._fresh = False
        self._last = self._believed(driver)
        return self._last

    def doubt(self) -> None:
        """Look at everything anew next time: something went otherwise than it was believed to."""
        self._fresh = False

    def picture(self) -> NDArray[np.uint8]:
        """Return what the last look made of its pictures, side by side, (height, width, 3) RGB; what is fixed is not outlined."""
        parts = [_ShownPart(item) for item in self._detected() if item.id in self._parts.by_id]
        return draw(self.frames, (), [*(one for one in self._things.by_id.values() if one.pose is not None), *parts])

    def _begin(self, driver: Driver) -> None:
        """Forget all but the file where an episode begins."""
        if driver.episode == self._episode:
            return
        self._episode, self._last, self._fresh = driver.episode, None, False
        self._depths.data.qpos[:] = self._start
        self._depths.place()
        self._parts.forget()
        self._hands = {
            name: HoldTracker(hand.spec.geometry, float(hand.spec.force_limits.sum()))
            for name, hand in driver.hands.items()
        }
        self._things.forget()

    # What is felt.

    def _feel(self, driver: Driver) -> None:
        """Find out from the grippers' readings what they hold or lead, and move that along with them."""
        known = [thing for thing in self._things.by_id.values() if thing.pose is not None]
        states = _states(driver)
        for name, hand in self._hands.items():
            before = hand.hold
            elsewhere = {other.hold.id for other in self._hands.values() if other is not hand and other.hold}
            hand.update(states[name], [thing for thing in known if thing.id not in elsewhere])
            if before is not None and hand.hold is not before:
                self._things.drop(self._things.by_id[before.id])
        self._things.stand()
        self._parts.feel(self._hands, states, {name: arm.state() for name, arm in driver.arms.items()})

    # What is seen.

    def _look(self, captures: list[RgbdFrame], driver: Driver) -> None:
        self.frames, notes = self._frames(captures)
        views = list(self.frames.by_camera.values())
        if not views:
            raise SensorError(f"no camera shows anything: {'; '.join(notes)}")
        self._parts.measure(views, _states(driver))
        points, colours = self._before_file(views, driver)
        held = {hand.hold.id for hand in self._hands.values() if hand.hold is not None}
        left = self._things.look(views, points, colours, held)
        self.notes = (*notes, *self._differences(), *self._strangers(left))

    def _frames(self, captures: list[RgbdFrame]) -> tuple[FrameSet, list[str]]:
        if self._calibration is not None:
            captures = [self._calibration.apply(rgbd) for rgbd in captures]
        carried = [
            thing.mesh.corners @ thing.pose.rotation.T + thing.pose.position
            for thing in self._things.by_id.values()
            if thing.pose is not None and any(hand.hold and hand.hold.id == thing.id for hand in self._hands.values())
        ]
        found, notes = {}, []
        for rgbd in captures:
            problem = check_frame(rgbd)
            if problem is not None:
                notes.append(problem)
                continue
            self._robot.place(rgbd.arms)
            robot, near = self._robot.masks(rgbd, carried)
            frame = make_frame(rgbd, self._table, robot)
            # What stands there is not cut into segments: it is laid on the file.
            found[rgbd.camera] = segmented_by(frame, self._table, robot, near, ())
        return FrameSet(found, self._table), notes

    def _before_file(self, views: Sequence[SegmentedFrame], driver: Driver) -> tuple[Array, Array]:
        """Return points (n, 3) that stand before what the file fixes and its parts, and their colours, 0..1, (n, 3)."""
        arms = [arm.spec for arm in driver.arms.values()]
        points, colours = [], []
        for view in views:
            frame = view.frame
            rows, columns, off = self._off(view, *_grid(frame.depth.shape, _COARSE))
            some = off[np.abs(off) < 0.02]
            noise = float(MAD * median(np.abs(some - median(some)))) if len(some) else TOLERANCES.depth
            least = max(_BEFORE, _DEVIATIONS * noise)
            # Where something may stand it is looked closer.
            maybe = np.zeros((-(-frame.depth.shape[0] // _COARSE), -(-frame.depth.shape[1] // _COARSE)), dtype=np.uint8)
            maybe[rows // _COARSE, columns // _COARSE] = off < -least / 2.0
            maybe = cv2.dilate(maybe, np.ones((5, 5), np.uint8))
            rows, columns = _grid(frame.depth.shape, _STRIDE)
            closer = maybe[rows // _COARSE, columns // _COARSE] > 0
            rows, columns = rows[closer], columns[closer]
            cast = self._depths.cast(frame.position, frame.rays(rows, columns))
            nearest = np.full((-(-frame.depth.shape[0] // _STRIDE), -(-frame.depth.shape[1] // _STRIDE)), np.inf)
            nearest[rows // _STRIDE, columns // _STRIDE] = cast
            nearest = _eroded(nearest)[rows // _STRIDE, columns // _STRIDE]
            clear = frame.valid[rows, columns] & ~view.robot[rows, columns]
            before = clear & (frame.depth[rows, columns] < nearest - least)
            xyz = frame.xyz[:, rows[before], columns[before]].T.astype(float)
            near = np.zeros(len(xyz), dtype=bool)
            for spec in arms:
                near |= np.linalg.norm(xyz - np.array(spec.base_position), axis=1) < spec.reach[1] + _AROUND
            points.append(xyz[near])
            colours.append(frame.rgb[rows[before], columns[before]][near] / 255.0)
        return np.concatenate([np.zeros((0, 3)), *points]), np.concatenate([np.zeros((0, 3)), *colours])

    def _off(
        self, view: SegmentedFrame, rows: NDArray[np.intp], columns: NDArray[np.intp]
    ) -> tuple[NDArray[np.intp], NDArray[np.intp], Array]:
        """Return those of some pixels that have a depth and no robot before it, and how far it is off the file's, metres."""
        clear = view.frame.valid[rows, columns] & ~view.robot[rows, columns]
        rows, columns = rows[clear], columns[clear]
        cast = self._depths.cast(view.frame.position, view.frame.rays(rows, columns))
        return rows, columns, np.asarray(view.frame.depth[rows, columns] - cast, dtype=float)

    # What is told.

    def _believed(self, driver: Driver) -> ObservedScene:
        """Return what is believed as skills and planners are told of it."""
        robot = next(iter(driver.arms.values())).spec
        return ObservedScene(
            time=driver.time,
            objects=tuple(self._detected()),
            table_height=self._scene.table_height,
            table_area=self._scene.table_area,
            base_xy=(float(robot.base_position[0]), float(robot.base_position[1])),
            hands={name: hand.hold.id if hand.hold else None for name, hand in self._hands.items()},
            reach=robot.reach,
            grips=robot.gripper is not None,
            notes=self.notes,
        )

    def _detected(self) -> Iterator[DetectedObject]:
        for item in self._scene.objects:
            thing = self._things.by_id.get(item.id)
            if thing is not None:
                if thing.pose is not None:
                    yield thing.detected()
                continue
            told = object_truth(
                self._world,
                self._depths.data,
                item,
                size=item.size,
                contacts=(),
                felt=0.0,
                solids=(),
                touches=None,
                weighed=False,
            )
            yield _named(told.detected())

    def _differences(self) -> Iterator[str]:
        """Yield what differs from the file, in sentences."""
        for thing in self._things.by_id.values():
            if thing.pose is None:
                yield f"{thing.id} is not where {self._file} has it, and is not seen anywhere"
                continue
            off = float(np.linalg.norm(thing.pose.position - thing.item.pose.position))
            if thing.hidden:
                if off < _MOVED:
                    yield f"{thing.id} is hidden, and taken to be where {self._file} has it"
            elif off > _MOVED:
                yield f"{thing.id} is {100.0 * off:.0f} cm from where {self._file} has it"
        for name, part in self._parts.by_id.items():
            was = float(self._start[part.address])
            if abs(part.value - was) * part.lever() > _MOVED:
                turns = part.turns
                off = degrees(part.value - was) if turns else 1e3 * (part.value - was)
                yield f"{name} is {abs(off):.0f} {'deg' if turns else 'mm'} from where {self._file} has it"

    def _strangers(self, points: Array) -> Iterator[str]:
        """Yield what stands there that the file does not have, in sentences."""
        for piece in pieces(points):
            low, high = np.percentile(piece, [2.0, 98.0], axis=0)
            x, y, z = (low + high) / 2.0
            wide = " x ".join(f"{100.0 * one:.0f}" for one in high - low)
            yield f"something of {wide} cm at ({x:.2f}, {y:.2f}, {z:.2f}) is not in {self._file}"


def _states(driver: Driver) -> dict[str, ArmState]:
    """Return the state of the arm that carries each hand, by the hand's name."""
    return {name: driver.arms[hand.arm].state() for name, hand in driver.hands.items()}


def _named(item: DetectedObject) -> DetectedObject:
    return replace(item, colour=colour_name(item.rgba))


def _grid(size: tuple[int, ...], stride: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return rows and columns of every so many pixels of a picture, (n,) each."""
    rows, columns = np.mgrid[: size[0] : stride, : size[1] : stride]
    return rows.ravel(), columns.ravel()


def _eroded(depth: Array) -> Array:
    """Return the least of each pixel's depth and its neighbours', (height, width)."""
    return np.asarray(cv2.erode(np.minimum(depth, 1e3).astype(np.float32), np.ones((3, 3), np.uint8)), dtype=float)
