"""The driver `ros2` before a plant that it starts: for the conformance checks, the bench and tests."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Iterable
from multiprocessing.connection import Client
from pathlib import Path
from time import monotonic, sleep
from typing import Any, Literal

# Before rclpy reads them: nothing leaves this machine, and two plants at once do not hear each other.
os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
# Pictures are larger than Fast DDS's shared memory takes as it comes, and in pieces over UDP most are lost.
os.environ.setdefault("FASTDDS_BUILTIN_TRANSPORTS", "LARGE_DATA")
os.environ.setdefault("ROS_DOMAIN_ID", str(1 + os.getpid() % 100))

from robosandbox.drivers.ros2.driver import Ros2
from robosandbox.types import Array, Scene, Truth


class Referee:
    """The other end of a plant's socket: its true state, and faults that are made in it.

    Args:
        folder: The plant's.
    """

    def __init__(self, folder: Path) -> None:
        self._client, self._lock = Client(str(folder / "referee"), "AF_UNIX"), threading.Lock()

    def __getattr__(self, name: str) -> Callable[..., Any]:
        def ask(*arguments: Any) -> Any:
            with self._lock:
                self._client.send((name, arguments))
                return self._client.recv()

        return ask


class PlantProcess:
    """A plant in a process of its own.

    Args:
        scene: What it is loaded with.
        felt: Objects of which the referee is to tell how hard they were pressed.
        start_q: Where the arm begins, shape (n,).
        options: Of the plant's command line.
    """

    def __init__(
        self, scene: Scene, *, felt: Iterable[str] = (), start_q: Array | None = None, options: Iterable[str] = ()
    ) -> None:
        self._folder = tempfile.TemporaryDirectory()
        self.folder, self._options = Path(self._folder.name), [*options]
        (self.folder / "scene.pickle").write_bytes(pickle.dumps((scene, tuple(felt), start_q)))
        self.start()

    def start(self) -> None:
        """Start it, or start it again."""
        (self.folder / "referee").unlink(missing_ok=True)
        command = [sys.executable, "-m", "robosandbox_ros2.plant", str(self.folder), *self._options]
        self._process = subprocess.Popen(command)
        end = monotonic() + 60.0
        while True:
            try:
                self.referee = Referee(self.folder)
                return
            # Its socket has a name before it listens.
            except (FileNotFoundError, ConnectionRefusedError):
                if self._process.poll() is not None or monotonic() > end:
                    # One that is left to itself would go on telling of its own arm.
                    self.kill()
                    raise RuntimeError(f"the plant ended with {self._process.returncode}") from None
                sleep(0.05)

    def kill(self) -> None:
        """End it as a power cut does."""
        self._process.kill()
        self._process.wait()

    def close(self) -> None:
        """End it, and forget its folder."""
        self.kill()
        self._folder.cleanup()


class PlantDriver(Ros2):
    """The driver `ros2` before a plant of its own, with a referee who sees it.

    Args:
        scene: What the plant is loaded with.
        felt: Objects of which the referee is to tell how hard they were pressed.
        start_q: Where the arm begins, shape (n,).
        eyes: Whether its cameras are listened to.
        wrench: Whether there is a sensor at the wrist.
        gripper_action: Which action its gripper serves.
        path_tolerance: How far a joint may be off its path, rad or m; 0 does not look.
        link_timeout: As of `Ros2`; the plant is a process that a busy computer may put off.
        answer: Likewise; the plant draws its pictures without a graphics card.
    """

    def __init__(
        self,
        scene: Scene,
        *,
        felt: Iterable[str] = (),
        start_q: Array | None = None,
        eyes: bool = True,
        wrench: bool = True,
        gripper_action: Literal["parallel", "plain"] = "parallel",
        path_tolerance: float = 0.0,
        link_timeout: float = 0.5,
        answer: float = 5.0,
    ) -> None:
        options = ("--gripper-action", gripper_action, "--path-tolerance", str(path_tolerance))
        self.plant = PlantProcess(scene, felt=felt, start_q=start_q, options=options)
        try:
            super().__init__(
                scene,
                gripper="/gripper_controller/gripper_cmd",
                wrench="/wrench" if wrench else None,
                cameras="+".join(f"/{name}" for name in self.plant.referee.cameras()) if eyes else "",
                link_timeout=link_timeout,
                answer=answer,
            )
        except BaseException:
            self.plant.close()
            raise

    @property
    def referee(self) -> Callable[[], Truth]:
        """Returns the plant's true state, for a judge."""
        truth: Callable[[], Truth] = self.plant.referee.truth
        return truth

    def close(self) -> None:
        """Leave the graph, and end the plant."""
        super().close()
        self.plant.close()
