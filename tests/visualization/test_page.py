"""The panel of a recording's page."""

from drake_starnav.visualization.meshes import Layer
from drake_starnav.visualization.page import Cameras, Caption, add_panel

PAGE = "<html><title>Drake MeshCat</title><body>scene</body></html>"


def test_texts_are_escaped_and_the_legend_is_ordered_by_height() -> None:
    layers = {
        "low": Layer("low & wide", (0.0, 0.0, 0.0), "area", 0.1),
        "high": Layer("high", (1.0, 0.0, 0.0), "line", 0.2),
        "silent": Layer("", (0.0, 0.0, 1.0), "line", 0.3),
    }
    caption = Caption("<room>", ("seed 0",), layers)
    text = add_panel(PAGE, caption, Cameras((0.0, 0.0, 4.0, 3.0), "top", "/drake/robot", (1.0, 2.0)))
    assert [layer.label for layer in caption.legend.values()] == ["high", "low & wide"]
    assert "<h1>&lt;room&gt;</h1>" in text and "<title>&lt;room&gt; · seed 0</title>" in text
    assert text.index(">high<") < text.index(">low &amp; wide<")
    assert text.endswith("</body></html>")


def test_a_caption_says_what_is_shown() -> None:
    caption = Caption("room", shown=frozenset({"trail", "roadmap/nodes"}))
    shown = [
        name for name in ("trail/0003", "roadmap/nodes", "roadmap/edges/0001", "scan", "robot") if caption.shows(name)
    ]
    assert shown == ["trail/0003", "roadmap/nodes", "robot"]
    assert all(Caption("room").shows(name) for name in ("trail", "scan"))
