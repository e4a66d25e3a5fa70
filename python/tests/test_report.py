"""Pages of cuts and studies, read by a real browser at a phone's width."""

import html
import json
import re
import shutil
import subprocess

import pytest

import swarf
from swarf import SwarfError

pytest.importorskip("plotly")
BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
WIDTH = 390

# Looks at the page in a frame as wide as a phone, plays the chip, and writes what it finds into its own body.
WRAPPER = """<!doctype html><meta charset=utf-8><link rel=icon href="data:,">
<iframe src="PAGE" style="width:WIDTHpx;height:800px;border:0"></iframe>
<pre id=found></pre>
<script>
const frame = document.querySelector("iframe");
const wait = setInterval(() => {
  const page = frame.contentDocument, root = page && page.documentElement;
  if (!root || root.dataset.figures === undefined) return;
  clearInterval(wait);
  const canvas = page.querySelector("canvas"), inks = [];
  if (canvas) {
    const choice = page.querySelector("select");
    for (const option of choice.options) {
      choice.value = option.value;
      choice.onchange();
      const ink = canvas.toDataURL();
      let sum = 0;
      for (let i = 0; i < ink.length; i++) sum = (sum * 31 + ink.charCodeAt(i)) % 1000003;
      inks.push(sum);
    }
    page.querySelector(".controls button").click();
  }
  const figures = [...page.querySelectorAll(".figure")];
  document.getElementById("found").textContent = JSON.stringify({
    figures: figures.map(f => f.id),
    drawn: figures.filter(f => f.querySelectorAll("svg.main-svg path").length > 3).length,
    widest: Math.max(...figures.map(f => f.getBoundingClientRect().right)),
    width: root.scrollWidth,
    title: page.title,
    inks,
    text: page.body.innerText.slice(0, 4000),
    outside: [...page.querySelectorAll("[src],link[href]")].map(e => e.src || e.href),
  });
}, 50);
</script>
"""


def look(page, folder):
    """What the browser finds in a page, and what it says on its console."""
    if BROWSER is None:
        pytest.skip("no Chromium here: apt-get install chromium")
    wrapper = folder / "wrapper.html"
    wrapper.write_text(WRAPPER.replace("PAGE", page.name).replace("WIDTH", str(WIDTH)), encoding="utf-8")
    command = [BROWSER, "--headless=new", "--no-sandbox", "--disable-gpu", "--allow-file-access-from-files"]
    command += [
        f"--user-data-dir={folder / 'profile'}",
        "--enable-logging=stderr",
        "--virtual-time-budget=20000",
    ]
    done = subprocess.run(
        [*command, "--dump-dom", wrapper.as_uri()], capture_output=True, text=True, timeout=120
    )
    console = [line for line in done.stderr.splitlines() if "CONSOLE" in line]
    found = re.search(r"<pre id=\"?found\"?>(.*?)</pre>", done.stdout, re.DOTALL)
    assert found and found[1], f"the page never drew its figures: {console}"
    return json.loads(html.unescape(found[1])), console


@pytest.fixture(scope="module")
def study(cut, tmp_path_factory):
    """Two feeds by three speeds, and a cut that fails."""
    folder = tmp_path_factory.mktemp("study")
    return swarf.study(
        cut,
        feed=["0.1 mm", "0.15 mm"],
        speed=(100, 300, "m/min"),
        n=3,
        design="grid",
        travel=3,
        folder=folder,
        scheduler="serial",
        progress=False,
    )


def test_the_page_of_a_cut(result, tmp_path):
    """Console clean, figures drawn, nothing wider than the phone; each field colours the chip its own way."""
    page = result.report(tmp_path / "cut.html")
    found, console = look(page, tmp_path)
    assert console == []
    assert found["figures"] == ["forces", "heat", "rake", "ledger"] and found["drawn"] == 4
    assert found["width"] <= WIDTH and found["widest"] <= WIDTH
    assert len(set(found["inks"])) == 3
    assert "AISI 1045" in found["title"] and found["outside"] == ["data:,"]
    force = result.steady.cutting_force
    assert f"{force.mean:.4g} N" in found["text"] and "180 m/min" in found["text"]


def test_the_page_of_a_study(study, tmp_path):
    """A figure for each varied quantity, the map, and the price."""
    found, console = look(study.report(tmp_path / "study.html"), tmp_path)
    assert console == []
    assert set(found["figures"]) == {"over feed", "over tool_velocity", "map", "cost"} and found["drawn"] == 4
    assert found["width"] <= WIDTH and "6 cuts succeeded, 0 failed" in found["text"]


def test_a_sweep_of_the_feed_shows_kienzles_law(cut, tmp_path):
    study = swarf.study(
        cut,
        feed=["0.1 mm", "0.15 mm", "0.2 mm"],
        travel=2,
        folder=tmp_path / "study",
        scheduler="serial",
        progress=False,
    )
    page = study.report(tmp_path / "study.html").read_text(encoding="utf-8")
    assert "k_c1.1 = " in page and 'id="kienzle"' in page


def test_a_page_of_a_failed_cut_tells_why(cut, tmp_path):
    """No figures, no script of plotly's; text of the FMU is text, whatever it holds."""
    found = cut.replace(**{"numerics.courant": 1.24, "numerics.speed": "exact"}).run(travel=1, progress=False)
    found.failure += " <script>alert(1)</script>"
    page = found.report(tmp_path / "cut.html").read_text(encoding="utf-8")
    assert "ended early" in page and "courant" in page and "<script>alert" not in page
    assert len(page) < 100_000


def test_a_page_of_nothing_is_refused(cut, tmp_path):
    study = swarf.study(cut, feed=["0.1 mm"], folder=tmp_path, run=False)
    with pytest.raises(SwarfError, match="no rows"):
        study.report(tmp_path / "study.html")
