# make demo    drive the default scenario and leave its recording in out/
# make test    run the tests that take seconds
# make test-all  run all tests, with long drives, notebooks, the wheel and the site, and `test-realtime`
# make test-oldest  demo and some tests with the oldest dependencies that pyproject.toml allows, in an environment of its own
# make test-realtime  drive a ROS 2 robot in real time, one test after the other; needs an idle machine
# make coverage  run the tests, and list the lines that none of them reaches
# make paper   drive Table I of the paper, with TRIALS=30 of each method in both worlds; goes on where it was interrupted
# make fuzz    search for examples that break a property: random ones, for MINUTES=10
# make check   lint, formatting and types
# make docs    build the documentation: out/site/index.html
# make wheels  build sdist and wheels, one of them compiled for this Python, and try them with every Python there is
# make install only make the environment that the others use
#
# PYTHON=...   the interpreter for the environment; without it the best one found
# VENV=...     the environment's folder
# TESTS=...    the tests to run; without it all
# MARKS=...    those with these marks: `slow`, `not slow and not realtime`

VENV ?= .venv
PYTHON ?=
TESTS ?=
MARKS ?= not slow and not realtime
MINUTES ?= 10
TRIALS ?= 30
RUN = $(VENV)/bin/python

.PHONY: demo test test-all test-oldest test-realtime coverage paper fuzz check docs wheels compiled install clean

demo: install
	$(RUN) -m drake_starnav demo

test: compiled
	$(RUN) -m pytest -q -n logical --maxprocesses 8 -m "$(MARKS)" $(TESTS)

test-all:
	$(MAKE) test MARKS="not realtime"
	$(MAKE) test-realtime

test-oldest:
	mkdir -p out
	sed -n '/^dependencies/,/^\]/s/^ *"\([^>]*\)>=\([^",]*\).*/\1==\2/p' pyproject.toml >out/oldest.txt
	PIP_CONSTRAINT="$(CURDIR)/out/oldest.txt" $(MAKE) demo test VENV="$(VENV)-oldest" \
	    TESTS="$(or $(TESTS),tests/geometry tests/lidar tests/models tests/worlds)"

test-realtime: install
	$(RUN) -m pytest -q -m realtime $(TESTS)

coverage: compiled
	$(RUN) -m pytest -q -n logical --maxprocesses 8 -m "$(MARKS)" --cov --cov-report=term-missing $(TESTS)

paper: compiled
	$(RUN) scripts/maintenance/reproduce_paper.py --trials $(TRIALS)

fuzz: compiled
	export FUZZ_UNTIL=$$(($$(date +%s) + 60 * $(MINUTES))); while [ $$(date +%s) -lt $$FUZZ_UNTIL ]; do \
	    $(RUN) -m pytest -q -n logical --maxprocesses 8 -m hypothesis --hypothesis-profile=random $(TESTS) || exit; done

check: install
	$(RUN) -m ruff check .
	$(RUN) -m ruff format --check .
	$(RUN) -m mypy

docs: install
	$(RUN) -m sphinx -W --keep-going -q docs out/site
	@echo "open file://$(CURDIR)/out/site/index.html in a browser, no network needed"

wheels: install
	$(RUN) -m build --outdir dist
	$(RUN) scripts/maintenance/compile_wheel.py dist
	$(RUN) scripts/maintenance/check_wheel.py dist

compiled: install  # what most tests need, once and not by each worker; with everything compiled, a few seconds
	@$(RUN) -m drake_starnav simulate room --quiet --set simulation.timeout=8 >/dev/null 2>&1 || true

install:
	@sh scripts/maintenance/make_venv.sh "$(VENV)" "$(PYTHON)"

clean:
	rm -rf "$(VENV)" "$(VENV)-oldest" out dist
	find drake_starnav -name __pycache__ -prune -exec rm -r {} +
