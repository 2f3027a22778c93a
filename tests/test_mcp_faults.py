"""MCP servers whose clients break off, write nonsense or come from elsewhere: real processes, pipes and sockets."""

import itertools
import json
import signal
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from http.client import HTTPConnection, HTTPResponse
from typing import Any
from urllib.parse import urlparse

import pytest
from support.processes import McpProcess, SimProcess, mcp_over_http

ACCEPT = {"content-type": "application/json", "accept": "application/json, text/event-stream"}
# Seconds: twice those in which a server gives up a request that is not whole.
PATIENCE = 20.0


def test_one_ctrl_c_ends_a_server_that_waits_for_its_client() -> None:
    with McpProcess() as server:
        assert not server.call(1, "look")["result"].get("isError")
        server.process.send_signal(signal.SIGINT)
        assert server.process.wait(PATIENCE) == 130


@pytest.mark.parametrize(
    ("line", "number", "code"),
    [
        ("{nonsense", None, -32700),
        ("[" * 100_000, None, -32700),
        ("[]", None, -32600),
        ('\n \n{"jsonrpc": "2.0", "id": "\\ud800", "method": "tools/list"}', None, -32600),
        ('{"jsonrpc": "2.0", "id": 7}', 7, -32600),
        ('{"jsonrpc": "2.0", "id": 8, "method": "tools/call", "params": {"name": "\\ud800"}}', 8, -32600),
    ],
)
def test_a_line_that_is_no_message_is_answered_and_the_next_one_too(line: str, number: int | None, code: int) -> None:
    with McpProcess() as server:
        server.write(line)
        answer = server.read()
        assert (answer["id"], answer["error"]["code"]) == (number, code)
        assert not server.call(9, "look")["result"].get("isError")


@pytest.mark.slow
def test_a_sim_that_died_is_told_by_name() -> None:
    with SimProcess() as sim, McpProcess("--connect", sim.endpoint, "--reconnect", "2") as server:
        server.call(1, "look")
        sim.kill()
        found = server.call(2, "pick", object="red_cube")["result"]
        assert found["isError"]
        assert found["structuredContent"]["error"]["code"] == "service_unavailable"
        read = server.ask(3, "resources/read", uri="robosandbox://scene")
        assert read["error"]["code"] == -32603 and "robot" in read["error"]["message"]


class Visitor:
    """A client over HTTP, a connection a request."""

    def __init__(self, url: str) -> None:
        self.host, self.port = str(urlparse(url).hostname), int(urlparse(url).port or 0)
        self.headers = dict(ACCEPT)
        self.numbers = itertools.count()
        client = {"name": "test", "version": "1"}
        about = {"protocolVersion": "2025-06-18", "capabilities": {}, "clientInfo": client}
        with self.post("initialize", about) as answer:
            self.headers["mcp-session-id"] = str(answer.getheader("mcp-session-id"))
        with self.post("notifications/initialized"):
            pass

    @contextmanager
    def post(self, method: str, params: object = None, **headers: str) -> Iterator[HTTPResponse]:
        body: dict[str, object] = {"jsonrpc": "2.0", "method": method, **({"params": params} if params else {})}
        if not method.startswith("notifications/"):
            body["id"] = next(self.numbers)
        connection = HTTPConnection(self.host, self.port, timeout=60.0)
        try:
            connection.request("POST", "/mcp", json.dumps(body), {**self.headers, **headers})
            yield connection.getresponse()
        finally:
            connection.close()

    def look(self) -> dict[str, Any]:
        with self.post("tools/call", {"name": "look", "arguments": {}}) as answer:
            lines = [line.removeprefix("data: ") for line in answer.read().decode().splitlines() if "result" in line]
        found: dict[str, Any] = json.loads(lines[-1])["result"]["structuredContent"]
        return found


def test_an_arm_stops_when_the_http_connection_that_moves_it_is_dropped() -> None:
    with mcp_over_http("--task", "stack_five", "--realtime") as url:
        visitor = Visitor(url)
        moving = {"name": "run", "arguments": {"prompt": "stack all the cubes"}, "_meta": {"progressToken": 1}}
        with visitor.post("tools/call", moving) as answer:
            # The first progress: it moves.
            while b"progress" not in answer.readline():
                pass
            moves = visitor.look()
            assert moves["doing"]
        while (rests := visitor.look())["doing"]:
            pass
        # Stacking takes it half a minute of the world's time.
        assert rests["state"]["time"] < moves["state"]["time"] + 5.0


def test_pages_of_other_ports_and_machines_are_turned_away_and_those_of_this_one_not() -> None:
    with mcp_over_http() as url:
        visitor = Visitor(url)
        port = urlparse(url).port
        pages = {f"http://localhost:{port}": 200, "http://localhost:8888": 403, "http://127.0.0.1:1": 403}
        for origin, status in {**pages, "http://evil.example": 403, "null": 403}.items():
            with visitor.post("tools/list", origin=origin) as answer:
                assert answer.status == status, origin


def test_requests_that_are_never_whole_are_closed() -> None:
    head = b"POST /mcp HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Type: application/json\r\n"
    parts = (b"", b"POST /m", head, head + b"Content-Length: 100\r\n\r\n{")
    with mcp_over_http() as url:
        address = (str(urlparse(url).hostname), int(urlparse(url).port or 0))
        halves = [socket.create_connection(address, timeout=PATIENCE) for _ in range(75) for _ in parts]
        for number, half in enumerate(halves):
            half.sendall(parts[number % len(parts)])
        assert Visitor(url).look()
        for half in halves:
            assert half.recv(1000) == b"" or half.recv(1000) == b""
            half.close()
