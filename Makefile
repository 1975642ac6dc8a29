# make demo   the Section 6 model, end to end          make test   the whole test suite
# make check  what CI runs: lint, types, tests, docs   make docs   the site, into docs/_build/html
# make lowest a sample of the tests with the lowest versions that pyproject.toml allows; make newest with the newest
# make nightly  the tests with many more random cases, PART=cli one part of them; notes in CONTRIBUTING.md what passed
# make drawn  ten random changes of each module that the answers rest on: which do tests notice? MODULE=path/of.py one
# make kratos the tests that couple two models in Kratos Multiphysics, with its wheels in an environment of their own
# make paper  the paper with its numbers and figures: docs/_build/paper/paper.pdf
# make release-check  what keeps this commit from being released: versions, changelog, tag, archives, site, notebooks
# make bench  the times on the site's page on speed; FULL=1 adds the long sizes
# Needs Python >= 3.11 with pip, make and git; everything else goes into .venv, pinned by requirements.lock.

PYTHON ?= python3
VENV   := .venv
BIN    := $(VENV)/bin
UV     := uv==0.13.9
JOBS   ?= auto
# A lock holds all that is needed, so nothing is resolved; a module is compiled when it is first imported.
INSTALL = $(BIN)/python -m pip --quiet --disable-pip-version-check install --no-deps --no-compile --editable . \
	--requirement $(1) && $(BIN)/python -m pip check
LOCKS  := requirements.lock requirements-test.lock requirements-run.lock
NEEDS  := pyproject.toml $(LOCKS) ndtheory/__init__.py

# What a shell exports decides nothing here: PYTHONUNBUFFERED, PYTHONDONTWRITEBYTECODE (each of the many processes of
# tests and pages would compile the packages anew), PYTHONPATH, PYTHONHASHSEED and all others that Python reads.
unexport $(filter PYTHON%,$(filter-out PYTHON,$(.VARIABLES)))

.PHONY: demo test check lint docs nightly drawn lowest newest kratos paper bench release-check lock clean
.NOTPARALLEL:  # one pip at a time; pytest uses the processors itself

demo: $(VENV)/.run
	$(BIN)/ndtheory demo
	$(BIN)/ndtheory explore ndtheory-demo/problem.toml -o ndtheory-demo/explore.html

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
	PYTHONPATH=tests $(BIN)/python tests/docs/test_slides.py docs/_build/html
	PYTHONPATH=tests $(BIN)/python tests/docs/test_search.py docs/_build/html
	@echo "the site: docs/_build/html/index.html"

nightly: $(VENV)/.test
	$(BIN)/python .ci/nightly.py $(PART)

drawn: $(VENV)/.test
	PYTHONPATH=tests $(BIN)/python -m safeguards.drawn $(MODULE)

# Each dependency has a test here that calls it.
SAMPLE := fem1d2d/test_mesh_files.py theorem/test_gradient_descent.py theorem/test_symbolic.py cli/test_commands.py \
	cli/test_documents.py cli/test_progress.py cli/test_shell.py cli/test_sweep_command.py verification/certificate/test_certificate.py \
	verification/contact/test_contact.py verification/showing/test_figures.py verification/semidefinite/test_interior_point.py \
	verification/showing/test_report.py verification/sweeps/test_sweep_cluster.py verification/sweeps/test_sweep_dataset.py \
	verification/algorithm/test_threads.py

# In an environment without the lock; WHOLE=1 runs all tests.
lowest: RESOLUTION := lowest-direct
newest: RESOLUTION := highest
lowest newest: $(VENV)/.venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check $(UV)
	$(BIN)/uv venv --quiet --clear --python $(BIN)/python $(VENV)/$@
	$(BIN)/uv pip install --quiet --python $(VENV)/$@/bin/python --resolution $(RESOLUTION) --editable '.[test]'
	$(VENV)/$@/bin/python -m pytest -n $(JOBS) --dist worksteal -p no:cacheprovider $(if $(WHOLE),,$(addprefix tests/,$(SAMPLE)))

# No dependency: the tests are skipped without it.
APPLICATIONS := CoSimulation StructuralMechanics ConstitutiveLaws Mapping LinearSolvers
WHEELS := KratosMultiphysics==10.4.4 $(patsubst %,Kratos%Application==10.4.4,$(APPLICATIONS))
KRATOS := $(VENV)/kratos

kratos: $(VENV)/.venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check $(UV)
	$(BIN)/uv venv --quiet --clear --python $(BIN)/python $(KRATOS)
	$(BIN)/uv pip install --quiet --python $(KRATOS)/bin/python --requirement requirements-test.lock --editable . $(WHEELS)
	$(KRATOS)/bin/python -m pytest -n auto -p no:cacheprovider tests/verification/coupling/test_kratos.py

paper: $(VENV)/.run
	$(BIN)/python docs/paper/compute.py docs/_build/paper
	$(BIN)/python -m pip install --quiet --disable-pip-version-check $(UV)
	$(BIN)/uv run --quiet --no-project --python $(BIN)/python --with typst==0.15.2 docs/paper/typeset.py docs/_build/paper

bench: $(VENV)/.test
	for b in benchmarks/bench_*.py; do $(BIN)/python $$b --record benchmarks/records $(if $(FULL),--full) || exit 1; done

release-check: $(VENV)/.docs
	$(BIN)/python .ci/release_check.py

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
