# `make demo` and `make test` are the two commands of the README; everything happens inside this directory.
PYTHON ?= python3
WORKERS ?= 2
BIN := .venv/bin
export TMPDIR := $(CURDIR)/build/tmp
# the tests start hundreds of Python processes: none of them is to compile the package anew
unexport PYTHONDONTWRITEBYTECODE
# caches of the compilers and libraries that the tests use stay inside; pip keeps its own
export PIP_CACHE_DIR ?= $(or $(XDG_CACHE_HOME),$(HOME)/.cache)/pip
export XDG_CACHE_HOME := $(CURDIR)/build/cache
export PIP_DISABLE_PIP_VERSION_CHECK := 1
PIP := $(BIN)/python -m pip install --quiet --no-compile --constraint constraints.txt
# pip compiles ten thousand modules in one process; some packages have files for other versions of Python; left out is
# more than half of the text, which is compiled where it is imported at last
RARE := /(tests?|testing|sympy|networkx|sqlalchemy|mypyc?|pip|setuptools|lexers|async_api|torch/distributed|_inductor|_dynamo|_functorch|_vendor|_export|onnx|fontTools|gui)/
COMPILE := $(BIN)/python -m compileall -qq -j 0 -x '$(RARE)' .venv/lib || true
# without --no-build-isolation pip would build in a fresh environment; `make` compiles the core itself, below
EDITABLE := $(PIP) --no-build-isolation --config-settings wheel.cmake=false --config-settings editable.mode=inplace --editable
PYTEST := $(BIN)/python -m pytest -q
SPREAD := -n $(WORKERS) --dist worksteal

.PHONY: demo test contract stress mutants dev core check check-types check-files lines generate core-page modelica modelica-strict openmodelica platforms bench choice devices intervals docs wheel release use lower importers papers clean

demo: build/installed core
	$(BIN)/hystfmu demo -o demo

# some cases of each grid, drawn anew (tests/conftest.py); four minutes on two cores
test: dev
	$(PYTEST) $(SPREAD)

# what the author of a block waits for: the contract of every block, its vectors, its rows in generated texts
contract: dev
	$(PYTEST) $(SPREAD) --no-header --tb=short tests/contract
	$(BIN)/python tests/generated.py

# long runs: a million fuzzed sequences, every compiler and processor at hand, threads, coverage, mutated files, and every
# case of the tests of which `make test` draws some; two hours
stress: dev
	$(PIP) wasmtime ziglang zopfli
	$(PYTEST) -m stress

# small faults in eleven rooms (tests/mutation/sample.py): which does no test find?  An hour, and as much at first
# to see which tests run which lines; an interrupted run goes on
SEED ?= 2
mutants: dev
	$(PIP) coverage
	$(BIN)/python tests/mutation/run.py --seed $(SEED)

# an editable installation: an edit of Python needs nothing, an edit of C one run of ninja
dev: build/installed-dev core

core: build/dev/build.ninja
	@$(BIN)/cmake --build build/dev --target install/strip -- --quiet

# what there is to read: files and lines by room, without comments and docstrings; ROOT=path counts another checkout
lines: build/tools
	@$(BIN)/python tests/lines.py $(ROOT)

# formatting, lint (of the Modelica library too), types, stale generated files; `make -j 2 check` uses two processes
check: check-types check-files

check-types: dev
	$(BIN)/mypy --cache-dir build/mypy

check-files: dev
	$(BIN)/ruff format --check fmu_build python tests scenarios modelica
	$(BIN)/ruff check fmu_build python tests scenarios modelica
	$(BIN)/clang-format --dry-run --Werror $(shell find fmu_build tests -name '*.[ch]')
	$(BIN)/python tests/generated.py
	$(BIN)/python fmu_build/platforms/page.py fmu_build python/hystfmu/report/core_page.txt --check
	$(BIN)/python tests/modelica/lint/rules.py -q

# the site of tutorials, explanations and reference, without network: build/docs/html/index.html
docs: dev
	$(PIP) sphinx myst-parser furo
	$(BIN)/python python/docs/build.py build/docs

generate: dev core-page
	$(BIN)/python tests/generated.py --write

# the core for pages, which the package holds as text; nothing is built while the text belongs to the C sources
core-page: dev
	$(PIP) ziglang zopfli
	$(BIN)/python fmu_build/platforms/page.py fmu_build python/hystfmu/report/core_page.txt

# every class of the Modelica library: loads, simulates, error against the C core and the committed reference, which
# HYSTFMU_RECORD=1 writes anew
modelica: dev
	$(PYTEST) -rP -m "stress or not stress" tests/modelica/test_library.py tests/modelica/test_validation.py tests/modelica/export

# what OpenModelica and Dymola refuse or mark in a class, and the compiler of the tests does not: each rule by its section
# of the language specification
modelica-strict: dev
	$(BIN)/python tests/modelica/lint/rules.py

# the FMU binary for Windows, Linux and macOS, x86-64 and arm64, on this machine; exports and wheels then carry them
platforms: build/tools
	$(PIP) ziglang zopfli
	$(BIN)/python fmu_build/platforms/build.py fmu_build build/platforms

# library, exports and examples in OpenModelica ($HYSTFMU_OMC, or omc on the path), against the same oracles; skipped
# where there is none
openmodelica: dev
	$(PYTEST) -m "openmodelica or not stress" tests/modelica/test_openmodelica.py

bench: dev
	$(BIN)/python tests/benchmarks/run.py

# the choice of the kind of model against all kinds and the fitted true structure, ninety minutes on two cores; an
# interrupted run goes on
choice: dev
	$(BIN)/python tests/benchmarks/choice_grid.py --jobs 2 --work build/choice.jsonl -o python/docs/choice.md

# 50 devices drawn anew, four records each: does what `hystfmu start` approves hold on the device itself?  Two hours; an
# interrupted run goes on from build/devices.jsonl, which belongs to one draw and one state of the code
devices: dev
	$(BIN)/python tests/benchmarks/devices.py --jobs $(WORKERS) --work build/devices.jsonl

# 200 devices drawn anew: does the 95 % interval of a fit hold on new signals?  Ten minutes of two cores; resumable
intervals: dev
	$(BIN)/python tests/benchmarks/intervals.py --jobs $(WORKERS) --work build/intervals.jsonl

# the tables of the four papers, about ten minutes on two cores; python/docs/papers.md follows from them
papers: dev
	mkdir -p build/papers
	printf '%s\n' shen_ma_2017 yu_alici_2005_smc zhao_tan_2008 ipmc_bfbnn | \
	  xargs -P 2 -I{} sh -c '$(BIN)/hystfmu reproduce {} --json > build/papers/{}.json'
	cat build/papers/*.json | $(BIN)/python tests/papers_table.py
	$(BIN)/python tests/generated.py --write

# every kind of model and every shipped loop in importers that are not ours; writes python/docs/importers.md
importers: dev
	$(BIN)/python tests/fmu/importers/matrix.py

# a wheel in dist/, and one use of it in an environment of its own, outside the repository
wheel: build/tools
	rm -rf dist
	$(BIN)/python -m pip wheel --quiet --no-build-isolation --no-deps --wheel-dir dist .
	$(PYTHON) tests/release/use.py dist build/wheel

# in dist/: the wheels of all platforms from this machine, the sdist, the list of parts, checksums; their tests
release: dev platforms
	$(PIP) twine 'readme-renderer[md]'
	$(BIN)/python fmu_build/platforms/cores.py fmu_build build/cores
	rm -rf dist
	$(BIN)/python fmu_build/platforms/release.py build/platforms build/cores dist
	$(BIN)/python -m twine check --strict dist/*.whl dist/*.gz
	$(PYTEST) -m stress tests/release
	$(PYTHON) tests/release/use.py dist build/wheel
	cat dist/SHA256SUMS

# one use of the wheel of this machine in dist/, in an environment of its own, without a compiler on the path
use:
	$(PYTHON) tests/release/use.py dist build/wheel

# face, reader of measured files, start and scenarios on the lowest versions that pyproject.toml allows, then on the
# newest, each in an environment of its own; ten minutes
lower:
	mkdir -p $(TMPDIR)
	$(PYTHON) tests/release/lower.py build/lower

.venv/pyvenv.cfg:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { echo "HystFMU needs Python 3.11 or newer; try: make PYTHON=python3.11 $(MAKECMDGOALS)"; exit 1; }
	mkdir -p $(TMPDIR)
	$(PYTHON) -m venv .venv

# what the build itself needs, then the package; pip keeps its downloads in its own cache
build/tools: .venv/pyvenv.cfg constraints.txt
	mkdir -p $(TMPDIR)
	$(PIP) scikit-build-core cmake ninja fmpy
	touch $@

build/installed: build/tools pyproject.toml
	$(EDITABLE) .
	$(COMPILE)
	touch $@

build/installed-dev: build/tools pyproject.toml
	$(EDITABLE) '.[train,control,study,dev]'
	$(COMPILE)
	touch $@ build/installed

# libraries, sources and licence are installed beside the Python files, where git ignores them
build/dev/build.ninja: build/tools
	$(BIN)/cmake -S . -B build/dev -G Ninja --log-level=WARNING -DCMAKE_BUILD_TYPE=Release -DCMAKE_INSTALL_PREFIX=$(CURDIR)/python \
		-DCMAKE_INSTALL_MESSAGE=NEVER -DCMAKE_MAKE_PROGRAM=$(CURDIR)/$(BIN)/ninja -DPython_EXECUTABLE=$(CURDIR)/$(BIN)/python

clean:
	rm -rf build demo dist .venv python/hystfmu/_platforms
	rm -f python/hystfmu/_core.* python/hystfmu/_fmu.* python/hystfmu/_sources.c python/hystfmu/LICENSE
