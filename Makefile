# Every target makes .venv first (.ci/setup.sh: once, then again when pyproject.toml or constraints.txt changes).
.DEFAULT_GOAL := help
.PHONY: help demo gallery test bench format setup clean

# PyTorch's CPU wheels live at an address of their own; on Linux without an NVIDIA card, give it here.
TORCH_INDEX ?=
# Empty: the newest of python3.14 ... python3.11, python3.
PYTHON ?=
# More words for the tool behind the target: make test ARGS="-k matte"
ARGS ?=
export TORCH_INDEX PYTHON

BIN = .venv/bin
# Two workers, each with a pool of threads in every library, would only stand in each other's way.
ONE_THREAD = OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 MKL_NUM_THREADS=1 VECLIB_MAXIMUM_THREADS=1 \
	NUMBA_NUM_THREADS=1 OPENCV_FOR_THREADS_NUM=1

help:  ## show this list
	@echo "make TARGET, where TARGET is one of"
	@sed -n 's/^\([a-z]*\):.*## /\1  /p' Makefile | while read -r name what; do \
		printf '  %-8s %s\n' "$$name" "$$what"; done

demo: setup  ## capture the built-in cartoon, lend its motion to another drawing, write the videos
	@$(BIN)/tooncap demo $(ARGS)

gallery: setup  ## make the pictures of the README anew (ARGS="analogy desk" for some)
	@$(BIN)/python -m notebooks.gallery.make $(ARGS)

test: setup  ## lint, format check and all tests (ARGS="-k matte" for some)
	@$(BIN)/ruff check
	@$(BIN)/ruff format --check
	@$(ONE_THREAD) $(BIN)/python -m pytest -q -n 2 --dist worksteal $(ARGS)

bench: setup  ## the figures: prints a table, writes tests/bench/results.json
	@$(BIN)/python tests/bench/run.py $(ARGS)

format: setup  ## put the code into the house format, and mend what the linter can
	@$(BIN)/ruff check --fix
	@$(BIN)/ruff format

setup:  ## make .venv with everything in it; the other targets do it by themselves
	@sh .ci/setup.sh

clean:  ## remove .venv and the caches, and nothing that you made
	@rm -rf .venv .browser .pytest_cache .ruff_cache .hypothesis dist
	@find capture mocap retarget fixtures tests -name __pycache__ -prune -exec rm -rf {} +
