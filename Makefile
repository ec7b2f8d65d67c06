PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
INSTALL := $(VENV)/.installed

.PHONY: demo test bench instructions soak lint clean

demo: $(INSTALL)  ## train PPO, evaluate it beside the classical controllers, write figures and videos to runs/demo
	$(BIN)/ccr-gym train --run runs/demo
	$(BIN)/ccr-gym evaluate --runs runs/demo --out runs/demo

test: $(INSTALL)
	$(BIN)/python -m pytest -n auto --dist worksteal

lint: $(INSTALL)
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy

bench: $(INSTALL)
	$(BIN)/ccr-gym bench

instructions: $(INSTALL)  ## count instructions of the kernel (needs valgrind)
	$(BIN)/python benchmarks/instructions.py

soak: $(INSTALL)
	OMP_NUM_THREADS=1 PYTHONPATH=tests $(BIN)/python -m soak --steps 3000000

$(INSTALL): pyproject.toml CMakeLists.txt constraints.txt $(wildcard solver/native/*) solver/formulation.py solver/spatial/formulation.py solver/codegen.py
	test -d $(VENV) || $(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --constraint constraints.txt --editable '.[dev]'
	touch $@

clean:
	rm -rf $(VENV) build dist runs
