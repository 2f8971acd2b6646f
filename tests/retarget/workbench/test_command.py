"""`tooncap workbench`: an address is printed, the page is there, and ^C ends it."""

import os
import re
import signal
import subprocess
import sys
import urllib.request
from pathlib import Path

import pytest

from retarget.cli import main

ROOT = Path(__file__).resolve().parents[3]


@pytest.mark.skipif(os.name != "posix", reason="^C is sent as POSIX has it")
def test_the_page_is_at_the_printed_address_until_it_is_interrupted(tmp_path):
    (tmp_path / "hop.shot.toml").write_text('clip = "hop.mp4"\n')
    command = [sys.executable, "-m", "retarget.cli", "workbench", str(tmp_path), "--no-open"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=ROOT) as running:
        try:
            line = running.stdout.readline()
            (address,) = re.findall(r"http://127\.0\.0\.1:\d+/\?token=[\w-]{20,}", line)
            with urllib.request.urlopen(address, timeout=10) as answer:
                assert b"static/main.js" in answer.read()
            running.send_signal(signal.SIGINT)
            assert running.wait(20) == 0
            assert running.stdout.read().strip() == f"{tmp_path}: all is saved"
        finally:
            running.kill()


@pytest.mark.parametrize("file", ["nothing.shot.toml", "text.txt"])
def test_what_cannot_be_opened_is_refused_in_a_sentence(tmp_path, capsys, file):
    (tmp_path / "text.txt").write_text("no cartoon")
    assert main(["workbench", str(tmp_path / file), "--no-open"]) == 2
    said = capsys.readouterr()
    assert said.out == "" and len(said.err.strip().splitlines()) == 1 and file in said.err
