"""What the benchmarks of a checkout compare with is there and steps."""

import sys

import matplotlib
import mujoco
from mujoco import mjx

model = mujoco.MjModel.from_xml_string("<mujoco><worldbody><body/></worldbody></mujoco>")
data = mujoco.MjData(model)
mujoco.mj_step(model, data)
if data.time <= 0 or mjx.put_model(model).nbody != 2:
    sys.exit(f"MuJoCo {mujoco.__version__} does not step, matplotlib {matplotlib.__version__}")
