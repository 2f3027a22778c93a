"""Zenoh sessions that are closed by default: loopback only, no scouting, no open door without a lock, no answers but the sim's."""

from __future__ import annotations

import ipaddress
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import zenoh

from robosandbox.errors import InputError, ServiceUnavailableError
from robosandbox.forks import ForkGuard
from robosandbox.workcell.zenoh.access import rules_for_anyone
from robosandbox.workcell.zenoh.messages import DEFAULT_ENDPOINT

_RETRY = {"period_init_ms": 50, "period_max_ms": 250, "period_increase_factor": 1.5}
_ZENOH = ForkGuard("Zenoh")
_LOCAL_PROTOCOLS = ("unixsock-stream", "unixpipe")


def open_listener(
    listen: str | None = None, *, config_file: Path | None = None, insecure: bool = False
) -> tuple[zenoh.Session, tuple[str, ...]]:
    """Open a session that clients connect to.

    Args:
        listen: A Zenoh endpoint; what the config file says, or else `DEFAULT_ENDPOINT`.
        config_file: A Zenoh configuration (JSON5).
        insecure: Listen beyond this machine without asking who comes.

    Returns:
        The session and the endpoints that it listens on; none where the config connects to a router as a client.

    Raises:
        InputError: The endpoint or file is wrong, or would let anybody in from outside.
        ServiceUnavailableError: The endpoint is taken.
    """
    config = _base_config(config_file)
    mode = _set_default(config, "mode", "peer")
    if listen is not None:
        _set(
            config,
            "listen/endpoints",
            [listen],
            f"--listen: {listen!r} is no Zenoh endpoint; write it like {DEFAULT_ENDPOINT}",
        )
    elif mode != "client" and _get(config, "listen/endpoints") == _get(zenoh.Config(), "listen/endpoints"):
        _set(config, "listen/endpoints", [DEFAULT_ENDPOINT])
    elif mode == "client":
        _set(config, "listen/endpoints", [])
    _set_default(config, "listen/exit_on_failure", True)
    endpoints = _endpoints(config, mode)
    outside = [item for item in endpoints if not is_loopback(item)]
    if outside and not insecure:
        _require_protection(config, outside)
    routers = _addresses(_get(config, "connect/endpoints"), mode)
    beyond = [item for item in routers if not is_loopback(item)]
    if beyond and not insecure:
        _require_credentials(config, beyond)
    # What a session that connects to a router may hear is for the router to say.
    if mode == "peer" and not routers and not _get(config, "access_control/enabled"):
        _set(config, "access_control", rules_for_anyone())
    where = f"listen on {', '.join(endpoints)}" if endpoints else "reach the routers of the Zenoh config"
    return _open(config, f"cannot {where}"), endpoints


def open_connector(
    endpoints: Sequence[str] = (), *, config_file: Path | None = None, timeout: float = 1.0, mode: str = "peer"
) -> zenoh.Session:
    """Open a session that connects to sims, keeps trying, and listens nowhere.

    Args:
        endpoints: Zenoh endpoints of sims or routers; what the config file says, or else `DEFAULT_ENDPOINT`.
        config_file: A Zenoh configuration (JSON5) with the client's credentials.
        timeout: Seconds to wait for the connection before going on trying in the background.
        mode: What the session is where the file does not say it; a `client` does not go on trying.

    Raises:
        InputError: An endpoint or the file is wrong.
        ServiceUnavailableError: It is a client, and its routers are not there or do not let it in.
    """
    config = _base_config(config_file)
    mode = _set_default(config, "mode", mode)
    if endpoints:
        wrong = f"--connect: {', '.join(endpoints)!r} is no Zenoh endpoint; write it like {DEFAULT_ENDPOINT}"
        _set(config, "connect/endpoints", list(endpoints), wrong)
    elif not _get(config, "connect/endpoints"):
        _set(config, "connect/endpoints", [DEFAULT_ENDPOINT])
    if mode == "peer" and _get(config, "listen/endpoints") == _get(zenoh.Config(), "listen/endpoints"):
        _set(config, "listen/endpoints", [])
    _set_default(config, "connect/retry", _RETRY)
    _set_default(config, "connect/timeout_ms", round(1000 * timeout))
    _set_default(config, "connect/exit_on_failure", False)
    # Without multicast there is nothing to wait for when a session opens.
    _set_default(config, "scouting/delay", 0)
    return _open(config, "cannot connect: nobody listens there or the credentials are refused")


def is_loopback(endpoint: str) -> bool:
    """Tell whether nobody from another machine can reach an endpoint."""
    protocol, _, rest = endpoint.partition("/")
    if protocol in _LOCAL_PROTOCOLS:
        return True
    host = rest.partition("?")[0].partition("#")[0].rpartition(":")[0].strip("[]")
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def _require_protection(config: zenoh.Config, outside: Sequence[str]) -> None:
    """Raise unless strangers are kept out and those let in are told apart."""
    missing = []
    password = _get(config, "transport/auth/usrpwd/dictionary_file")
    mutual = _get(config, "transport/link/tls/enable_mtls") and all(
        item.startswith(("tls/", "quic/")) for item in outside
    )
    if not (password or mutual):
        missing.append("user/password (transport/auth/usrpwd) or TLS with client certificates (enable_mtls)")
    if not _get(config, "access_control/enabled") or _get(config, "access_control/default_permission") != "deny":
        missing.append("access control (access_control/enabled, with default_permission deny)")
    if missing:
        raise InputError(
            f"listen: {', '.join(outside)} can be reached from other machines and the Zenoh config lacks "
            f"{' and '.join(missing)}; give one like those in examples/zenoh/ with --zenoh-config, or --insecure"
        )


def _require_credentials(config: zenoh.Config, routers: Sequence[str]) -> None:
    """Raise where the sim would be served through a router that asks nobody who they are."""
    user = _get(config, "transport/auth/usrpwd/user")
    if not user and not _get(config, "transport/link/tls/connect_certificate"):
        raise InputError(
            f"connect: {', '.join(routers)} is beyond this machine and the Zenoh config has neither a user "
            "(transport/auth/usrpwd) nor a certificate (transport/link/tls/connect_certificate) to show there, so the "
            "router cannot ask for one; give one like those in examples/zenoh/router/, or --insecure"
        )


def _base_config(file: Path | None) -> zenoh.Config:
    if file is None:
        config = zenoh.Config()
    else:
        if not file.is_file():
            raise InputError(f"--zenoh-config: {str(file)!r} is no file")
        try:
            config = zenoh.Config.from_file(str(file))
        except Exception as error:  # zenoh raises its own ZError, and others for broken encodings
            raise InputError(f"--zenoh-config: {file.name}: {_first_line(error)}") from None
    _set_default(config, "scouting/multicast/enabled", False)
    # Nobody is told where others listen: clients that meet each other directly would not be held to the sim's rules.
    _set_default(config, "scouting/gossip/enabled", False)
    _set_default(config, "timestamping/enabled", True)
    return config


def is_forked() -> bool:
    """Return whether this process was forked after Zenoh was used, so that it cannot be used here."""
    return _ZENOH.lost() is not None


def check_process() -> None:
    """Raise ServiceUnavailableError where this process was forked after Zenoh was used."""
    lost = _ZENOH.lost()
    if lost is not None:
        raise ServiceUnavailableError(lost)


def _open(config: zenoh.Config, otherwise: str) -> zenoh.Session:
    check_process()
    _ZENOH.begin()
    try:
        return zenoh.open(config)
    except zenoh.ZError as error:
        raise ServiceUnavailableError(f"{otherwise}: {_first_line(error)}") from None


def _endpoints(config: zenoh.Config, mode: str) -> tuple[str, ...]:
    return _addresses(_get(config, "listen/endpoints"), mode)


def _addresses(found: Any, mode: str) -> tuple[str, ...]:
    """Return endpoints in any of the forms that a configuration may have them in."""
    if isinstance(found, dict):
        found = found.get(mode) or []
    return tuple(str(item["address"] if isinstance(item, dict) else item) for item in found or ())


def _get(config: zenoh.Config, path: str) -> Any:
    return json.loads(config.get_json(path))


def _set(config: zenoh.Config, path: str, value: Any, otherwise: str | None = None) -> None:
    try:
        config.insert_json5(path, json.dumps(value))
    except zenoh.ZError as error:
        raise InputError(otherwise or f"{path}: {_first_line(error)}") from None


def _set_default(config: zenoh.Config, path: str, value: Any) -> Any:
    """Set what the file left open; return what holds then."""
    found = _get(config, path)
    if found is not None:
        return found
    _set(config, path, value)
    return value


def _first_line(error: Exception) -> str:
    # The rest of a Zenoh error is its source file and a backtrace.
    return str(error).strip().partition("\n")[0].partition(" at ")[0][:300] or type(error).__name__
