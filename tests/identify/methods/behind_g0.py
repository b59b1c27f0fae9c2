"""Known dynamics G0(s) behind a static part: options, scaled inputs, the linear part by its definition."""

import numpy as np

from hystfmu.identify.estimate.dynamics import Dynamics

H = 1e-3
G = Dynamics(60.0, 0.4, 2.3 * H)
PI = {"N": 4, "w0_min": 0.0, "u0": None, "hold": "foh", "delay_max": 10.0, "zeta_max": 5.0}
TRAIN = slice(30, 400)


def scaled(u, rows):
    return (2 * u - u[rows].max() - u[rows].min()) / np.ptp(u[rows])


def projected(data, columns, g, rows=TRAIN):
    a = np.column_stack([np.ones(len(data.u)), g.filter(columns, H, "foh")])
    c = np.linalg.lstsq(a[rows], data.y[rows], rcond=None)[0]
    return (a @ c - data.y)[rows], a @ c
