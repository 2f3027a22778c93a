"""Drivers for their authors and callers: capabilities, a bare driver to start from, opening by name, limits."""

from robosandbox.driver.bare import BareDriver, ControlLoop, per_tick
from robosandbox.driver.capabilities import (
    CAPABILITIES,
    CameraSpec,
    Capabilities,
    come_to_rest,
    refusal,
    require,
    simulated,
)
from robosandbox.driver.loading import SUPPLIED, driver_factory, fitted, load_driver, split_name
from robosandbox.driver.passing import PassingDriver
from robosandbox.driver.protocols import Driver, Guard, Refereed, Simulated
from robosandbox.driver.safe import SafeDriver, SafeSimulated, face_of, made_safe
from robosandbox.driver.safety import Mode, Safety

__all__ = [
    "CAPABILITIES",
    "SUPPLIED",
    "BareDriver",
    "CameraSpec",
    "Capabilities",
    "ControlLoop",
    "Driver",
    "Guard",
    "Mode",
    "PassingDriver",
    "Refereed",
    "SafeDriver",
    "SafeSimulated",
    "Safety",
    "Simulated",
    "come_to_rest",
    "driver_factory",
    "face_of",
    "fitted",
    "load_driver",
    "made_safe",
    "per_tick",
    "refusal",
    "require",
    "simulated",
    "split_name",
]
