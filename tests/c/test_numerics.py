"""Roots, matrix exponentials, polynomials, double-doubles and random numbers of the core, compiled alone.

Against mpmath, scipy, zlib and numbers counted by hand; roots also by how often they evaluate their function.
"""

import ctypes as C
import math
import shutil
import subprocess
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import mpmath
import numpy as np
import pytest
from scipy.linalg import expm

CORE = Path(__file__).parents[2] / "fmu_build" / "core"
RESIDUAL = C.CFUNCTYPE(C.c_double, C.c_void_p, C.c_double)
SOURCE = Path(__file__).with_name("numerics.c")


@pytest.fixture(scope="module")
def lib(tmp_path_factory: pytest.TempPathFactory) -> Any:
    compiler = shutil.which("cc")
    if compiler is None:
        pytest.skip("no C compiler `cc` on the path")
    folder = tmp_path_factory.mktemp("numerics")
    flags = ["-std=c99", "-O1", "-ffp-contract=off", "-fPIC", "-shared", f"-I{CORE.parent}"]
    subprocess.run([compiler, *flags, str(SOURCE), "-o", "numerics.so"], cwd=folder, check=True, timeout=60)
    found = C.CDLL(str(folder / "numerics.so"))
    d, u64, p = C.c_double, C.c_uint64, C.POINTER(C.c_double)
    for name, result, arguments in [
        ("between", d, [RESIDUAL, d, d, d, d, d, p]), ("root", d, [RESIDUAL, *[d] * 6, p]),
        ("polynomial", d, [p, d]), ("fit", None, [d, RESIDUAL, p]), ("clamp", d, [d] * 3),
        ("clamp_tangent", d, [d] * 4), ("crc", C.c_uint32, [C.c_char_p, C.c_long]), ("bits", u64, [u64, u64]),
        ("uniform", d, [u64, u64]), ("normal", d, [u64, u64]), ("dd", None, [C.c_int, p, p, p]),
        ("exponential", C.c_int, [C.c_int, p, p]),
    ]:  # fmt: skip
        function = getattr(found, name)
        function.restype, function.argtypes = result, arguments
    return found


def array(*values: float) -> Any:
    return (C.c_double * len(values))(*values)


# ---- roots ---------------------------------------------------------------------------------------------------------
class Counted:
    """A function for C that counts its calls."""

    def __init__(self, f: Callable[[float], float]) -> None:
        self.at: list[float] = []

        def call(_: Any, u: float) -> float:
            self.at.append(u)
            return float(f(u))

        self.f, self.c = f, RESIDUAL(call)


SMOOTH: list[tuple[Callable[[float], float], float, float, float, int]] = [
    (lambda x: x**3 - 2 * x - 5, 2.0, 3.0, 2.0945514815423265, 8),
    (lambda x: 1 - 1 / x**2, 0.5, 4.01, 1.0, 14),
    (lambda x: (x - 3) ** 3, 0.0, 5.0, 3.0, 60),
    (lambda x: math.exp(x) - 2, -4.0, 4.0 / 3, math.log(2), 10),
    (lambda x: math.sin(x), 2.0, 4.5, math.pi, 8),
    (lambda x: x - 0.3, -1.0, 1.0, 0.3, 3),
    (lambda x: math.copysign(1, x - 0.7), -1.0, 1.0, 0.7, 70),
    (lambda x: 1e300 * x if x > 0 else x, -1.0, 1.0, 0.0, 120),
]


@pytest.mark.parametrize("k", range(len(SMOOTH)))
def test_a_bracketed_root_is_found_with_few_evaluations(lib: Any, k: int) -> None:
    """Chandrupatla 1997: inverse quadratic interpolation needs 4 to 10 for smooth functions, bisection about 60."""
    f, a, b, root, most = SMOOTH[k]
    for flip in (1, -1):
        for lo, hi in ((a, b), (b, a)):
            c, off = Counted(lambda u, s=flip: s * f(u)), C.c_double()
            found = lib.between(c.c, lo, flip * f(lo), hi, flip * f(hi), 0.0, C.byref(off))
            assert found == pytest.approx(root, rel=1e-5 if k == 2 else 4e-15, abs=1e-15)
            assert off.value == flip * f(found)
            assert len(c.at) <= most, c.at
            assert all(a <= u <= b for u in c.at)


def test_a_tolerance_ends_the_search(lib: Any) -> None:
    f = SMOOTH[3][0]
    counts = []
    for fine in (0.0, 1e-9, 1e-6, 1e-2):
        c, off = Counted(f), C.c_double()
        found = lib.between(c.c, -4.0, f(-4.0), 4.0, f(4.0), fine, C.byref(off))
        assert abs(found - math.log(2)) <= 2 * fine + 1e-15
        counts.append(len(c.at))
    assert counts == sorted(counts, reverse=True)
    assert counts[0] > counts[3]


def test_outputs_without_number_are_bisected(lib: Any) -> None:
    c, off = Counted(lambda x: math.inf if x > 0.25 else -math.inf), C.c_double()
    assert lib.between(c.c, -1.0, -math.inf, 1.0, math.inf, 0.0, C.byref(off)) == pytest.approx(0.25, abs=1e-15)
    assert len(c.at) < 70


def search(
    lib: Any, f: Callable[[float], float], lo: float, hi: float, before: float, last: float
) -> tuple[float, float, int]:
    c, off = Counted(f), C.c_double()
    found = lib.root(c.c, lo, hi, before, f(before), last, f(last), C.byref(off))
    assert all(lo <= u <= hi for u in c.at)
    return found, off.value, len(c.at)


@pytest.mark.parametrize("wanted", [0.31, 0.305, 0.3, 0.29, -0.2, 0.9])
def test_a_small_step_of_a_smooth_output_costs_few_evaluations(lib: Any, wanted: float) -> None:
    """The secant through the last two roots: 2 to 4 evaluations for a small step."""

    def f(u: float) -> float:
        return u + 0.2 * math.sin(3 * u) - (wanted + 0.2 * math.sin(3 * wanted))

    found, off, n = search(lib, f, -1.0, 1.0, 0.295, 0.3)
    assert found == pytest.approx(wanted, abs=1e-15)
    assert abs(off) < 1e-15
    assert n <= (4 if abs(wanted - 0.3) < 0.02 else 9)


@pytest.mark.parametrize(("wanted", "root"), [(0.5, 0.5), (-0.75, -0.75), (2.0, 1.0), (-3.0, -1.0)])
def test_without_a_root_the_nearer_bound_is_the_result(lib: Any, wanted: float, root: float) -> None:
    found, off, n = search(lib, lambda u: u - wanted, -1.0, 1.0, 0.0, 0.0)
    assert found == pytest.approx(root, abs=1e-15)
    assert n <= 2 + 2 * 11, "one search of 11 rings"
    assert off == pytest.approx(root - wanted, abs=1e-15)


def test_of_two_bounds_as_near_the_upper_one_is_taken_if_the_output_is_too_low(lib: Any) -> None:
    assert search(lib, lambda u: -1.0, -1.0, 1.0, 0.0, 0.25)[0] == 1.0
    assert search(lib, lambda u: 1.0, -1.0, 1.0, 0.0, 0.25)[0] == -1.0


def test_an_extremum_that_comes_closer_than_both_bounds(lib: Any) -> None:
    """-(u - 0.2)^2 - 0.1 never reaches 0: the search closes in on its top, up to the smallest ring."""
    found, off, n = search(lib, lambda u: -((u - 0.2) ** 2) - 0.1, -1.0, 1.0, -0.6, -0.5)
    assert n <= 2 + 8 * 2 * 11, "eight searches at most"
    assert found == pytest.approx(0.2, abs=2.0 / 1024)
    assert off == pytest.approx(-0.1, abs=1e-5)


def test_among_several_roots_the_nearest_is_found(lib: Any) -> None:
    for last, root in [(0.45, 0.5), (-0.45, -0.5), (0.55, 0.5), (0.05, 0.0)]:
        found = search(lib, lambda u: math.sin(2 * math.pi * u), -1.0, 1.0, last, last)[0]
        assert found == pytest.approx(root, abs=1e-14)


# ---- matrices ------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("scale", [0.0, 1e-12, 0.1, 1.0, 30.0])
@pytest.mark.parametrize("n", [1, 2, 3, 5])
def test_the_exponential_of_a_matrix(lib: Any, n: int, scale: float) -> None:
    rng = np.random.default_rng(n)
    M = scale * rng.normal(size=(n, n))
    M[0, -1] = 0.0
    E = array(*[0.0] * (2 * n * n))
    assert lib.exponential(n, array(*M.ravel()), E) == 1
    with mpmath.workdps(40):
        want = mpmath.expm(mpmath.matrix(M.tolist()))
        worst = max(abs(want[i, j]) for i in range(n) for j in range(n))
        for i in range(n):
            for j in range(n):
                got = mpmath.mpf(E[2 * (i * n + j)]) + mpmath.mpf(E[2 * (i * n + j) + 1])
                assert abs(got - want[i, j]) <= 1e-25 * worst
    assert np.array(E)[::2].reshape(n, n) == pytest.approx(expm(M), rel=1e-9, abs=1e-9 * float(worst))


@pytest.mark.parametrize("bad", [math.nan, math.inf, 1e308])
def test_an_exponential_that_is_not_finite(lib: Any, bad: float) -> None:
    for place in range(4):
        M = [0.0] * 4
        M[place] = bad
        if place in (1, 2) and bad == 1e308:
            continue  # e^M = I + M
        assert lib.exponential(2, array(*M), array(*[0.0] * 8)) == 0


# ---- polynomials ---------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("half", [0.5, 2.0])
def test_a_smooth_function_as_a_polynomial(lib: Any, half: float) -> None:
    c = array(*[7.0] * 24)
    for f in (math.exp, math.cos, lambda x: 1 / (2 + x), lambda x: 3.0, lambda x: x**5 - x):
        lib.fit(half, RESIDUAL(lambda _, x, f=f: f(x)), c)
        for x in np.linspace(-1, 1, 21):
            assert lib.polynomial(c, x) == pytest.approx(f(half * (1 + x)), rel=1e-10, abs=1e-10)
    lib.fit(1.0, RESIDUAL(lambda _, x: (x - 1) ** 3), c)
    assert list(c) == pytest.approx([0, 0, 0, 1, *[0] * 20], abs=1e-6)


def test_a_polynomial_has_all_its_powers(lib: Any) -> None:
    rng = np.random.default_rng(3)
    c = rng.normal(size=24)
    for x in (0.0, 1.0, -1.0, 0.7, -0.9):
        assert lib.polynomial(array(*c), x) == pytest.approx(np.polynomial.polynomial.polyval(x, c), rel=1e-13)


# ---- numbers -------------------------------------------------------------------------------------------------------
def test_limits_and_their_tangents(lib: Any) -> None:
    for u, want, up, down in [(-2, -1, 0, 0), (-1, -1, 3, 0), (0.5, 0.5, 3, -3), (2, 2, 0, -3), (3, 2, 0, 0)]:
        assert lib.clamp(u, -1.0, 2.0) == want
        assert (lib.clamp_tangent(u, -1.0, 2.0, 3.0), lib.clamp_tangent(u, -1.0, 2.0, -3.0)) == (up, down)


@pytest.mark.parametrize("text", [b"", b"123456789", bytes(range(256))])
def test_checksums_are_those_of_zip(lib: Any, text: bytes) -> None:
    assert lib.crc(text, len(text)) == zlib.crc32(text)


def test_random_numbers_are_those_of_splitmix64(lib: Any) -> None:
    """The first numbers of seed 1234567 as its authors' Java class prints them."""
    printed = [6457827717110365317, 3203168211198807973, 9817491932198370423, 4593380528125082431, 16408922859458223821]
    assert [lib.bits(1234567, k) for k in range(5)] == printed
    assert [lib.uniform(1234567, k) for k in range(5)] == [(b >> 11) / 2**53 for b in printed]
    for k in range(3):
        u, v = (printed[2 * k + j] >> 11 for j in (0, 1)) if k < 2 else (lib.bits(1234567, j) >> 11 for j in (4, 5))
        want = math.sqrt(-2 * math.log(1 - u / 2**53)) * math.cos(2 * math.pi * v / 2**53)
        assert lib.normal(1234567, k) == pytest.approx(want, rel=1e-13)


def test_double_doubles_have_twice_the_digits(lib: Any) -> None:
    rng = np.random.default_rng(5)
    with mpmath.workdps(60):
        for _ in range(200):
            a, b = rng.normal(size=2) * 10.0 ** rng.integers(-3, 4, 2)
            x, y = (a, a * 1e-17 * rng.uniform(-1, 1)), (b, b * 1e-17 * rng.uniform(-1, 1))
            exact = [mpmath.mpf(x[0]) + x[1], mpmath.mpf(y[0]) + y[1]]
            size = abs(exact[0]) + abs(exact[1])
            for what, want, room in [
                (0, exact[0] + exact[1], size), (1, exact[0] * exact[1], abs(exact[0] * exact[1])),
                (2, exact[0] / mpmath.mpf(y[0]), abs(exact[0] / exact[1])),
            ]:  # fmt: skip
                r = array(0.0, 0.0)
                lib.dd(what, array(*x), array(*y), r)
                assert abs(mpmath.mpf(r[0]) + r[1] - want) <= 3e-31 * room
                assert abs(r[1]) <= math.ulp(r[0])
