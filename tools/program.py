"""The program as `cargo build --release` leaves it, for the scripts of this folder."""

import json
import signal
import subprocess
from pathlib import Path

PROGRAM = Path(__file__).resolve().parent.parent / "target/release/isolume"


class Failed(Exception):
    """What the program said last, or the signal that ended it."""


def isolume(*words, program=PROGRAM):
    """What it prints."""
    done = subprocess.run([str(word) for word in (program, *words)], capture_output=True, text=True)
    if done.returncode < 0:
        raise Failed(f"{words[0]}: ended by {signal.Signals(-done.returncode).name}")
    if done.returncode > 0:
        said = done.stderr.strip().splitlines()
        raise Failed(said[-1] if said else f"{words[0]}: ended with status {done.returncode}")
    return done.stdout


def isolume_json(*words, program=PROGRAM):
    """What it prints as JSON."""
    return json.loads(isolume(*words, "--json", program=program))
