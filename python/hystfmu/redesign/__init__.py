"""Design of controllers for the loop of a scenario. Each function returns a new scenario with the designed controller.

>>> import hystfmu as hy
>>> made = hy.redesign.repetitive(hy.Scenario.load("mine/loop"))  # doctest: +SKIP
>>> made.scenario.save("mine/repetitive")  # doctest: +SKIP
"""

from hystfmu.redesign.controller import Controller, controller
from hystfmu.redesign.repetitive import Repetitive, repetitive

__all__ = ["Controller", "Repetitive", "controller", "repetitive"]
