# The two commands: `make demo` and `make test`. Both install what they need into .venv.
PYTHON ?= python3
BIN := .venv/bin

MINUTES ?= 10
SEED ?= 1
SCALE ?= 1
RESULTS_SEED ?= 1000
PHOTOGRAPHS ?= ../shared/data
PICTURED := $(and $(wildcard $(PHOTOGRAPHS)/cables),$(wildcard $(PHOTOGRAPHS)/mbest),"$(PHOTOGRAPHS)/cables" "mbest:$(PHOTOGRAPHS)/mbest")
BOTH := default,paper

.PHONY: demo test test-ros lint docs fuzz bench results clean

demo: .venv/installed
	$(BIN)/dloftbs demo --out demo

# README's moving picture, from a demo of its own.
docs/images/demo.webp: .venv/installed-dev
	$(BIN)/dloftbs demo --out build/demo
	$(BIN)/python -m benchmarks.moving_picture build/demo/overlay.mp4

# In as many processes as there are cores; one that is done early takes tests over from another. The kernels are
# compiled before: processes that meet an empty cache each compile all of them, in the middle of tests with deadlines.
test: .venv/installed-dev
	$(BIN)/dloftbs warmup
	$(BIN)/python -m pytest --numprocesses logical --maxprocesses 8 --dist worksteal

# The node of ROS 2, with a ROS that comes from pip, in an environment of its own.
test-ros: .venv-ros/installed
	.venv-ros/bin/python -m pip install --quiet --no-compile ./ros2/dloftbs_ros
	.venv-ros/bin/python -m pytest ros2/dloftbs_ros/test

lint: .venv/installed-dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

# The site, in build/site; a warning is an error. Its packages are in an environment of its own.
docs: .venv-docs/installed
	.venv-docs/bin/python -m sphinx --quiet --fail-on-warning --keep-going --builder html docs build/site

# All properties with ten times as many examples, then hostile input until the minutes are over, new with every seed;
# or one case again: make fuzz FAMILY=combs SEED=7 CASE=12.
# What is found stays in build/fuzz. See docs/maintainers/fuzzing.md.
fuzz: .venv/installed-dev
	$(if $(FAMILY),,HYPOTHESIS_PROFILE=thorough $(BIN)/python -m pytest --quiet -m hypothesis \
		--numprocesses logical --maxprocesses 8 --dist worksteal)
	PYTHONPATH=tests:. $(BIN)/python -m fuzz --minutes $(MINUTES) --seed $(SEED) \
		$(if $(FAMILY),--family $(FAMILY)) $(if $(CASE),--case $(CASE))

# docs/maintainers/performance-details.md with its plots, and from it docs/performance.md, on a machine that does nothing else.
bench: .venv/installed-dev
	$(BIN)/python -m benchmarks.speed --docs docs/maintainers/performance-details.md
	$(BIN)/python -m benchmarks.growth --docs docs/maintainers/performance-details.md --plot docs/images/performance/growth.png
	$(BIN)/python -m benchmarks.profile --docs docs/maintainers/performance-details.md --plot docs/images/performance/profile.png
	$(BIN)/python -m benchmarks.throughput --docs docs/maintainers/performance-details.md
	$(BIN)/python -m benchmarks.recordings --docs docs/maintainers/performance-details.md
	$(BIN)/python -m benchmarks.batch --docs docs/maintainers/performance-details.md
	$(BIN)/python -m benchmarks.process --docs docs/maintainers/performance-details.md
	$(BIN)/python -m benchmarks.summary --details docs/maintainers/performance-details.md --docs docs/performance.md

# docs/results.md and the pages that it leads to, with the line of README and the paper's figures: the default method,
# the published one, and the baseline that gets the start; the default again, with one cable known. 90 minutes on two
# cores; whatever is finished stays in build/. SCALE=0.05 has fewer scenes, and says so. Photographs are scored where
# there are any; else their page stays.
results: .venv/installed-dev
	$(BIN)/dloftbs evaluate --method $(BOTH),cpd --scale $(SCALE) --seed $(RESULTS_SEED) --out build/results
	$(BIN)/dloftbs evaluate rgb rgbd simulated --method default --set linking.objects=1 --scale $(SCALE) --seed $(RESULTS_SEED) \
		--out build/one-cable
	$(if $(PICTURED),$(BIN)/dloftbs evaluate $(PICTURED) --method $(BOTH) --out build/photographs)
	$(BIN)/python -m dloftbs_lab.evaluation.report.docs_page build/results docs --one-cable build/one-cable \
		$(if $(PICTURED),--photographs build/photographs)
	$(BIN)/python -m benchmarks.paper_strips docs/images/paper

clean:
	rm -rf .venv .venv-ros .venv-docs demo dist build

.venv/bin/python:
	$(PYTHON) -m venv .venv

# What is imported is compiled then; most of what is installed never is.
.venv/installed: .venv/bin/python pyproject.toml
	$(BIN)/python -m pip install --quiet --no-compile --editable ".[headless]"
	touch $@

.venv/installed-dev: .venv/bin/python pyproject.toml
	$(BIN)/python -m pip install --quiet --no-compile --editable ".[dev]"
	touch $@ .venv/installed

.venv-docs/installed: pyproject.toml docs/requirements.txt
	$(PYTHON) -m venv .venv-docs
	.venv-docs/bin/python -m pip install --quiet --no-compile --requirement docs/requirements.txt --editable ".[headless]"
	touch $@

# Builds of ROS by third parties, so pinned, and for tests alone: robots have a ROS of their own.
.venv-ros/installed: pyproject.toml
	$(PYTHON) -m venv .venv-ros
	.venv-ros/bin/python -m pip install --quiet --no-compile "ros-jazzy-rclpy[fastrtps]==7.1.6" ros-jazzy-sensor-msgs \
		ros-jazzy-visualization-msgs ros-jazzy-diagnostic-msgs ros-jazzy-std-srvs "pytest>=7.4" --editable ".[headless]"
	touch $@
