"""Cameras and the sensor at the wrist of an arm in a ROS 2 graph."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from typing import Literal

from robosandbox.driver import ARM, BareSenses, CameraSpec, require
from robosandbox.driver.capabilities import Declares
from robosandbox.drivers.ros2.link import RosLink, Shot
from robosandbox.errors import InputError, SensorError
from robosandbox.types import Array, PictureWindow, Pose, Posture, RgbdFrame

# Seconds between two looks for a picture.
_LOOK_SECONDS = 0.005


class RosSenses(BareSenses):
    """Readings of the topics of cameras and of a wrench.

    Args:
        driver: Whose.
        link: To the graph.
        topics: Names of cameras before `/image_raw`; each camera is called by its name without the first "/".
        posture: Returns how the arms stand.
        answer: Seconds in which a picture has to come.
        oldest: How old a wrench may be, seconds.
        began: When the driver's clock began, seconds of `time.monotonic`.
    """

    def __init__(
        self,
        driver: Declares,
        link: RosLink,
        topics: Sequence[str],
        posture: Callable[[], Mapping[str, Posture]],
        answer: float,
        oldest: float,
        began: float,
    ) -> None:
        super().__init__(driver)
        self._link, self._posture, self._answer, self._oldest = link, posture, answer, oldest
        self._topics = {topic.lstrip("/"): topic for topic in topics}
        self._began = began

    def built_in(self, tcp_pose: Pose) -> dict[str, CameraSpec]:
        """Return the cameras as their topics and transforms tell of them.

        Args:
            tcp_pose: The TCP in the world: a camera whose transforms move rides on the hand.

        Raises:
            InputError: It is not known any more where one is.
        """
        found = {}
        for name, topic in self._topics.items():
            lens, shot = self._link.lens(topic), self._link.shot(topic, "rgb")
            assert lens is not None and shot is not None, "waited for"
            place = self._link.frame(shot.frame)
            if place is None:
                raise InputError(f"--driver ros2: camera {name}: {self._link.astray(shot.frame)}")
            pose, moves = place
            mount = tcp_pose.inverse() @ pose if moves else pose
            found[name] = CameraSpec(intrinsics=lens, pose=mount, arm=ARM if moves else None)
        return found

    def capture(self, camera: str, window: PictureWindow | None = None) -> RgbdFrame:
        """Return the next picture, the depth that comes with it, and where the camera is now.

        Raises:
            UnsupportedError: There are no cameras.
            InputError: There is no such camera.
            SensorError: None comes, or nothing tells where the camera is.
        """
        del window
        require(self.driver, "cameras", f"a frame of {camera!r} was asked for")
        if camera not in self._topics:
            raise InputError(f"camera {camera!r} is not one of {', '.join(self._topics)}")
        topic, asked = self._topics[camera], time.monotonic()
        rgb, depth = self._next(topic, "rgb", asked), self._next(topic, "depth", asked)
        lens, place = self._link.lens(topic), self._link.frame(rgb.frame)
        if place is None:
            raise SensorError(f"{camera}: {self._link.astray(rgb.frame)}")
        if lens is None:
            raise SensorError(f"{camera}: its camera_info tells of no lens that is known here any more")
        if rgb.pixels.shape[:2] != depth.pixels.shape or depth.pixels.shape != (lens.height, lens.width):
            raise SensorError(
                f"{camera}: colour is {rgb.pixels.shape[:2]}, depth {depth.pixels.shape} and camera_info "
                f"{(lens.height, lens.width)} pixels large; publish depth that is registered to the colour"
            )
        return RgbdFrame(
            camera=camera,
            time=rgb.time - self._began,
            rgb=rgb.pixels,
            depth=depth.pixels,
            intrinsics=lens,
            pose_camera_in_world=place[0],
            arms=self._posture(),
        )

    def force_on(self, object_id: str | None, arm: str | None = None) -> Array:
        """Return what the wrist's sensor feels, N in the world, shape (3,); it cannot tell of which object, or of the table.

        Raises:
            UnsupportedError: There is no such sensor.
            SensorError: What it told last is too old, or nothing tells how it is turned.
        """
        del object_id, arm
        require(self.driver, "wrist_wrench", "a force was asked for")
        asked = time.monotonic()
        # This process may have been away: what came meanwhile is taken in as soon as it listens again.
        while True:
            told, now = self._link.force(), time.monotonic()
            if told is not None and now - told[0] <= self._oldest:
                return told[1]
            if now - asked > self._oldest:
                break
            time.sleep(_LOOK_SECONDS)
        if told is None:
            raise SensorError(f"the wrench: {self._link.numb()}")
        raise SensorError(f"the wrench is {now - told[0]:.3f} s old, and {self._oldest:g} are allowed")

    def _next(self, topic: str, kind: Literal["rgb", "depth"], since: float) -> Shot:
        """Return a picture that was taken after a moment of the monotonic clock."""
        while time.monotonic() - since < self._answer:
            shot = self._link.shot(topic, kind)
            if shot is not None and shot.time >= since:
                return shot
            time.sleep(_LOOK_SECONDS)
        if self._link.ended:
            raise SensorError(self._link.ended)
        raise SensorError(f"{topic.lstrip('/')}: no {kind} picture has come for {self._answer:g} s")
