"""Drivers for their authors and callers: capabilities, a bare driver to start from, opening by name, limits."""

from robosandbox.driver.bare import BareArm, BareDriver, BareHand, BareSenses, ControlLoop, per_tick
from robosandbox.driver.capabilities import (
    CAPABILITIES,
    CameraSpec,
    Capabilities,
    come_to_rest,
    refusal,
    require,
    robot_name,
    simulated,
)
from robosandbox.driver.clamps import TOLERANCES, braking_rows
from robosandbox.driver.eyes import Eyes, open_eyes
from robosandbox.driver.integral import IntegralAction
from robosandbox.driver.loading import SUPPLIED, driver_factory, fitted, load_driver, split_name
from robosandbox.driver.passing import PassingArm, PassingDriver, PassingHand, PassingSenses
from robosandbox.driver.protocols import Arm, Driver, Guard, Hand, Mode, Senses, Simulated
from robosandbox.driver.safe import SafeDriver, made_safe
from robosandbox.driver.safety import Safety
from robosandbox.driver.wall_clock import WallClockDriver
from robosandbox.types.robot import ARM, HAND

__all__ = [
    "ARM",
    "CAPABILITIES",
    "HAND",
    "SUPPLIED",
    "TOLERANCES",
    "Arm",
    "BareArm",
    "BareDriver",
    "BareHand",
    "BareSenses",
    "CameraSpec",
    "Capabilities",
    "ControlLoop",
    "Driver",
    "Eyes",
    "Guard",
    "Hand",
    "IntegralAction",
    "Mode",
    "PassingArm",
    "PassingDriver",
    "PassingHand",
    "PassingSenses",
    "SafeDriver",
    "Safety",
    "Senses",
    "Simulated",
    "WallClockDriver",
    "braking_rows",
    "come_to_rest",
    "driver_factory",
    "fitted",
    "load_driver",
    "made_safe",
    "open_eyes",
    "per_tick",
    "refusal",
    "require",
    "robot_name",
    "simulated",
    "split_name",
]
