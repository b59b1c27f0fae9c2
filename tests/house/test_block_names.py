"""Names of blocks stand in Python only where a method needs that block; lists of blocks come from the C tables."""

import ast
import functools
from collections.abc import Iterator
from pathlib import Path

import hystfmu
from hystfmu.core.library import block_types

PACKAGE = Path(hystfmu.__file__).parent
EVERY = "*"
MODEL = "kind of model of that name"

# file or folder -> name of a block -> the method and why it needs this name; EVERY: a folder that builds graphs
ALLOWED: dict[str, dict[str, str]] = {
    "identify/methods": {EVERY: "build(): a kind of model names the blocks of its graph"},
    "identify/graphs.py": {"scaling": "scaled_input(): the first block of the graphs of kinds"},
    "identify/kinds.py": {EVERY: "Kind: the keys of the kinds of model"},
    "identify/estimate/template.py": {EVERY: "build(): the chain of an operator and dynamics"},
    "model/guards.py": {"transfer_function": "_fast_poles(): the block that has poles"},
    "identify/estimate/dynamics.py": {
        "transfer_function": "nodes(): G0 with the rest of the delay",
        "delay": "nodes(): the whole samples of the delay",
        "modes": "told: the field of what a fit found",
    },
    "identify/evidence/__init__.py": {
        "modes": "from_dict(): the field of what a record shows",
    },
    "face/page.py": {"modes": "evidence_section(): the name of a line of the diagram"},
    "identify/features/plays.py": {"play_bank": "plays(): columns of a regression, the dead band"},
    "identify/features/bent_chain.py": {EVERY: "chain(): the blocks of the structure"},
    "identify/features/bell_density.py": {"preisach": "node(): the block of the density and of its derivatives"},
    "identify/features/smooth_density.py": {"preisach": "node(): the block of the density and of its columns"},
    "identify/network/readout.py": {
        "scaling": "fit_readout(): limits and output scaling",
        "mlp": "fit_readout(): the network",
        "sum": "fit_readout(): the linear readout",
    },
    "identify/estimate/free.py": {"sum": "KEYS: what the elements of a free parameter make together"},
    "identify/estimate/graph_fit.py": {"sum": "around(): what a block alone stands before"},
    "inverse/adaptive.py": {
        "adaptive_inverse": "adaptive_inverse(): the block that it makes",
        **dict.fromkeys(("prandtl_ishlinskii", "scaling"), "_chain(): operator and scalings that it may consist of"),
        "delay": "OPTIONS: the size of this name",
    },
    "inverse/dynamic.py": {
        **dict.fromkeys(("delay", "scaling", "transfer_function"), "split(): linear blocks at the end of a chain"),
        "polynomial_narx": "dynamic_inverse(): weights of the last samples, which start at the first one",
    },
    "inverse/exact.py": {
        "prandtl_ishlinskii": "_INVERT: asks for a linear term and positive slopes",
        "dead_zones": "_INVERT: the inverse has other knots and slopes",
        "scaling": "_INVERT: the inverse has the reciprocal gain; _refuse_zero(): limits of covariates in a factor",
        **dict.fromkeys(("sum", "product"), "inverted_beside(): solved for the input that the chain drives"),
    },
    "inverse/ports.py": {"scaling": "line(): gain and offset of scalings in a row"},
    "inverse/learned.py": {
        **dict.fromkeys(("scaling", "play_bank", "zhao_tan_inverse"), "_corrected(): what the network reads"),
        "prandtl_ishlinskii": MODEL,
    },
    "inverse/implicit.py": {
        "implicit_inverse": "implicit_inverse(): the block around the model",
        "creep": "known_states(): the block whose lags are known",
        **dict.fromkeys(("sum", "scaling"), "_separated(): a step of creep, and lags that start at 0"),
    },
    "model/coverage.py": {
        "scaling": "_limiters(): the block that limits the inputs of a network",
        "in_range": "with_in_range(): the block that compares the input with its range",
    },
    "model/from_torch.py": {"mlp": "torch_graph(): the block of two linear layers"},
    "design/delays.py": {
        "delay": "cut(): delays become states",
        "scaling": "cut(): gains of 1 at the ends of a delay",
        **dict.fromkeys(("polynomial_narx", "sum"), "unfolded(): weights of past samples as delays and a sum"),
    },
    "design/linear.py": {
        **dict.fromkeys(
            ("delay", "pid", "lead_lag", "sliding_mode", "super_twisting", "repetitive"), "_SAMPLED: its state space"
        ),
        "iterative_learning": "LIFTED: has no state space",
        "transfer_function": "to_control(): the block is a transfer function already",
    },
    "design/repetitive.py": {
        "iterative_learning": "LAWS: its memory has no state space",
        "repetitive": "LAWS: its memory has no state space",
        "sum": "cut_memories(): corrections and errors",
    },
    "design/feedforward.py": {"transfer_function": "transfer_function(): the modes of a plant as one block"},
    "design/structures.py": {EVERY: "Structure.graph(): a controller names the blocks of its graph"},
    "design/sector.py": {"scaling": "without_dynamics(): a gain in the place of dynamics"},
    "data/synthetic.py": {"bouc_wen_oscillator": "oscillator(): the plant of the benchmark"},
    "scenario/deploy.py": {
        **dict.fromkeys(("delay", "quantiser"), "LATE: computing time and converters"),
        **dict.fromkeys(("noise", "disturbance"), "NOISE: sources that a sensor or a plant reads"),
        "amplifier": "acts_on_plant(): the block of this hardware",
        "reference": "_lead(): the source that looks ahead",
        "bumpless_transfer": "_with_handover(): the block that it inserts",
        "scaling": "_before_limits(): the block that limits",
    },
    "scenario/outcome/metrics.py": dict.fromkeys(
        ("delay", "quantiser", "sum"), "PASSED_ON: the output has the unit of measure of the inputs"
    ),
    "start/page.py": {"reference": "reference_table(): head of a column"},
    "start/requirements.py": dict.fromkeys(("reference", "amplifier"), "Requirements: names of what is asked"),
    "start/loop.py": {EVERY: "loop_scenario(): a scenario names its units and their blocks"},
    "start/run.py": {"scaling": "drawn(): the gain of a model without second-order dynamics"},
    "start/device.py": {
        "transfer_function": "at_rest(): the block of the dynamics",
        "delay": "plant_model(): the command that comes late",
        "creep": "unsuited(): the inverse knows its lags",
        "scaling": "at_rest(), plant_model(): gains in the place of dynamics, and behind the device",
        "sum": "plant_model(): what the model misses",
    },
    "demo/__init__.py": dict.fromkeys(("noise", "pid"), "loop(): units of the scenario")
    | dict.fromkeys(("prandtl_ishlinskii", "bouc_wen"), MODEL),
    "face/table.py": {"reference": "the reference signal of a new scenario"},
    "fmu/write/reference.py": {"reference": "name of an experiment, not of a block"},
    "modelica/actuator": dict.fromkeys(
        (
            "bouc_wen",
            "creep",
            "dead_zones",
            "delay",
            "duhem",
            "jiles_atherton",
            "krasnoselskii_pokrovskii",
            "mlp",
            "play_bank",
            "prandtl_ishlinskii",
            "preisach",
            "product",
            "scaling",
            "sum",
            "transfer_function",
        ),
        "a class of the slot of an actuator stands for these blocks together",
    ),
    "modelica/realisation.py": dict.fromkeys(
        ("scaling", "sum"), "rate_of(): gains through which the rates of ports reach an operator"
    ),
    "modelica/wiring.py": dict.fromkeys(
        ("sum", "product"), "inlined_before_samples(): the blocks that one compiler reads too early"
    ),
    "modelica/classes.py": {
        **dict.fromkeys(
            ("delay", "iterative_learning", "narx_network", "polynomial_narx", "repetitive"), "COUNTED: lags in samples"
        ),
    },
    "redesign/__init__.py": {"repetitive": "a function of this name, not a block"},
    "redesign/controller.py": {"pid": "controller(): a gain of 1 in the place of the controllers"},
    "redesign/insert.py": {
        "repetitive": "the block that is added",
        **dict.fromkeys(("in_range", "delay", "transfer_function"), "_within(): whether commands kept their limits"),
        "sum": "with_repetitive(): adds its corrections to the command",
    },
    "redesign/corners.py": {"noise": "aim(): noise of the sensor", "reference": "the block whose signal repeats"},
    "scenario/loop/plant.py": {
        "delay": "plant_side(): its steps count",
        "quantiser": "for_small_signals(): a gain for signals of many levels",
        "scaling": "a gain in the place of levels, of dynamics, of nothing; its offset is constant",
        "sum": "as_gain(): a gain in the place of a hysteresis; its offset is constant",
    },
    "scenario/loop/table.py": {"delay": "_delayed(): a further delay"},
    "scenario/loop/opening.py": {
        "scaling": "_break(): what units read behind a broken signal",
        "sliding_mode": "its gain depends on the amplitude",
        "super_twisting": "its gain depends on the amplitude",
    },
    "scenario/report/loops.py": {"delay": "delay_budget(): its samples count"},
    "scenario/system/case.py": {
        "delay": "sizes(): the block whose size may be set",
        "scaling": "delayed(): a connection in the place of no delay",
    },
    "scenario/system/events.py": {
        "disturbance": "its steps are located as events",
        "reference": "its discontinuities and kinks are located as events",
    },
}


def literals(tree: ast.Module) -> Iterator[str]:
    """String literals of a module without its docstrings."""
    documented = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
    docstrings = {
        id(n.body[0].value)
        for n in ast.walk(tree)
        if isinstance(n, documented) and n.body and isinstance(n.body[0], ast.Expr)
    }
    for n in ast.walk(tree):
        if isinstance(n, ast.Constant) and isinstance(n.value, str) and id(n) not in docstrings:
            yield n.value


@functools.cache
def found() -> dict[str, set[str]]:
    """Names of blocks in every file of the package, by its path."""
    names = set(block_types())
    files = {path.relative_to(PACKAGE).as_posix(): path for path in PACKAGE.rglob("*.py")}
    return {file: names & set(literals(ast.parse(path.read_text()))) for file, path in files.items()}


def allowed(file: str) -> dict[str, str]:
    """Names allowed in a file, by the file itself or by its folder."""
    return {**ALLOWED.get(file.rpartition("/")[0], {}), **ALLOWED.get(file, {})}


def test_a_block_name_in_python_has_a_reason():
    for file, names in found().items():
        extra = set() if EVERY in allowed(file) else names - set(allowed(file))
        assert not extra, f"python/hystfmu/{file}: derive {sorted(extra)} from the C tables, or give the reason here"


def test_no_reason_has_outlived_its_name():
    seen = found()
    for place, reasons in ALLOWED.items():
        here = set().union(*(names for file, names in seen.items() if file == place or file.startswith(f"{place}/")))
        assert here, f"{place} names no block"
        unused = set(reasons) - here - {EVERY}
        assert not unused, f"{place} does not name {sorted(unused)}: remove it here"


def test_a_name_in_code_is_found_and_one_in_a_docstring_is_not():
    tree = ast.parse('"""pid"""\ndef f():\n    """sum"""\n    return ["delay", f"mlp{1}"]\n')
    assert set(literals(tree)) & set(block_types()) == {"delay", "mlp"}
