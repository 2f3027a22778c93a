"""Names of the MuJoCo that robosuite 1.5.2 was written for, given to MuJoCo 3.17; robosuite's files are left as they are.

To be imported before an environment is made.
"""

from __future__ import annotations

from types import SimpleNamespace

import mujoco
import numpy as np
from numpy.typing import NDArray
from robosuite.controllers.parts import controller
from robosuite.utils.binding_utils import MjData, MjModel


def _full_inertia(model: mujoco.MjModel, full: NDArray[np.float64], data: mujoco.MjData) -> None:
    mujoco.mj_fullM(model, data, full)


# Names of types equal Python's integers and no longer NumPy's.
MjModel.jnt_type = property(lambda self: self._model.jnt_type.tolist())
# The inertia in its sparse form is no longer an argument of what makes it full: the state is.
MjData.qM = property(lambda self: self._data)
controller.mujoco = SimpleNamespace(mj_fullM=_full_inertia, mj_name2id=mujoco.mj_name2id, mjtObj=mujoco.mjtObj)
