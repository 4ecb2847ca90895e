# Two commands for a fresh machine with Python 3.11 and make: `make search`, `make test`.
PYTHON ?= python3.11
BUDGET ?= 20
VENV := .venv
BIN := $(VENV)/bin
FLIES := $(VENV)/.flies
READY := $(VENV)/.installed
CLUSTERS := $(VENV)/.clusters
CHECKS := $(VENV)/checks.log
SMOKE := .garl/experiment-smoke

# The tests start some thousand processes; without the compiled files each would parse the sources.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: search test test-long test-ray lint types layers tests bench faults experiment-smoke clean
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
tests: $(READY)
	$(BIN)/pytest -n 2 --dist=worksteal -m "not ray and not long" --durations=15 tests landing_systems

test-long: $(READY)  ## the tutorial, 50 kills, 154 misbehaving systems, more fuzz: an hour
	$(BIN)/pytest -n 2 --dist=worksteal -m long tests

test-ray: $(CLUSTERS)  ## the tests that start Ray clusters: minutes, so not part of `test`
	$(BIN)/pytest -m ray tests

bench: $(READY)  ## measure frames, flights and the plugin's overhead
	$(BIN)/python -m lab.benchmarks

faults: $(READY)  ## search for planted faults and print mutation scores: a day on two cores
	$(BIN)/python -m lab.faults
	$(BIN)/python -m lab.faults --report

experiment-smoke: $(READY)  ## fly, measure and report an experiment at toy size
	rm -rf $(SMOKE)
	$(BIN)/python -m lab.experiment docs/experiments/smoke.toml --out=$(SMOKE) --folder=$(SMOKE)/runs
	$(BIN)/python -m lab.experiment docs/experiments/smoke.toml --out=$(SMOKE) --report

clean:  ## remove the virtual environment and the run folder
	rm -rf $(VENV) .garl

# Nothing is compiled that is never imported: pip would compile for half a minute.
# What flies needs neither PyTorch nor a linter.
$(FLIES): pyproject.toml constraints.txt
	$(PYTHON) -m venv $(VENV)
	$(BIN)/pip install --quiet --disable-pip-version-check --no-compile -c constraints.txt -e .
	touch $@

# Not after $(FLIES): pip installs all in one go.
$(READY): pyproject.toml constraints.txt
	$(PYTHON) -m venv $(VENV)
	$(BIN)/pip install --quiet --disable-pip-version-check --no-compile -c constraints.txt -e '.[dev,train]'
	touch $(FLIES) $@

# Only the tests of clusters need Ray.
$(CLUSTERS): $(READY)
	$(BIN)/pip install --quiet --disable-pip-version-check --no-compile -c constraints.txt -e '.[dev,train,ray]'
	touch $@
