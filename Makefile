# make run      set up, pour 1,000 spheres, print what came out
# make test     set up, check style and types, run the tests
# make report   set up, write the report of the paper's studies from the results kept here
# make validate set up, check the physics (minutes)
# make bench    set up, measure speed and accuracy (an hour and more; bench-quick: 15 minutes)
# make tables   set up, print the measured tables of the documentation (an hour)
# make clean    remove what these made

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
# All that ends up in the installed package: it is installed anew when any of it changes.
SOURCES := $(shell find src_fix inputs workflow analysis -type f -not -path '*/__pycache__/*') \
           CMakeLists.txt pyproject.toml README.md LICENSE
# The environment's mpicxx and mpiexec come before any of the system's.
export PATH := $(abspath $(BIN)):$(PATH)

.PHONY: run report test validate tables bench bench-quick setup clean

run: setup
	lmp -in inputs/spheres.in -var out out
	inelastic look out

report: setup
	inelastic reproduce --stored-only --out paper

test: setup
	ruff check .
	ruff format --check .
	mypy -p lammps_inelastic.analysis -p lammps_inelastic.workflow
	pytest -m "not validation"

validate: setup
	pytest -m validation -s --durations=0

tables: setup
	python -m tests.tables

bench: setup
	python -m tests.benchmark

bench-quick: setup
	python -m tests.benchmark --quick

setup: $(VENV)/installed

$(VENV)/installed: $(SOURCES)
	@command -v $(PYTHON) >/dev/null && $(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' \
	  || { echo 'Python 3.11 or later is needed (make PYTHON=/path/to/python3.11)'; exit 1; }
	@$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null \
	  || { echo 'The venv module is missing: apt-get install python3-venv'; exit 1; }
	@$(PYTHON) -c 'import os, sysconfig as s, sys; sys.exit(not os.path.exists(s.get_path("include") + "/Python.h"))' \
	  || { echo 'The headers of Python are missing: apt-get install python3-dev'; exit 1; }
	@command -v c++ >/dev/null || { echo 'A C++ compiler is missing: apt-get install g++'; exit 1; }
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check '.[test]'
	touch $@

clean:
	rm -rf $(VENV) build out
