"""Perception from colour and depth: what the cameras show, fused, fitted, named and remembered."""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from robosandbox.driver import CameraSpec, Driver, require
from robosandbox.errors import InputError
from robosandbox.motion.planning_scene import PlanningScene, PlanningScenes
from robosandbox.perception.attention import Attention
from robosandbox.perception.calibration import Calibration
from robosandbox.perception.camera_watch import CameraWatch
from robosandbox.perception.factory import Setup
from robosandbox.perception.fit import Fit
from robosandbox.perception.frame import Image, Mask, PointCloudFrame, TablePrior, check_frame, make_frame
from robosandbox.perception.frames import FrameSet, segment_frame
from robosandbox.perception.groups import group
from robosandbox.perception.holding import HoldTracker
from robosandbox.perception.known_meshes import KnownMeshes
from robosandbox.perception.known_scene import KnownScenePerception
from robosandbox.perception.occlusion import lies_in
from robosandbox.perception.recognize import recognize
from robosandbox.perception.robot_mask import RobotMask
from robosandbox.perception.segments import Segment
from robosandbox.perception.sensed import SensedDriver
from robosandbox.perception.silhouette import CUT_OFF
from robosandbox.perception.tag_removal import tags_removed
from robosandbox.perception.tags import Tag, find_tags, labelled, merged
from robosandbox.perception.thing import Thing
from robosandbox.perception.tolerances import TOLERANCES
from robosandbox.perception.track import Track
from robosandbox.perception.tracker import Tracker
from robosandbox.perception.unseen import Unseen
from robosandbox.perception.visualize import draw
from robosandbox.types import Array, ObservedScene, RgbdFrame

_log = logging.getLogger(__name__)


class RgbdPerception:
    """Finds objects in RGB-D pictures.

    It knows the robot's model and joints, the cameras' calibration, where the table is and what colour it has, and how the
    task describes its objects; of the simulated state it reads nothing.

    Args:
        setup: What is known before the first look.
        cameras: Which to look through; all that the driver declares when left out.
        calibration: A file that `robo-sandbox calibrate` wrote.

    Attributes:
        frames: The last look's views.
        things: What the last look showed, before it was put together with what is remembered.
        tags: What tags the last look showed; they are looked for where the setup describes an object with one.
        notes: Why the last look may have missed something.
    """

    def __init__(
        self,
        *,
        setup: Setup = Setup(),  # noqa: B008  frozen
        cameras: tuple[str, ...] | None = None,
        calibration: Path | None = None,
    ) -> None:
        if setup.scene.world is not None:
            raise InputError(
                f"perception: without depth, or with names from a model, things are looked for on a bare table, and the fixtures "
                f"of {setup.scene.world.name} are not known; use --perception rgbd, or ground_truth"
            )
        self._setup = setup
        self._cameras = cameras
        self._calibration = Calibration.load(calibration) if calibration else None
        self._silhouette: RobotMask | None = None
        self._tracker = Tracker(setup.declared)
        self._containers = frozenset({"cup", *(item.kind for item in setup.declared)})
        self._tag_sizes = [item.tag_size for item in setup.declared if item.tag is not None]
        self._meshes = KnownMeshes(setup)
        self._hands: dict[str, HoldTracker] = {}
        self._attention = Attention(TablePrior(setup.scene.table_height))
        self._watch = CameraWatch()
        self._unseen: Unseen | None = None
        self._views: list[RgbdFrame] = []
        self._stale = True
        self._complete = True
        self._episode = -1
        self._last: ObservedScene | None = None
        self._scenes: PlanningScenes | None = None
        self.frames: FrameSet = FrameSet({}, TablePrior(setup.scene.table_height))
        self.things: list[Thing] = []
        self.tags: list[Tag] = []
        self.notes: tuple[str, ...] = ()

    @property
    def tracks(self) -> list[Track]:
        """All that is remembered."""
        return list(self._tracker.tracks.values())

    def view(self, driver: Driver) -> Driver:
        """Return the driver without its truth."""
        return SensedDriver(driver)

    def planning(self, driver: Driver, seen: ObservedScene) -> PlanningScene:
        """Return the robot among what was seen."""
        del driver
        return self._planning_scenes().of(seen)

    def perceive(self, driver: Driver) -> ObservedScene:
        """Return what the cameras show now, put together with what they showed before.

        Raises:
            UnsupportedError: The driver declares no camera.
            SensorError: A frame's arrays do not fit one another or its intrinsics. A camera that shows nothing usable is told in the notes,
                and what was seen before is remembered.
            RenderingError: Nothing renders here.
        """
        if not self._begins(driver) and self._complete and self._last is not None and driver.time == self._last.time:
            # A second look at the same moment would show the same.
            return self._last
        self._feel(driver)
        if not self._stands(driver, None):
            self._look_all_over(driver)
        self._complete = True
        self._last = self._believed(driver)
        return self._last

    def glance(self, driver: Driver, names: Sequence[str]) -> ObservedScene:
        """Return what is believed now, having looked at these things alone; all over where one of them is not as it was.

        Args:
            driver: As for `perceive`.
            names: Ids. What the hand holds is felt, not looked at; without any, nothing is looked at.
        """
        if self._begins(driver) or any(name not in self._tracker.tracks for name in names):
            return self.perceive(driver)
        if self._complete and self._last is not None and driver.time == self._last.time:
            return self._last
        self._feel(driver)
        self._complete = False
        seen = [name for name in names if name not in self._held]
        if seen and not self._stands(driver, seen):
            self._look_all_over(driver)
            self._complete = True
        self._last = self._believed(driver)
        return self._last

    def doubt(self) -> None:
        """Look at everything anew next time: something went otherwise than it was believed to."""
        self._stale, self._complete = True, False

    def uncovered(self, driver: Driver, arms: Mapping[str, Array]) -> float:
        """Return the share of what robots have hidden so far that fixed cameras would show with arms in configurations (n,), by name."""
        if self._unseen is None or not self._unseen.share:
            return 0.0
        fixed = [rgbd for rgbd in self._views if driver.capabilities.cameras[rgbd.camera].arm is None]
        now = self._views[0].arms
        stand = {name: replace(posture, q=arms.get(name, posture.q)) for name, posture in now.items()}
        return self._unseen.uncovered(fixed, self._robot(), stand)

    @property
    def half_hidden(self) -> list[Array]:
        """Surface points, (n, 3) each, of what is too unclear to be acted on and is cut off by a robot."""
        robots = {camera: segmented.robot for camera, segmented in self.frames.by_camera.items()}
        return [
            thing.group.points
            for thing in self.things
            if thing.confidence < TOLERANCES.acted_on
            and any(_is_cut(segment, robots[segment.frame.camera]) for segment in thing.group.segments)
        ]

    def _stands(self, driver: Driver, names: Sequence[str] | None) -> bool:
        """Tell whether what is believed need not be looked at all over; arguments as those of `_is_unchanged`."""
        return not self._stale and self._is_unchanged(driver, names)

    def _begins(self, driver: Driver) -> bool:
        """Tell whether this is the first look of an episode; nothing that is remembered is true of another."""
        if driver.episode == self._episode:
            return False
        self._tracker, self._hands = Tracker(self._setup.declared), {}
        for name, hand in driver.hands.items():
            self._hands[name] = HoldTracker(hand.spec.geometry, float(hand.spec.force_limits.sum()))
        self._attention = Attention(TablePrior(self._setup.scene.table_height))
        self._watch = CameraWatch()
        self._unseen = Unseen(TablePrior(self._setup.scene.table_height), next(iter(driver.arms.values())).spec)
        self._episode, self._stale = driver.episode, True
        return True

    def _is_unchanged(self, driver: Driver, names: Sequence[str] | None) -> bool:
        """Take few pictures; tell whether they show these things, or all of the table, as they were when all was looked at."""
        tracks, held = self._tracker.tracks, self._held
        about = [name for name in (tracks if names is None else names) if name not in held]
        if any(tracks[name].confidence < TOLERANCES.clear for name in about):
            # What one look does not tell for sure several tell better.
            return False
        if names is None and len(tracks) - len(self._open_to_view()) > 1:
            # Things in a container hide each other; each look from another posture tells more of them.
            return False
        places = {name: tracks[name].thing.fit.corners() for name in about}
        return self._attention.is_unchanged(driver, places, self._robot(), self._carried, everywhere=names is None)

    def _look_all_over(self, driver: Driver) -> None:
        """Look with all cameras, and put together what they show with what is remembered."""
        require(driver, "cameras", "perception from colour and depth looks through them")
        specs = driver.capabilities.cameras
        cameras = self._cameras or self._usual_cameras(specs)
        before = {track.id: track.thing.fit for track in self.tracks}
        self.look([driver.senses.capture(camera) for camera in cameras])
        if self._unseen is not None:
            self._unseen.half_hidden = self.half_hidden
        self._update(driver)
        after = {track.id: track.thing.fit for track in self.tracks}
        left = [
            fit.corners()
            for name, fit in before.items()
            if name not in after or float(np.abs(after[name].centre - fit.centre).max()) > TOLERANCES.position
        ]
        fixed = [camera for camera in cameras if camera in specs and specs[camera].arm is None]
        self._attention.remember(self.frames, fixed, [fit.corners() for fit in self._open_to_view()], left)
        self._stale = False

    def _usual_cameras(self, specs: Mapping[str, CameraSpec]) -> tuple[str, ...]:
        """Return which cameras are looked through where nobody says."""
        return tuple(specs)

    def _open_to_view(self) -> list[Fit]:
        """Return what lies in no container: what lies in one may be seen from above alone, and better when the arm is gone."""
        vessels = [track.thing.fit for track in self.tracks if track.thing.shape.holds_things]
        fits = [track.thing.fit for track in self.tracks]
        return [fit for fit in fits if not any(fit is not hull and lies_in(fit.centre, hull) for hull in vessels)]

    def look(self, captures: list[RgbdFrame]) -> list[Thing]:
        """Return what these frames show, by themselves.

        Args:
            captures: One of each camera.
        """
        self.frames = self._frames(captures)
        segments = [segment for segmented in self.frames.by_camera.values() for segment in segmented.segments]
        held = self._held
        told, segments = self._meshes.find(segments, self.frames, self._tracker.tracks, held)
        things = recognize(
            group(segments), self.frames, self._tracker.hulls(held), self._tracker.solids(held), self._containers
        )
        self.things = labelled([*told, *things], self.tags)
        return self.things

    def picture(self) -> NDArray[np.uint8]:
        """Return what the last look made of its pictures, side by side, (height, width, 3) RGB."""
        return draw(self.frames, self.things, self.tracks, self.tags)

    def assign_ids(self) -> None:
        """Give what is remembered other names, with `rename`; here things keep those that they have."""

    def rename(self, old: str, new: str) -> None:
        """Call a remembered thing something else from now on."""
        self._tracker.rename(old, new)
        for hand in self._hands.values():
            if hand.hold is not None and hand.hold.id == old:
                hand.hold.id = new

    def _frames(self, captures: list[RgbdFrame]) -> FrameSet:
        table = TablePrior(self._setup.scene.table_height)
        silhouette = self._robot()
        notes = []
        sound: dict[str, PointCloudFrame] = {}
        masks: dict[str, tuple[Mask, Image]] = {}
        carried = self._carried
        if self._calibration is not None:
            captures = [self._calibration.apply(rgbd) for rgbd in captures]
        for rgbd in captures:
            problem = check_frame(rgbd)
            if problem is not None:
                notes.append(problem)
                continue
            silhouette.place(rgbd.arms)
            robot, near = silhouette.masks(rgbd, carried)
            frame = make_frame(rgbd, table, robot)
            if self._watch.has_moved(frame, robot, table):
                notes.append(
                    f"{rgbd.camera} has been moved since it was looked through first: what stands still is elsewhere in its picture; "
                    "put it back, or calibrate it and begin anew"
                )
                continue
            sound[rgbd.camera], masks[rgbd.camera] = frame, (robot, near)
        self.tags = []
        if self._tag_sizes:
            found = [
                tag
                for camera, frame in sound.items()
                for tag in find_tags(frame, table, masks[camera][0], self._tag_sizes)
            ]
            self.tags = merged(found)
            sound = tags_removed(sound, self.tags, found, table)
        by_camera = {camera: segment_frame(frame, table, *masks[camera]) for camera, frame in sound.items()}
        self.notes = tuple(notes)
        self._take([(frame.rgbd, masks[camera][1]) for camera, frame in sound.items()])
        return FrameSet(by_camera, table)

    def _take(self, views: Sequence[tuple[RgbdFrame, Image]]) -> None:
        """Take note of what robots hide in these frames, each with the depths from which on they do."""
        self._views = [rgbd for rgbd, _ in views]
        if self._unseen is not None:
            self._unseen.look(views)

    def _feel(self, driver: Driver) -> None:
        """Find out from the grippers' readings what they hold, and move that along with them."""
        places = {track.id: track.thing.fit.corners() for track in self.tracks}
        openings = {track.id: track.thing.opening or 0.0 for track in self.tracks}
        for name, hand in self._hands.items():
            seen, before = driver.arms[driver.hands[name].arm].state(), hand.hold
            elsewhere = {one for other, one in self._in_hands.items() if other != name}
            hand.update(seen, (track for track in self.tracks if track.id not in elsewhere))
            hand.move_drawers(seen, self.tracks)
            if before is not None and hand.hold is not before:
                # Where it went is not felt.
                self._stale = True
            if hand.hold is not None and hand.hold is not before:
                self._attention.vacate(places[hand.hold.id])
        if any(abs((track.thing.opening or 0.0) - openings[track.id]) > TOLERANCES.size for track in self.tracks):
            # Whether the drawer went along is not felt.
            self._stale = True

    def _update(self, driver: Driver) -> None:
        """Put together what the last look shows with what is remembered."""
        seen = {name: arm.state() for name, arm in driver.arms.items()}
        held = self._held
        holds = [hand.hold for hand in self._hands.values() if hand.hold is not None]
        in_hand = [(hold, self._tracker.tracks[hold.id]) for hold in holds]
        tcps = [state.tcp_pose.position for state in seen.values()]
        self._tracker.update(self._loose(held), self.frames, held, tcps)
        for hold, track in in_hand:
            # A tag elsewhere may tell that it is not what it was taken for.
            hold.id = track.id
        for name, hand in self._hands.items():
            # The hand that holds a drawer tells its opening better than a look, which the hand itself obstructs.
            hand.move_drawers(seen[driver.hands[name].arm], self.tracks)
        self.assign_ids()

    def _believed(self, driver: Driver) -> ObservedScene:
        """Return what is remembered as skills and planners are told of it."""
        robot = next(iter(driver.arms.values())).spec
        base = robot.base_position
        clear = [track for track in self.tracks if track.confidence >= TOLERANCES.acted_on or track.id in self._held]
        unclear = [_unclear(track) for track in self.tracks if track not in clear]
        return ObservedScene(
            time=driver.time,
            objects=tuple(track.detected() for track in clear),
            table_height=self._setup.scene.table_height,
            base_xy=(float(base[0]), float(base[1])),
            hands=self._in_hands,
            reach=robot.reach,
            grips=robot.gripper is not None,
            notes=(*self.notes, *unclear),
            unseen=self._unseen.share if self._unseen else 0.0,
        )

    @property
    def _in_hands(self) -> dict[str, str | None]:
        """Ids of the objects in the hands, by the hand's name."""
        return {name: hand.hold.id if hand.hold else None for name, hand in self._hands.items()}

    @property
    def _held(self) -> frozenset[str]:
        """All that is held."""
        return frozenset(name for name in self._in_hands.values() if name is not None)

    @property
    def _carried(self) -> list[Array]:
        """Points around each thing that is held."""
        holds = [hand.hold.id for hand in self._hands.values() if hand.hold is not None]
        return [self._tracker.tracks[name].thing.fit.corners(TOLERANCES.depth) for name in holds]

    def _loose(self, held: frozenset[str]) -> list[Thing]:
        """Return what is seen and not held."""
        loose = self.things
        for known in (self._tracker.tracks[name].thing for name in held):
            middle, size = known.fit.centre, float(max(known.fit.sizes)) + 0.02
            loose = [thing for thing in loose if float(abs(thing.fit.centre - middle).max()) > size]
        return loose

    def _planning_scenes(self) -> PlanningScenes:
        if self._scenes is None:
            self._scenes = PlanningScenes(self._setup.scene, self._setup.known)
        return self._scenes

    def _robot(self) -> RobotMask:
        if self._silhouette is None:
            self._silhouette = RobotMask(self._planning_scenes().robot_shapes())
        return self._silhouette


def make_rgbd(
    *,
    setup: Setup = Setup(),  # noqa: B008  frozen
    cameras: tuple[str, ...] | None = None,
    calibration: Path | None = None,
) -> RgbdPerception | KnownScenePerception:
    """Return perception from colour and depth: of what stands on a table, or of a scene whose file is known.

    Args:
        setup: What is known before the first look.
        cameras: Which to look through; all that the driver declares when left out.
        calibration: A file that `robo-sandbox calibrate` wrote.
    """
    kind = RgbdPerception if setup.scene.world is None else KnownScenePerception
    return kind(setup=setup, cameras=cameras, calibration=calibration)


def _is_cut(segment: Segment, robot: Mask) -> bool:
    """Tell whether a piece ends where a robot begins."""
    beside = cv2.dilate(robot.view(np.uint8), np.ones((2 * CUT_OFF + 1,) * 2, np.uint8)).view(np.bool_)
    return bool((segment.mask & beside[segment.crop]).any())


def _unclear(track: Track) -> str:
    x, y, _ = track.thing.fit.centre
    item = track.detected()
    return (
        f"something {item.colour} at ({x:.2f}, {y:.2f}) is not clear ({100.0 * track.confidence:.0f} %: {item.kind}?); "
        "look again when less is in the way"
    )
