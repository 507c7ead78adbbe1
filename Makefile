# setup: a Python environment in .venv     demo: record five real episodes     drive: a robot, in the browser
# test: the tests
# check: everything that CI checks          format: put the code in order      constraints: pin what is installed
# bench: list what measures Handrail        soak: hours of commands and faults (HOURS=2)
# Another Python than the one found: make setup PYTHON=/path/to/python3.12

.PHONY: setup demo drive test check format constraints bench soak
.DELETE_ON_ERROR:
.DEFAULT_GOAL := setup

BIN := .venv/bin
STAMP := .venv/.handrail-is-set-up
DEMO := outputs/demo

export HF_HUB_OFFLINE ?= 1
unexport PYTHONDONTWRITEBYTECODE  # with it, as in many images, every process would compile torch and LeRobot again

setup: $(STAMP)

$(STAMP): pyproject.toml constraints.txt .ci/setup
	PYTHON="$(PYTHON)" sh .ci/setup
	@touch $@

demo: $(STAMP)
	$(BIN)/handrail-demo $(DEMO) --overwrite

drive: $(STAMP)
	$(BIN)/handrail-cockpit

test: $(STAMP)
	$(BIN)/python -m pytest -n auto --dist loadfile

check: $(STAMP)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/pyright
	$(MAKE) test
	bash .ci/check_wheel

format: $(STAMP)
	$(BIN)/ruff check --fix-only .
	$(BIN)/ruff format .

constraints: $(STAMP)
	$(BIN)/python .ci/constraints.py

bench: $(STAMP)
	$(BIN)/python -m handrail.scripts.bench

soak: $(STAMP)
	$(BIN)/python -m handrail.scripts.bench soak --hours $(or $(HOURS),2) --drive
