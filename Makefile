# `make test` and `make demo` each set up all they need: a Python 3.11+ and make are enough.
SHELL := bash
.DEFAULT_GOAL := help
MAKEFLAGS += --no-builtin-rules --no-print-directory
# Tests start many processes: each would compile all of the package's source where none is kept.
unexport PYTHONDONTWRITEBYTECODE

PYTHON ?= python3
VENV := .venv
# Tests of what needs PyTorch have an environment of their own: 3 GB more on Linux.
VENV_SB3 := build/venv-sb3
SB3_TESTS = $(shell grep -rlE "\bSB3\b" tests --include="test_*.py")
PY := $(VENV)/bin/python
PIP := $(PY) -m pip --disable-pip-version-check --no-input
INSTALLED := $(VENV)/.installed
DEMO := $(VENV)/.demo
EXTRAS ?= all
TYPING := build/typing
LAYERS := dynamics optim envs agents
SHAPES := tests/typing/shapes.py tests/dynamics/biped/test_kinematics.py
# Quick tests compile more than they compute; these halve the time of compiling and more: old emitters,
# LLVM without optimisation and in one piece, and loops as they are traced. What users have, XLA's
# defaults, the long tests run with, and pytest where it is called by hand.
LOOP_PASSES := while-loop-invariant-code-motion,simplify-while-loops,while-loop-constant-sinking,while-loop-trip-count-annotator
QUICKLY := --xla_cpu_use_fusion_emitters=false --xla_backend_optimization_level=0 \
	--xla_cpu_parallel_codegen_split_count=1 --xla_disable_hlo_passes=$(LOOP_PASSES)
SOURCES := $(wildcard setup.py $(LAYERS) src tests benchmarks documentation)

# $(INSTALLED) says which extras are there, $(DEMO) that those are which the demo needs. Only a
# finished install writes either, with the checkout it belongs to: an interrupted one, a moved checkout
# or a vanished interpreter all start again from an empty $(VENV).
COMMA := ,
ASKED := $(subst $(COMMA), ,$(EXTRAS))
MARKS := $(shell $(PY) -c "" 2>/dev/null && \
	for mark in $(INSTALLED) $(DEMO); do printf '|'; cat $$mark; echo '|'; done 2>/dev/null)
ifeq ($(findstring |$(CURDIR) ,$(MARKS)),)
$(INSTALLED) $(DEMO): fresh-venv
else ifneq ($(filter-out $(shell cat $(INSTALLED) 2>/dev/null),$(ASKED)),)
$(INSTALLED): other-extras
endif

.PHONY: help venv test quick check test-sb3 quick-sb3 test-long test-shapes lint typecheck format docs notebooks demo bench release-check clean fresh-venv other-extras

help:  ## list the targets
	@awk -F ':.*##' '/^[a-z-]+:.*##/ {printf "  make %-13s %s\n", $$1, $$2}' Makefile

venv: $(INSTALLED)  ## create .venv with the pinned packages and stickslip, editable

test: lint  ## lint, types, the documentation, and every test but the long ones
	@$(MAKE) -j 2 typecheck docs quick

# Types are checked beside the tests: one core would idle meanwhile.
quick: $(INSTALLED)
	@XLA_FLAGS="$(QUICKLY) $$XLA_FLAGS" $(PY) -m pytest -n 2 --dist loadfile --no-loadscope-reorder \
		--durations 30

check: lint typecheck  ## lint and types only

test-sb3:  ## the tests that need Stable-Baselines3, in an environment of its own
	@$(MAKE) VENV=$(VENV_SB3) EXTRAS=all,sb3 quick-sb3

quick-sb3: typecheck
	@XLA_FLAGS="$(QUICKLY) $$XLA_FLAGS" $(PY) -m pytest -m "sb3 and not long" $(SB3_TESTS)

test-long: $(INSTALLED)  ## the tests that take minutes
	@$(PY) -m pytest -m long -n 2 --dist loadfile --durations 30

test-shapes: $(INSTALLED)  ## what signatures say of types and shapes, checked at every call
	@$(PY) -m pytest -p tests.typing.checked -m "long or not long" $(SHAPES)

lint: $(INSTALLED)  ## ruff: rules and formatting
	@$(PY) -m ruff check $(SOURCES)
	@$(PY) -m ruff format --check $(SOURCES)

# Links file by file (the checker passes over linked folders), and messages name the real files.
typecheck: $(INSTALLED)  ## basedpyright, in its "standard" mode
	@rm -rf $(TYPING)
	@find $(wildcard $(LAYERS)) src/stickslip -name '*.py' | while read -r file; do \
		link="$(TYPING)/stickslip/$${file#src/stickslip/}"; \
		mkdir -p "$${link%/*}" && ln -s "$(CURDIR)/$$file" "$$link"; done
	@$(PY) -m tests.typing.settings
	@set -o pipefail; $(VENV)/bin/basedpyright -p build/pyrightconfig.json --warnings \
		| sed -E 's#$(TYPING)/stickslip/(($(subst $() ,|,$(LAYERS)))/)#\1#g; s#$(TYPING)/#src/#g'
	@$(PY) -m tests.typing.as_user

format: $(INSTALLED)  ## apply ruff's fixes and formatting
	@$(PY) -m ruff check --fix $(SOURCES)
	@$(PY) -m ruff format $(SOURCES)

# The notice is of mkdocs-material's end in 2027; docs/design.md says why it is used.
# Not --quiet, which hides warnings from strict mode, too.
docs: $(INSTALLED)  ## the documentation site, in build/site, with warnings as errors
	@NO_MKDOCS_2_WARNING=1 $(PY) -m mkdocs build
	@! grep -rlE '<(script|img|link rel="stylesheet")[^>]+(src|href)="https?:' build/site --include='*.html'

notebooks: $(INSTALLED)  ## run the notebooks again: what the site shows of them
	@$(VENV)/bin/jupyter-execute --inplace notebooks/*.ipynb

demo: $(DEMO)  ## train a walker for a slippery floor and show what it learnt
	@$(VENV)/bin/stickslip train biped --out runs/demo $$(test ! -e runs/demo/config.json || echo --resume)
	@$(VENV)/bin/stickslip evaluate runs/demo constant-torque crank-speed-pi computed-torque \
	  optimal-gait --episodes 64 --out runs/demo --overwrite

bench: $(INSTALLED)  ## environment steps per second, beside Gymnasium's own
	@$(PY) -m benchmarks.throughput

release-check:  ## build, install on each Python with each set of extras, test
	@release/check.sh

clean:  ## remove the environment and everything built (runs/ stays)
	rm -rf $(VENV) build dist *.egg-info src/*.egg-info .pytest_cache .ruff_cache .hypothesis
	find $(SOURCES) -name __pycache__ -type d -prune -exec rm -rf {} +

other-extras:

fresh-venv:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null || { \
		echo "stickslip needs Python 3.11 or newer; $(PYTHON) is" \
			"$$($(PYTHON) --version 2>/dev/null || echo not there)." \
			"Name another: make PYTHON=python3.12" >&2; exit 1; }
	@echo "Creating $(VENV) with $$($(PYTHON) --version)"
	@$(PYTHON) -m venv --clear $(VENV) || { \
		echo "$(PYTHON) -m venv failed; some systems package it apart (python3-venv)." >&2; exit 1; }

# Of pip's output, only the larger downloads are shown; errors always are. What is being changed is
# not whole: the marks go, and come back where pip gives up by itself, which leaves what was there.
install = trap 'exit 130' INT TERM; set -o pipefail; mkdir -p $(VENV)/marks; \
	mv -f $(wildcard $(INSTALLED) $(DEMO)) $(VENV)/marks 2>/dev/null; \
	$(PIP) install -q -c constraints.txt setuptools && \
	$(PIP) install --progress-bar off --no-build-isolation -c constraints.txt -e '.[$(1)]' \
		| awk '/^ *Downloading .*[0-9][0-9]\.. MB/ {print "  fetching", $$2, $$3, $$4; fflush()}' \
	|| { mv -f $(VENV)/marks/.[di]* $(VENV) 2>/dev/null; exit 1; }; \
	rm -rf $(VENV)/marks; printf '%s ' "$(CURDIR)" $(2) > $@; echo "Installed in $(VENV)"

$(INSTALLED): pyproject.toml setup.py constraints.txt
	@echo "Installing the pinned packages of: $(EXTRAS)" \
		"(the first time 0.6 GB to fetch; sb3 has another 3 GB on Linux)"
	@$(call install,$(EXTRAS),$(ASKED))
	@cp $@ $(DEMO)

$(DEMO): pyproject.toml setup.py constraints.txt
	@echo "Installing the pinned packages of the demo (the first time 0.25 GB to fetch)"
	@$(call install,train)
