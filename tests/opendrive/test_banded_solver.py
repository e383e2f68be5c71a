"""Solutions of systems with a band of entries are those of a dense solver."""

import subprocess
import sys

import numpy as np
import pytest

from envgen_usd.opendrive.mesh.banded_solver import solve_banded


@pytest.mark.parametrize("count", [1, 31, 32, 33, 100])
@pytest.mark.parametrize("reach", [0, 1, 40, 99])
def test_it_agrees_with_a_dense_solver(count, reach):
    random = np.random.default_rng(count + reach)
    factor = np.tril(np.triu(random.uniform(-1.0, 1.0, (count, count)), -reach))
    matrix = factor @ factor.T + np.eye(count)
    right = random.uniform(-1.0, 1.0, count)
    rows, columns = np.nonzero(matrix)
    values = matrix[rows, columns]
    solution = solve_banded(rows, columns, values, right)
    np.testing.assert_allclose(solution, np.linalg.solve(matrix, right), rtol=1e-9, atol=1e-12)


def test_a_plate_that_hardly_anything_holds_stays_a_plane():
    """A plane has no bends, so a plate with the ridge and the load of a plane is that plane."""
    number = np.arange(90 * 40).reshape(90, 40)
    triples = [
        np.stack([line[:-2], line[1:-1], line[2:]]).reshape(3, -1) for line in (number, number.T)
    ]
    nodes = np.concatenate(triples, axis=1)
    bend = np.array([1.0, -2.0, 1.0])
    rows = np.append(np.repeat(nodes, 3, axis=0), number)
    columns = np.append(np.tile(nodes, (3, 1)), number)
    values = np.append(np.repeat(81 * np.outer(bend, bend), nodes.shape[1]), 0 * number + 1e-6)
    x, y = np.divmod(number.ravel(), 40)
    plane = 0.01 * x - 0.02 * y
    np.testing.assert_allclose(solve_banded(rows, columns, values, 1e-6 * plane), plane, atol=1e-4)


def test_entries_at_one_place_add_up():
    rows = columns = np.array([0, 0, 1])
    solution = solve_banded(rows, columns, np.array([1.0, 3.0, 2.0]), np.array([8.0, 8.0]))
    np.testing.assert_allclose(solution, [2.0, 4.0])


def test_plates_over_junctions_import_no_other_solver():
    text = "import sys, envgen_usd.opendrive.mesh.junction_plate; print('scipy' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"
