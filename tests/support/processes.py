"""Processes of the real program for tests and benchmarks: a sim, killed and restarted at will, and an MCP server."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Self

# Seconds that a sim process may take to start; chosen for a machine ten times as busy as one on which it takes 5 s of
# CPU.
_START_SECONDS = 60.0
# Seconds that an MCP server may take to end when it is asked to; chosen like the above, for one that takes 1 s.
_END_SECONDS = 20.0
_MAIN = "from robosandbox.apps.cli import main; main()"


class SimProcess:
    """`robo-sandbox sim` as a child process, ready when the constructor returns.

    Args:
        options: As on the command line, without `--listen`.
        state_file: Where the world is kept; `restart` then goes on from it.
        log: Where stderr goes; nowhere if left out.
        protocol: Of the endpoint, `tcp` or `tls`; None for a sim that connects to a router and listens nowhere.
        first: Python that the process runs before the program, to break something in it.
        environment: Of the process; this one's if left out.

    Attributes:
        endpoint: Where it listens; empty for a sim that does not.
    """

    def __init__(
        self,
        *options: str,
        state_file: Path | None = None,
        log: Path | None = None,
        protocol: str | None = "tcp",
        first: str = "",
        environment: Mapping[str, str] | None = None,
    ) -> None:
        self.endpoint: str = f"{protocol}/127.0.0.1:{free_port()}" if protocol else ""
        self._options = [*options, *(["--state-file", str(state_file)] if state_file else [])]
        self._log = log
        self._first = first
        self._environment = environment
        self._process = self._start()

    @property
    def pid(self) -> int:
        """The process id."""
        return self._process.pid

    @property
    def running(self) -> bool:
        """Whether the process lives."""
        return self._process.poll() is None

    def ended(self, timeout: float = 30.0) -> int:
        """Wait until it has ended by itself and return its exit code.

        Raises:
            subprocess.TimeoutExpired: It did not end in time.
        """
        return self._process.wait(timeout)

    def kill(self) -> None:
        """End it at once, as a power cut would."""
        self._process.kill()
        self._process.wait()

    def stop(self, number: int = signal.SIGTERM, timeout: float = 30.0) -> int:
        """Ask it to end; return its exit code.

        Raises:
            subprocess.TimeoutExpired: It did not end in time.
        """
        if self.running:
            self._process.send_signal(number)
        return self._process.wait(timeout)

    def restart(self) -> None:
        """Start it again with the same options."""
        self._process = self._start()

    def close(self) -> None:
        """Make sure that it is gone."""
        if self.running:
            self.kill()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _start(self) -> subprocess.Popen[str]:
        listen = ["--listen", self.endpoint] if self.endpoint else []
        command = [sys.executable, "-c", f"{self._first}\n{_MAIN}", "sim", *listen, *self._options]
        with open(self._log or os.devnull, "a", encoding="utf-8") as errors:
            process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=errors, text=True, env=self._environment)
        watchdog = threading.Timer(_START_SECONDS, process.kill)
        watchdog.start()
        try:
            line = process.stdout.readline() if process.stdout else ""
        finally:
            watchdog.cancel()
        if not line.startswith("listening on"):
            process.kill()
            raise RuntimeError(f"the sim did not start (exit code {process.wait()}): {line!r}")
        return process


def mcp_command(*options: str) -> list[str]:
    """Return what starts `robo-sandbox mcp` with options."""
    return [sys.executable, "-c", _MAIN, "mcp", *options]


class McpProcess:
    """`robo-sandbox mcp` on its stdin and stdout, spoken to message by message."""

    def __init__(self, *options: str) -> None:
        pipe = subprocess.PIPE
        self.process = subprocess.Popen(mcp_command(*options), stdin=pipe, stdout=pipe, stderr=pipe, text=True)
        client = {"name": "test", "version": "1"}
        self.ask(0, "initialize", protocolVersion="2025-06-18", capabilities={}, clientInfo=client)
        self.write(json.dumps({"jsonrpc": "2.0", "method": "notifications/initialized"}))

    def write(self, line: str) -> None:
        """Send a line as it is."""
        print(line, file=self.process.stdin, flush=True)

    def read(self) -> dict[str, Any]:
        """Return the next message; raises EOFError where the server has ended."""
        line = self.process.stdout.readline() if self.process.stdout else ""
        if not line:
            raise EOFError("the MCP server has ended")
        message: dict[str, Any] = json.loads(line)
        return message

    def ask(self, number: int, method: str, **params: Any) -> dict[str, Any]:
        """Return the answer to a request, whatever comes before it."""
        self.write(json.dumps({"jsonrpc": "2.0", "id": number, "method": method, "params": params}))
        while (message := self.read()).get("id") != number:
            pass
        return message

    def call(self, number: int, tool: str, **arguments: Any) -> dict[str, Any]:
        """Return a tool's result, or the error in its place."""
        return self.ask(number, "tools/call", name=tool, arguments=arguments)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.process.kill()
        self.process.communicate()


@contextmanager
def mcp_over_http(*options: str) -> Iterator[str]:
    """Serve MCP over HTTP on a free port and yield the address; the server is asked to end behind it.

    Raises:
        RuntimeError: The server did not start, or ended with another exit code than 0.
    """
    process = subprocess.Popen(mcp_command("--http", "0", *options), stderr=subprocess.PIPE, text=True)
    try:
        line = process.stderr.readline() if process.stderr else ""
        if not line.startswith("serving on http://127.0.0.1:"):
            process.kill()
            raise RuntimeError(f"the MCP server did not start (exit code {process.wait()}): {line!r}")
        yield line.split()[-1]
        process.terminate()
        if (code := process.wait(_END_SECONDS)) != 0:
            raise RuntimeError(f"the MCP server ended with exit code {code}")
    finally:
        process.kill()


def free_port() -> int:
    """Return a TCP port of 127.0.0.1 that nobody listens on now."""
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        port: int = found.getsockname()[1]
        return port
