"""A robot's own cameras, with what LeRobot does not know of them: their lenses, and where they stand."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import yaml
from pydantic import TypeAdapter, ValidationError

from robosandbox.driver import ARM, BareSenses, CameraSpec, require
from robosandbox.errors import InputError, SensorError
from robosandbox.types import Pose, RgbdFrame
from robosandbox.types.sensed import Intrinsics
from robosandbox.values import frozen

if TYPE_CHECKING:
    from collections.abc import Mapping

    from robosandbox.types import PictureWindow
    from robosandbox_lerobot.driver import LeRobot

# LeRobot's depth is in whole millimetres.
_METRES = 1e-3


@frozen(kw_only=True)
class Place:
    """One camera, as a file of places says it.

    Attributes:
        lens: Size and pinhole.
        pose: Of its optical frame (z forward, y down), in the world, or in the TCP's frame where it rides on the hand.
        on_hand: Whether it does.
    """

    lens: Intrinsics
    pose: Pose
    on_hand: bool = False


_FILE = TypeAdapter(dict[str, Place])


def read_places(path: Path) -> dict[str, Place]:
    """Return what is said of each camera, by the name that it has in the robot's configuration.

    Raises:
        InputError: There is no such file, or something in it is not as it is to be.
    """
    try:
        return _FILE.validate_python(yaml.safe_load(path.read_text(encoding="utf-8")))
    except OSError as error:
        raise InputError(f"places: {path}: {error.strerror}") from None
    except (yaml.YAMLError, ValidationError) as error:
        raise InputError(f"places: {path}: {error}") from None


class RobotSenses(BareSenses):
    """Pictures of a robot's cameras whose places are known.

    Args:
        driver: Whose.
        places: Of its cameras, by name.

    Attributes:
        cameras: By name.

    Raises:
        InputError: A place is that of no camera of this robot, or of one with pictures of another size.
    """

    def __init__(self, driver: LeRobot, places: Mapping[str, Place]) -> None:
        super().__init__(driver)
        self._driver, self._places = driver, places
        features = driver.robot.observation_features
        for name, place in places.items():
            size, wanted = features.get(name), (place.lens.height, place.lens.width, 3)
            if size != wanted:
                raise InputError(
                    f"places: {name}: the robot's pictures are {size or 'not there'}, and the lens is of {wanted}"
                )
        self.cameras = {
            name: CameraSpec(intrinsics=place.lens, pose=place.pose, arm=ARM if place.on_hand else None)
            for name, place in places.items()
        }

    def capture(self, camera: str, window: PictureWindow | None = None) -> RgbdFrame:
        """Return a camera's latest picture, with depth where it has some.

        Raises:
            UnsupportedError: There are no cameras.
            InputError: There is no such camera.
            SensorError: The robot told nothing new.
        """
        del window
        require(self.driver, "cameras", f"a frame of {camera!r} was asked for")
        if camera not in self._places:
            raise InputError(f"camera {camera!r} is not one of {', '.join(self._places)}")
        driver, place = self._driver, self._places[camera]
        driver.look()
        if driver.time - driver.heard > 2.0 * driver.control_timestep:
            raise SensorError(f"{camera}: {driver.robot.name} has told nothing for {driver.time - driver.heard:.2f} s")
        rgb = np.asarray(driver.observed[camera], dtype=np.uint8)
        told = driver.observed.get(f"{camera}_depth")
        depth = np.zeros(rgb.shape[:2]) if told is None else _METRES * np.asarray(told).reshape(rgb.shape[:2])
        state = driver.arms[ARM].state()
        return RgbdFrame(
            camera=camera,
            time=driver.heard,
            rgb=rgb,
            depth=depth.astype(np.float32),
            intrinsics=place.lens,
            pose_camera_in_world=state.tcp_pose @ place.pose if place.on_hand else place.pose,
            arms=driver.posture(),
        )
