"""A workcell that is another process's: connect to it, ask it, watch it, give it goals."""

from robosandbox.service.client.client import Client, connect
from robosandbox.service.client.robot import RemoteRobot

__all__ = ["Client", "RemoteRobot", "connect"]
