# make run    TachoBot on its doubles for 10 s in real time
# make play   the same with a page on which one sees it, breaks it and rewinds it, until Ctrl-C
# make test   lint, types, import contracts, tests: those for all cores, and beside them those in real
#             time, which mostly wait and go first where both want a processor
# make test-fast  the quick tests only: neither slow ones nor those in real time
# make test-portable  those, and all of what another Python could do otherwise: CI, on the newest
# make vm-test  the service in a Debian guest: real kernel, real systemd (needs root and QEMU)
# make pi-test  both robots on an emulated Raspberry Pi 3B, down to its I2C controller; PI_KERNELS chooses
#             from stock and rt (downloads 160 MB once; no root)
# make update-test  twenty bad builds and twenty equal ones deployed to a container with a systemd of its
#             own (half an hour; needs root and systemd-nspawn)
# make pi-full-test  a whole Debian on an emulated Raspberry Pi, deployed to by ssh, updated, and cut
#             off at steps of it (root; some 45 minutes on two cores); STEPS chooses from deploy, cuts,
#             page, restart and each-cut
# make campaign  robots struck, killed and soaked, mutants, wire formats: each part of MINUTES minutes
#             (30), in turn, into docs/reliability.md; PARTS chooses (tests/reliability/run.py)
# make bench  benchmarks against peers; each prints its ratio last
# make ros    .venv-ros: the interpreter of the ROS 2 node, with rclpy from wheels
# make test-ros  the tests of the ROS 2 node, with real rclpy; part of `make test` where .venv-ros is
# make docs   this documentation as a site in build/docs; a link that leads nowhere fails it
# make pictures  those of README and docs, from runs on this machine (needs chromium and webp)
# make clean  remove what the others made
#
# Each target does its own set-up, in .venv. PYTHON chooses the interpreter: make test PYTHON=python3.12
# VENV and ROS_VENV choose other folders than .venv and .venv-ros, PYTEST_OPTIONS adds to pytest's,
# such as --forbid-skips

PYTHON ?= python3
VENV ?= .venv
ROS_VENV ?= .venv-ros
PYTEST_OPTIONS ?=
BIN := $(VENV)/bin
# setuptools warns of every editable installation that is made from the folder of the package.
INSTALL = PYTHONWARNINGS="ignore:Editable installation" \
	$(BIN)/python -m pip install --quiet --disable-pip-version-check
# The variable keeps a dependency of rclpy from starting every interpreter of that venv twice.
INSTALL_IN_ROS = _ROS_WHEELS_BOOTSTRAP_COMPLETE=1 \
	$(ROS_VENV)/bin/python -m pip install --quiet --quiet --disable-pip-version-check
ON_ALL_CORES = $(BIN)/python -m pytest -q -n auto --dist worksteal --ignore=tests/ros2
# They wait most of the time, and what they assert holds on a busy machine.
IN_REAL_TIME = $(BIN)/python -m pytest -q -n 4 --dist worksteal --ignore=tests/ros2
# What waits on a clock may be too late once beside enough other work: that is shown, and what failed
# is tried once more.
AGAIN = { $(1); } || { [ $$? = 1 ] && echo "make: what failed in real time, once more" && \
	$(1) --last-failed --last-failed-no-failures=none; }
WITH_ROS = $(if $(wildcard $(ROS_VENV)/installed-node),test-ros)

# The tests start some hundred processes: each would compile every module again.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: run play test all-cores real-time test-fast test-portable \
	lint types ros test-ros vm-test pi-test pi-full-test update-test campaign bench docs pictures clean \
	interpreter wheels-of-rclpy
.DEFAULT_GOAL := run

run: $(VENV)/installed-run
	@$(BIN)/firmware-runtime run tachobot --doubles --for 10

play: $(VENV)/installed-view
	@$(BIN)/firmware-runtime play $(BOARD)

# The parts of a test that need no other part, beside one another; what one says is shown when it ends.
test: lint
	@echo "make: types, the tests for all cores, those in real time$(if $(WITH_ROS), and of ROS 2)"
	@$(MAKE) --no-print-directory --jobs=4 --keep-going --output-sync=target \
		types all-cores real-time $(WITH_ROS)

all-cores: $(VENV)/installed-test
	@MAKEFLAGS= nice -n 5 $(ON_ALL_CORES) -m "not real_time and not hardware" $(PYTEST_OPTIONS)

real-time: $(VENV)/installed-test
	@export MAKEFLAGS=; $(call AGAIN,$(IN_REAL_TIME) -m "real_time and not hardware" \
		-o cache_dir=build/pytest/real-time $(PYTEST_OPTIONS))

test-fast: $(VENV)/installed-test
	@$(ON_ALL_CORES) -m "not slow and not real_time and not hardware" $(PYTEST_OPTIONS)

test-portable: $(VENV)/installed-test
	@$(ON_ALL_CORES) -m "(not slow or portable) and not real_time and not hardware" \
		$(PYTEST_OPTIONS)

lint: $(VENV)/installed-test
	@$(BIN)/ruff check .
	@$(BIN)/ruff format --check .

types: $(VENV)/installed-test
	@nice -n 5 $(BIN)/mypy

ros: $(ROS_VENV)/installed-node

# A test's DDS and its nodes are in domains of their own.
test-ros: $(ROS_VENV)/installed-test $(VENV)/installed-run
	@export FIRMWARE_RUNTIME_TEST_PYTHON=$(abspath $(BIN))/python \
		FIRMWARE_RUNTIME_ROS_VENV=$(abspath $(ROS_VENV)); \
	$(call AGAIN,$(BIN)/python -m firmware_runtime.links.ros2.interpreter $(ROS_VENV) \
		-m pytest -q -n 3 --dist worksteal $(or $(ROS_TESTS),tests/ros2) \
		-o cache_dir=build/pytest/ros2 $(PYTEST_OPTIONS))

vm-test: $(VENV)/installed-run
	@$(BIN)/python -m tests.vm.run

pi-test: $(VENV)/installed-run
	@$(BIN)/python -m tests.pi.run $(PI_KERNELS)

update-test: $(VENV)/installed-test
	@$(BIN)/python -m tests.updates.run

pi-full-test: $(VENV)/installed-test
	@$(BIN)/python -m tests.pi.full.run $(STEPS)

ALL_PARTS := mutants fuzzing dying soak campaigns planted networks machines
PARTS ?= $(ALL_PARTS)
MINUTES ?= 30
ifeq ($(strip $(PARTS)),)
$(error PARTS: no part; expected some of $(ALL_PARTS))
endif
ifneq ($(filter-out $(ALL_PARTS),$(PARTS)),)
$(error PARTS: no part $(filter-out $(ALL_PARTS),$(PARTS)); expected some of $(ALL_PARTS))
endif

campaign: $(VENV)/installed-fuzz
	@for part in $(PARTS); do \
		$(BIN)/python -m tests.reliability.run $$part --minutes $(MINUTES) --save || failed=1; done; \
		$(BIN)/python -m tests.reliability.document; exit $${failed:-0}

bench: $(VENV)/installed-bench
	@$(BIN)/firmware-runtime bench devstone

docs: $(VENV)/installed-docs
	@$(BIN)/python -m sphinx -q -W --keep-going -d build/doctrees -b html docs build/docs
	@echo "docs: build/docs/index.html"

pictures: $(VENV)/installed-test
	@$(BIN)/python -m benchmarks.page.pictures

clean:
	rm -rf $(VENV) $(ROS_VENV) build dist *.egg-info .mypy_cache .ruff_cache .pytest_cache .hypothesis \
		.import_linter_cache .coverage htmlcov
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

interpreter:
	@command -v $(PYTHON) >/dev/null || { \
		echo "make: $(PYTHON) not found; install Python 3.11 or later (Debian: apt install python3)"; \
		exit 1; }
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { \
		echo "make: $$($(PYTHON) --version) is too old; install Python 3.11 or later" \
			"and say make PYTHON=python3.11"; \
		exit 1; }
	@$(PYTHON) -c 'import venv, ensurepip' 2>/dev/null || { \
		echo "make: the venv module is missing; install it (Debian: apt install python3-venv)"; \
		exit 1; }

$(VENV)/bin/python: | interpreter
	@echo "make: creating $(VENV)"
	@$(PYTHON) -m venv $(VENV)

wheels-of-rclpy:
	@test "$$(uname -sm)" = "Linux x86_64" || { \
		echo "make: there are wheels of rclpy for Linux on x86_64 only; here use Ubuntu 24.04's" \
			"package ros-jazzy-rclpy and a venv with --system-site-packages: docs/ros2.md"; \
		exit 1; }

$(ROS_VENV)/installed-node: ros2/requirements/node.txt pyproject.toml | interpreter wheels-of-rclpy
	@echo "make: installing rclpy and firmware-runtime into $(ROS_VENV)"
	@test -x $(ROS_VENV)/bin/python || $(PYTHON) -m venv $(ROS_VENV)
	@$(INSTALL_IN_ROS) --require-hashes --requirement ros2/requirements/node.txt
	@$(INSTALL_IN_ROS) --no-deps --editable .
	@touch $@

$(ROS_VENV)/installed-test: ros2/requirements/test.txt $(ROS_VENV)/installed-node
	@echo "make: installing the test tools of the ROS 2 node into $(ROS_VENV)"
	@$(INSTALL_IN_ROS) --require-hashes --requirement ros2/requirements/test.txt
	@touch $@

# Dependency groups take pip 25.1; the one that came with Python may be older.
$(VENV)/pip-of-groups: | $(VENV)/bin/python
	@$(INSTALL) 'pip>=25.1'
	@touch $@

$(VENV)/installed-run: pyproject.toml | $(VENV)/bin/python
	@echo "make: installing firmware-runtime into $(VENV)"
	@$(INSTALL) --editable .
	@touch $@

$(VENV)/installed-view: $(VENV)/installed-run
	@echo "make: installing what serves the page into $(VENV)"
	@$(INSTALL) --editable .[view]
	@touch $@

$(VENV)/installed-test: pyproject.toml tests/outsiders/requirements.txt | $(VENV)/pip-of-groups
	@echo "make: installing firmware-runtime and its test tools into $(VENV)"
	@$(INSTALL) --editable . --group test \
		$(addprefix --editable ,$(wildcard examples/*))
	@$(INSTALL) --no-deps \
		--requirement tests/outsiders/requirements.txt
	@touch $@ $(VENV)/installed-run $(VENV)/installed-view

# Where there is no wheel of atheris, fuzzing says so.
$(VENV)/installed-fuzz: $(VENV)/installed-test
	@echo "make: installing what fuzzes wire formats into $(VENV)"
	@$(INSTALL) --group fuzz || echo "make: not installed: wire formats are not fuzzed"
	@touch $@

$(VENV)/installed-bench: pyproject.toml | $(VENV)/pip-of-groups
	@echo "make: installing firmware-runtime and its benchmark peers into $(VENV)"
	@$(INSTALL) --editable . --group bench
	@touch $@ $(VENV)/installed-run

$(VENV)/installed-docs: docs/requirements.txt $(VENV)/installed-run
	@echo "make: installing what makes the documentation into $(VENV)"
	@$(INSTALL) -r docs/requirements.txt
	@touch $@
