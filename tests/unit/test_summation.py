"""Sums in one order: right to round-off, and the same bits on any number of threads of BLAS."""

from __future__ import annotations

import os
import subprocess
import sys

import numpy as np
import pytest

from etc_engine.solvers.summation import combine, dot, inner

BITS = """
import hashlib, sys
import numpy as np
from etc_engine import Box, PackingSpec, bonded_contacts, effective_conductivity, medium_of, pack, parse_radii
from scipy.sparse import diags_array, kron, eye_array
from etc_engine.solvers import build_preconditioner, solve_energy
n = 160
line = diags_array([2.001, -1.0, -1.0], offsets=[0, 1, -1], shape=(n, n))
K = (kron(line, eye_array(n)) + kron(eye_array(n), line)).tocsr()
b = np.random.default_rng(501).random(n * n)
u, report = solve_energy(K, b, 1e9, preconditioner=build_preconditioner(K, 2000))
spec = PackingSpec("advancing-front", parse_radii("uniform:0.01:0.02"), Box((1.0, 1.0)))
medium = medium_of(bonded_contacts(pack(spec, np.random.default_rng(502)), 0.1))
found = [effective_conductivity(medium, engine=engine).tensor for engine in ("dtem", "pipe")]
print(report.iterations, hashlib.sha256(u.tobytes() + b"".join(t.tobytes() for t in found)).hexdigest())
"""


def test_sums_are_exact_to_round_off():
    rng = np.random.default_rng(503)
    a, b = rng.standard_normal((1003, 3)), rng.standard_normal((1003, 2))
    np.testing.assert_allclose(inner(a, b), a.T @ b, rtol=1e-12)
    np.testing.assert_allclose(combine(a, b[:3]), a @ b[:3], rtol=1e-12)
    assert dot(a[:, 0], b[:, 0]) == pytest.approx(a[:, 0] @ b[:, 0], rel=1e-13)
    assert dot(np.zeros(0), np.zeros(0)) == 0.0


def test_bits_do_not_depend_on_the_threads_of_blas():
    found = set()
    for threads in ("1", "2", "4"):
        names = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
        environment = os.environ | dict.fromkeys(names, threads)
        done = subprocess.run([sys.executable, "-c", BITS], env=environment, capture_output=True, text=True, check=True)
        found.add(done.stdout)
    (only,) = found
    assert int(only.split()[0]) > 3  # multigrid, with iterations
