"""Packages from PyPI for a script of this folder, in a virtual environment of its own."""

import os
import subprocess
import sys
import venv
from pathlib import Path


def enter(home, packages, alone=()):
    """Starts the script again in the environment in the folder `home`, with these packages installed; returns there.

    Those in `alone` are installed without the packages that they ask for. What has been installed is written down when
    it is there: an installation that was interrupted is done again.
    """
    home = Path(os.path.abspath(home))
    if Path(sys.prefix) == home:
        return
    python, installed = home / "bin/python", home / "installed"
    wanted = {*packages, *alone}
    if not installed.exists():
        # Links are left as they are where an earlier installation was interrupted.
        try:
            venv.create(home, with_pip=True, symlinks=True)
        except subprocess.CalledProcessError:
            sys.exit(f"no virtual environment can be made in {home}: apt-get install python3-venv")
    found = set(installed.read_text().split()) if installed.exists() else set()
    if not wanted <= found:
        for switches, names in [([], packages), (["--no-deps"], alone)]:
            if names:
                subprocess.run([python, "-m", "pip", "install", "--quiet", *switches, *sorted(names)],
                               check=True, stdout=sys.stderr)
        installed.write_text(" ".join(sorted(found | wanted)))
    os.execv(python, [str(python), *sys.argv])
