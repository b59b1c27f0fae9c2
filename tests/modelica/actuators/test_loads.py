"""What is joined rigidly to an actuator: two masses are one, and the start is that of the actuator."""

import bench
import numpy as np
import pytest

FED = f"""{bench.FEED}
  Feed feed;
  HystFMU.Plants.Fixed wall;
"""
JOINED = """
  feed.u = 50 + 40*sin(600*time);
  connect(feed.p, stack.pin_p);
  connect(feed.n, stack.pin_n);
  connect(wall.flange, stack.flange_a);
  connect(stack.flange_b, load.flange);
"""


@pytest.mark.stress
def test_a_load_on_an_actuator_with_a_mass_moves_as_one() -> None:
    """The actuator has .02 kg and the load .1 kg, or the load has both; each starts at 0, where nothing is applied."""

    def loaded(stack: str, load: str) -> tuple[str, str]:
        parts = f"  HystFMU.Actuators.Stack stack({stack});\n  HystFMU.Plants.SpringMassLoad load({load});\n"
        return FED + parts, JOINED

    v = bench.beside(
        {"apart": loaded("m = 0.02", "m = 0.1"), "whole": loaded("withMass = false", "m = 0.12, fixedStart = true")},
        stop=0.01,
    )
    apart, whole = (v[name]["load.s"] for name in ("apart", "whole"))
    assert np.ptp(whole) > 1e-5
    assert np.abs(apart - whole).max() <= 1e-6 * np.ptp(whole)
