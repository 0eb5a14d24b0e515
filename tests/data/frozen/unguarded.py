"""A field shared among two processes by a script that has no `if __name__ ==
"__main__"`."""

import rolling

import geomech
from geomech.runs import pending

pending.WORTH_PROCESSES = 0.0  # s
print("once")
with geomech.workers.using(2):
    found = geomech.geometry.connection.fit(
        rolling.velocity, geomech.geometry.connection.grid(2, 100)
    )
print(len(rolling.others()), f"{abs(found.A).sum():.9g}")
