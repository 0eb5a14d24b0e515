"""A field shared among two processes by a script that has no `if __name__ == "__main__"`."""

import os
import pathlib

import rolling

import geomech

print("once")
with geomech.workers.using(2):
    found = geomech.connection.fit(rolling.velocity, geomech.connection.grid(2, 140))
others = {p.name for p in pathlib.Path().glob("process-*")} - {f"process-{os.getpid()}"}
print(len(others), f"{abs(found.A).sum():.9g}")
