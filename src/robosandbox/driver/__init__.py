"""Drivers for their authors and callers: capabilities, a bare driver to start from, opening by name."""

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
from robosandbox.driver.protocols import Driver, Guard, Refereed, Simulated

__all__ = [
    "CAPABILITIES",
    "SUPPLIED",
    "BareDriver",
    "CameraSpec",
    "Capabilities",
    "ControlLoop",
    "Driver",
    "Guard",
    "Refereed",
    "Simulated",
    "come_to_rest",
    "driver_factory",
    "fitted",
    "load_driver",
    "per_tick",
    "refusal",
    "require",
    "simulated",
    "split_name",
]
