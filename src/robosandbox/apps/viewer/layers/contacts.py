"""Contact forces, as arrows from where bodies touch."""

from __future__ import annotations

import time

import mujoco
import numpy as np

from robosandbox.apps.viewer.layers.layer import Layer
from robosandbox.apps.viewer.source import Frame

_SECONDS = 0.1  # Seconds between drawings. Chosen.
_METRES_PER_NEWTON = 0.01  # Metres of arrow per newton. Chosen: a cube's weight shows as 5 mm.
_LEAST_NEWTON = 0.05  # Newtons from which a force is drawn. Chosen.
_LONGEST = 0.25  # Metres of the longest arrow. Chosen.
_COLOUR = (200, 40, 160)  # Channels of 255 levels. Chosen: no bundled object has it.


class ContactForces(Layer):
    """Draws the force of each contact, a centimetre per newton."""

    title = "Contact forces"
    hint = "A centimetre of arrow per newton, 25 cm at most; of a world in this process only"
    shown = False
    needs_forces = True
    _sent = 0.0

    def draw(self, frame: Frame, data: mujoco.MjData) -> None:
        """Draw the contacts of a frame."""
        if frame.state is None or time.monotonic() - self._sent < _SECONDS:
            return
        self._sent = time.monotonic()
        model = self.blueprint.model
        arrows = []
        force = np.zeros(6)
        for index in range(data.ncon):
            mujoco.mj_contactForce(model, data, index, force)
            contact = data.contact[index]
            # The frame's rows are the contact's axes, the normal first, from the first geom to the second.
            pushed = contact.frame.reshape(3, 3).T @ force[:3]
            size = float(np.linalg.norm(pushed))
            if size > _LEAST_NEWTON:
                length = min(size * _METRES_PER_NEWTON, _LONGEST)
                arrows.append([contact.pos.copy(), contact.pos + length / size * pushed])
        if not arrows:
            self.clear()
            return
        handle = self.scene.add_arrows(
            self.node("forces"), np.array(arrows), _COLOUR, shaft_radius=0.0016, head_radius=0.0045, head_length=0.01
        )
        self.keep("forces", handle)
