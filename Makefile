# make run       set up, pour 1,000 spheres, print what came out
# make test      set up, check style and types, run the tests (eight minutes on two cores)
# make test-all  the same, then the slow tests (ten minutes more)
# make report    set up, write the report of the paper's studies from the results kept here
# make validate  set up, check the physics (two hours on two cores)
# make bench     set up, measure speed and accuracy (four hours, then a million spheres; bench-quick: 9 minutes)
# make tables    set up, print the measured tables of the documentation (hours)
# make programs  install OVITO, VTK, ASE and Playwright, too (1.1 GB): slow tests open in them what is exported, and pages
# make docs      build the documentation as a site, build/site, and check its links
# make setup     set up only: Python files and decks are used where they are, C++ is compiled again
# make wheel     set up, put the package with its compiled parts into dist: for machines without a compiler
# make clean     remove the environment, build, dist and out; results of hours stay (paper, benchmark, and studies of one's own)

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
# Folders that the environment uses where they are: a change in them needs no installation.
LINKED := workflow analysis inputs
# All else that ends up in the installed package: it is compiled again when any of it changes.
SOURCES := $(shell find src_fix -type f -not -path '*/__pycache__/*') \
           CMakeLists.txt pyproject.toml
# The environment's mpicxx and mpiexec come before any of the system's.
export PATH := $(abspath $(BIN)):$(PATH)
# Two processes; the tests of a file stay together, since they share the fixtures of its module.
PYTEST := pytest -n 2 --dist loadfile
# Some files take half of the time: their tests are shared out. What they print comes at the end.
VALIDATION := pytest -n 2 --dist worksteal -vv -rP --durations=0

.PHONY: run report test test-all style validate tables bench bench-quick docs programs setup wheel clean

run: setup
	lmp -in inputs/spheres.in -var out out
	inelastic look out

report: setup
	inelastic reproduce --stored-only --out paper

style: setup
	ruff check .
	ruff format --check .
	clang-format --dry-run -Werror --style=file $$(find src_fix tests/core tests/npz -name '*.h' -o -name '*.cpp')
	mypy -p lammps_inelastic.core -p lammps_inelastic.analysis -p lammps_inelastic.workflow -p tests

test: style
	$(PYTEST) -m "not slow and not validation"

test-all: test
	$(PYTEST) -rs -m "slow and not validation"

validate: setup
	$(VALIDATION) -m validation

tables: setup
	python -m tests.tables

bench: setup
	python -m tests.benchmark

bench-quick: setup
	python -m tests.benchmark --quick

programs: $(VENV)/other_programs

docs: $(VENV)/site_builder
	NO_MKDOCS_2_WARNING=1 mkdocs build --strict --quiet
	@echo 'The site is in build/site. To read it, with search: mkdocs serve'

setup: $(VENV)/installed

# What setup has compiled is not compiled again. An earlier wheel goes.
wheel: setup
	rm -f dist/lammps_inelastic-*.whl
	$(BIN)/python -m pip wheel --quiet --disable-pip-version-check --no-build-isolation --no-deps -w dist .
	@for file in dist/*.whl; do echo "Written: $$file"; done
	@echo 'Next, with the same Python and a C library no older than here: pip install the file'

# All that is needed to build, to run and to test, as pyproject.toml says.
REQUIREMENTS := import tomllib; file = tomllib.load(open("pyproject.toml", "rb")); \
  one = file["project"]; print(*file["build-system"]["requires"], *one["dependencies"], \
  *one["optional-dependencies"]["test"], sep="\n")

$(VENV)/requirements.txt: pyproject.toml
	@command -v $(PYTHON) >/dev/null && $(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' \
	  || { echo 'Python 3.11 or later is needed (make PYTHON=/path/to/python3.11)'; exit 1; }
	@$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null \
	  || { echo 'The venv module is missing: apt-get install python3-venv'; exit 1; }
	@$(PYTHON) -c 'import os, sysconfig as s, sys; sys.exit(not os.path.exists(s.get_path("include") + "/Python.h"))' \
	  || { echo 'The headers of Python are missing: apt-get install python3-dev'; exit 1; }
	@command -v c++ >/dev/null || { echo 'A C++ compiler is missing: apt-get install g++'; exit 1; }
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(BIN)/python -c '$(REQUIREMENTS)' > $@.new
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -r $@.new
	mv $@.new $@

# The site and the other programs need nothing that is compiled.
$(VENV)/site_builder: GROUP := docs
$(VENV)/other_programs: GROUP := programs
$(VENV)/site_builder $(VENV)/other_programs: $(VENV)/requirements.txt
	$(BIN)/python -c 'import tomllib; file = tomllib.load(open("pyproject.toml", "rb")); \
	  print(*file["project"]["optional-dependencies"]["$(GROUP)"], sep="\n")' > $@.new
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -r $@.new
	mv $@.new $@

# The compiled parts alone are built (in build/, where only what changed is compiled again) and
# installed; beside them the package gets links to the folders of this repository. An editable
# installation would not do: mypy finds no package whose folder has another name than the package.
$(VENV)/installed: $(VENV)/requirements.txt $(SOURCES)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-build-isolation --no-deps \
	  $(LINKED:%='--config-settings=wheel.exclude=lammps_inelastic/%/**') .
	package=$$($(BIN)/python -c 'import sysconfig; print(sysconfig.get_path("platlib"))')/lammps_inelastic \
	  && for folder in $(LINKED); do \
	    rm -rf "$$package/$$folder" && ln -s "$(CURDIR)/$$folder" "$$package/$$folder" || exit 1; \
	  done
	touch $@

clean:
	rm -rf $(VENV) build dist out
