"""The shipped Zenoh configurations at work: a sim, for one of them a router, and what each role connects with."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import zenoh
from support.processes import SimProcess, free_port

KITS: Final = ("default", "password", "tls", "router")
# A router that asks nobody who they are and has no rules: what clients are protected by there is their own doing.
OPEN: Final = "open"
PASSWORDS: Final = {"change-me-operator": "right horse", "change-me-observer": "battery staple"}


@dataclass(frozen=True)
class Kit:
    """A running sim and the configuration of each role.

    Attributes:
        name: Of the folder in examples/zenoh; `default` is a sim that was given no configuration.
        folder: The copies of the configurations that are in use.
        endpoints: What a client names; empty where its configuration does.
        sim: The sim's process.
    """

    name: str
    folder: Path
    endpoints: tuple[str, ...]
    sim: SimProcess

    @property
    def roles(self) -> tuple[str, ...]:
        """Who is let in; without a configuration nobody is told from anybody."""
        return ("anyone",) if self.name in ("default", OPEN) else ("operator", "observer")

    def config(self, role: str) -> Path | None:
        """Return the configuration file of a role."""
        return None if self.name in ("default", OPEN) else self.folder / f"{role}.json5"


@contextmanager
def running_kit(
    name: str, examples: Path, folder: Path, *, certificates: Path | None = None, options: Sequence[str] = ()
) -> Iterator[Kit]:
    """Run a sim as the README of the examples says, on this machine's loopback.

    Args:
        name: One of `KITS`, or `OPEN`.
        examples: The folder examples/zenoh.
        folder: Where the copies go.
        certificates: A folder that `make_certificates` made; one in `folder`, made if it is not there, when left out.
        options: More of `robo-sandbox sim`.
    """
    if name == "default":
        with SimProcess(*options) as sim:
            yield Kit(name, folder, (sim.endpoint,), sim)
        return
    if name == OPEN:
        with (
            _open_router(folder) as (endpoint, sim_config),
            SimProcess("--zenoh-config", str(sim_config), *options, protocol=None) as sim,
        ):
            yield Kit(name, folder, (endpoint,), sim)
        return
    certificates = certificates or folder / "certificates"
    if not certificates.exists():
        make_certificates(examples, certificates)
    kit = copy_kit(name, examples, folder / name, certificates)
    options = ("--zenoh-config", str(kit / "sim.json5"), *options)
    with ExitStack() as stack:
        if name == "router":
            port = stack.enter_context(running_router(kit))
            for file in kit.glob("*.json5"):
                file.write_text(file.read_text().replace("localhost:7447", f"localhost:{port}"))
            sim = stack.enter_context(SimProcess(*options, protocol=None))
            yield Kit(name, kit, (), sim)
        else:
            sim = stack.enter_context(SimProcess(*options, protocol="tcp" if name == "password" else "tls"))
            yield Kit(name, kit, (sim.endpoint,), sim)


def make_certificates(examples: Path, folder: Path) -> None:
    """Make a certificate authority and everybody's certificates with the shipped program."""
    command = [sys.executable, str(examples / "make_certificates.py"), str(folder), "--hosts", "sim.test"]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)


def copy_kit(name: str, examples: Path, folder: Path, certificates: Path) -> Path:
    """Do what the README says to a copy of the configurations; paths become absolute, as for a service."""
    shutil.copytree(examples / name, folder)
    users = "".join(f"{old.rpartition('-')[2]}:{new}\n" for old, new in PASSWORDS.items())
    (folder / "passwords.txt").write_text(users)
    for file in folder.glob("*.json5"):
        text = file.read_text().replace('"certificates/', f'"{certificates}/')
        text = text.replace('"passwords.txt"', f'"{folder}/passwords.txt"')
        file.write_text(re.sub("|".join(PASSWORDS), lambda found: PASSWORDS[found[0]], text))
    return folder


@contextmanager
def running_router(folder: Path) -> Iterator[int]:
    """Run the shipped zenohd configuration as a router in this process; yield its port."""
    config = zenoh.Config.from_file(str(folder / "router.json5"))
    port = free_port()
    config.insert_json5("listen/endpoints", json.dumps([f"tls/127.0.0.1:{port}"]))
    with zenoh.open(config):
        yield port


@contextmanager
def _open_router(folder: Path) -> Iterator[tuple[str, Path]]:
    """Run a router without credentials and rules; yield its endpoint and the configuration of a sim that connects to it."""
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    config = zenoh.Config()
    for path, value in {
        "mode": "router",
        "listen/endpoints": [endpoint],
        "scouting/multicast/enabled": False,
    }.items():
        config.insert_json5(path, json.dumps(value))
    file = folder / "open-sim.json5"
    file.write_text(json.dumps({"mode": "client", "connect": {"endpoints": [endpoint]}}))
    with zenoh.open(config):
        yield endpoint, file
