"""Inspect: go near a thing, take a picture of it, and keep the picture."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np

from robosandbox.cache import state_file
from robosandbox.driver import refusal
from robosandbox.errors import Phase, UnsupportedError
from robosandbox.skills.point_at import PointAt
from robosandbox.skills.primitives.hand_move import HandMove
from robosandbox.skills.primitives.manipulator import Manipulator
from robosandbox.skills.protocols import SkillContext
from robosandbox.skills.words import Words
from robosandbox.types import Array, RgbdFrame, SkillResult
from robosandbox.world.relations import centre

_TAKES = ("take", "get", "shoot", "snap", "make", "take me", "get me")
_PICTURES = ("a picture", "a photo", "a photograph", "a closeup", "an image", "a snapshot")
_CAMERAS = (
    "with your camera",
    "with the camera",
    "with your wrist camera",
    "with the wrist camera",
)


class Inspect(HandMove):
    """Take a picture of a thing from near by."""

    name = "inspect"
    words = Words(
        verbs=(
            *("inspect", "examine", "photograph", "take a closer look at", "have a closer look at", "look closely at"),
            *(f"{take} {picture} of" for take in _TAKES for picture in _PICTURES),
            *(f"{take} {picture} of {{}} {camera}" for take in _TAKES for picture in _PICTURES for camera in _CAMERAS),
            *("check {} visually", "visually inspect", "look {} over"),
        ),
        object="object",
        hand="any",
    )

    def run(self, ctx: SkillContext, *, object: str) -> SkillResult:
        """Bring the hand before a thing, take a picture with the nearest camera that has it in view, and keep that as a file.

        The file lies in the state folder of the machine that moves the robot; the result tells where.

        Args:
            object: Id of the thing.

        Raises:
            UnsupportedError: There is no camera, none that has it in view, or nowhere to keep the picture.
            SkillError: As `point_at` raises them.
        """
        arm = Manipulator(ctx)
        cameras = arm.driver.capabilities.cameras
        if not cameras:
            raise refusal(arm.driver, "cameras", f"a picture of {object} was asked for")
        pointed = PointAt().run(ctx, object=object)
        arm = Manipulator(ctx)
        at = centre(arm.find(object))
        arm.ctx.enter(Phase.VERIFY)
        taken = [arm.driver.senses.capture(name) for name in cameras]
        frames = [(distance, frame) for frame in taken if (distance := _in_view(frame, at)) > 0.0]
        if not frames:
            raise UnsupportedError(
                f"none of the cameras ({', '.join(cameras)}) has {object} in view", phase=Phase.VERIFY
            )
        distance, frame = min(frames, key=lambda pair: pair[0])
        path = _kept(frame, object)
        return SkillResult(
            skill=self.name,
            detail={**pointed.detail, "picture": str(path), "camera": frame.camera, "distance_m": distance},
            found=f"a picture of {object}, by the camera {frame.camera} from {100.0 * distance:.0f} cm, is in {path}",
        )


def _in_view(frame: RgbdFrame, point: Array) -> float:
    """Return how far before a camera a point (3,) is, metres; 0 where the picture does not show it."""
    lens, place = frame.intrinsics, frame.pose_camera_in_world
    x, y, z = place.rotation.T @ (point - place.position)
    if z <= 0.0:
        return 0.0
    # Only where a program takes pictures: what only plans does without it.
    import cv2

    pixels, _ = cv2.projectPoints(
        np.array([[x, y, z]]),
        np.zeros(3),
        np.zeros(3),
        np.array([[lens.fx, 0.0, lens.cx], [0.0, lens.fy, lens.cy], [0.0, 0.0, 1.0]]),
        np.array(lens.distortion),
    )
    u, v = pixels.ravel()
    return float(z) if 0.0 <= u < lens.width and 0.0 <= v < lens.height else 0.0


def _kept(frame: RgbdFrame, name: str) -> Path:
    """Write a picture and return where.

    Raises:
        UnsupportedError: It cannot be written.
    """
    place = state_file(f"pictures/{name}-{time.strftime('%Y%m%dT%H%M%S')}-{round(1e3 * frame.time)}.png")
    if place is None:
        raise UnsupportedError("there is no home folder to keep the picture in", phase=Phase.VERIFY)
    import cv2

    _, content = cv2.imencode(".png", frame.rgb[..., ::-1])
    try:
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_bytes(content.tobytes())
    except OSError as error:
        raise UnsupportedError(f"{place}: {error.strerror}; the picture was not kept", phase=Phase.VERIFY) from None
    return place
