"""A ruled panel says what matplotlib's own axes would say, in fewer pieces."""

import re

import numpy as np

from dmpcli.reporting import drawing, ruling


def texts(figure):
    svg = drawing.saved(figure, png=False)["svg"].decode()
    return sorted(re.findall(r"<text[^>]*>([^<]+)</text>", svg)), len(svg)


def panel(bar=False):
    figure = drawing.page(4.0, 3.0)
    axes = drawing.panel(figure, 0.8, 0.6, 2.4, 2.0)
    drawing.labels(axes, "t / s", "x / mm")
    shown = axes.scatter([0.0, 7.3], [-2.0, 31.0], c=[0.0, 1.0])
    if bar:
        side = drawing.panel(figure, 3.3, 0.6, 0.1, 2.0)
        figure.colorbar(shown, cax=side, label="force / N")
    return figure


def test_numbers_and_names_are_those_of_matplotlib():
    with drawing.settings(text=True):
        plain, size = texts(panel())
        figure = panel()
        ruling.rule(figure)
        ruled, less = texts(figure)
    assert ruled == plain
    assert {"t / s", "x / mm", "30"} <= set(ruled)
    assert less < size


def test_a_colour_bar_keeps_its_numbers_on_its_own_side():
    with drawing.settings(text=True):
        plain, _ = texts(panel(bar=True))
        figure = panel(bar=True)
        ruling.rule(figure)
        ruled, _ = texts(figure)
    assert ruled == plain
    assert not figure.axes[0].yaxis.get_visible()
    assert figure.axes[1].yaxis.get_visible()


def test_a_power_of_ten_is_in_the_numbers_where_matplotlib_writes_it_aside():
    figure = drawing.page(4.0, 3.0)
    axes = drawing.panel(figure, 0.8, 0.6, 2.4, 2.0)
    axes.plot([0.0, 1.0], [0.0, 1.8e-12])
    with drawing.settings(text=True):
        ruling.rule(figure)
        ruled, _ = texts(figure)
    assert "1.5e-12" in ruled
    assert "1.5" not in ruled


def test_a_hidden_row_of_numbers_stays_hidden():
    with drawing.settings(text=True):
        figure = panel()
        figure.axes[0].tick_params(labelbottom=False)
        ruling.rule(figure)
        ruled, _ = texts(figure)
    assert np.count_nonzero([text == "4" for text in ruled]) == 0
    assert "30" in ruled
