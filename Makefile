# Two commands for a fresh machine with Python and make: `make search`, `make test`.
# The first takes the newest Python that is supported and installed, the second 3.11 if it is there;
# both take PYTHON if that is set, and an environment that is there as it is.
SUPPORTED := 3.11 3.12 3.13
runs = $(shell for python in $(1); do $$python -c 0 2>/dev/null && echo $$python && break; done)
NEWEST = $(or $(PYTHON),$(call runs,python3.13 python3.12 python3.11),python3)
TESTED = $(or $(PYTHON),$(call runs,$(SUPPORTED:%=python%)),python3)
BUDGET ?= 20
VENV := .venv
BIN := $(VENV)/bin
FLIES := $(VENV)/.flies
READY := $(VENV)/.installed
COMPILED := $(VENV)/.compiled
CLUSTERS := $(VENV)/.clusters
ROS := $(VENV)/ros
DRONEKIT := $(VENV)/dronekit
ROS_PACKAGES := rclpy rmw-fastrtps-cpp rmw-security-common rosgraph-msgs sensor-msgs geometry-msgs std-msgs
OTHER := $(VENV)/.other
RELEASES := $(VENV)/.releases
SITE := $(VENV)/.site
CHECKS := $(VENV)/checks.log
SMOKE := .garl/experiment-smoke

# The tests start some thousand processes; without the compiled files each would parse the sources.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: search test test-others test-other test-long test-ray test-ros test-dronekit lint types layers tests bench docs dist faults experiment-smoke clean
.DEFAULT_GOAL := help

help:  ## show the commands
	@grep -hE '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/'

# Violations are failing tests: pytest's status 1 says that the search went well and found some.
search: $(FLIES)  ## fly BUDGET scenarios (default 20) per landing system and map, as if nothing were known
	@echo $(BIN)/pytest --garl-budget=$(BUDGET) -o garl_cases=.garl/cases landing_systems/
	@$(BIN)/pytest --garl-budget=$(BUDGET) -o garl_cases=.garl/cases landing_systems/; \
	status=$$?; test $$status -le 1 || exit $$status

# Types take a minute of one core, in which the tests that wait leave one; the output comes in one piece.
test: $(READY)  ## lint, types, layers and all tests
	@$(MAKE) --no-print-directory lint types layers >$(CHECKS) 2>&1 & checks=$$!; \
	$(MAKE) --no-print-directory tests; tests=$$?; \
	wait $$checks; checks=$$?; cat $(CHECKS); \
	test $$tests = 0 && test $$checks = 0

lint: $(READY)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: $(READY)
	$(BIN)/mypy

layers: $(READY)
	$(BIN)/lint-imports

# The saved cases come last: the pool that flies them lives to the end, and tests of processes count children.
# Four processes on two cores: many a test waits for a hang, for a clock or for another process.
# Cases that gate nothing are flown by `test-long`, which flies all saved cases.
tests: $(COMPILED)
	$(BIN)/pytest -n 4 --dist=worksteal -m "not ray and not long and not garl_gates_nothing" --durations=15 -rs \
	    tests landing_systems

# PyTorch, which only training needs, is not installed there: its tests skip.
test-others:  ## the fast tests and the saved cases on every other supported Python that is installed
	@tested=$$($(TESTED) -c 'import sys; print("%d.%d" % sys.version_info[:2])'); found=; \
	for version in $(SUPPORTED); do \
	    test $$version != $$tested || continue; \
	    for python in python$$version $(HOME)/.pyenv/versions/$$version.*/bin/python; do \
	        $$python -c 0 2>/dev/null || continue; \
	        found="$$found $$version"; \
	        $(MAKE) --no-print-directory PYTHON=$$python VENV=.venvs/$$version test-other || exit; \
	        break; \
	    done; \
	done; \
	echo "Tested on:$${found:- no other Python: of $(SUPPORTED) only $$tested is installed}"

test-other: $(OTHER)
	$(BIN)/python --version
	$(BIN)/pytest -n 2 --dist=worksteal -m "not sim and not ray and not long" tests
	$(BIN)/pytest -n 2 --dist=worksteal -m long tests/landing_systems/test_saved_cases.py tests/test_distribution.py

test-long: $(READY)  ## the tutorial, 50 kills, 154 misbehaving systems, more fuzz: an hour
	$(BIN)/pytest -n 2 --dist=worksteal -m long tests

test-ray: $(CLUSTERS)  ## the tests that start Ray clusters: minutes, so not part of `test`
	$(BIN)/pytest -m ray tests

test-ros: $(READY) $(ROS)/.installed  ## the tests that run a ROS 2 node: 394 MB of wheels for Linux on x86-64
	ROS_PYTHON=$(ROS)/bin/python $(BIN)/pytest tests/external/test_ros2.py

test-dronekit: $(READY) $(DRONEKIT)/.installed  ## the tests that fly real dronekit, and MAVSDK's package
	DRONEKIT_PYTHON=$(DRONEKIT)/bin/python $(BIN)/pytest tests/companion/test_dronekit.py tests/companion/test_mavsdk.py

# A warning is an error: a link to a page, a heading or a file that is not there.
docs: $(SITE)  ## make a site with a search of the pages, in build/docs
	$(BIN)/sphinx-build --quiet --fail-on-warning --keep-going -c docs/site . build/docs

dist: $(RELEASES)  ## build what is released into dist/, and check it
	rm -rf dist
	$(BIN)/python -m hatchling build
	$(BIN)/twine check --strict dist/*

bench: $(READY)  ## measure frames, flights and the plugin's overhead
	$(BIN)/python -m lab.benchmarks

faults: $(READY)  ## search for planted faults with all arms and print the tables: a day on two cores
	$(BIN)/python -m lab.judges faults
	$(BIN)/python -m lab.judges faults --report

experiment-smoke: $(READY)  ## fly, measure and report an experiment at toy size
	rm -rf $(SMOKE)
	$(BIN)/python -m lab.experiment docs/results/experiments/smoke.toml --out=$(SMOKE) --folder=$(SMOKE)/runs
	$(BIN)/python -m lab.experiment docs/results/experiments/smoke.toml --out=$(SMOKE) --report

clean:  ## remove the virtual environments and the run folder
	rm -rf $(VENV) .venvs .garl

# Nothing is compiled that is never imported: pip would compile for half a minute.
INSTALL = $(BIN)/pip install --quiet --disable-pip-version-check --no-compile -c constraints.txt
ANEW = test "$$($(BIN)/python --version 2>&1)" = "$$($(TESTED) --version)" || $(TESTED) -m venv --clear $(VENV)

# What flies needs neither PyTorch nor a linter.
$(FLIES): pyproject.toml constraints.txt
	test -d $(VENV) || $(NEWEST) -m venv $(VENV)
	$(INSTALL) -e .
	touch $@

# Not after $(FLIES): pip installs all in one go.
$(READY): pyproject.toml constraints.txt
	$(ANEW)
	$(INSTALL) -e '.[dev,train]'
	touch $(FLIES) $@

# Once, while the types are checked: the processes of the tests would each compile all of it at first.
$(COMPILED): $(READY)
	-$(BIN)/pytest --collect-only -qq tests landing_systems >/dev/null
	touch $@

$(OTHER): pyproject.toml constraints.txt
	$(ANEW)
	$(INSTALL) -e '.[dev]'
	touch $@

# Only the site needs Sphinx.
$(SITE): $(READY)
	$(INSTALL) -e '.[dev,train,docs]'
	touch $@

# Only a release needs Twine.
$(RELEASES): $(READY)
	$(INSTALL) -e '.[dev,train,release]'
	touch $@

# Only the tests of clusters need Ray.
$(CLUSTERS): $(READY)
	$(INSTALL) -e '.[dev,train,ray]'
	touch $@

# ROS 2 has its own environment, as a user's node has: it flies beside pytest's, not in it.
$(DRONEKIT)/.installed: | $(READY)
	$(TESTED) -m venv $(DRONEKIT)
	$(DRONEKIT)/bin/pip install --quiet --disable-pip-version-check dronekit2 'mavsdk<4'
	touch $@

$(ROS)/.installed: | $(READY)
	$(TESTED) -m venv $(ROS)
	$(ROS)/bin/pip install --quiet --disable-pip-version-check $(addprefix ros-,$(ROS_PACKAGES)) numpy
	touch $@
