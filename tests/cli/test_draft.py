"""The command draft: problem files from mesh files, which `solve` takes after the edits that their comments propose."""

import re
import shutil
import tomllib
from pathlib import Path

import meshio
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import verification as vf
from verification.interface.draft import draft

pytestmark = pytest.mark.usefixtures("meshes_read_here")


MESHES = Path(__file__).parents[2] / "docs" / "meshes"
NAMES = ("bottom", "right", "top", "left")
ABAQUS = """*NODE
{nodes}
*ELEMENT, TYPE={of}, ELSET=all
{elements}
{sets}
"""


def block(x, y, names, cells=(4, 2), lift=0.0):
    """Points, quadrilaterals and the named sides of a rectangle, whose bottom is bent up by a parabola of this lift."""
    xs, ys = np.linspace(*x, cells[0] + 1), np.linspace(*y, cells[1] + 1)
    node = np.arange(len(xs) * len(ys)).reshape(len(xs), len(ys))
    points = np.array([[a, b, 0.0] for a in xs for b in ys])
    along, up = (points[:, 0] - np.mean(x)) / np.ptp(x), (points[:, 1] - y[0]) / np.ptp(y)
    points[:, 1] += lift * along**2 * (1 - up)
    quads = np.stack([node[:-1, :-1], node[1:, :-1], node[1:, 1:], node[:-1, 1:]], -1).reshape(-1, 4)
    rows = dict(zip(NAMES, (node[:, 0], node[-1], node[:, -1], node[0]), strict=True))
    lines = {}
    for side, name in names.items():
        line = np.column_stack([rows[side][:-1], rows[side][1:]])
        lines[name] = np.concatenate([lines[name], line]) if name in lines else line
    return points, quads, lines


def named(prefix, sides=NAMES):
    return {side: f"{prefix}{side}" for side in sides}


def joined(blocks, *, merged=False):
    """The blocks in one list of points: quadrilaterals by block, and lines by name."""
    points, quads, lines, start = [], [], {}, 0
    for own, cells, rows in blocks:
        points, quads = [*points, own], [*quads, cells + start]
        for name, line in rows.items():
            lines[name] = np.concatenate([lines[name], line + start]) if name in lines else line + start
        start += len(own)
    points = np.concatenate(points)
    if merged:
        points, number = np.unique(points.round(9), axis=0, return_inverse=True)
        quads, lines = [number[of] for of in quads], {name: number[of] for name, of in lines.items()}
    return points, quads, lines


def gmsh(path, blocks, surfaces, *, merged=False, triangles=False):
    """A Gmsh file with one physical surface for each block, or the same for several."""
    points, quads, lines = joined(blocks, merged=merged)
    number = {name: i for i, name in enumerate([*lines, *dict.fromkeys(surfaces)], 1)}
    kinds = [("line", of, name) for name, of in lines.items()]
    for of, name in zip(quads, surfaces, strict=True):
        cells = np.concatenate([of[:, :3], of[:, [0, 2, 3]]]) if triangles else of
        kinds.append(("triangle" if triangles else "quad", cells, name))
    tags = [np.full(len(of), number[name]) for _, of, name in kinds]
    data = {"gmsh:physical": tags, "gmsh:geometrical": tags}
    names = {name: np.array([i, 1 if name in lines else 2]) for name, i in number.items()}
    mesh = meshio.Mesh(points, [(kind, of) for kind, of, _ in kinds], cell_data=data, field_data=names)
    meshio.write(path, mesh, "gmsh22", binary=False)
    return path


def abaqus(path, blocks, surfaces, of):
    """An Abaqus file with an element set for each block, for all of them, and for each named line."""
    points, quads, lines = joined(blocks)
    row = lambda i, members: f"{i}, {', '.join(str(m) for m in members)}"
    cells = np.concatenate(quads)
    bars = np.concatenate(list(lines.values()))
    elements = "\n".join(row(i, nodes + 1) for i, nodes in enumerate(cells, 1))
    trusses = "\n".join(row(i, nodes + 1) for i, nodes in enumerate(bars, len(cells) + 1))
    sets, first = [f"*ELEMENT, TYPE=T2D2, ELSET=lines\n{trusses}"], 1
    for name, members in [*zip(surfaces, quads, strict=True), *lines.items()]:
        numbers = "\n".join(str(i) for i in range(first, first + len(members)))
        sets, first = [*sets, f"*ELSET, ELSET={name}\n{numbers}"], first + len(members)
    nodes = "\n".join(row(i, point[:2]) for i, point in enumerate(points, 1))
    path.write_text(ABAQUS.format(nodes=nodes, of=of, elements=elements, sets="\n".join(sets)))
    return path


def two(sides=(NAMES, NAMES), **more):
    """Two unit squares on each other: their sides are called 'a bottom', .. and 'b bottom', ..."""
    first, second = (named(prefix, of) for prefix, of in zip(("a ", "b "), sides, strict=True))
    return [block((0, 1), (-1, 0), first), block((0, 1), (0, 1), second, **more)]


#: Comments that are lines of a file: taking away the # is one edit.
PROPOSED = re.compile(r"^# ((?:fixed|prescribed|shape) = .*|\[body2\].*)$", re.M)


def finished(found, folder, *, most=3, **changes):
    """Solve a draft after its proposals are taken and Poisson's ratio is 0, so that two blocks are two springs."""
    text = found if isinstance(found, str) else found.toml
    assert 0 < len(PROPOSED.findall(text)) <= most
    text = PROPOSED.sub(r"\1", text).replace("poisson = 0.3", "poisson = 0.0")
    for old, new in changes.items():
        text = re.sub(rf"^{old} = .*$", f"{old} = {new}", text, flags=re.M)
    (folder / "my.toml").write_text(text, encoding="utf-8")
    return vf.solve(vf.load(folder / "my.toml"))


def test_a_file_with_two_bodies_becomes_a_problem_of_two_edits(call, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    gmsh(tmp_path / "both.msh", two()[::-1], ["upper", "lower"])
    answer = call("draft", "both.msh")
    assert answer.status == 0
    data = tomllib.loads(answer.out)
    assert [data[f"body{i}"]["group"] for i in (1, 2)] == [["lower"], ["upper"]]
    assert data["body1"]["mesh"] == "both.msh"
    assert data["contact"]["surface"] == ["a top", "b bottom"]
    assert '# fixed = ["a bottom"]  # choose the sides that hold it: a bottom' not in answer.out  # names are in quotes
    assert '# fixed = ["a bottom"]  # choose the sides that hold it: "a bottom", "a right", "a left"' in answer.out
    assert '# prescribed = { "b top" = [0.0, -0.005] }' in answer.out
    assert answer.err.splitlines()[1].startswith("to do: body 2: choose the sides that move, and how far")
    assert finished(answer.out, tmp_path, most=2).contact.force["normal"] == pytest.approx(525, rel=1e-9)


def test_the_document_of_a_draft_has_its_bodies_contacts_and_choices(call, tmp_path):
    path = gmsh(tmp_path / "both.msh", two(), ["lower", "upper"])
    document = call("draft", path, "--json").document
    assert [(body["group"], body["cells"], len(body["sides"])) for body in document["bodies"]] == [
        (["lower"], 32, 4),
        (["upper"], 32, 4),
    ]
    (contact,) = document["contacts"]
    assert (contact["bodies"], contact["surface"], contact["gap"]) == ([1, 2], ["a top", "b bottom"], 0)
    assert document["choices"][0].startswith("body 1: choose the sides that hold it")
    assert tomllib.loads(document["toml"])["body2"]["mesh"] == str(path)


@pytest.mark.parametrize("triangles", [False, True])
def test_three_bodies_get_a_table_for_each_contact(triangles, tmp_path):
    stack = [block((0, 1), (i, i + 1), named(f"{i}"), cells=(3 + i, 2)) for i in range(3)]
    found = draft(gmsh(tmp_path / "stack.msh", stack, ["c", "b", "a"], triangles=triangles))
    data = tomllib.loads(found.toml)
    assert [(each["bodies"], each["surface"]) for each in data["contact"]] == [
        ([1, 2], ["0top", "1bottom"]),
        ([2, 3], ["1top", "2bottom"]),
    ]
    force = finished(found, tmp_path).contact.force["normal"]
    assert force == pytest.approx(2 * 2.1e5 * 0.005 / 3, rel=1e-6)  # of two lines


def test_bodies_beside_each_other_are_numbered_from_the_left_and_pressed_along_x(tmp_path):
    jaws = [block((i, i + 1), (0, 1), named(f"{i}")) for i in (1, 0)]
    found = draft(gmsh(tmp_path / "jaws.msh", jaws, ["right", "left"]))
    assert [body.group for body in found.bodies] == [("left",), ("right",)]
    assert "# prescribed = { 1right = [-0.005, 0.0] }" in found.toml
    assert finished(found, tmp_path).contact.force["normal"] == pytest.approx(525, rel=1e-9)


def test_two_bodies_on_which_a_third_one_stands_are_both_held(tmp_path):
    pillars = [block((i, i + 1), (0, 1), named(f"{i}")) for i in (0, 2)]
    beam = [block((0, 1), (1, 2), named("3 ")), block((1, 2), (1, 2), {"top": "3 middle"})]
    beam += [block((2, 3), (1, 2), {"top": "3 top", "bottom": "3 foot"})]
    points, quads, lines = joined(beam, merged=True)
    found = draft(gmsh(tmp_path / "beam.msh", [*pillars, (points, np.concatenate(quads), lines | {})], ["a", "b", "c"]))
    assert [touch.bodies for touch in found.contacts] == [(1, 3), (2, 3)]
    assert found.toml.count("# fixed = ") == 2


def test_two_files_are_a_body_each(call, tmp_path):
    for name, body in zip(("low", "high"), two(), strict=True):
        gmsh(tmp_path / f"{name}.msh", [body], [name])
    answer = call("draft", tmp_path / "high.msh", tmp_path / "low.msh")
    data = tomllib.loads(answer.out)
    assert data["title"] == "high and low"
    assert data["body1"]["mesh"] == str(tmp_path / "low.msh")
    assert "group" not in data["body1"]
    assert finished(answer.out, tmp_path).contact.force["normal"] == pytest.approx(525, rel=1e-9)


@pytest.mark.parametrize(("of", "plane"), [("CPS4", "stress"), ("CPE4R", "strain")])
def test_elements_of_abaqus_say_which_plane_the_problem_is_of(of, plane, tmp_path):
    first, second = [[p, q, {k.replace(" ", "-"): v for k, v in rows.items()}] for p, q, rows in two()]
    found = draft(abaqus(tmp_path / "both.inp", [first, second], ["lower", "upper"], of))
    data = tomllib.loads(found.toml)
    assert data["plane"] == plane
    assert [body.group for body in found.bodies] == [("lower",), ("upper",)]
    assert finished(found, tmp_path).contact.force["normal"] == pytest.approx(525, rel=1e-9)


def test_surfaces_that_share_nodes_are_the_materials_of_one_body(tmp_path):
    low, high = block((0, 1), (-1, 0), named("a ", ["bottom"])), block((0, 1), (0, 1), named("b ", ["top"]))
    punch = block((0, 1), (1, 2), named("c "))
    points, quads, lines = joined([low, high], merged=True)
    pieces = [(points, quads[0], lines), (points[:0], quads[1] - len(points), {}), punch]
    found = draft(gmsh(tmp_path / "tied.msh", pieces, ["steel", "rubber", "punch"]))
    assert [(body.group, body.materials) for body in found.bodies] == [
        (("steel", "rubber"), ("steel", "rubber")),
        (("punch",), ()),
    ]
    assert "young = { steel = 2.1e5, rubber = 2.1e5 }" in found.toml
    assert "For contact between them give each a [body]" in found.toml
    changes = {"young": "2.1e5"}
    text = found.toml.replace("{ steel = 0.3, rubber = 0.3 }", "0.0")
    assert finished(text, tmp_path, **changes).contact.force["normal"] == pytest.approx(350, rel=1e-9)
    text = text.replace("rubber = 2.1e5", "rubber = 1.05e5")
    assert finished(text, tmp_path).contact.force["normal"] == pytest.approx(262.5, rel=1e-9)


def test_of_one_body_the_draft_asks_for_a_second_and_proposes_an_obstacle(call, tmp_path):
    path = gmsh(tmp_path / "one.msh", two()[:1], ["lower"])
    answer = call("draft", path)
    assert "group" not in tomllib.loads(answer.out)["body1"]
    assert "a second body is missing: give a second mesh file" in answer.err
    assert finished(answer.out, tmp_path).contact.force["normal"] == pytest.approx(1050, rel=1e-9)


def test_a_boundary_without_a_name_is_named_by_its_ends(call, tmp_path):
    path = gmsh(tmp_path / "both.msh", two((("bottom",), ("bottom", "top"))), ["lower", "upper"])
    answer = call("draft", path)
    missing = "needed a physical name for the boundary of body 1 from (0, 0) to (1, 0)"
    assert (
        f"# the boundary of body 1 from (0, 0) to (1, 0) and side 'b bottom' of body 2 face each other: {missing}"
        in (answer.out)
    )
    assert missing in answer.err
    assert "surface" not in tomllib.loads(answer.out)["contact"]
    assert finished(answer.out, tmp_path).contact.force["normal"] == pytest.approx(525, rel=1e-9)  # both are flat


def test_a_body_without_any_named_line_is_drafted_with_what_it_needs(tmp_path):
    path = gmsh(tmp_path / "both.msh", two((NAMES, ())), ["lower", "upper"])
    found = draft(path)
    assert found.bodies[1].sides == ()
    assert "# needed a named side, to hold it or to move it" in found.toml
    assert found.choices[0].endswith("needed a physical name for the boundary of body 2 from (0, 0) to (1, 0)")


def test_bodies_that_lie_far_from_each_other_have_no_contact(tmp_path):
    apart = [two()[0], block((0, 1), (0.2, 1.2), named("b "))]
    found = draft(gmsh(tmp_path / "both.msh", apart, ["lower", "upper"]))
    assert found.contacts == ()
    assert found.choices[0].startswith("body 1: needed a line of it that faces another body nearby")


def test_a_gap_is_closed_by_the_displacement_that_is_proposed(tmp_path):
    apart = [two()[0], block((0, 1), (0.05, 1.05), named("b "))]
    found = draft(gmsh(tmp_path / "both.msh", apart, ["lower", "upper"]))
    assert found.contacts[0].gap == pytest.approx(0.05)
    assert '"b top" = [0.0, -0.055]' in found.toml
    assert finished(found, tmp_path).contact.force["normal"] == pytest.approx(525, rel=1e-6)


def test_a_file_without_names_is_refused_in_one_line(call, tmp_path):
    path = gmsh(tmp_path / "none.msh", two(((), ())), ["lower", "upper"])
    assert call("draft", path).complaint.startswith(f"ndtheory: {path}: no named lines; give the sides physical names")


def test_the_pieces_of_a_surface_are_bodies(tmp_path):
    found = draft(gmsh(tmp_path / "both.msh", two(), ["all", "all"]))
    assert [body.group for body in found.bodies] == [("all.1",), ("all.2",)]
    assert finished(found, tmp_path).contact.force["normal"] == pytest.approx(525, rel=1e-9)


@pytest.mark.parametrize("name", ["a.b", "Fläche β", "a # b", "[x]", "1 = 2", "'"])
def test_names_that_toml_writes_in_quotes_are_written_so(name, tmp_path):
    sides = [{side: f"{name} {side}" for side in NAMES}, {side: f"{side} {name}" for side in NAMES}]
    blocks = [block((0, 1), (-1, 0), sides[0]), block((0, 1), (0, 1), sides[1])]
    found = draft(gmsh(tmp_path / "both.msh", blocks, [f"{name}1", f"{name}2"]))
    assert tomllib.loads(found.toml)["contact"]["surface"] == [f"{name} top", f"bottom {name}"]
    assert finished(found, tmp_path).contact.force["normal"] == pytest.approx(525, rel=1e-9)


def test_curved_sides_of_two_files_are_joined_along_their_line(tmp_path):
    for name in ("groove.msh", "pin.msh"):
        shutil.copy(MESHES / name, tmp_path)
    found = draft(tmp_path / "groove.msh", tmp_path / "pin.msh")
    assert found.contacts[0].surface == ("groove", "tip")
    solution = finished(found, tmp_path, prescribed="{ top = [0.0, -0.01] }")
    data = vf.load(MESHES / "pin.toml").to_dict()
    for body in ("body1", "body2"):
        data[body] |= {"young": "2.1e5", "poisson": 0}
    data["body2"]["prescribed"], data["contact"]["friction"] = {"top": [0, "-0.01"]}, 0
    data["iteration"]["neumann_body"] = tomllib.loads(found.toml)["iteration"]["neumann_body"]
    straight = vf.solve(vf.Problem.from_dict(data))
    assert solution.contact.force["normal"] == pytest.approx(straight.contact.force["normal"], rel=1e-9)


def test_a_curved_bottom_touches_a_flat_top(tmp_path):
    found = draft(gmsh(tmp_path / "lens.msh", two(lift=0.2), ["lower", "upper"]))
    solution = finished(found, tmp_path)
    pressure = solution.contact.pressure
    assert solution.contact.force["normal"] > 0
    assert pressure.argmax() == len(pressure) // 2


def test_of_half_a_model_the_plane_of_symmetry_is_mentioned(tmp_path):
    found = draft(gmsh(tmp_path / "both.msh", two((("left", "top", "bottom"),) * 2), ["lower", "upper"]))
    assert found.toml.count("; on a plane of symmetry prescribed = { ") == 2
    assert 'on a plane of symmetry prescribed = { "a left" = [0.0, "free"] }' in found.toml


def test_a_body_without_a_side_away_from_its_contact_says_so(tmp_path):
    found = draft(gmsh(tmp_path / "both.msh", two((("top", "left"), NAMES)), ["lower", "upper"]))
    assert "# needed a named side away from the contact, to hold it or to move it; on a plane of symmetry" in found.toml
    assert "fixed = " not in found.toml


def test_contacts_share_no_node_and_a_second_name_of_a_line_is_no_second_contact(tmp_path):
    """A block in a corner: of the two sides that face it the longer one touches."""
    corner = joined(
        [
            block((0, 2), (-1, 0), {"top": "floor", "bottom": "base"}, (4, 2)),
            block((-1, 0), (0, 1), {"right": "wall"}),
            block((-1, 0), (-1, 0), {}),
        ],
        merged=True,
    )
    corner = (corner[0], np.concatenate(corner[1]), corner[2])
    inside = block((0, 2), (0, 1), {"bottom": "under", "left": "beside", "top": "top"})
    found = draft(gmsh(tmp_path / "corner.msh", [corner, inside], ["corner", "block"]))
    assert [touch.surface for touch in found.contacts] == [("floor", "under")]
    assert "side 'wall' of body 1 and side 'beside' of body 2 face each other: it is left out" in found.choices[0]


def test_a_narrow_punch_on_a_coarse_block_carries_the_contact_grid(tmp_path):
    """No edge of the block faces the punch as a whole; the sides of the punch, which begin on it, are no contact."""
    punch = [block((0, 4), (-1, 0), named("a "), (4, 1)), block((1.2, 1.8), (0, 1), named("b "), (6, 6))]
    found = draft(gmsh(tmp_path / "punch.msh", punch, ["block", "punch"]))
    assert [(touch.surface, touch.contact) for touch in found.contacts] == [(("a top", "b bottom"), 2)]
    assert tomllib.loads(found.toml)["iteration"]["neumann_body"] == 1
    assert '# fixed = ["a bottom"]' in found.toml
    assert finished(found, tmp_path).contact.force["normal"] > 0


def test_surfaces_that_share_nodes_are_two_bodies_where_each_has_its_table(tmp_path):
    """What the comment on the materials says."""
    merged = gmsh(tmp_path / "merged.msh", two((NAMES, ("right", "top", "left"))), ["low", "high"], merged=True)
    found = draft(merged)
    assert "# Its surfaces share nodes and stick to each other." in found.toml
    body = {"mesh": str(merged), "young": "2.1e5", "poisson": 0}
    problem = {
        "body1": body | {"group": ["low"], "fixed": ["a bottom"]},
        "body2": body | {"group": ["high"], "prescribed": {"b top": [0, "-0.005"]}},
        "contact": {"surface": ["a top", "a top"]},
    }
    assert vf.solve(vf.Problem.from_dict(problem)).contact.force["normal"] == pytest.approx(525, rel=1e-9)


def test_three_bodies_that_touch_each_other_keep_two_contacts(tmp_path):
    ring = [block((0, 2), (-1, 0), {"top": "t", "bottom": "b"}, (4, 2))]
    ring += [block((1.05 * i, 1 + 1.05 * i), (0, 1), named(f"{i}")) for i in (0, 1)]
    found = draft(gmsh(tmp_path / "ring.msh", ring, ["low", "left", "right"]))
    touches = [touch.bodies for touch in found.contacts]
    assert touches == [(1, 2), (1, 3)]
    assert finished(found, tmp_path).contact.force["normal"] > 0
    assert any("it is left out" in choice for choice in found.choices)


def test_thirty_named_lines_are_all_offered(tmp_path):
    many = {f"part {i}": np.array([[5 * i + 4, 5 * i + 9]]) for i in range(30)}
    upper = block((0, 3), (0, 1), named("b "), (30, 4))
    path = gmsh(tmp_path / "many.msh", [block((0, 3), (-1, 0), named("a ", ["bottom"]), (30, 4)), upper], ["l", "u"])
    found = draft(path)
    assert "from (0, 0) to (3, 0)" in found.choices[0]
    low = block((0, 3), (-1, 0), named("a ", ["bottom"]), (30, 4))
    path = gmsh(tmp_path / "many.msh", [(*low[:2], low[2] | many), upper], ["l", "u"])
    found = draft(path)
    assert len(found.bodies[0].sides) == 31
    assert all(name in found.toml for name in many)
    assert finished(found, tmp_path).contact.force["normal"] > 0


@pytest.mark.parametrize("content", ["", "no mesh", "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n", "\x00\x01"])
@pytest.mark.parametrize("ending", ["msh", "inp", "stl"])
def test_a_file_that_is_no_mesh_is_refused_in_one_line(call, tmp_path, content, ending):
    path = tmp_path / f"no.{ending}"
    path.write_text(content)
    assert call("draft", path).complaint.startswith(f"ndtheory: {path}: ")
    assert call("draft", path, path, "--json").complaint.startswith(f"ndtheory: {path}: ")


def test_a_file_that_is_missing_and_a_folder_are_refused_in_one_line(call, tmp_path):
    assert call("draft", tmp_path / "no.msh").complaint.endswith("no such mesh file")
    assert call("draft", tmp_path).complaint.endswith("this is a folder, a pipe or a device")
    assert "MESH" in call("draft").complaint


@settings(max_examples=8, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    width=st.floats(0.3, 5), heights=st.tuples(st.floats(0.3, 5), st.floats(0.3, 5)), turn=st.sampled_from([0, 90, 30])
)
def test_two_rectangles_of_any_size_and_direction_are_two_springs(tmp_path, width, heights, turn):
    blocks = [block((0, width), (-heights[0], 0), named("a ")), block((0, width), (0, heights[1]), named("b "), (3, 2))]
    c, s = np.cos(np.radians(turn)), np.sin(np.radians(turn))
    blocks = [(points @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]), *rest) for points, *rest in blocks]
    found = draft(gmsh(tmp_path / "any.msh", blocks, ["one", "other"]))
    (touch,) = found.contacts
    assert {*touch.surface} == {"a top", "b bottom"}
    solution = finished(found, tmp_path)
    (moved,) = (
        body.prescribed.values() for body in (solution.problem.body1, solution.problem.body2) if body.prescribed
    )
    pressed = np.linalg.norm([float(v) for v in next(iter(moved))])
    assert solution.contact.force["normal"] == pytest.approx(2.1e5 * width * pressed / sum(heights), rel=0.02)


@pytest.mark.parametrize(("cells", "neumann"), [(((8, 2), (3, 2)), 2), (((3, 2), (8, 2)), 1)])
def test_the_body_with_the_finer_side_gets_the_contact_grid(cells, neumann, tmp_path):
    blocks = [block((0, 1), (i - 1, i), named("ab"[i]), cells=cells[i]) for i in (0, 1)]
    found = draft(gmsh(tmp_path / "both.msh", blocks, ["low", "high"]))
    assert tomllib.loads(found.toml)["iteration"]["neumann_body"] == neumann
    assert found.choices[-4] == "plane: strain is written, as thick bodies"


def test_the_radius_follows_the_edges_where_the_bodies_are_nearest(tmp_path):
    """Edges that grow away from the middle, where a bent side touches: the longest is 0.44, in the middle 0.06."""
    blocks = [block((-1, 1), (-1, 0), named("a"), cells=(8, 2)), block((-1, 1), (0, 1), named("b"), (8, 2), lift=0.1)]
    for points, *_ in blocks:
        points[:, 0] = np.sign(points[:, 0]) * points[:, 0] ** 2
    found = draft(gmsh(tmp_path / "both.msh", blocks, ["low", "high"]))
    assert 0.06 < tomllib.loads(found.toml)["contact"]["radius"] < 0.25
