# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0

# The Python to use: make PYTHON=/usr/bin/python3.12 test
PYTHON ?=
PYTEST_ARGS ?=
MUTANTS_ARGS ?=
# One worker more than processors: a test of the node mostly waits.
pytest := --timeout 300 -n $(shell expr $$(nproc) + 1) --dist worksteal
# The Python that `make bench-system` measures, as the distribution or a ROS has it.
SYSTEM_PYTHON ?= /usr/bin/python3

# Any Python that can run tools/setup_env.py, which finds one that suits, or says what to do.
boot := $(shell for each in $(PYTHON) python3 python3.13 python3.12 python3.11 python3.10; do \
	$$each -c 'import sys; sys.exit(sys.version_info < (3, 8))' >/dev/null 2>&1 \
	&& echo $$each && break; done)
environment = $(or $(boot),$(error No Python found: install Python 3.10 to 3.13 with its venv \
	module (Debian and Ubuntu: sudo apt install python3-venv))) tools/setup_env.py \
	--interpreter '$(PYTHON)'

# The ROS wheels of an activated environment mark their set-up as done; ours do their own.
unexport _ROS_WHEELS_BOOTSTRAP_COMPLETE
# Tests start hundreds of processes: each would compile the package anew.
unexport PYTHONDONTWRITEBYTECODE

.DEFAULT_GOAL := help
.PHONY: help demo test test-noble noble-environment lint colcon dist bench bench-system robustness \
	any-camera distance compression frame-rate cross-traffic mutants locate film docs docs-links \
	version release pins clean

help:  ## Show this list
	@sed -n 's/^\([a-z-]*\):.*## /\1 /p' $(MAKEFILE_LIST) \
		| while read -r name text; do printf '  make %-11s %s\n' "$$name" "$$text"; done

demo:  ## Drive through a rendered street, live over DDS; results in out/demo
	@$(environment) .venv --extras ros,map
	@.venv/bin/phase_traj demo --output out/demo

test:  ## Run all tests; PYTEST_ARGS='-k name' selects some
	@$(environment) .venv --extras ros,test
	@.venv/bin/python -m pytest $(pytest) -m 'not linter' $(PYTEST_ARGS)

# What depends on the versions of numpy, OpenCV and Python: these tests run all but 30 of the 1,375
# lines of the package that call them; then the transforms without scipy.
noble := $(addprefix test/core/,camera correlation fixed rotation calibration/test_turn_fit.py \
	frames/test_prepare.py road/test_patch_correlator.py road/test_road_patches.py test_auto.py) \
	$(addprefix test/io/,images maps messages results sources test_params_file.py \
	replay/test_any_camera.py replay/test_replay_overlays.py) test/cli/test_locate.py \
	$(addprefix test/integration/,test_live_heading.py test_node.py)
test-noble: noble-environment  ## Test with the versions of Ubuntu 24.04 (needs Python 3.12)
	@.venv-noble/bin/python -m pytest $(pytest) $(or $(PYTEST_ARGS),$(noble))
ifeq ($(PYTEST_ARGS),)
	@.venv-noble/bin/python -m pytest $(pytest) --without-scipy test/core/correlation
endif

noble-environment:
	@$(environment) .venv-noble --extras ros,test --wheels --python-version 3.12 \
		--constraints tools/constraints-noble.txt

lint:  ## Run ruff, mypy, ament_flake8 and ament_pep257
	@$(environment) .venv --extras ros,test,lint
	@tools/lint.sh .venv/bin/python

colcon:  ## Build, install and test with colcon in a clean workspace
	@$(environment) .venv-colcon --extras ros,test,colcon --without-package
	@.venv-colcon/bin/python tools/check_install.py

dist:  ## Build sdist and wheel into out/dist; install and try them with pip, uv and pipx
	@$(environment) .venv-dist --extras dist --wheels
	@.venv-dist/bin/python tools/check_dist.py

bench:  ## Measure speed against peers, side by side; writes docs/measurements/benchmarks.md
	@$(environment) .venv --extras ros,bench
	@.venv/bin/python -m benchmarks.speed.run

film:  ## Measure replays of a film beside decoding alone; writes docs/measurements/film.md
	@$(environment) .venv --extras ros,video
	@.venv/bin/python -m benchmarks.speed.film
	@.venv/bin/python -m benchmarks.speed.hour

bench-system:  ## Measure speed on the distribution's OpenCV, for docs/measurements/benchmarks.md
	@PYTHONPATH="$(CURDIR)$${PYTHONPATH:+:$$PYTHONPATH}" $(SYSTEM_PYTHON) -m benchmarks.speed.installations

robustness:  ## Measure robustness to noise against peers; writes docs/measurements/robustness.md
	@$(environment) .venv --extras ros
	@.venv/bin/python -m benchmarks.turns.robustness

distance:  ## Measure distances on clips and drives; writes docs/measurements/distance.md
	@$(environment) .venv --extras ros
	@.venv/bin/python -m benchmarks.distance.distance

compression:  ## Measure distances in compressed films; writes docs/measurements/compression.md
	@$(environment) .venv --extras ros,video
	@.venv/bin/python -m benchmarks.distance.compression

frame-rate:  ## Measure drives at 5 to 120 Hz; writes docs/measurements/frame_rate.md
	@$(environment) .venv --extras ros
	@.venv/bin/python -m benchmarks.distance.frame_rate

cross-traffic:  ## Measure lorries before a standing vehicle; writes docs/measurements/cross_traffic.md
	@$(environment) .venv --extras ros
	@.venv/bin/python -m benchmarks.heading.cross_traffic

# The odometry along the rendered drives takes ten minutes once, and is kept.
locate:  ## Measure where on a road map drives are; writes docs/measurements/locate.md
	@$(environment) .venv --extras ros,map
	@.venv/bin/python -m benchmarks.location.odometry out/locate/odometry 00 02 08 00-learned
	@.venv/bin/python -m benchmarks.location.locate

mutants:  ## Plant faults in the core and count those that no test finds; MUTANTS_ARGS='--only path'
	@$(environment) .venv --extras ros,test
	@.venv/bin/python tools/mutants.py $(MUTANTS_ARGS)

any-camera:  ## Measure the turns of 16 unknown cameras; writes docs/measurements/any_camera.md
	@$(environment) .venv --extras ros
	@.venv/bin/python -m benchmarks.turns.any_camera

# Warnings are errors: a link, an anchor or an image that leads nowhere is one.
docs:  ## Build the site into out/docs, and check its links
	@$(environment) .venv --extras ros,docs
	@.venv/bin/python tools/document_cli.py
	@.venv/bin/python -m sphinx --quiet --fail-on-warning --keep-going --fresh-env \
		--doctree-dir out/doctrees docs out/docs
	@echo out/docs/index.html

docs-links:  ## Check the links of the docs to other sites
	@$(environment) .venv --extras ros,docs
	@.venv/bin/python -m sphinx --quiet -b linkcheck --doctree-dir out/doctrees \
		docs out/docs-links

version:  ## Set the version everywhere, and date the changelog: make version VERSION=0.2.0
	@$(environment) .venv-dist --extras dist --wheels
	@.venv-dist/bin/python tools/release.py --set-version '$(VERSION)'

release:  ## Check a tagged tree, and build its sdist, wheel and changes into out/dist
	@$(environment) .venv-dist --extras dist --wheels
	@.venv-dist/bin/python tools/release.py
	@.venv-dist/bin/python tools/check_dist.py
	@.venv-dist/bin/python tools/release.py --changes out/dist/CHANGES.rst

pins:  ## Renew tools/constraints.txt, for every Python at once
	@$(environment) .venv-pins --extras pins
	@.venv-pins/bin/uv --system-certs pip compile --quiet --upgrade --universal \
		--python-version 3.10 --no-annotate --no-emit-package setuptools \
		--custom-compile-command 'make pins' --output-file tools/constraints.txt setup.py \
		$(addprefix --extra ,ros test bench lint colcon docs dist)

clean:  ## Remove environments, caches, builds and the demo's results
	@rm -rf .venv .venv-* *.egg-info build install log out/demo
	@rm -rf .hypothesis .mypy_cache .pytest_cache .ruff_cache .coverage
	@find . -name __pycache__ -type d -prune -exec rm -rf {} +
