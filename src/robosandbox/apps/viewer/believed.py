"""A world that nobody simulates, drawn as it is believed to be: the planning model, its robot where the encoders say it is."""

from __future__ import annotations

from robosandbox.apps.viewer.source import Frame
from robosandbox.motion.carried import SinceLook
from robosandbox.motion.planning_scene import PlanningScenes
from robosandbox.motion.twin import standing
from robosandbox.sim.world import World
from robosandbox.types import Observation, ObservedScene, Scene, frozen_array


class BelievedWorld:
    """Makes frames of what perception believes; the model is another one where other objects or sizes are believed.

    Args:
        scene: Names robot and table, and says of objects what no camera shows.
        seen: What perception saw first.

    Attributes:
        world: The model of the last frame.
    """

    def __init__(self, scene: Scene, seen: ObservedScene) -> None:
        self._scenes = PlanningScenes.exact(scene)
        self._since_look = SinceLook()
        self.world: World = self._scenes.world_of(seen)

    def frame(self, seen: ObservedScene, state: Observation) -> Frame:
        """Return what is believed as a frame of `world`.

        Args:
            seen: What perception saw last.
            state: How the robot stands now.
        """
        self.world = self._scenes.world_of(seen)
        qpos = frozen_array(standing(self.world, self._since_look.objects(seen, state.arms), state.arms))
        return Frame(model=self.world.model, seen=state, hands=seen.hands, qpos=qpos)
