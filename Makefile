# `make demo` and `make test` set up .venv themselves; nothing here needs root.
PYTHON ?= python3.11
PY := .venv/bin/python
READY := .venv/.ready
PEER := .venv-ros/.ready

.PHONY: demo test test-browser screenshots lint parity export-fixtures export-venv ros-peer setup docs pins clean

demo: $(READY)
	.venv/bin/openbelief demo --out demo-out

# TESTS=tests/replay for some of them.
test: $(READY)
	$(PY) -m pytest $(TESTS)

# The console in a real, headless Chromium (Debian's: apt-get install chromium), over a simulated robot in wall time.
test-browser: $(READY)
	OPENBELIEF_BROWSER=1 $(PY) -m pytest tests/browser

# The pictures of docs/operator.md, from the same tests: look at them before you commit them.
screenshots: $(READY)
	OPENBELIEF_SCREENSHOTS=docs/operator $(PY) -m pytest tests/browser -k "first_candidate or (walks_cancels and tap) or (screen_holds and closed) or contrast or scrubbed or whatever_is_open or by_name"

lint: $(READY)
	$(PY) -m ruff check .
	$(PY) -m ruff format --check .
	$(PY) -m mypy
	.venv/bin/lint-imports

# Our drivers against a real ROS 2 (rclpy, Fast-DDS), which lives in a venv of its own.
ros-peer: $(READY) $(PEER)
	timeout 420 $(PY) -m pytest tests/ros_peer

docs: $(READY)
	$(PY) scripts/write_docs.py

setup: $(READY)

$(READY): requirements/dev.txt requirements/livox_oracle.txt pyproject.toml
	@command -v $(PYTHON) >/dev/null || { echo "openbelief needs Python 3.11: install it, or name one with make PYTHON=/path/to/python3.11"; exit 1; }
	@$(PYTHON) scripts/check_system.py
	$(PYTHON) -m venv .venv || { echo "Python's venv module is missing. Mend it with: sudo apt-get install python3.11-venv"; exit 1; }
	$(PY) -m pip install --quiet --disable-pip-version-check --require-hashes -r requirements/dev.txt
	@$(PY) -m pip install --quiet --disable-pip-version-check --no-deps --require-hashes -r requirements/livox_oracle.txt || echo "py-livox2 does not install here: the test against Livox's own SDK will skip"
	$(PY) -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation -e .
	@touch $@

$(PEER): requirements/ros-peer.txt
	rm -rf .venv-ros
	$(PYTHON) -m venv .venv-ros
	.venv-ros/bin/python -m pip install --quiet --disable-pip-version-check --require-hashes -r requirements/ros-peer.txt
	@touch $@

# Exporting networks and comparing them with their reference implementations: torch, in a .venv of its own (6 GB).
# Where it is, `make test` also asks a real model server (tests/robot_app/models/test_server.py).
EXPORT := .venv-export/.ready
export-venv: $(EXPORT)

parity: $(EXPORT)
	PYTHONPATH=. .venv-export/bin/python scripts/export/parity.py $(ARCHITECTURES)

export-fixtures: $(EXPORT)
	PYTHONPATH=. .venv-export/bin/python scripts/export/fixtures.py

$(EXPORT): requirements/export.txt
	$(PYTHON) -m venv .venv-export
	.venv-export/bin/python -m pip install --quiet --disable-pip-version-check --require-hashes -r requirements/export.txt
	@touch $@

# Maintainers: re-resolve the pins (hashes, no addresses).
pins: $(READY)
	$(PY) -m pip install --quiet uv
	for name in runtime voice agent dds dev; do $(PY) -m uv pip compile --quiet --universal --python-version 3.11 --generate-hashes --no-header --no-annotate requirements/$$name.in -o requirements/$$name.txt; done
	for name in export ros-peer; do $(PY) -m uv pip compile --quiet --python-version 3.11 --generate-hashes --no-header --no-annotate requirements/$$name.in -o requirements/$$name.txt; done

clean:
	rm -rf .venv .venv-ros .venv-export demo-out build *.egg-info
