"""An element that only a test knows: what it supports works and is right, the rest is refused by its name."""

import meshio
import numpy as np
import pytest
from scipy.linalg import eigh

import verification as vf
from fem1d2d import Mesh, gram, plane_strain, rectangle, stiffness, stresses
from fem1d2d.element import ELEMENTS, Element
from fem1d2d.mesh import MeshError
from verification.cli.main import main
from verification.interface import assembly
from verification.interface.body import material_of
from verification.output.fields import write_fields

CORNERS = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
ORDER = [0, 3, 1, 2]  # of the corners as quadrilaterals list them, from products of hat functions along x and y


class Rectangles(Element):
    """Q1 on rectangles: Simpson's rule is exact for products of gradients, which are quadratic along each axis."""

    words, vtk = "bilinear rectangles", "quad"

    def points(self, mesh):
        p = mesh.points[mesh.cells]
        a, b = (p[:, 2] - p[:, 0]).T
        x, y = CORNERS.T
        for s, w in zip((-1, 0, 1), (1, 4, 1), strict=True):
            for t, v in zip((-1, 0, 1), (1, 4, 1), strict=True):
                slopes = np.stack([x * (1 + t * y), y * (1 + s * x)], axis=-1)
                yield a * b * w * v / 36, slopes / (2 * np.stack([a, b], axis=-1))[:, None, :]

    def mass(self, mesh):
        p = mesh.points[mesh.cells]
        one = np.array([[2, 1], [1, 2]])
        whole = np.kron(one, one)[np.ix_(ORDER, ORDER)]
        return np.prod(p[:, 2] - p[:, 0], axis=1)[:, None, None] * whole / 36


def quadrilaterals(x, y, cells, split="alternating"):
    assert split == "alternating"
    triangles = rectangle(x, y, cells)
    node = np.arange(len(triangles.points)).reshape(cells[0] + 1, cells[1] + 1)
    quads = np.stack([node[:-1, :-1], node[1:, :-1], node[1:, 1:], node[:-1, 1:]], axis=-1).reshape(-1, 4)
    return Mesh(points=triangles.points, cells=quads, sides=triangles.sides)


@pytest.fixture(autouse=True)
def rectangles(monkeypatch):
    """The bodies of all problem files are made of them."""
    monkeypatch.setitem(ELEMENTS, (2, 4), Rectangles())
    monkeypatch.setattr(assembly, "rectangle", quadrilaterals)


PROBLEM = vf.example("section6-60").changed(cells=[[8, 2], [8, 2]])


def test_its_matrices_are_symmetric_and_pass_the_patch_test():
    mesh, material = quadrilaterals((0.0, 2.0), (0.0, 1.0), (4, 3)), plane_strain(2.0, 0.3)
    slope = [[0.3, -0.2], [0.5, 0.4]]
    A, u = stiffness(mesh, material), mesh.points @ np.transpose(slope)
    strain = (np.array(slope) + np.transpose(slope)) / 2
    energy = 2.0 * (material.lame_lambda * np.trace(strain) ** 2 + 2 * material.lame_mu * (strain**2).sum())
    assert u.ravel() @ A @ u.ravel() == pytest.approx(energy, rel=1e-14)
    inner = np.setdiff1d(np.arange(len(mesh.points)), mesh.boundary)
    assert np.abs((A @ u.ravel()).reshape(-1, 2)[inner]).max() <= 1e-14 * abs(A).max()
    stress = stresses(mesh, material, u)[:, :2, :2]
    assert stress == pytest.approx(np.broadcast_to(stress[0], stress.shape), rel=1e-13)
    for matrix in (A, gram(mesh)):
        assert abs(matrix - matrix.T).max() <= 1e-15 * abs(matrix).max()


def test_the_constants_of_bodies_of_it_are_those_of_dense_matrices():
    found, pair = vf.measure(PROBLEM), vf.build(PROBLEM)
    S = {}
    for spec, name in ((PROBLEM.body1, "body1"), (PROBLEM.body2, "body2")):
        body = getattr(pair, name).mesh_body
        mesh = quadrilaterals(*(tuple(map(float, ends)) for ends in (spec.x, spec.y)), spec.cells)
        free = body.positions
        A, H = (
            matrix.toarray()[np.ix_(free, free)]
            for matrix in (stiffness(mesh, material_of(spec)), gram(mesh, float(PROBLEM.length)))
        )
        values = eigh(A, H, eigvals_only=True)
        constants = getattr(found, name)
        assert (constants.m.value, constants.M.value) == pytest.approx((values[0], values[-1]), rel=1e-9)
        inside = np.setdiff1d(np.arange(len(A)), body.interface)
        block = lambda rows, columns, A=A: A[np.ix_(rows, columns)]
        on = body.interface
        S[name] = block(on, on) - block(on, inside) @ np.linalg.solve(block(inside, inside), block(inside, on))
    S_1, S_2 = S[pair.contact.body.name], S[pair.neumann.body.name]  # normals up or down change no eigenvalue
    P = np.kron(np.eye(2), pair.interface.transfer)
    assert found.rho_max.value == pytest.approx(eigh(P.T @ S_1 @ P, S_2, eigvals_only=True)[-1], rel=1e-9)


def test_a_run_ends_at_the_solution_and_is_drawn_and_written(tmp_path):
    run, solution = vf.run(PROBLEM), vf.solve(PROBLEM)
    assert run.converged
    size = solution.contact.pressure.max()
    assert run.contact.pressure == pytest.approx(solution.contact.pressure, abs=1e-7 * size)
    figure = run.plot("bodies", stress="mises")
    assert {len(path.vertices) for drawn in figure.axes[0].collections for path in drawn.get_paths()} == {5}  # closed
    write_fields(run, tmp_path)
    for body in run.bodies.elastic:
        written = meshio.read(tmp_path / f"{body.name}.vtu")
        assert np.array_equal(written.cells_dict["quad"], body.mesh.cells)
        assert written.cell_data["von_mises"][0].shape == (len(body.mesh.cells),)


def test_what_it_does_not_support_is_refused_by_its_name(monkeypatch, tmp_path):
    measured = vf.measure(PROBLEM, verified=True)
    assert measured.rho_cells is measured.rho_normal_cells is None
    assert measured.why_no_cells == "body1: no waves on layers with bilinear rectangles"
    assert set(measured.unverified.values()) == {"body1: no proofs with bilinear rectangles"}
    assert measured.rho_max.level == measured.m.level == "float"
    with pytest.raises(vf.ProblemError, match="body1: no proofs with bilinear rectangles"):
        vf.certify(PROBLEM)
    monkeypatch.setattr(Rectangles, "vtk", "")
    with pytest.raises(MeshError, match="body1: no files for ParaView with bilinear rectangles"):
        write_fields(vf.solve(PROBLEM), tmp_path)


def test_the_command_refuses_a_certificate_of_it_in_one_line(tmp_path, capsys):
    file = tmp_path / "plates.toml"
    file.write_text(PROBLEM.to_toml(), encoding="utf-8")
    assert main(["certify", str(file), "-o", str(tmp_path / "certificate.json")])
    error = capsys.readouterr().err
    assert error.endswith("body1: no proofs with bilinear rectangles\n")
    assert error.count("\n") == 1
