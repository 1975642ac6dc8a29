# make demo   the Section 6 model, end to end          make test   the whole test suite
# make check  what CI runs: lint, types, tests, docs   make docs   the site, into docs/_build/html
# make bench  the times on the site's page on speed; FULL=1 adds the long sizes
# Needs Python >= 3.11 with pip, make and git; everything else goes into .venv, pinned by requirements.lock.

PYTHON ?= python3
VENV   := .venv
BIN    := $(VENV)/bin
UV     := uv==0.13.9
JOBS   ?= auto
INSTALL = $(BIN)/python .ci/install.py $(1) $(UV)
LOCKS  := requirements.lock requirements-test.lock requirements-run.lock
NEEDS  := pyproject.toml $(LOCKS) ndtheory/__init__.py

# Tests and pages start many processes: each would compile the packages anew.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: demo test check lint docs nightly bench lock clean
.NOTPARALLEL:  # one pip at a time; pytest uses the processors itself

demo: $(VENV)/.run
	$(BIN)/ndtheory demo

test: $(VENV)/.test
	$(BIN)/python -m pytest -n auto --dist worksteal

check: $(VENV)/.docs lint test docs

lint: $(VENV)/.test
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

docs: $(VENV)/.docs
	$(BIN)/python -m sphinx -j $(JOBS) -W --keep-going -q -b html docs docs/_build/html
	$(BIN)/python tests/docs/test_site.py docs/_build/html
	@echo "the site: docs/_build/html/index.html"

nightly: $(VENV)/.test
	HYPOTHESIS_PROFILE=nightly $(BIN)/python -m pytest -n auto --dist worksteal

bench: $(VENV)/.test
	for b in benchmarks/bench_*.py; do $(BIN)/python $$b --record benchmarks/records $(if $(FULL),--full) || exit 1; done

COMPILE := $(BIN)/uv pip compile --quiet --universal --python-version 3.11 --no-header

lock: $(VENV)/.venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check $(UV)
	$(COMPILE) --all-extras --output-file requirements.lock pyproject.toml
	$(COMPILE) --constraint requirements.lock --no-annotate --output-file requirements-run.lock pyproject.toml
	$(COMPILE) --constraint requirements.lock --no-annotate --extra test --output-file requirements-test.lock pyproject.toml

$(VENV)/.venv:
	$(PYTHON) -c 'import sys; sys.exit("Python 3.11 or later is needed, this is " + sys.version.split()[0] if sys.version_info < (3, 11) else 0)'
	$(PYTHON) -m venv $(VENV)
	touch $@

$(VENV)/.run: $(VENV)/.venv $(NEEDS)
	$(call INSTALL,requirements-run.lock)
	touch $@

$(VENV)/.test: $(VENV)/.venv $(NEEDS)
	$(call INSTALL,requirements-test.lock)
	touch $(VENV)/.run $@

$(VENV)/.docs: $(VENV)/.venv $(NEEDS)
	$(call INSTALL,requirements.lock)
	touch $(VENV)/.run $(VENV)/.test $@

clean:
	rm -rf $(VENV) docs/_build .pytest_cache .mypy_cache .ruff_cache .hypothesis
