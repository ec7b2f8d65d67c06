PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
INSTALL := $(VENV)/.installed

.PHONY: demo test coverage lint docs numbers native sanitize address thread bench instructions soak browser clients readme clean

NATIVE = $(BIN)/cmake -S tests/native -DPython_EXECUTABLE=$(abspath $(BIN)/python) -B
BUILD = $(BIN)/cmake --build
CHECK = $(BIN)/ctest --output-on-failure --test-dir
CXX_FILES = $(shell git ls-files "*.cpp" "*.hpp" "*.inc")
CORES ?= $(shell getconf _NPROCESSORS_ONLN)
SEED ?= 1
FUZZ ?= 45
CLIENTS ?= core rllib tianshou d3rlpy
WHEELS = build/clients/wheels
KERNEL_SOURCES = CMakeLists.txt $(wildcard solver/native/* solver/native/*/*) solver/common/gap_laws.py solver/common/operations.py solver/common/transition_laws.py solver/planar/formulation.py solver/spatial/arc.py solver/spatial/formulation.py solver/codegen.py

demo: $(INSTALL)  ## train PPO, evaluate it beside the classical controllers, write figures and videos to runs/demo
	$(BIN)/ccr-gym train --run runs/demo
	$(BIN)/ccr-gym evaluate --runs runs/demo --out runs/demo

test: $(INSTALL)
	$(BIN)/python -m pytest -n auto --dist worksteal $(PYTEST)

coverage: PYTEST = --cov --cov-report=term
coverage: test  ## the same, and which lines of the packages they run

lint: $(INSTALL)
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/clang-format --dry-run --Werror $(CXX_FILES)
	$(BIN)/mypy

docs: $(INSTALL)  ## the documentation, in build/docs; warnings are errors
	OMP_NUM_THREADS=1 $(BIN)/python -m sphinx -q -W --keep-going -b html docs build/docs

numbers: $(INSTALL)  ## numbers of README and docs, from the result files in docs/results
	$(BIN)/python -m benchmarks.pages $(NUMBERS)

native: $(INSTALL)  ## tests of the kernel in C++ (needs doctest: apt-get install doctest-dev)
	$(NATIVE) build/native
	$(BUILD) build/native --parallel $(CORES)
	$(CHECK) build/native

sanitize: address thread  ## the same under ASan and UBSan, FUZZ seconds of random scenes from a SEED on, and the batch under TSan

address: $(INSTALL)
	$(NATIVE) build/address -DCCR_SANITIZE=address,undefined
	$(BUILD) build/address --parallel $(CORES)
	$(CHECK) build/address
	build/address/fuzz $(SEED) $(FUZZ)

thread: $(INSTALL)
	$(NATIVE) build/thread -DCCR_SANITIZE=thread
	$(BUILD) build/thread --parallel $(CORES) --target batch_tests
	build/thread/batch_tests

bench: $(INSTALL)
	$(BIN)/ccr-gym bench

instructions: $(INSTALL)  ## count instructions of the kernel (needs valgrind)
	$(BIN)/python benchmarks/instructions.py

soak: $(INSTALL)
	OMP_NUM_THREADS=1 PYTHONPATH=tests $(BIN)/python -m soak --steps 3000000
	$(BIN)/python -m pytest -k fuzz --hypothesis-profile=default
	$(BIN)/python -m pytest -n auto --dist worksteal --long --soak 100000 --vector-steps 10000

browser: $(INSTALL)  ## ccr-gym play in a real browser (needs chromium: apt-get install chromium)
	$(BIN)/python -m pip install --quiet --constraint constraints.txt playwright
	$(BIN)/python -m pytest tests/browser -s

readme:  ## the README as printed, on a fresh clone of the last commit; README="--fast" or "--hours" for less or more of it
	$(PYTHON) tests/fresh_readme.py $(README)

$(INSTALL): pyproject.toml constraints.txt $(KERNEL_SOURCES)
	test -d $(VENV) || $(PYTHON) -m venv $(VENV)
	PIP_NO_COMPILE=1 $(BIN)/python -m pip install --quiet --constraint constraints.txt --editable '.[dev]'
	touch $@

clients: $(CLIENTS:%=build/clients/%/.installed)  ## what learns on these environments, in a virtual environment for each group of pins
	$(PYTHON) tests/clients/matrix.py $(CLIENTS)

build/clients/%/.installed: tests/clients/requirements-%.txt $(WHEELS)/.built
	test -d build/clients/$* || $(PYTHON) -m venv build/clients/$*
	build/clients/$*/bin/python -m pip uninstall --quiet --yes ccr-gym
	build/clients/$*/bin/python -m pip install --quiet --requirement $< $(if $(filter d3rlpy,$*),,"$$(echo $(WHEELS)/*.whl)[render]")
	touch $@

$(WHEELS)/.built: pyproject.toml $(KERNEL_SOURCES) $(wildcard solver/*.py solver/*/*.py ccr_gym/*.py ccr_gym/*/*.py)
	rm -rf $(WHEELS)
	$(PYTHON) -m pip wheel --quiet --no-deps --wheel-dir $(WHEELS) .
	touch $@

clean:
	rm -rf $(VENV) build dist runs
