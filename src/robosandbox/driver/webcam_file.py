"""Files of webcams: what they say, and entries written into their text, whose comments stay."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml

from robosandbox.errors import InputError
from robosandbox.types import Intrinsics, Pose, StrictModel
from robosandbox.validation import parse_yaml, read_text, validate

# Digits after the point: a micrometre, a thousandth of a pixel and a hundredth of an arc second are told.
_DIGITS = 8
# A value that stands elsewhere in the file, after its key.
_ALIAS = re.compile(r"\s*:\s*\*[^\s,\]}]+")


class Lens(StrictModel):
    """A camera's pinhole and lens, as in `robosandbox.types.Intrinsics`; pixels."""

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    distortion: tuple[float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0)

    @property
    def intrinsics(self) -> Intrinsics:
        """The same for frames."""
        return Intrinsics(**self.model_dump())


class Webcam(StrictModel):
    """A camera as its file describes it.

    Attributes:
        source: Number of the device, or its path, or that of a video or of numbered pictures (`seen_%03d.png`); of a depth camera
            `realsense`, or `realsense:SERIAL`.
        lens: Its intrinsics; None before `robo-sandbox calibrate --lens` has written them, and where the camera itself tells them.
        pose: Of its optical frame (z forward, y down) in the world, or in the TCP's frame of the arm on whose hand it rides; None before
            `robo-sandbox calibrate` has written it.
        arm: Name of that arm, "arm" where there is one; None where it stands.
    """

    source: int | str
    lens: Lens | None = None
    pose: Pose | None = None
    arm: str | None = None


class WebcamFile(StrictModel):
    """Content of a file of webcams.

    Attributes:
        webcams: By name.
    """

    webcams: dict[str, Webcam]


def known_lens(path: Path, name: str, webcam: Webcam) -> Lens:
    """Return the lens of a webcam.

    Raises:
        InputError: Its file has none.
    """
    if webcam.lens is None:
        raise InputError(
            f"{path}: webcams.{name}.lens is missing; hold the board before it and run "
            f"`robo-sandbox calibrate --webcams {path} --lens {name}`"
        )
    return webcam.lens


def write_entries(path: Path, entries: Mapping[str, Webcam], output: Path) -> None:
    """Write the lens and the pose of some webcams into a copy of their file's text; all else stays as it is, comments too.

    Args:
        path: The file.
        entries: Webcams by name, as they are to be.
        output: The copy; may be the file itself.

    Raises:
        InputError: The file cannot be changed or the copy not be written; nothing is then.
    """
    text, source = read_text(path), path.name
    file = validate(parse_yaml(text, source), WebcamFile, source=source)
    for name, wanted in entries.items():
        for key in ("lens", "pose", "arm"):
            value = getattr(wanted, key)
            if value is not None and value != getattr(file.webcams[name], key):
                plain = value if isinstance(value, str) else _rounded(value.model_dump(mode="json"))
                text = _with_value(text, ("webcams", name), key, plain)
    meant = WebcamFile(webcams={**file.webcams, **entries})
    try:
        written = WebcamFile.model_validate(yaml.safe_load(text))
    except ValueError:
        written = None
    if written is None or not _alike(written.model_dump(), meant.model_dump()):
        raise InputError(
            f"{path}: its text cannot be changed in place (an entry that stands elsewhere, as `<<: *other`, say); write the "
            f"entries of {', '.join(entries)} out and run this again"
        )
    try:
        output.write_text(text, encoding="utf-8")
    except OSError as error:
        raise InputError(f"--output: {output}: {error.strerror}") from None


def _rounded(value: Any) -> Any:
    """Return data whose numbers have no more digits than can be measured."""
    if isinstance(value, dict):
        return {key: _rounded(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_rounded(item) for item in value]
    return round(value, _DIGITS) if isinstance(value, float) else value


def _alike(one: Any, other: Any) -> bool:
    """Return whether data are the same but for what rounding leaves."""
    if isinstance(one, dict) and isinstance(other, dict):
        return one.keys() == other.keys() and all(_alike(one[key], other[key]) for key in one)
    if isinstance(one, list | tuple) and isinstance(other, list | tuple):
        return len(one) == len(other) and all(map(_alike, one, other))
    if isinstance(one, float) and isinstance(other, float):
        return math.isclose(one, other, abs_tol=10.0 * 10.0**-_DIGITS)
    return bool(one == other)


def _with_value(text: str, where: tuple[str, ...], key: str, value: Mapping[str, object] | str) -> str:
    """Return a YAML text in which a mapping within mappings has a value: in the old one's place, or after the last one."""
    flow = yaml.safe_dump(value, default_flow_style=True, sort_keys=False, width=math.inf).removesuffix("...\n").strip()
    mapping: Any = yaml.compose(text, Loader=yaml.SafeLoader)
    for name in where:
        mapping = next(item for at, item in mapping.value if at.value == name)
    for at, item in mapping.value:
        if at.value == key:
            begin = at.end_mark.index + (text[at.end_mark.index :].index(":") + 1)
            return f"{text[:begin]} {flow}{text[_end(text, at, item) :]}"
    end = _end(text, *mapping.value[-1])
    if mapping.flow_style:
        return f"{text[:end]}, {key}: {flow}{text[end:]}"
    # A remark may stand behind the last value.
    end = text.find("\n", end) if "\n" in text[end:] else len(text)
    return f"{text[:end]}\n{' ' * mapping.start_mark.column}{key}: {flow}{text[end:]}"


def _end(text: str, key: Any, value: Any) -> int:
    """Return where a value of a mapping (nodes of `yaml`) ends in a text, without what follows it in the lines below."""
    alias = _ALIAS.match(text, key.end_mark.index)
    if alias is not None:
        return alias.end()
    if isinstance(value, yaml.ScalarNode) or value.flow_style:
        return int(value.end_mark.index)
    last = value.value[-1]
    if isinstance(value, yaml.MappingNode):
        return _end(text, *last)
    return _end(text, last, last)
