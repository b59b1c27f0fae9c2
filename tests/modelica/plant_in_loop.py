"""The plant simulated from Modelica, stepwise, under a controller that is a Python unit: `plant_in_loop.py OUT.npz`.

rumoca 0.10.2 takes no inputs and no start values of discrete variables.  So the commands are parameters, and each
step simulates the plant from time 0 up to the end of that step under the commands given so far.
"""

import sys

import library
import numpy as np
import rumoca
import test_loops

ROWS = 61
STEP = 1e-4
COMMANDS = [f"c_{k}" for k in range(ROWS)]
PLANT = f"""
model Loop
  {"".join(f"parameter Real {c} = 0; " for c in COMMANDS)}
  HystFMU.Sources.Steps command(m = {ROWS}, levels = {{{", ".join(COMMANDS)}}}, T = {STEP!r});
  HystFMU.Plants.BacklashSumDynamics plant(Ts = {STEP!r});
equation
  connect(command.r, plant.u);
end Loop;
"""  # fmt: skip


class Plant:
    """The calls of a unit that test_loops.closed_loop makes."""

    def __init__(self) -> None:
        self.model = rumoca.Session(roots=[str(library.ROOT)]).loads(PLANT, model="Loop")
        self.commands: list[float] = []
        self.y = self.u = 0.0

    def initialize(self, t: float, u: float) -> None:
        self.u = u

    def set(self, name: str, value: float) -> None:
        self.u = value

    def get(self, name: str) -> float:
        return self.y

    def do_step(self, t: float, h: float) -> None:
        self.commands.append(self.u)
        config = rumoca.SimConfig(solver="rk-like", rtol=1e-10, atol=1e-10, max_wall_seconds=900.0)
        given = dict(zip(COMMANDS, self.commands, strict=False))
        result = self.model.simulate(t=(0.0, t + h), dt=h, config=config, params=given)
        self.y = float(np.asarray(result["plant.y"])[-1])


if __name__ == "__main__":
    rest = test_loops.controller_side(*test_loops.scenario_parts("sliding_mode"), test_loops.SLIDING_MODE)
    np.savez(sys.argv[1], rows=test_loops.closed_loop(Plant(), rest, ROWS, STEP))
