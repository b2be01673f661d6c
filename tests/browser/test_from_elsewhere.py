"""The console reached from another machine: TLS by the site's own authority, a login, a link and a QR code."""

from __future__ import annotations

import base64
import hashlib
import re
import socket
import ssl
import subprocess
import sys
import urllib.error
import urllib.request
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import pytest
from cryptography import x509
from cryptography.hazmat.primitives.serialization import Encoding, PublicFormat
from playwright.sync_api import Error, Playwright

from robot_app.benches.chromium import chromium_path
from robot_app.cli import main
from tests.browser.conftest import Program, Site, Tab, until

PASSWORD = "a horse, correctly"
CELL_PX, QUIET = 8, 4


def own_address() -> str | None:
    """An address of this machine that is not loopback; nothing is sent for it."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(("192.0.2.1", 9))
            return str(probe.getsockname()[0])
        except OSError:
            return None


ADDRESS = own_address()
pytestmark = pytest.mark.skipif(ADDRESS is None, reason="this machine has no address but loopback")


@dataclass(frozen=True)
class Reached:
    """The console at this machine's own address. authority: who made its certificate."""

    site: Site
    authority: Path
    certificate: x509.Certificate

    @property
    def pin(self) -> str:
        """What makes Chromium trust this one key, as installing the site's ca.pem makes it trust all of its."""
        key = self.certificate.public_key().public_bytes(Encoding.DER, PublicFormat.SubjectPublicKeyInfo)
        return base64.b64encode(hashlib.sha256(key).digest()).decode()


@pytest.fixture(scope="module")
def config(folder: Path) -> Path:
    """A site whose network has its own authority: `openbelief certs`, and its [console] section."""
    network = folder.parent / "site-certs"
    assert main(["certs", "-o", str(network), "--robot", "192.168.123.164", "--console", str(ADDRESS)]) == 0
    section = (network / "console" / "robot.toml").read_text()
    head = (folder / "robot.toml").read_text().replace('serve = "here"', 'serve = "off"')
    rest = re.sub(r"\n\[console\]\n.*?(?=\n\[|\Z)", "\n", head, flags=re.DOTALL)
    path = folder / "elsewhere.toml"
    path.write_text(rest + re.sub(r'"([\w.-]+\.(?:pem|key))"', rf'"{network}/console/\1"', section))
    return path


def refusal(config: Path) -> str:
    command = [sys.executable, "-m", "robot_app.cli", "run", "--config", str(config), "--console", f"{ADDRESS}:0"]
    ended = subprocess.run(command, input="", capture_output=True, text=True, timeout=60, check=False)
    assert ended.returncode == 1
    return ended.stderr


@pytest.fixture(scope="module")
def reached(config: Path) -> Iterator[Reached]:
    add = [
        sys.executable,
        "-m",
        "robot_app.cli",
        "accounts",
        "add",
        "ada",
        "--role",
        "operator",
        "--config",
        str(config),
    ]
    subprocess.run(add, input=PASSWORD + "\n", text=True, check=True)
    console = config.parent.parent / "site-certs" / "console"
    program = Program("run", "--config", str(config), "--console", f"{ADDRESS}:0")
    certificate = x509.load_pem_x509_certificate((console / "console.pem").read_bytes())
    yield Reached(Site(config.parent, program), console / "ca.pem", certificate)
    program.end()


def test_it_refuses_to_be_reached_without_a_certificate_and_while_nobody_can_log_in(folder, config):
    bare = folder / "bare.toml"
    bare.write_text((folder / "robot.toml").read_text())
    assert "not opened to" in (said := refusal(bare)) and "without TLS" in said and "openbelief certs --console" in said
    assert "nobody can log in" in (said := refusal(config)) and "openbelief accounts add" in said


def test_its_certificate_is_valid_for_its_address_by_the_sites_authority_alone(reached):
    trusted = ssl.create_default_context(cafile=reached.authority)
    with urllib.request.urlopen(reached.site.program.url + "/", context=trusted, timeout=20) as answer:
        assert answer.status == 200
    with pytest.raises(urllib.error.URLError, match="CERTIFICATE_VERIFY_FAILED"):
        urllib.request.urlopen(reached.site.program.url + "/", timeout=20)


@pytest.fixture(scope="module")
def trusting(playwright: Playwright, reached: Reached) -> Iterator[Tab]:
    pin = f"--ignore-certificate-errors-spki-list={reached.pin}"
    browser = playwright.chromium.launch(
        executable_path=chromium_path(), args=["--no-sandbox", "--no-proxy-server", pin]
    )
    tab = Tab(browser.new_context().new_page(), reached.site)
    tab.listen()
    yield tab
    browser.close()


def test_a_browser_that_does_not_know_the_authority_does_not_open_it(browser, reached):
    page = browser.new_page()
    with pytest.raises(Error, match="ERR_CERT_AUTHORITY_INVALID"):
        page.goto(reached.site.program.url)
    page.close()


def test_one_logs_in_by_name_takes_the_command_and_stops_over_tls(trusting, reached):
    trusting.may_complain = "401"
    page = trusting.page
    page.goto(reached.site.program.url)
    page.locator("#login-name").fill("ada")
    page.locator("#login-password").fill("a horse, wrongly")
    page.keyboard.press("Enter")
    until(lambda: "do not belong together" in trusting.words("login-error"), "the refusal")
    trusting.picture("login")
    page.locator("#login-password").fill(PASSWORD)
    page.keyboard.press("Enter")
    until(lambda: trusting.state().get("n"), "the first painted snapshot, over wss")
    trusting.take()
    trusting.stopped(lambda tab: tab.page.keyboard.press("Escape"))
    trusting.until_stopped_by("ada")
    [cookie] = page.context.cookies()
    assert cookie["secure"] and cookie["httpOnly"] and cookie["sameSite"] == "Strict"
    assert page.evaluate("isSecureContext") and trusting.trouble() == []


def test_the_terminals_qr_code_is_its_pairing_link_which_logs_in_once(trusting, reached):
    program = reached.site.program
    link = program.link()
    until(lambda: qr_code("".join(program.said)) == link, "the code of that link on the terminal")
    for role, seen in (("first", "#app"), ("again", "#login")):
        context = trusting.page.context.browser.new_context()
        page = context.new_page()
        page.goto(link)
        until(page.locator(seen).is_visible, role)
        if role == "again":
            assert "used already" in page.locator("#login-error").inner_text()
        context.close()


HALVES = {" ": (0, 0), "▀": (1, 0), "▄": (0, 1), "█": (1, 1)}


def qr_code(screen: str) -> str:
    """What a phone reads from the last QR code on a terminal's screen; "" where it reads none."""
    rows = [re.sub(r"\x1b\[[0-9;]*m", "", line.rstrip("\n")) for line in screen.splitlines()]
    drawn = [row for row in rows if len(row) > 20 and set(row) <= set(HALVES)]
    lines = drawn[-(len(drawn[-1]) // 2 + 1) :] if drawn else [" "]  # two rows of squares a line
    light = np.array([[HALVES[c][half] for c in line] for line in lines for half in (0, 1)], np.uint8)
    picture = np.kron(light * 255, np.ones((CELL_PX, CELL_PX), np.uint8))
    picture = np.pad(picture, QUIET * CELL_PX, constant_values=255)
    return cv2.QRCodeDetector().detectAndDecode(picture)[0]
