"""The elementary functions of the C core against mpmath, on every optimisation level bit for bit, and without libm."""

import ctypes
import re
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import mpmath
import numpy as np
import pytest
from mpmath import mpf
from numpy.typing import NDArray

Array = NDArray[np.float64]

CORE = Path(__file__).parents[2] / "fmu_build" / "core"
UNARY = ["exp", "expm1", "log", "tanh", "sigmoid", "sin", "cos", "fabs", "sqrt", "floor"]
FLAGS = ["-std=c99", "-ffp-contract=off", "-Wall", "-Wextra", "-Wpedantic", "-Werror", f"-I{CORE.parent}"]
BUILDS = {
    "O2": ["-O2", "-fno-math-errno"],
    "O0": ["-O0", "-fno-math-errno"],
    "O3": ["-O3", "-march=native", "-fno-math-errno"],
    "plain": ["-O2"],  # with math errno the square root is the one by digits
    "freestanding": ["-O1", "-ffreestanding"],
    "one lane": ["-O2", "-fno-math-errno", "-DHYST_LANES=1"],
}
SOURCE = (
    '#include "core/elementary/elementary_lanes.h"\n'
    '#include "core/elementary/elementary_sine.h"\n'
    + "".join(
        f"void v_{name}(const double *x, const double *y, double *f, long n) {{\n"
        f"    (void)y;\n    for (long i = 0; i < n; i++) f[i] = hyst_{name}(x[i]);\n}}\n"
        for name in [*UNARY, "isfinite"]
    )
    + "void v_pow(const double *x, const double *y, double *f, long n) {\n"
    "    for (long i = 0; i < n; i++) f[i] = hyst_pow(x[i], y[i]);\n}\n"
    + "".join(  # y: what stands in the other lane
        f"void v_lanes_{name}(const double *x, const double *y, double *f, long n) {{\n"
        f"    for (long i = 0; i < n; i++) {{\n"
        f"        hyst_lanes a[2] = {{hyst_lanes_of(y[i], x[i]), hyst_lanes_of(x[i], y[i])}};\n"
        f"        hyst_lanes_{name}(a, 2);\n"
        f"        f[i] = HYST_LANE(a[1], 0);\n"
        f"        const double other = HYST_LANE(a[0], HYST_LANES - 1);\n"
        f"        if (HYST_LANES == 2 && hyst_to_bits(other) != hyst_to_bits(f[i])) f[i] = 7;\n"
        f"    }}\n}}\n"
        for name in ("sigmoid", "tanh")
    )
)
EXACT: dict[str, Callable[..., mpf]] = {
    "exp": mpmath.exp, "expm1": mpmath.expm1, "log": mpmath.log, "tanh": mpmath.tanh,
    "sigmoid": lambda x: 1 / (1 + mpmath.exp(-x)), "sin": mpmath.sin, "cos": mpmath.cos, "pow": mpmath.power,
}  # fmt: skip
# The bounds the comments of the header state, in ulp.
BOUNDS = {"exp": 0.75, "expm1": 1.1, "log": 0.51, "tanh": 1.6, "sigmoid": 1.5, "sin": 0.85, "cos": 0.85, "pow": 0.75}
INF, NAN = np.inf, np.nan


def evaluate(library: ctypes.CDLL, name: str, x: Array, y: Array | None = None) -> Array:
    """Apply one function of a built library elementwise."""
    arguments = np.ascontiguousarray(x, dtype=np.float64)
    seconds = np.ascontiguousarray(arguments if y is None else y, dtype=np.float64)
    result = np.empty_like(arguments)
    pointers = (ctypes.c_void_p(a.ctypes.data) for a in (arguments, seconds, result))
    getattr(library, f"v_{name}")(*pointers, ctypes.c_long(arguments.size))
    return result


@pytest.fixture(scope="module")
def paths(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Shared libraries of the header, one per set of compiler flags."""
    compiler = shutil.which("cc")
    if compiler is None:
        pytest.skip("no C compiler `cc` on the path")
    folder = tmp_path_factory.mktemp("elementary")
    (folder / "vectors.c").write_text(SOURCE)
    built = {}
    for build, flags in BUILDS.items():
        built[build] = folder / f"{build}.so"
        command = [compiler, *FLAGS, *flags, "-fPIC", "-shared", "-nostdlib", "vectors.c", "-o", str(built[build])]
        subprocess.run(command, cwd=folder, check=True, timeout=60)
    return built


@pytest.fixture(scope="module")
def libraries(paths: dict[str, Path]) -> dict[str, ctypes.CDLL]:
    return {build: ctypes.CDLL(str(path)) for build, path in paths.items()}


def spread(random: np.random.Generator, low: float, high: float, n: int = 500) -> Array:
    return random.uniform(low, high, n)


def decades(random: np.random.Generator, low: float, high: float, n: int = 500) -> Array:
    """Both signs, magnitudes from 10^low to 10^high evenly in the logarithm."""
    return random.choice([-1.0, 1.0], n) * 10.0 ** random.uniform(low, high, n)


def around(points: list[float] | Array) -> Array:
    """Each point and its neighbouring doubles on both sides."""
    p = np.asarray(points, dtype=np.float64)
    return np.concatenate([np.nextafter(p, -INF), p, np.nextafter(p, INF)])


def arguments(name: str) -> tuple[Array, Array | None]:
    """At least 3000 fixed arguments: wide ranges, the edges of the ranges, and the breakpoints of the method."""
    random = np.random.default_rng(20240229)
    table = np.log(2) / 128 * np.arange(-300, 301)  # the table changes rows at the odd multiples
    if name == "exp":
        parts = [spread(random, -745, 709.7, 1000), decades(random, -20, 1), spread(random, -745.1, -706)]
        parts += [spread(random, 706, 709.78), around(table), around([-707, 707, 709.782712893384, -745.1332191019411])]
    elif name == "expm1":
        parts = [spread(random, -1, 1), spread(random, -40, 709), decades(random, -300, 0), around(table)]
        parts += [spread(random, -0.03, 0.03), around([-40, 40, 2.0**-54])]
    elif name == "tanh":
        parts = [spread(random, -1, 1), spread(random, -21, 21), decades(random, -300, 0), around(table / 2)]
        parts += [around([2.0**-28, 20, np.log(2) / 2, np.log(4) / 2]), spread(random, 0.1, 0.8)]
    elif name == "sigmoid":
        parts = [spread(random, -1, 1), spread(random, -40, 40), decades(random, -20, 1), around(table)]
        parts += [spread(random, -744, -35), around([-36, 36, 40])]
    elif name == "log":
        parts = [np.abs(decades(random, -323, 308, 1500)), spread(random, 0.5, 2), 1 + decades(random, -15, -1.5)]
        parts += [around(np.exp(table)), around([2.0**-1022]), np.array([5e-324, np.finfo(float).max])]
    elif name in ("sin", "cos"):
        quarter_turns = np.round(spread(random, -636619, 636619)) * np.pi / 2
        parts = [spread(random, -10, 10), spread(random, -1e6, 1e6, 1000), decades(random, -300, 6)]
        parts += [around(quarter_turns), around([np.pi / 4, -np.pi / 4, 3 * np.pi / 4])]
    else:
        x = np.concatenate([np.abs(decades(random, -323, 308, 1000)), 1 + decades(random, -12, -1.1, 1000)])
        y = random.uniform(-1, 1, x.size) * 744 / np.abs(np.log(x))
        small = spread(random, 0, 4, 1000)
        whole = np.repeat([1.0, 2.0, 3.0, -1.0, 0.5], 40)
        bases = spread(random, 0, 50, whole.size)
        return np.concatenate([x, small, bases]), np.concatenate([y, spread(random, 0, 4, 1000), whole])
    return np.concatenate(parts), None


@pytest.mark.some(4)
@pytest.mark.parametrize("name", list(EXACT))
def test_error_stays_within_the_stated_bound(name: str, libraries: dict[str, ctypes.CDLL]) -> None:
    x, y = arguments(name)
    assert x.size >= 3000
    got = evaluate(libraries["O2"], name, x, y)
    worst, where = mpf(0), ""
    with mpmath.workprec(140):
        for i in range(0, x.size, 2):
            operands = [mpf(x[i])] if y is None else [mpf(x[i]), mpf(y[i])]
            exact = EXACT[name](*operands)
            nearest = float(exact)
            if not (np.isfinite(nearest) and np.isfinite(got[i])):
                assert got[i] == nearest, (operands, got[i], nearest)
                continue
            error = abs(mpf(got[i]) - exact) / mpf(np.spacing(abs(nearest)))
            if error > worst:
                worst, where = error, f"{operands}"
    assert worst <= BOUNDS[name], (float(worst), where)


def test_exactly_rounded_functions(libraries: dict[str, ctypes.CDLL]) -> None:
    random = np.random.default_rng(1)
    x = np.concatenate([np.abs(decades(random, -323, 308, 4000)), around(np.arange(1.0, 200.0) ** 2), [5e-324, 0.0]])
    wide = np.concatenate([decades(random, -3, 18, 3000), around(np.arange(-20.0, 21.0)), [0.0, -0.0, INF, -INF]])
    for build in ("O2", "plain"):
        np.testing.assert_array_equal(evaluate(libraries[build], "sqrt", x), np.sqrt(x))
        np.testing.assert_array_equal(evaluate(libraries[build], "floor", wide), np.floor(wide))
        np.testing.assert_array_equal(evaluate(libraries[build], "fabs", wide), np.abs(wide))
    finite = evaluate(libraries["O2"], "isfinite", np.array([0.0, -1e308, 5e-324, INF, -INF, NAN]))
    np.testing.assert_array_equal(finite != 0, [True, True, True, False, False, False])


SPECIAL = {  # C99 Annex F
    "exp": [(0.0, 1.0), (-0.0, 1.0), (INF, INF), (-INF, 0.0), (710.0, INF), (-746.0, 0.0), (1e308, INF)],
    "expm1": [(0.0, 0.0), (-0.0, -0.0), (INF, INF), (-INF, -1.0), (5e-324, 5e-324), (-50.0, -1.0)],
    "log": [(1.0, 0.0), (0.0, -INF), (-0.0, -INF), (INF, INF), (-1.0, NAN), (-INF, NAN)],
    "tanh": [(0.0, 0.0), (-0.0, -0.0), (INF, 1.0), (-INF, -1.0), (-5e-324, -5e-324), (25.0, 1.0)],
    "sigmoid": [(0.0, 0.5), (-0.0, 0.5), (INF, 1.0), (-INF, 0.0), (800.0, 1.0), (-800.0, 0.0)],
    "sin": [(0.0, 0.0), (-0.0, -0.0), (INF, NAN), (-INF, NAN), (5e-324, 5e-324)],
    "cos": [(0.0, 1.0), (-0.0, 1.0), (INF, NAN), (-INF, NAN)],
    "sqrt": [(0.0, 0.0), (-0.0, -0.0), (INF, INF), (-1.0, NAN), (-INF, NAN)],
    "floor": [(-0.0, -0.0), (-0.5, -1.0), (0.5, 0.0)],
    "fabs": [(-0.0, 0.0), (-INF, INF)],
}


@pytest.mark.parametrize("name", list(SPECIAL))
def test_special_values(name: str, libraries: dict[str, ctypes.CDLL]) -> None:
    x, expected = np.array([*SPECIAL[name], (NAN, NAN)]).T
    got = evaluate(libraries["O2"], name, x)
    np.testing.assert_array_equal(got, expected)
    number = ~np.isnan(expected)
    np.testing.assert_array_equal(np.signbit(got[number]), np.signbit(expected[number]))


def test_special_powers(libraries: dict[str, ctypes.CDLL]) -> None:
    base = [0.0, 0.5, 1.0, 2.0, 1 - 2.0**-53, 1 + 2.0**-52, INF, NAN]
    power = [0.0, -0.0, 1.0, -1.0, 3.0, 1e300, -1e300, INF, -INF, 5e-324, NAN]
    x, y = (grid.ravel() for grid in np.meshgrid(base, power))
    with np.errstate(all="ignore"):
        np.testing.assert_array_equal(evaluate(libraries["O2"], "pow", x, y), np.power(x, y))
    assert np.isnan(evaluate(libraries["O2"], "pow", np.array([-1.0, -INF]), np.array([2.0, 2.0]))).all()


def test_sine_and_cosine_of_large_arguments(libraries: dict[str, ctypes.CDLL]) -> None:
    random = np.random.default_rng(3)
    large, huge = decades(random, 6, 18), decades(random, 18, 308)
    for name in ("sin", "cos"):
        got = evaluate(libraries["O2"], name, large)
        with mpmath.workprec(140):
            assert all(abs(mpf(g) - EXACT[name](mpf(x))) < mpf(2) ** -52 for g, x in zip(got, large, strict=True))
        assert np.abs(evaluate(libraries["O2"], name, huge)).max() <= 1


def test_every_build_gives_the_same_bits(libraries: dict[str, ctypes.CDLL]) -> None:
    edges = np.array([0.0, -0.0, INF, -INF, NAN, -NAN, 5e-324, -5e-324, -1.0, 1e308, -1e308, 1e22])
    for name in [*UNARY, "pow"]:
        x, y = arguments(name if name in EXACT else "log")
        x = np.concatenate([x, edges])
        y = None if y is None else np.concatenate([y, np.roll(edges, 3)])
        bits = {build: evaluate(library, name, x, y).view(np.uint64) for build, library in libraries.items()}
        for build in BUILDS:
            np.testing.assert_array_equal(bits[build], bits["O2"], err_msg=f"{name} built as {build}")


@pytest.mark.parametrize("name", ["sigmoid", "tanh"])
def test_a_lane_has_the_bits_of_the_number_alone(name: str, libraries: dict[str, ctypes.CDLL]) -> None:
    x, _ = arguments(name)
    x = np.concatenate([x, [0.0, -0.0, INF, -INF, NAN, 1e300, -1e300, 1e-300]])
    beside = np.random.default_rng(3).permutation(x)
    for library in libraries.values():
        alone, lanes = evaluate(library, name, x), evaluate(library, f"lanes_{name}", x, beside)
        assert np.array_equal(alone.view(np.uint64), lanes.view(np.uint64))


def test_no_build_needs_an_outside_symbol(paths: dict[str, Path]) -> None:
    nm = shutil.which("nm")
    if nm is None:
        pytest.skip("no `nm` on the path")
    for build, path in paths.items():
        listing = subprocess.run([nm, "-D", "-u", str(path)], capture_output=True, text=True, check=True, timeout=20)
        assert listing.stdout.strip() == "", f"{build} needs {listing.stdout}"


def test_tables_are_what_their_comments_define() -> None:
    header = (CORE / "elementary" / "elementary.h").read_text()
    numbers = [
        [int(word, 0) for word in re.findall(r"0x[0-9a-f]+|\d+", body)]
        for body in re.findall(r"_table\[128\] = \{(.*?)\};", header, re.DOTALL)
    ]
    powers, indices = numbers
    rows = []
    with mpmath.workprec(200):
        for i in range(64):
            exact = mpf(2) ** (mpf(i) / 64)
            tail = np.float64(exact / mpf(float(exact)) - 1)
            rows += [int(tail.view(np.uint64)), int(np.float64(exact).view(np.uint64)) - (i << 46)]
    assert powers == rows
    assert indices == [round(64 * np.log2(1 + (b + 0.5) / 128)) for b in range(128)]
