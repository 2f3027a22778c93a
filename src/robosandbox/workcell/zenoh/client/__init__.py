"""A workcell that is another process's: connect to it, ask it, watch it, give it goals."""

from robosandbox.workcell.zenoh.client.client import Client, connect
from robosandbox.workcell.zenoh.client.robot import RemoteRobot

__all__ = ["Client", "RemoteRobot", "connect"]
