# make run   makes the environment and plays recorded ship motion through the node (about 90 s after the install)
# make check  tests that start no process, and the linter: after an edit (a minute and a half, kernels compiled)
# make test   makes the environment and runs what a user needs to trust an installation
# make test-rest  the other tests;  make test-view  those of one folder of test/;  make lint  runs linter and type checks
# make coverage  runs all tests (half as long again) and lists files above the physics below 80 %
# make install-check  installs as docs/install.md says (wheel, stand-in for a ROS from its distribution) and makes the site
# make bench  run time against error beside other codes;  make validate  repeats the experiments (both into runs/)
# make soak  what the clock judges: tests, then the real node under load, faults and neighbours (two hours, idle machine)
# make stress  stability N1 to N28, bags and recordings I and S at full size (half an hour or more), into runs/
# make nightly  stress, validate and bench one after the other, the longest tests, run times beside AGAINST
# make wheel  a wheel that brings compiled kernels for processors with x86-64-v3, into dist/ (minutes the first time)
# make docs  the pages of docs/ and the Python API as a site, build/docs/index.html; a broken link is an error
SHELL := bash
.SHELLFLAGS := -eu -o pipefail -c
.DELETE_ON_ERROR:
.DEFAULT_GOAL := help
# each of the tests' processes would compile every module anew, 5 s of processor time where uv installed
unexport PYTHONDONTWRITEBYTECODE
.PHONY: help run check test test-rest install-check coverage lint bench validate stress soak nightly wheel docs clean

VENV ?= .venv
BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip install -qq --disable-pip-version-check
PACKAGING := setup.py setup.cfg package.xml cable_sim_ros/requirements.txt
SECONDS_OF_TOW ?= 60
PYTEST_ARGS ?=
# make nightly compares run times with this commit: that of the release before this one
AGAINST ?= $(shell sed -n 's/^| [0-9.]* | [0-9-]* | \([0-9a-f]\{8\}\) .*/\1/p' docs/releases.md | sed -n 2p)
# a worker more than cores, as many of the rest wait for processes of their own
MORE = $(shell n=$$(nproc); echo $$((n < 4 ? n + 1 : n)))
# a file of tests stays on one worker: its starts are shared; xdist would put files of few tests last
PYTEST = $(BIN)/python -m pytest -n auto --maxprocesses 4 --dist loadfile --no-loadscope-reorder

help:
	@sed -n 's/^# //p' Makefile

run: $(VENV)/.run
	$(BIN)/cable-sim live nbp1406 --scene full_scale --duration $(SECONDS_OF_TOW)

check: $(VENV)/.test
	$(PYTEST) -m check $(PYTEST_ARGS)
	$(MAKE) lint

test: $(VENV)/.test
	$(PYTEST) -m "check or trust" $(PYTEST_ARGS)

test-rest: $(VENV)/.rest
	$(PYTEST) -n $(MORE) -m rest $(PYTEST_ARGS)

test-%: $(VENV)/.rest
	$(PYTEST) test/$* $(PYTEST_ARGS)

# of what is installed a test imports a tenth
install-check: export PIP_COMPILE = 0
install-check: $(VENV)/.test
	$(BIN)/python -m pytest -n 2 --dist loadfile -m install test/install $(PYTEST_ARGS)

# not in make test: on Python 3.11 tracing takes 40 % of the suite's time; from 3.12 on the interpreter itself counts lines
coverage: $(VENV)/.rest
	$(BIN)/coverage erase
	@core=$$($(BIN)/python -c 'import sys; print("sysmon" if sys.version_info >= (3, 12) else "ctrace")'); \
	COVERAGE_CORE=$$core $(BIN)/coverage run -m pytest $(PYTEST_ARGS)
	@$(BIN)/coverage combine -q
	@echo "below 80 %, and in all:"
	@$(BIN)/coverage report | awk '/%/ && ($$NF + 0 < 80 || /^TOTAL/)'

lint: $(VENV)/.rest
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

bench: $(VENV)/.test
	$(PIP) -e '.[peers]'
	$(BIN)/cable-sim bench --peers --out runs/bench

stress: $(VENV)/.test
	$(BIN)/cable-sim stress --out runs/stress

soak: $(VENV)/.rest
	$(BIN)/python -m pytest -m realtime $(PYTEST_ARGS)
	$(BIN)/cable-sim soak --out runs/soak

nightly: $(VENV)/.rest stress validate bench
	$(BIN)/mypy --config-file <(sed '/^\[mypy-numpy/,$$d' mypy.ini)
	$(PYTEST) -m nightly
	CABLE_SIM_COMPILER=numba $(PYTEST) -m "check or trust" test/physics test/sim
	$(BIN)/cable-sim bench --against $(AGAINST) --out runs/against

validate: $(VENV)/.test
	$(BIN)/cable-sim validate --out runs/validate
	$(BIN)/cable-sim bench --mesh --out runs/validate

wheel: $(VENV)/.run
	$(BIN)/python -m verification.wheel dist

docs: $(VENV)/.docs
	$(BIN)/sphinx-build -q -W --keep-going -c docs -d build/doctrees . build/docs
	@echo "site: build/docs/index.html"

clean:
	rm -rf $(VENV) build dist install log *.egg-info

# The first python3 that is new enough, not newer than the wheels, and able to make an environment.
$(BIN)/python:
	@for python in $(PYTHON) python3 python3.12 python3.11 python3.13 python3.14; do \
	    if "$$python" -c 'import sys, venv, ensurepip; sys.exit(not (3, 11) <= sys.version_info[:2] <= (3, 14))' \
	            2>/dev/null; then \
	        echo "environment: $(VENV) with $$("$$python" --version)"; \
	        "$$python" -m venv $(VENV); exit 0; \
	    fi; \
	done; \
	echo "error: no usable Python found (3.11 to 3.14 with the venv module); nothing was installed." >&2; \
	echo "       Install one, e.g. 'apt install python3.11 python3.11-venv', or name it: make PYTHON=/path/to/python3" >&2; \
	exit 1

# Installed in place: a change of the code needs no new install.
$(VENV)/.run: $(PACKAGING) | $(BIN)/python
	@echo "installing the simulator, ROS 2 (rclpy from wheels) and matplotlib: a minute or two the first time"
	@$(PIP) -e '.[ros,viz]'
	@touch $@

$(VENV)/.docs: $(PACKAGING) | $(BIN)/python
	@echo "installing the simulator with Sphinx: a minute or two the first time"
	@$(PIP) -e '.[docs]'
	@touch $@

# what make test needs none of: parsers of other makers' logs, live view, exports, reports, sweeps
$(VENV)/.rest: $(PACKAGING) | $(BIN)/python
	@echo "installing what reads and writes the formats of others: a minute the first time"
	@$(PIP) -e '.[ros,viz,test,all]'
	@touch $@ $(VENV)/.test $(VENV)/.run

$(VENV)/.test: $(PACKAGING) | $(BIN)/python
	@echo "installing the simulator with its test tools: a minute or two the first time"
	@$(PIP) -e '.[ros,viz,test]'
	@touch $@ $(VENV)/.run
