#!/usr/bin/env python3
"""Runs the recipes of the guide: each section's command, then its Python lines.

    recipes.py VOXLATHE

Lines that import what is not there are left out, and said to be.
"""

import os
import re
import subprocess
import sys
import tempfile

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))


def main(voxlathe):
    with open(os.path.join(ROOT, "src/guide/recipes.md")) as page:
        sections = re.split(r"^# ", page.read(), flags=re.M)[1:]
    assert len(sections) >= 12
    with tempfile.TemporaryDirectory() as place:
        os.symlink(os.path.join(ROOT, "scenes"), os.path.join(place, "scenes"))
        os.mkdir(os.path.join(place, "bin"))
        os.symlink(os.path.abspath(voxlathe), os.path.join(place, "bin/voxlathe"))
        path = os.path.join(place, "bin") + os.pathsep + os.environ["PATH"]
        for section in sections:
            name = section.splitlines()[0]
            for kind, text in re.findall(r"```([^\n]+)\n(.*?)```", section, flags=re.S):
                if kind == "sh":
                    done = subprocess.run(
                        ["sh", "-ec", text], cwd=place, env={**os.environ, "PATH": path},
                        capture_output=True, text=True,
                    )
                    assert done.returncode == 0, (name, done.stderr)
                    continue
                done = subprocess.run(
                    [sys.executable, "-c", text], cwd=place, capture_output=True, text=True
                )
                missing = re.search(r"ModuleNotFoundError: No module named '(\w+)", done.stderr)
                if missing and f"import {missing[1]}" in text:
                    print(f"{name}: left out, {missing[1]} is not there")
                    continue
                assert done.returncode == 0, (name, done.stderr)
                print(f"{name}: runs")


main(*sys.argv[1:])
