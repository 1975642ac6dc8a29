"""The map of the proof: the statements asked for and their grounds, legible, with the losses that were found."""

import re
from functools import cache
from itertools import pairwise
from math import log10
from xml.etree import ElementTree

import pytest
from matplotlib.font_manager import FontProperties
from matplotlib.textpath import TextPath

import verification as vf
from ndtheory.statements import proof_of, statements
from verification.figures.proof_map import BOX, CHAIN, LOOKS, PRINTED, STEPS, WIDTH, draw_map, width_of
from verification.semidefinite.losses import EXACT, LossForms, Suprema, locate, quotients, suprema

SVG = "{http://www.w3.org/2000/svg}"
MAPS = {"chain": {"ids": CHAIN, "grounds": False}, "all": {}, "one": {"ids": ["4.1"]}}


@pytest.fixture(scope="module")
def measured():
    pair = vf.build(vf.example("section6").changed(cells=((10, 2), (6, 2))))
    return pair, vf.measure(pair)


@pytest.fixture(scope="module")
def losses(measured):
    return locate(*measured)


@pytest.fixture(scope="module", params=MAPS)
def picture(request, losses):
    return ElementTree.fromstring(draw_map(**MAPS[request.param], losses=losses, of="Section 6, in MPa"))


def of_class(picture, name):
    return [node for node in picture.iter() if name in (node.get("class") or "").split()]


def nodes(picture):
    return {node.get("data-id"): node for node in of_class(picture, "node")}


def edges(picture):
    return {tuple(node.get("data-edge").split()): node for node in of_class(picture, "edge") if node.get("data-edge")}


def place(node):
    """Left, right, top and bottom of a box."""
    number = next(text for text in node.iter(f"{SVG}text"))
    x, lines = float(number.get("x")), len(list(node.iter(f"{SVG}text"))) - 1
    y = float(number.get("y")) + 5 + 7 * (lines - 1)
    return x - BOX[0] / 2, x + BOX[0] / 2, y - BOX[1] / 2, y + BOX[1] / 2


# What is drawn.


def test_a_map_has_the_statements_asked_for_and_all_that_they_lean_on():
    picture = ElementTree.fromstring(draw_map(["5.12", "C1"]))
    assert set(nodes(picture)) == set(proof_of(["5.12", "C1"]))
    assert {node.get("data-id") for node in of_class(picture, "asked")} == {"5.12", "C1"}


def test_the_edges_are_what_is_left_of_leans_on_where_none_follows_from_others(picture):
    """Along the edges one reaches from a statement exactly the shown ones that it leans on."""
    shown = nodes(picture)
    direct = {id: {g for g in statements()[id].leans_on if g in shown} for id in shown}
    drawn = {id: {head for head, end in edges(picture) if end == id} for id in shown}

    def reaching(links):
        reach = cache(lambda id: {other for head in links[id] for other in (head, *reach(head))})
        return reach

    reach, along = reaching(direct), reaching(drawn)
    for id in shown:
        assert drawn[id] <= direct[id]
        assert along(id) == reach(id)
        for head in drawn[id] - {begin for begin, end in STEPS if end == id}:
            assert not any(head in reach(other) for other in direct[id])


def test_each_statement_has_at_most_four_words_without_a_formula():
    for one in statements().values():
        words = one.short or one.title
        assert len(words.split()) <= 4, one.id
        assert not re.search(r"[$\\]", words), one.id
        assert len(one.title.split()) > 4 or "$" in one.title or not one.short, f"{one.id}: its title is short enough"


def test_the_shape_of_a_box_shows_its_verdict_without_its_colour():
    verdicts = dict.fromkeys(LOOKS)
    for verdict in verdicts:
        picture = ElementTree.fromstring(draw_map(["4.1"], verdicts={"4.1": verdict}))
        path = nodes(picture)["4.1"].find(f"{SVG}path")
        verdicts[verdict] = (path.get("d"), path.get("stroke-dasharray"))
        assert path.get("fill") == LOOKS[verdict][0]
        assert verdict in nodes(picture)["4.1"].find(f"{SVG}title").text
        assert verdict.lower() in [text.text for text in of_class(picture, "legend")]
    assert len(set(verdicts.values())) == len(LOOKS)


def luminance(colour):
    parts = [int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)]
    linear = [c / 12.92 if c <= 0.03928 else ((c + 0.055) / 1.055) ** 2.4 for c in parts]
    return sum(c * weight for c, weight in zip(linear, (0.2126, 0.7152, 0.0722), strict=True))


def test_words_stand_out_from_every_fill():
    for fill, line, _ in LOOKS.values():
        for ink, least in (("#333333", 4.5), (line, 3)):
            assert (luminance(fill) + 0.05) / (luminance(ink) + 0.05) >= least


# That it can be read.


@cache
def width(text):
    """Of a text in DejaVu Sans, of size 1."""
    return TextPath((0, 0), text, size=100, prop=FontProperties(family="DejaVu Sans")).get_extents().width / 100


def test_every_text_is_large_enough_and_inside_its_box(picture):
    """In DejaVu Sans, wider than most fonts; a long number is squeezed."""
    sizes = dict(re.findall(r"text\.(\w+)\{font:(\d+)px", picture.find(f"{SVG}style").text))
    assert set(map(int, sizes.values())) == {10, 11, 12}
    for node in nodes(picture).values():
        left, right, top, bottom = place(node)
        middles = []
        for text in node.iter(f"{SVG}text"):
            size = float(sizes[text.get("class")])
            wide = width(text.text) * size
            wide = min(wide, float(text.get("textLength") or wide))
            assert wide <= right - left - 4, text.text
            assert top <= float(text.get("y")) - 0.8 * size, text.text
            assert float(text.get("y")) + 0.25 * size <= bottom, text.text
            middles.append(float(text.get("y")))
        assert all(b - a >= 12 for a, b in pairwise(middles))
        assert len(middles) <= 3


def test_no_line_however_wide_touches_a_box_that_is_not_at_its_ends(picture):
    boxes = {id: place(node) for id, node in nodes(picture).items()}
    for edge in of_class(picture, "edge"):
        if not edge.get("data-edge"):
            continue
        half = float(edge.get("stroke-width")) / 2
        numbers = [float(number) for number in re.findall(r"-?[\d.]+", edge.get("d"))]
        points = [complex(*pair) for pair in zip(numbers[2::2], numbers[3::2], strict=True)]  # M, then L C C C again
        for a, b, c, d in zip(*[iter(points)] * 4, strict=True):
            for t in (i / 16 for i in range(17)):
                at = a * (1 - t) ** 3 + 3 * b * t * (1 - t) ** 2 + 3 * c * t**2 * (1 - t) + d * t**3
                for id, (left, right, top, bottom) in boxes.items():
                    if id not in edge.get("data-edge").split():
                        inside = left - half < at.real < right + half and top - half < at.imag < bottom + half
                        assert not inside, (edge.get("data-edge"), id)


def test_the_same_ledger_gives_the_same_file(losses):
    assert draw_map(["5.30"], losses=losses) == draw_map(["5.30"], losses=losses)


# What the steps lose.


def test_each_step_that_loses_something_is_an_edge_of_the_ledger():
    for begin, end in STEPS:
        assert begin in statements()[end].leans_on


def test_an_edge_is_as_wide_as_the_decades_that_its_step_loses(losses):
    drawn = edges(ElementTree.fromstring(draw_map(CHAIN, losses=losses, grounds=False)))
    found = {name: {one.label: one for one in getattr(losses, name)} for name in ("links", "friction", "lipschitz")}
    for step, (chain, labels) in STEPS.items():
        decades = sum(found[chain][label].decades for label in labels)
        assert float(drawn[step].get("stroke-width")) == pytest.approx(WIDTH["thin"] + decades, abs=0.051)
        assert ("searched" in drawn[step].get("class")) == any(found[chain][label].searched for label in labels)
    for edge in set(drawn) - set(STEPS):
        assert drawn[edge].get("stroke-width") == "1.2"


def test_widths_add_up_where_edges_meet(losses):
    total = {end: sum(loss.decades for loss in chain if not loss.only_unit) for end, chain in
             (("5.30", losses.friction), ("5.38", losses.lipschitz))}  # fmt: skip
    for end, decades in total.items():
        into = [labels for edge, (_, labels) in STEPS.items() if edge[1] == end]
        out = next(labels for edge, (_, labels) in STEPS.items() if edge[0] == end)
        assert sorted(label for labels in into for label in labels) == sorted(out)
        chain = losses.friction if end == "5.30" else losses.lipschitz
        assert sum(loss.decades for loss in chain if loss.label in out) == pytest.approx(decades)
    links = {loss.label: loss.decades for loss in losses.links}
    assert total["5.30"] == pytest.approx(links["(5.30)"])
    assert 2 * total["5.38"] == pytest.approx(links["(5.38)"])


def test_the_printed_edge_is_wider_by_the_unit_of_stress(losses):
    drawn = ElementTree.fromstring(draw_map(["5.31"], losses=losses))
    (printed,) = [node for node in of_class(drawn, "printed") if node.get("data-edge") == " ".join(PRINTED)]
    decades = sum(loss.decades for loss in losses.friction)
    assert float(printed.get("stroke-width")) == pytest.approx(width_of(decades), abs=0.051)
    assert float(printed.get("stroke-width")) > float(edges(drawn)[PRINTED].get("stroke-width"))


def test_without_losses_every_edge_is_thin():
    picture = ElementTree.fromstring(draw_map(["5.31"]))
    assert {edge.get("stroke-width") for edge in edges(picture).values()} == {"1.2"}
    assert not of_class(picture, "loss")


def test_quotients_are_the_losses_that_need_no_search(measured, losses):
    pair, found = measured
    constants = found.constants()
    values = quotients(*(float(v) for v in (constants.m, constants.M, constants.C_R)), **vars(suprema(LossForms(pair))))
    links = {loss.label: loss.decades for loss in losses.links if not loss.searched}
    assert set(links) == set(EXACT)
    for label, value in zip(EXACT, values, strict=False):
        assert log10(value) == pytest.approx(links[label] * (1 if label == "(5.29)" else 2), rel=1e-12)
    steps = {"(5.19)": log10(values[-1]), "(5.23)": log10(values[EXACT.index("(5.23)")])}
    for chain, part in ((losses.friction, 1), (losses.lipschitz, 0.5)):
        exact = {loss.label: loss.decades for loss in chain if not loss.searched and not loss.only_unit}
        assert exact == pytest.approx({label: part * value for label, value in steps.items()}, rel=1e-9)
    assert tuple(Suprema.__annotations__) == tuple(quotients.__annotations__)[3:-1]
