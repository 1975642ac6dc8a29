"""Least contraction factor that a quadratic norm |g|_Q and multipliers prove for T_theta, with every entry of Q free.

A model in cvxpy for small pairs, to compare with.
"""

from __future__ import annotations

import warnings

import cvxpy as cp
import numpy as np

#: Accuracy asked of Clarabel.
ACCURACY = dict.fromkeys(("tol_gap_abs", "tol_gap_rel", "tol_feas"), 1e-10)


class FullProgram:
    """Search for Q > 0 and multipliers that make the form of a step positive definite.

    With differences g of forces on the Neumann grid and p of reactions on the contact grid the form is ::

        q^2 |g|_Q^2 - |theta P'p + (1 - theta) g|_Q^2 - Sigma,      jump = -(S_c^-1 p + P S_n^-1 g),  zeta = S g_N,
        Sigma = sum_j lambda_j p_N jump_N + tau_j p_T jump_T + w_j k_j (a_j zeta_j^2 + b_j jump_T^2),

    with 4 a_j b_j >= tau_j^2.  It is written in y and s, where g = L y with S_n = L L', and p = reaction s with
    p' S_c^-1 p = |s|^2: there the norm (5.21) is Q = I.  Without friction p_T = 0.

    Parameters
    ----------
    pair : ContactPair
        The contact body is held by its supports; no contact node is held tangentially.
    theta : float
        The relaxation factor, 0 < theta <= 1.
    """

    def __init__(self, pair, theta):
        contact, interface = pair.contact.grid, pair.interface
        root, flexible = np.linalg.cholesky(pair.neumann.schur), np.linalg.inv(pair.contact.schur)
        kept = np.eye(contact.size) if pair.rubs else np.eye(contact.size)[:, contact.normal]
        self.root, self.reaction = root, kept @ np.linalg.inv(np.linalg.cholesky(kept.T @ flexible @ kept)).T
        m, n = len(root), kept.shape[1]
        self.state = np.eye(m, m + n)
        carried = np.linalg.solve(root, interface.carry_back(self.reaction))
        self.step = np.hstack([(1 - theta) * np.eye(m), theta * carried])
        p = np.hstack([np.zeros((contact.size, m)), self.reaction])
        jump = -np.hstack([interface.carry(np.linalg.inv(root).T), flexible @ self.reaction])
        products = [(p[contact.normal], jump[contact.normal])]
        if pair.rubs:
            weight = np.sqrt(float(pair.friction) * contact.weights)[:, None]
            zeta, slip = weight * (interface.kernel @ root[pair.neumann.grid.normal]), weight * jump[contact.tangential]
            zeta = np.hstack([zeta, np.zeros((contact.n, n))])
            lengths = [np.linalg.norm(rows, axis=1, keepdims=True) for rows in (slip, zeta)]
            even = np.sqrt(lengths[0] / np.maximum(lengths[1], 1e-12 * lengths[1].max()))
            products += [(p[contact.tangential], jump[contact.tangential]), (even * zeta,) * 2, (slip / even,) * 2]
        forms = [x[:, :, None] * y[:, None, :] for x, y in products]
        forms = [(form + form.transpose(0, 2, 1)) / 2 for form in forms]
        sizes = [np.linalg.norm(form, axis=(1, 2)) for form in forms]
        sizes[2:] = sizes[1:2] * len(sizes[2:])  # one for tau, a, b, so that 4 a b >= tau^2 stays as it is
        self.conditions = [form / size[:, None, None] for form, size in zip(forms, sizes, strict=True)]
        self.norm, self.margin = cp.Variable((m, m), symmetric=True), cp.Variable()
        self.square = cp.Parameter(nonneg=True)
        self.unknowns = [cp.Variable(len(form), nonneg=True) for form in forms]
        both = zip(self.conditions, self.unknowns, strict=True)
        sigma = cp.reshape(sum(form.reshape(len(form), -1).T @ x for form, x in both), (m + n, m + n), order="C")
        after = self.step.T @ self.norm @ self.step + sigma
        definite = self.square * (self.state.T @ self.norm @ self.state) - after >> self.margin * np.eye(m + n)
        tangential = [self.unknowns[1:]] if pair.rubs else []
        cones = [cp.SOC(a + b, cp.vstack([tau, a - b]), axis=0) for tau, a, b in tangential]
        self.problem = cp.Problem(cp.Maximize(self.margin), [definite, cp.trace(self.norm) == m, *cones])

    def proves(self, q):
        """Return Q, in y and of trace m, and the multipliers of the conditions, where they prove q; None otherwise."""
        self.square.value = q**2
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # "may be inaccurate": the eigenvalues below decide
            self.problem.solve(solver=cp.CLARABEL, **ACCURACY)
        Q, multipliers = self.norm.value, [np.maximum(x.value, 0) for x in self.unknowns]
        for tau, a, b in [multipliers[1:]] if len(multipliers) > 1 else []:
            np.minimum(tau, 2 * np.sqrt(a * b), out=tau)
        form = q**2 * self.state.T @ Q @ self.state - self.step.T @ Q @ self.step
        form -= sum(np.tensordot(x, form, 1) for x, form in zip(multipliers, self.conditions, strict=True))
        return (Q, multipliers) if min(np.linalg.eigvalsh(form)[0], np.linalg.eigvalsh(Q)[0]) > 0 else None


def least_factor(pair, theta, tolerance=1e-3):
    """Return a q that some Q > 0 proves for T_theta, at most ``tolerance`` above the least such q.

    For the q returned the form is positive definite as computed; that no smaller q is possible rests on the solver.
    """
    program = FullProgram(pair, theta)
    low, high = 1 - theta, 1.0
    while not program.proves(high):
        low, high = high, 2 * high
    while high - low > tolerance:
        middle = (low + high) / 2
        low, high = (low, middle) if program.proves(middle) else (middle, high)
    return high
