r"""Preconditioner for elements that are nearly stars: every node joined to the centre of its element alone.

An element K_e over its nodes is replaced by the star of conductances g_i from each node to a centre,
K_e ~ diag(g) - g g^T/sum(g). Its sum over all elements is inverted by way of the centres: with G_f the conductance of
node f to both of its centres and B the conductances from nodes to centres,

.. math:: z = G^{-1}(r + B\,t), \qquad (D - B^T G^{-1} B)\,t = B^T G^{-1} r,

where D holds the sums around the centres. The matrix of the centres is that of a network of pipes; multigrid solves it
nearly, and what is left for conjugate gradients is only how far the elements are from stars.
"""

from __future__ import annotations

import time

import numpy as np
from scipy.sparse import csr_matrix, diags_array

from etc_engine.arrays import Floats, Ints
from etc_engine.solvers.amg_cg import Preconditioner, build_preconditioner


def star_preconditioner(nodes: Ints, centres: Ints, conductances: Floats, size: int) -> Preconditioner:
    """Inverse of a sum of stars, exactly where the centres are few, by one V-cycle where they are many.

    Parameters
    ----------
    nodes : ndarray of int, shape (s,)
        Unknown of each arm, -1 where its temperature is prescribed.
    centres : ndarray of int, shape (s,)
        Centre of each arm, numbered from 0.
    conductances : ndarray, shape (s,) [W/K]
        Positive.
    size : int
        Number of unknowns; each has an arm.

    Returns
    -------
    Preconditioner

    Notes
    -----
    Symmetric positive definite if a prescribed node can be reached from every centre.

    Examples
    --------
    Two stars that share node 0; their other nodes are prescribed:

    >>> inverse = star_preconditioner(np.array([0, -1, 0, -1]), np.array([0, 0, 1, 1]), np.ones(4), 1)
    >>> inverse.apply(np.ones(1))  # half the sum of two conductances of 1/2
    array([1.])
    """
    start = time.perf_counter()
    inside = nodes >= 0
    here, there, g = nodes[inside], centres[inside], conductances[inside]
    count = int(centres.max(initial=-1)) + 1
    totals = np.bincount(here, g, minlength=size)
    arms = csr_matrix((g, (here, there)), shape=(size, count))
    spread = csr_matrix(diags_array(1.0 / totals) @ arms)
    gather = csr_matrix(spread.T)
    gather.sort_indices()
    around = diags_array(np.bincount(centres, conductances, minlength=count))
    coarse = csr_matrix(around - arms.T @ spread)
    coarse.sort_indices()
    inner = build_preconditioner(coarse)

    def apply(residual: Floats) -> Floats:
        return np.asarray(residual / totals + spread @ inner.apply(gather @ residual))

    return Preconditioner(apply, inner.levels + 1, time.perf_counter() - start)
