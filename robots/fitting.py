"""A model made fit for its roles: a site at the tool centre point, and servos that grip as a hand does."""

from __future__ import annotations

import mujoco

from robosandbox.robots.gripper.contact_model import fit_grip
from robosandbox.robots.importers.imported import ImportedModel
from robosandbox.robots.sidecar import Sidecar

TCP_SITE = "robosandbox_tcp"


def fit_roles(imported: ImportedModel, sidecar: Sidecar) -> str:
    """Change a model to fit its roles, and return the name of its TCP site.

    What a gripper does is measured on a model after this, by whoever asks: its servos decide how far it closes.
    """
    tcp_site = _place_tcp(imported.spec, sidecar)
    if sidecar.fingers and imported.options is None:
        fit_grip(imported, sidecar.fingers, tcp_site)
    return tcp_site


def _place_tcp(spec: mujoco.MjSpec, sidecar: Sidecar) -> str:
    inject = sidecar.ee_site.inject
    if inject is None:
        return str(sidecar.ee_site.name)
    x, y, z, w = inject.quat_xyzw or (0.0, 0.0, 0.0, 1.0)
    spec.body(inject.attach_body).add_site(name=TCP_SITE, pos=inject.xyz, quat=[w, x, y, z], size=[0.005] * 3, group=4)
    return TCP_SITE
