#!/usr/bin/env python3
"""Opens a recording in the headless viewer, writes what it shows as a picture, and fails on a blank or broken one.

usage: screenshot.py [--rerun PATH] [--size 1440x900] RECORDING PICTURE

Needs the viewer (pip install rerun-sdk==0.36.3 pillow) and a software Vulkan driver (Debian: mesa-vulkan-drivers).
Exit code 1, with the reason, if there is no picture, it has too few colours, or no part of it is a lit garment.
"""

import argparse
import os
import signal
import socket
import subprocess
import sys
import tempfile
import time

from PIL import Image

# A viewer that shows nothing is a few flat greys; the smallest recording here has several thousand colours.
FEWEST_COLOURS = 500
# Share of pixels that are clearly coloured (garments, colour bars): none in an empty or unlit scene.
SMALLEST_COLOURED_SHARE = 0.03


def free_port():
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return s.getsockname()[1]


def shoot(rerun, recording, picture, size):
    """Runs the viewer until its picture passes; on a busy machine the first may show the file still loading."""
    reason = ""
    for attempt in range(6):
        with tempfile.TemporaryDirectory() as runtime:
            environment = dict(os.environ, XDG_RUNTIME_DIR=runtime, RUST_LOG="off")
            command = [rerun, recording, "--headless", "--bind", "127.0.0.1", "--port", str(free_port()),
                       "--window-size", size, "--screenshot-to", picture]
            # In a session of its own: `rerun` starts the viewer proper, which outlives it if it is killed alone.
            viewer = subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                                      start_new_session=True)
            try:
                reason = viewer.communicate(timeout=120)[0].strip()
            except subprocess.TimeoutExpired:
                os.killpg(viewer.pid, signal.SIGKILL)
                viewer.communicate()
                reason = "the viewer did not finish within 120 s"
        if os.path.exists(picture):
            reason = fault(picture)
            if not reason:
                return
        time.sleep(2 * (attempt + 1))
    sys.exit(f"{recording}: no picture: {reason or 'the viewer said nothing'}")


def fault(picture):
    """What is wrong with the picture; empty if nothing is."""
    image = Image.open(picture).convert("RGB")
    small = image.resize((image.width // 4, image.height // 4))
    pixels = small.tobytes()
    triples = [pixels[i:i + 3] for i in range(0, len(pixels), 3)]
    colours = len(set(triples))
    coloured = sum(max(t) - min(t) > 60 for t in triples) / len(triples)
    if colours < FEWEST_COLOURS:
        return (f"{picture}: {colours} colours, expected at least {FEWEST_COLOURS}: a blank picture?")
    if coloured < SMALLEST_COLOURED_SHARE:
        return (f"{picture}: {100 * coloured:.1f} % of it is coloured, expected at least "
                 f"{100 * SMALLEST_COLOURED_SHARE:.0f} %: no garment in sight?")
    print(f"{picture}: {image.width}x{image.height}, {colours} colours, {100 * coloured:.0f} % coloured")
    return ""


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rerun", default="rerun", help="the viewer's program")
    parser.add_argument("--size", default="1440x900", help="size of the window")
    parser.add_argument("recording")
    parser.add_argument("picture")
    options = parser.parse_args()
    if os.path.exists(options.picture):
        os.remove(options.picture)
    os.makedirs(os.path.dirname(os.path.abspath(options.picture)), exist_ok=True)
    shoot(options.rerun, options.recording, options.picture, options.size)


if __name__ == "__main__":
    main()
