"""The demo on one page: the video, the figures, and the commands to run next."""

from __future__ import annotations

from html import escape

from dloftbs._version import __version__
from dloftbs_lab.commands.demo_names import INPUT, OVERLAY, README, SHEET

_STYLE = """
body { margin: 2rem auto; max-width: 1120px; padding: 0 1rem; font: 16px/1.5 system-ui, sans-serif; color: #222; }
video, img { width: 100%; border-radius: 6px; }
pre { padding: .8rem 1rem; overflow-x: auto; background: #f3f3f1; border-radius: 6px; }
th { padding-right: 1.5rem; text-align: left; font-weight: 600; }
th, td { padding-bottom: .2rem; vertical-align: top; }
"""


def demo_page(figures: list[tuple[str, str]], space_command: str) -> str:
    """Return the page, HTML; its files lie beside it."""
    rows = "\n".join(f"<tr><th>{escape(name)}</th><td>{escape(value)}</td></tr>" for name, value in figures)
    next_commands = "\n".join(
        [
            "# in this folder: one cable of this video, on a page, live",
            f"dloftbs view {INPUT} --config cable_1.config.yaml",
            "# its curves as a table, and drawn",
            f"dloftbs track {INPUT} --config cable_1.config.yaml --out cable_1.csv --overlay cable_1.mp4",
            "# the cable in space, as a mesh",
            space_command,
            "# your own video: draw along a cable, press Save, and track it",
            "dloftbs tune cable.mp4 --out cable.yaml",
            "dloftbs track cable.mp4 --config cable.yaml --out curves.csv --overlay overlay.mp4",
        ]
    )
    return f"""<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width">
<title>The demo of dloftbs</title>
<style>{_STYLE}</style>
</head>
<body>
<h1>The demo of dloftbs {escape(__version__)}</h1>
<p>A rendered video of two cables. Each was found by its colour, in every frame, and tracked: the blue one has a yellow
curve, the pink one a light blue curve. A dot is the start, a ring the end; dashes were inferred, not seen.
The default scene was chosen: with another <code>--seed</code>, some frames are misread.</p>
<video src="{OVERLAY}" autoplay loop muted playsinline controls></video>
<h2>How well that went</h2>
<table>
{rows}
</table>
<p>L1: mean distance of the visible pixels to the nearest curve; a perfect curve has a quarter of the width. L2: of
the curves to the nearest visible pixel. L3: of a curve from the true one, hidden ends included. Files:
<a href="{README}">{README}</a>.</p>
<h2>What to run next</h2>
<pre>{escape(next_commands)}</pre>
<p><code>view</code> and <code>tune</code> need an extra: <code>pip install "dloftbs[ui]"</code>. After
<code>make demo</code>, run <code>. .venv/bin/activate</code> first.</p>
<h2>In space</h2>
<img src="space.png" alt="A cable in space: picture, depth, and its curve from above and from the side">
<h2>A dozen frames</h2>
<img src="{SHEET}" alt="A dozen frames with their curves">
</body>
</html>
"""
