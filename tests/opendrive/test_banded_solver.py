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


def test_entries_at_one_place_add_up():
    rows = columns = np.array([0, 0, 1])
    solution = solve_banded(rows, columns, np.array([1.0, 3.0, 2.0]), np.array([8.0, 8.0]))
    assert solution.tolist() == [2.0, 4.0]


def test_plates_over_junctions_import_no_other_solver():
    text = "import sys, envgen_usd.opendrive.mesh.junction_plate; print('scipy' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"
