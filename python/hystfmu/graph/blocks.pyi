# generated from the C tables by `make generate` - do not edit
"""Block classes made from the C tables."""

from collections.abc import Sequence
from typing import Any, ClassVar, Literal

from numpy.typing import ArrayLike

from hystfmu.base.arrays import Array
from hystfmu.core.library import BlockType
from hystfmu.graph.graph import Graph
from hystfmu.graph.node import Node

class Block:
    """A single block; calling it runs it over input rows from a fresh start."""

    type: ClassVar[BlockType]
    node: Node
    graph: Graph
    def __init__(self, **values: Any) -> None: ...
    def __call__(self, u: ArrayLike, h: float = 1.0) -> Array: ...

class AdaptiveInverse(Block):
    """Adaptive inverse of a Prandtl-Ishlinskii operator: learns its weights during operation."""

    def __init__(
        self,
        *,
        n: int = ...,
        delay: int = ...,
        w0: float = 1.0,
        r: float | Sequence[float] | Array = 0.1,
        w: float | Sequence[float] | Array = 0.1,
        u0: float = 0.0,
        f_n: float = 0.0,
        zeta: float = 0.7,
        f_h: float = 0.0,
        sd: float | Sequence[float] | Array = 0.05,
        start: float = 0.1,
        T: float = 3.0,
        sigma: float = 0.01,
        change: float = 0.04,
        pause: float = 0.2,
        box: float = 6.0,
        w0_min: float = 0.1,
        u_min: float = -1e300,
        u_max: float = 1e300,
    ) -> None: ...

class Amplifier(Block):
    """Piezo amplifier with limited voltage, current and bandwidth."""

    def __init__(
        self,
        *,
        u_min: float = -20.0,
        u_max: float = 130.0,
        i_max: float = 0.25,
        C: float = 1.8e-06,
        f_b: float = 10000.0,
    ) -> None: ...

class BacklashSum(Block):
    """Weighted sum of backlash (play) operators, plain states."""

    def __init__(
        self,
        *,
        n: int = ...,
        w0: float = 0.0,
        r: float | Sequence[float] | Array = 0.1,
        w: float | Sequence[float] | Array = 0.1,
        z0: float | Sequence[float] | Array = 0.0,
    ) -> None: ...

class BoucWen(Block):
    """Bouc-Wen operator."""

    def __init__(
        self,
        *,
        A: float = 1.0,
        beta: float = 0.5,
        gamma: float = 0.5,
        n: float = 1.0,
        alpha: float = 0.5,
        k: float = 1.0,
        z0: float = 0.0,
        u0: float = 0.0,
    ) -> None: ...

class BoucWenOscillator(Block):
    """Oscillator with a Bouc-Wen force: the hysteretic benchmark plant."""

    def __init__(
        self,
        *,
        m_L: float = 2.0,
        c_L: float = 10.0,
        k_L: float = 50000.0,
        alpha: float = 50000.0,
        beta: float = 1000.0,
        gamma: float = 0.8,
        delta: float = -1.1,
        nu: float = 1.0,
    ) -> None: ...

class BumplessTransfer(Block):
    """Bumpless transfer: the output changes from the present command to a new one without a jump."""

    def __init__(self, *, T: float = 1.0) -> None: ...

class ColemanHodgdon(Block):
    """Coleman-Hodgdon operator."""

    def __init__(
        self,
        *,
        alpha: float = 1.0,
        b: float = 1.0,
        k: float = 0.6,
        y0: float = 0.0,
        u0: float = 0.0,
    ) -> None: ...

class ConstraintFactor(Block):
    """Constraint-factor operator (Ma): odd polynomial branch."""

    def __init__(
        self,
        *,
        m: int = ...,
        depth: int = ...,
        a0: float = 0.0,
        a: float | Sequence[float] | Array = 1.0,
        d_max: float = 10.0,
        memory: Literal["dominant", "last"] = "dominant",
        x0: float = 0.0,
    ) -> None: ...

class ConstraintFactorInverse(Block):
    """Exact inverse of the constraint-factor operator."""

    def __init__(
        self,
        *,
        m: int = ...,
        depth: int = ...,
        a0: float = 0.0,
        a: float | Sequence[float] | Array = 1.0,
        d_max: float = 10.0,
        x0: float = 0.0,
    ) -> None: ...

class Creep(Block):
    """Creep: weighted sum of the input and its first-order lags."""

    def __init__(
        self,
        *,
        n: int = ...,
        w: float | Sequence[float] | Array = 1.0,
        T: float | Sequence[float] | Array = 1.0,
        w0: float = 0.0,
        start: Literal["rest", "steady"] = "rest",
    ) -> None: ...

class CreepInverse(Block):
    """Exact inverse of creep."""

    def __init__(
        self,
        *,
        n: int = ...,
        w: float | Sequence[float] | Array = 1.0,
        T: float | Sequence[float] | Array = 1.0,
        w0: float = 1.0,
        start: Literal["rest", "steady"] = "rest",
    ) -> None: ...

class DeadZones(Block):
    """Weighted sum of one-sided dead zones."""

    def __init__(
        self,
        *,
        n: int = ...,
        w0: float = 1.0,
        r: float | Sequence[float] | Array = 0.1,
        w: float | Sequence[float] | Array = 0.1,
    ) -> None: ...

class Delay(Block):
    """Delay by a whole number of steps."""

    def __init__(self, *, n: int = ..., y0: float = 0.0) -> None: ...

class Differentiator(Block):
    """Filtered derivative of a signal."""

    def __init__(self, *, tau: float = 0.0) -> None: ...

class Disturbance(Block):
    """Disturbance: step plus sine."""

    def __init__(
        self,
        *,
        step: float = 0.0,
        t_step: float = 0.0,
        amplitude: float = 1.0,
        frequency: float = 1.0,
        phase: float = 0.0,
    ) -> None: ...

class DisturbanceObserver(Block):
    """Disturbance observer: subtracts an estimated input disturbance from the command."""

    def __init__(
        self,
        *,
        n: int = ...,
        f_n: float = 1.0,
        zeta: float = 0.7,
        gain: float = 1.0,
        f_o: float = 0.5,
        u_min: float = -1e300,
        u_max: float = 1e300,
    ) -> None: ...

class Duhem(Block):
    """Duhem operator with slopes for rising and falling input."""

    def __init__(
        self,
        *,
        m: int = ...,
        q: int = ...,
        k: float = 0.5,
        a_rise: float | Sequence[float] | Array = 0.5,
        b_rise: float | Sequence[float] | Array = -0.5,
        c_rise: float | Sequence[float] | Array = -0.5,
        a_fall: float | Sequence[float] | Array = 0.5,
        b_fall: float | Sequence[float] | Array = 0.5,
        c_fall: float | Sequence[float] | Array = -0.5,
        w_max: float = 1e100,
        du_max: float = 0.02,
        w0: float = 0.0,
        u0: float = 0.0,
    ) -> None: ...

class DuhemOscillator(Block):
    """Oscillator with a Duhem force of any shape."""

    def __init__(
        self,
        *,
        n: int = ...,
        m_L: float = 2.0,
        c_L: float = 10.0,
        k_L: float = 50000.0,
        f: float | Sequence[float] | Array = 50000.0,
        z_max: float = 100.0,
    ) -> None: ...

class Feedforward(Block):
    """Feed-forward: inverse of a second-order plant."""

    def __init__(self, *, f_n: float = 500.0, zeta: float = 0.7, gain: float = 1.0) -> None: ...

class ImplicitInverse(Block):
    """Implicit inverse: the input at which a static model has the wanted output."""

    def __init__(self, *, lo: float = -1.0, hi: float = 1.0) -> None: ...

class InRange(Block):
    """Test whether all signals are within their limits."""

    def __init__(
        self,
        *,
        n: int = ...,
        lo: float | Sequence[float] | Array = -1.0,
        hi: float | Sequence[float] | Array = 1.0,
    ) -> None: ...

class IterativeLearning(Block):
    """Iterative learning control: corrections from the errors of earlier periods."""

    def __init__(
        self,
        *,
        n: int = ...,
        gain: float = 0.0,
        lead: int = 1,
        smooth: float = 0.0,
        u_min: float = -1e300,
        u_max: float = 1e300,
    ) -> None: ...

class JilesAtherton(Block):
    """Jiles-Atherton operator."""

    def __init__(
        self,
        *,
        steps: int = ...,
        Ms: float = 1.0,
        a: float = 0.3,
        k: float = 0.25,
        c: float = 0.1,
        alpha: float = 0.05,
        m0: float = 0.0,
        u0: float = 0.0,
    ) -> None: ...

class KrasnoselskiiPokrovskii(Block):
    """Krasnosel'skii-Pokrovskii operator: weighted kernels between two ramps."""

    def __init__(
        self,
        *,
        n: int = ...,
        depth: int = ...,
        lo: float = -1.0,
        hi: float = 1.0,
        w: float | Sequence[float] | Array = 0.1,
        offset: float = 0.0,
        u0: float = 0.0,
    ) -> None: ...

class LeadLag(Block):
    """Lead-lag controller with feed-forward and limits."""

    def __init__(
        self,
        *,
        n: int = ...,
        K: float = 0.0,
        T_z: float | Sequence[float] | Array = 1.0,
        T_p: float | Sequence[float] | Array = 0.1,
        u_min: float = -1e300,
        u_max: float = 1e300,
    ) -> None: ...

class Lugre(Block):
    """LuGre friction: bristles with a Stribeck curve."""

    def __init__(
        self,
        *,
        sigma_0: float = 10.0,
        sigma_1: float = 0.1,
        sigma_2: float = 0.1,
        d_c: float = 0.1,
        d_s: float = 0.15,
        v_s: float = 0.5,
        z0: float = 0.0,
    ) -> None: ...

class MaxwellSlipOscillator(Block):
    """Oscillator with Maxwell-slip friction."""

    def __init__(
        self,
        *,
        n: int = ...,
        m_L: float = 2.0,
        c_L: float = 10.0,
        k_L: float = 50000.0,
        k: float | Sequence[float] | Array = 10000.0,
        r: float | Sequence[float] | Array = 1e-05,
    ) -> None: ...

class Mlp(Block):
    """Multilayer perceptron: one hidden layer, linear outputs."""

    def __init__(
        self,
        *,
        n_in: int = ...,
        n_hidden: int = ...,
        n_out: int = ...,
        W1: float | Sequence[float] | Array = 1.0,
        b1: float | Sequence[float] | Array = 0.0,
        W2: float | Sequence[float] | Array = 1.0,
        b2: float | Sequence[float] | Array = 0.0,
        activation: Literal["sigmoid", "tanh", "relu"] = "sigmoid",
    ) -> None: ...

class Modes(Block):
    """Second-order modes in parallel, discretised exactly."""

    def __init__(
        self,
        *,
        n: int = ...,
        f_n: float | Sequence[float] | Array = 1.0,
        zeta: float | Sequence[float] | Array = 0.02,
        k: float | Sequence[float] | Array = 1.0,
    ) -> None: ...

class ModifiedBoucWen(Block):
    """Modified Bouc-Wen model of a magnetorheological damper."""

    def __init__(
        self,
        *,
        c_0: float = 0.1,
        c_1: float = 2.0,
        k_0: float = 0.2,
        k_1: float = 0.05,
        x_0: float = 0.0,
        alpha: float = 5.0,
        A: float = 1.0,
        beta: float = 4.0,
        gamma: float = 4.0,
        n: float = 2.0,
        z0: float = 0.0,
    ) -> None: ...

class NarxNetwork(Block):
    """NARX network: one hidden layer with lags of input and output."""

    def __init__(
        self,
        *,
        n_u: int = ...,
        n_y: int = ...,
        n_hidden: int = ...,
        a: float | Sequence[float] | Array = 0.1,
        W1: float | Sequence[float] | Array = 0.2,
        b1: float | Sequence[float] | Array = 0.0,
        W2: float | Sequence[float] | Array = 0.1,
        b2: float = 0.0,
        y0: float = 0.0,
    ) -> None: ...

class Noise(Block):
    """White Gaussian noise."""

    def __init__(self, *, sigma: float = 1.0, seed: int = 1) -> None: ...

class Pid(Block):
    """PID controller with feed-forward and anti-windup."""

    def __init__(
        self,
        *,
        Kp: float = 0.0,
        Ki: float = 0.0,
        Kd: float = 0.0,
        tau: float = 0.0,
        u_min: float = -1e300,
        u_max: float = 1e300,
    ) -> None: ...

class PlayBank(Block):
    """Bank of play (backlash) operators."""

    def __init__(
        self,
        *,
        n: int = ...,
        r: float | Sequence[float] | Array = 0.1,
        z0: float | Sequence[float] | Array = 0.0,
    ) -> None: ...

class PolynomialNarx(Block):
    """Polynomial of lagged inputs, auxiliary function and outputs (NFIR, NARX)."""

    def __init__(
        self,
        *,
        n_u: int = ...,
        n_f: int = ...,
        n_y: int = ...,
        q: int = ...,
        n_k: int = ...,
        theta: float | Sequence[float] | Array = 0.05,
        y0: float = 0.0,
    ) -> None: ...

class PrandtlIshlinskii(Block):
    """Prandtl-Ishlinskii operator: linear term plus weighted plays."""

    def __init__(
        self,
        *,
        n: int = ...,
        depth: int = ...,
        w0: float = 0.0,
        r: float | Sequence[float] | Array = 0.1,
        w: float | Sequence[float] | Array = 0.1,
        u0: float = 0.0,
    ) -> None: ...

class PrandtlIshlinskiiInverse(Block):
    """Exact inverse of the Prandtl-Ishlinskii operator."""

    def __init__(
        self,
        *,
        n: int = ...,
        depth: int = ...,
        w0: float = 1.0,
        r: float | Sequence[float] | Array = 0.1,
        w: float | Sequence[float] | Array = 0.1,
        u0: float = 0.0,
    ) -> None: ...

class Preisach(Block):
    """Preisach operator in Everett's form."""

    def __init__(
        self,
        *,
        n: int = ...,
        depth: int = ...,
        lo: float = -4.0,
        hi: float = 4.0,
        E: float | Sequence[float] | Array = 1.0,
        offset: float = 0.0,
        start: Literal["demagnetised", "low", "high"] = "demagnetised",
    ) -> None: ...

class Product(Block):
    """Product of signals, divided by a product of other signals."""

    def __init__(self, *, n: int = ..., m: int = ..., least: float = 0.001) -> None: ...

class Quantiser(Block):
    """Uniform quantiser of an ADC or DAC."""

    def __init__(self, *, q: float = 0.01, offset: float = 0.0) -> None: ...

class RecursiveLeastSquares(Block):
    """Recursive least squares with a dead zone: learns the weights of regressors during operation."""

    def __init__(
        self,
        *,
        n: int = ...,
        form: Literal["corrected", "printed", "plain"] = "corrected",
        theta0: float | Sequence[float] | Array = 0.0,
        eta: float = 100.0,
        mu: float = 0.999,
        r: float = 0.05,
        share: float = 1.0,
    ) -> None: ...

class Reference(Block):
    """Reference signal with derivatives and preview for a feed-forward."""

    def __init__(
        self,
        *,
        m: int = ...,
        shape: Literal["sine", "triangle", "decaying_sine", "multisine", "steps", "random_reversals"] = "sine",
        amplitude: float = 1.0,
        offset: float = 0.0,
        frequency: float = 1.0,
        phase: float = 0.0,
        turn: float = 0.0,
        decay: float = 0.1,
        lead: float = 0.0,
        f: float | Sequence[float] | Array = 1.0,
        a: float | Sequence[float] | Array = 0.1,
        ph: float | Sequence[float] | Array = 0.0,
        levels: float | Sequence[float] | Array = 1.0,
        T: float = 1.0,
        seed: int = 1,
    ) -> None: ...

class Repetitive(Block):
    """Repetitive control: corrects the reference by the errors of the last period."""

    def __init__(
        self,
        *,
        n: int = ...,
        n_q: int = ...,
        n_l: int = ...,
        q: float | Sequence[float] | Array = 0.0,
        l: float | Sequence[float] | Array = 0.0,
    ) -> None: ...

class Scaling(Block):
    """Limit, gain and offset of each signal."""

    def __init__(
        self,
        *,
        n: int = ...,
        gain: float | Sequence[float] | Array = 1.0,
        offset: float | Sequence[float] | Array = 0.0,
        lo: float | Sequence[float] | Array = -1e300,
        hi: float | Sequence[float] | Array = 1e300,
    ) -> None: ...

class SlidingMode(Block):
    """Sliding mode controller with feed-forward, integral action and anti-windup."""

    def __init__(
        self,
        *,
        lam: float = 100.0,
        eta: float = 0.0,
        rho: float = 0.0,
        epsilon: float = 0.0,
        switching: Literal["smooth", "saturation"] = "smooth",
        k_i: float = 0.0,
        tau: float = 0.0,
        u_min: float = -1e300,
        u_max: float = 1e300,
    ) -> None: ...

class Sum(Block):
    """Weighted sum of signals."""

    def __init__(self, *, n: int = ..., k: float | Sequence[float] | Array = 1.0, offset: float = 0.0) -> None: ...

class SuperTwisting(Block):
    """Super-twisting sliding mode controller with feed-forward and anti-windup."""

    def __init__(
        self,
        *,
        lam: float = 100.0,
        k_1: float = 0.0,
        k_2: float = 0.0,
        mu: float = 0.0,
        epsilon: float = 0.0,
        tau: float = 0.0,
        u_min: float = -1e300,
        u_max: float = 1e300,
    ) -> None: ...

class TransferFunction(Block):
    """Linear transfer function of any order, discretised exactly."""

    def __init__(
        self,
        *,
        na: int = ...,
        nb: int = ...,
        b: float | Sequence[float] | Array = 1.0,
        a: float | Sequence[float] | Array = 1.0,
        hold: Literal["zoh", "foh"] = "zoh",
        start: Literal["rest", "steady"] = "rest",
    ) -> None: ...

class ZhaoTan(Block):
    """Zhao-Tan hysteretic operator."""

    def __init__(
        self,
        *,
        depth: int = ...,
        memory: Literal["dominant", "last"] = "dominant",
        x0: float = 0.0,
    ) -> None: ...

class ZhaoTanInverse(Block):
    """Exact inverse of the Zhao-Tan operator."""

    def __init__(self, *, depth: int = ..., x0: float = 0.0) -> None: ...

class ZhaoTanInverseReconstructed(Block):
    """Inverse Zhao-Tan operator, reconstructed from the paper."""

    def __init__(self, *, depth: int = ..., x0: float = 0.0) -> None: ...
