# `make report` and `make test` are all that a newcomer needs; `make help` lists the rest.
SHELL := /bin/sh
VENV := .venv
PYTHON_IN_VENV := $(VENV)/bin/python
SCENE ?= scenes/liquid_ring_paper.toml
OUT ?= out
WORKERS ?= 2
# Of tests/architecture, what may differ with Python: what starts load, packages and locks.
START_TESTS := tests/architecture/test_light_start.py tests/architecture/test_packaging.py
# Syntax and libraries of a Python between the oldest and the newest; a minute or so, for `make test-versions`.
SHORT_TESTS := $(START_TESTS) tests/scene tests/mesh tests/test_public_names.py tests/test_cli.py \
	tests/physics/test_pressure.py tests/physics/test_tube_loss.py tests/reduced_model/test_paper_law.py \
	tests/reduced_model/test_table.py tests/controller/test_compiled.py
# What may differ with Python, NumPy or SciPy: files, processes, pickles and printed examples; solves, roots,
# splines, linear algebra and compiled code.  What has failed under one version alone so far is among them or
# a matter of types; cases, fits, sweeps, judged devices and pages are this program's own code over all that.
NUMBER_TESTS := $(START_TESTS) tests/scene tests/results tests/mesh tests/physics \
	tests/test_cli.py tests/test_public_names.py tests/test_python_interface.py \
	tests/test_signals.py tests/export/test_fmu.py tests/export/test_compact.py tests/export/test_cli.py \
	tests/reduced_model/test_paper_law.py tests/reduced_model/test_table.py \
	tests/reduced_model/test_calibrated_law.py tests/reduced_model/test_calibration.py \
	tests/controller/test_loop.py tests/controller/test_compiled.py tests/controller/test_linear_loop.py
CODE := ringbalance mesh reduced_model verification reports tools benchmarks
# One thread per process: the tests run side by side, and sums then come out the same on every machine.
export OPENBLAS_NUM_THREADS ?= 1
export OMP_NUM_THREADS ?= 1
export MKL_NUM_THREADS ?= 1

.PHONY: help env report test test-numbers test-faults test-heavy test-panel test-short test-units test-versions test-ends lint style format bench bench-cfd pages docs dist lock clean

help: ## list the targets
	@sed -n 's/^\([a-z-]*\):.*## \(.*\)/make \1\t\2/p' Makefile | expand -t 18

env: ## make .venv from requirements/lock.txt and see to off-screen OpenGL; nothing to do when up to date
	@sh tools/make_env.sh $(VENV) requirements/lock.txt
	@sh tools/make_opengl.sh "$(CURDIR)/$(PYTHON_IN_VENV)"
	@# Where Python may not write bytecode, the program would be compiled again at every start.
	@$(PYTHON_IN_VENV) -m compileall -q $(CODE)

report: env ## the report on SCENE (the paper's disc) into OUT (out/)
	$(VENV)/bin/ringbalance report $(SCENE) --out $(OUT)

test: style ## lint, types and every test but the heavy ones and the faults
	@# mypy takes a minute of one processor: beside the tests, not before them.
	@mkdir -p build
	@$(VENV)/bin/mypy $(TYPED) >build/types.txt 2>&1 & types=$$!; \
	$(PYTHON_IN_VENV) -m pytest -n $(WORKERS) $(TESTS); tests=$$?; \
	wait $$types || { cat build/types.txt; exit 1; }; exit $$tests

# Types of NumPy differ between versions, and the product uses them; those of the tests were seen by `make test`.
test-numbers: TYPED := ringbalance tools benchmarks
test-numbers: TESTS := $(NUMBER_TESTS)
test-numbers: test ## lint, types and the tests of what may differ between versions of Python, NumPy and SciPy

test-faults: env ## kills, damaged caches, odd environments: a few minutes, part of .ci/run
	$(PYTHON_IN_VENV) -m pytest -n $(WORKERS) -m faults $$(grep -rl --include="*.py" "mark.faults" tests)

test-panel: env ## pages in Chromium and Firefox, exported JavaScript in Node, part of .ci/run
	@sh tools/make_browsers.sh
	@# Those of Node alone, too: `make test` leaves them out on a machine without it.
	$(PYTHON_IN_VENV) -m pytest -n $(WORKERS) -m "not heavy and not faults" tests/panel tests/panels \
		tests/export/test_javascript.py tests/export/test_host_pages.py::test_the_page_on_javascript

test-units: env ## units of `export` under FMPy, fmutool and the cross-compiler, which it fetches
	$(VENV)/bin/uv run --no-project --python $(PYTHON_IN_VENV) --with fmpy --with fmu-manipulation-toolbox --with ziglang -- \
		python -m pytest tests/export/test_fmu.py

test-short: env ## a short selection of the tests
	$(PYTHON_IN_VENV) -m pytest -n $(WORKERS) $(SHORT_TESTS)

test-versions: env ## the tests under every further supported Python of this machine, each in .venv-3.X
	$(PYTHON_IN_VENV) tools/other_pythons.py

test-ends: env ## of these the oldest and the newest Python alone, as in .ci/run
	$(PYTHON_IN_VENV) tools/other_pythons.py --ends

test-heavy: env ## the tests that take long
	$(PYTHON_IN_VENV) -m pytest -n $(WORKERS) -m heavy

lint: style ## style and types: ruff, the length of functions, mypy
	$(VENV)/bin/mypy

style: env ## ruff and the length of functions
	$(VENV)/bin/ruff check .
	$(VENV)/bin/ruff format --check .
	$(PYTHON_IN_VENV) tools/long_functions.py $(CODE)

format: env ## let ruff write what `make lint` asks for
	$(VENV)/bin/ruff check --fix .
	$(VENV)/bin/ruff format .

bench: env ## timed comparisons, each a ratio within one run
	$(PYTHON_IN_VENV) benchmarks/calibrate_command.py
	$(PYTHON_IN_VENV) benchmarks/designs.py
	$(PYTHON_IN_VENV) benchmarks/sweep.py
	$(PYTHON_IN_VENV) benchmarks/closed_loop.py
	$(PYTHON_IN_VENV) benchmarks/moving_injection.py
	$(PYTHON_IN_VENV) benchmarks/eccentric_mass.py
	@sh tools/make_browsers.sh
	$(PYTHON_IN_VENV) benchmarks/panel_frames.py

bench-cfd: env ## tube, waves and gas jet beside OpenFOAM, an hour or so; keeps the results
	@sh tools/make_openfoam.sh
	$(PYTHON_IN_VENV) benchmarks/openfoam.py --keep

pages: env ## run the code on every page of the documentation and compare what it prints
	$(PYTHON_IN_VENV) -W error tools/generate.py pages

docs: pages ## the site of the documentation into build/site/, its pages run and every warning an error
	@# From nothing, so that two builds are the same: what an earlier one has kept would show in the next.
	@rm -rf build/site build/doctrees
	$(PYTHON_IN_VENV) -m sphinx -q -W --keep-going -c docs -d build/doctrees . build/site
	@echo "open build/site/index.html"

dist: env ## source distribution and wheel of the last commit into dist/, the same bytes every time
	$(PYTHON_IN_VENV) tools/make_dist.py

lock: env ## rewrite the lock files from pyproject.toml (a change of dependencies only)
	sh tools/make_lock.sh $(VENV)/bin/uv

clean: ## remove what the other targets made, the environments included
	rm -rf $(VENV) .venv-3.* out build dist *.egg-info .pytest_cache .mypy_cache .ruff_cache .hypothesis
	find . -name __pycache__ -type d -not -path './.git/*' -prune -exec rm -rf {} +
