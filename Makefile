# `make demo` and `make test` are the two commands of the README; everything happens inside this directory.
PYTHON ?= python3
BIN := .venv/bin
export TMPDIR := $(CURDIR)/build/tmp
export PIP_DISABLE_PIP_VERSION_CHECK := 1
SOURCES := pyproject.toml constraints.txt CMakeLists.txt $(shell find fmu_build python -name '*.[ch]' -o -name '*.py') LICENSE
PIP := $(BIN)/python -m pip install --quiet --constraint constraints.txt

.PHONY: platforms demo test torture check generate bench modelica clean

demo: build/installed
	$(BIN)/hystfmu demo -o demo

test: build/installed-dev
	$(BIN)/python -m pytest -q

# the long runs: a million fuzzed sequences, every compiler and processor at hand, threads, coverage, hostile files
torture: build/installed-dev
	$(PIP) ziglang wasmtime zopfli
	$(BIN)/python -m pytest -q -m torture

# formatting, lint, types, stale generated files
check: build/installed-dev
	$(BIN)/ruff format --check python tests
	$(BIN)/ruff check python tests
	$(BIN)/clang-format --dry-run --Werror $(shell find fmu_build tests -name '*.[ch]')
	$(BIN)/mypy --cache-dir build/mypy
	$(BIN)/python tests/generated.py

generate: build/installed-dev
	$(BIN)/python tests/generated.py --write

# every class of the Modelica library: loads, simulates, error against the C core, numpy and the committed reference
modelica: build/installed-dev
	$(BIN)/python tests/modelica/report.py

# the FMU binary for Windows, Linux and macOS, x86-64 and arm64, on this machine; an install then carries them
platforms: build/tools
	$(PIP) ziglang zopfli
	$(BIN)/python fmu_build/platforms/build.py fmu_build build/platforms
	rm -f build/installed build/installed-dev

bench: build/installed-dev
	$(BIN)/python tests/benchmarks/run.py

.venv/pyvenv.cfg:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { echo "HystFMU needs Python 3.11 or newer; try: make PYTHON=python3.11 $(MAKECMDGOALS)"; exit 1; }
	mkdir -p $(TMPDIR)
	$(PYTHON) -m venv .venv

# what the build itself needs, then the package; pip keeps its downloads in its own cache
build/tools: .venv/pyvenv.cfg constraints.txt
	mkdir -p $(TMPDIR)
	$(PIP) scikit-build-core cmake ninja fmpy
	touch $@

build/installed: build/tools $(SOURCES)
	$(PIP) --no-build-isolation '.[train]'
	touch $@

build/installed-dev: build/tools $(SOURCES)
	$(PIP) --no-build-isolation '.[train,control,study,dev]'
	touch $@ build/installed

clean:
	rm -rf build demo .venv
