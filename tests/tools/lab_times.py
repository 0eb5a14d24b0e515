"""How long a frame of the gait lab takes while a point is dragged, and a step of a
family. By hand, not collected by pytest:

    python tests/tools/lab_times.py

It takes what the tests of the page take: chromium, chromium-driver and selenium."""

import shutil
import statistics
import tempfile
from pathlib import Path

from selenium import webdriver
from selenium.webdriver.chrome.service import Service

from geomech import lab, scenes
from geomech.studies.maps.lab import Lab

FRAMES = """
lab.player.playing = false;
const times = [];
for (let k = 0; k < 500; k++) {
  const begun = performance.now();
  lab.update();
  document.querySelector("#curve svg").getBoundingClientRect();
  times.push(performance.now() - begun);
}
return times.slice(200);
"""
FAMILY = """
const times = [], slider = document.getElementById("value"), {min, max} = slider;
for (let k = 0; k < 60; k++) {
  slider.value = Number(min) + (max - min) * ((k * .37) % 1);
  const begun = performance.now();
  slider.dispatchEvent(new Event("input"));
  document.querySelector("#map svg").getBoundingClientRect();
  times.push(performance.now() - begun);
}
return times.slice(10);
"""


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        page = Path(folder) / "lab.html"
        lab.write(
            Lab(
                (scenes.load("three-link-glass"),), {"medium.C": [1.0, 1.5, 2.2, 3.0]}
            ).ask(),
            page,
        )
        options = webdriver.ChromeOptions()
        options.binary_location = shutil.which("chromium")
        for argument in (
            "--headless=new",
            "--no-sandbox",
            "--disable-gpu",
            f"--user-data-dir={folder}/profile",
        ):
            options.add_argument(argument)
        browser = webdriver.Chrome(
            options=options, service=Service(shutil.which("chromedriver"))
        )
        try:
            browser.get(page.as_uri())
            for name, script in (
                ("a frame with all tiers", FRAMES),
                ("a step of the family", FAMILY),
            ):
                times = sorted(browser.execute_script(script))
                print(
                    f"{name}: median {statistics.median(times):.1f} ms, 95 % {times[int(0.95 * len(times))]:.1f} ms"
                )
        finally:
            browser.quit()


if __name__ == "__main__":
    main()
