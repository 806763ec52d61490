# make demo    drive the default scenario and leave its recording in out/
# make test    run the tests
# make check   lint, formatting and types
# make install only make the environment that the others use
#
# PYTHON=...   the interpreter for the environment; without it the best one found
# VENV=...     the environment's folder

VENV ?= .venv
PYTHON ?=
RUN = $(VENV)/bin/python

.PHONY: demo test check install clean

demo: install
	@mkdir -p out
	$(RUN) scripts/simulate.py forest --html out/forest.html --json out/forest.json

test: install
	$(RUN) -m pytest -q

check: install
	$(RUN) -m ruff check .
	$(RUN) -m ruff format --check .
	$(RUN) -m mypy

install:
	@sh scripts/make_venv.sh "$(VENV)" "$(PYTHON)"

clean:
	rm -rf "$(VENV)" out dist
	find drake_starnav -name '*.nbi' -delete
