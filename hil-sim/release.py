#!/usr/bin/env python3
"""Packs what a rig needs without a toolchain into one archive with sums. Publishes nothing.

The files are built before, see docs/GETTING_STARTED.md. The emulated board stays out: its core is
GPL-2.0.
"""

import argparse
import hashlib
import io
import pathlib
import platform
import re
import subprocess
import sys
import tarfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
IMAGE = "thumbv7em-none-eabihf/release/interstage"
PROGRAMS = ["debug/rig", "debug/rig-probe", IMAGE]
LICENCES = ["LICENSE-MIT", "LICENSE-APACHE"]


def git(*arguments):
    command = ["git", "-C", str(ROOT), *arguments]
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--target", default=ROOT / "target", type=pathlib.Path, help="cargo's folder")
    parser.add_argument("--out", default=".", type=pathlib.Path, help="where the archive goes")
    given = parser.parse_args()
    files = [given.target / name for name in PROGRAMS] + [ROOT / name for name in LICENCES]
    for file in files:
        if not file.is_file():
            sys.exit(f"{file}: not there; build it first, see docs/GETTING_STARTED.md")
    version = re.search(r'^version = "(.+)"', (ROOT / "Cargo.toml").read_text(), re.M)[1]
    commit = git("rev-parse", "--short=10", "HEAD")
    if git("status", "--porcelain", "--untracked-files=no"):
        commit += "-changed"
    name = f"interstage-{version}-{commit}-{platform.system()}-{platform.machine()}".lower()
    contents = {file.name: file.read_bytes() for file in files}
    sums = [f"{hashlib.sha256(data).hexdigest()}  {file}\n" for file, data in contents.items()]
    contents["SHA256SUMS"] = "".join(sums).encode()
    archive = given.out / f"{name}.tar.gz"
    with tarfile.open(archive, "w:gz") as packed:
        for file, data in contents.items():
            entry = tarfile.TarInfo(f"{name}/{file}")
            entry.size, entry.mode = len(data), 0o755 if file.startswith("rig") else 0o644
            packed.addfile(entry, io.BytesIO(data))
    print(archive)


if __name__ == "__main__":
    main()
