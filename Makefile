PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
INSTALL := $(VENV)/.installed

.PHONY: demo test coverage lint native sanitize address thread bench instructions soak clean

NATIVE = $(BIN)/cmake -S tests/native -DPython_EXECUTABLE=$(abspath $(BIN)/python) -B
BUILD = $(BIN)/cmake --build
CHECK = $(BIN)/ctest --output-on-failure --test-dir
CXX_FILES = $(shell git ls-files "*.cpp" "*.hpp" "*.inc")
CORES ?= $(shell getconf _NPROCESSORS_ONLN)
SEED ?= 1
FUZZ ?= 45

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

$(INSTALL): pyproject.toml CMakeLists.txt constraints.txt $(wildcard solver/native/* solver/native/*/*) solver/common/gap_laws.py solver/planar/formulation.py solver/spatial/arc.py solver/spatial/formulation.py solver/codegen.py
	test -d $(VENV) || $(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --constraint constraints.txt --editable '.[dev]'
	touch $@

clean:
	rm -rf $(VENV) build dist runs
