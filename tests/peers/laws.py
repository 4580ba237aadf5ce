"""The laws that are compared: constants, the lines of cutis's scene, and P(F) written down once more, by hand."""

import numpy as np

E, NU = 15e3, 0.4
MU, LAMBDA = E / (2 * (1 + NU)), E * NU / ((1 + NU) * (1 - 2 * NU))
C10, C01, C20, C30 = 0.4 * MU, 0.1 * MU, 0.3 * MU, 0.1 * MU
KAPPA = LAMBDA + 2 / 3 * MU

_modulus = f"E = {E!r}\nnu = {NU!r}\n"
SCENE = {
    "linear": _modulus,
    "st-venant-kirchhoff": _modulus,
    "neo-hookean": _modulus,
    "stable-neo-hookean": _modulus,
    "mooney-rivlin": f"c10 = {C10!r}\nc01 = {C01!r}\nkappa = {KAPPA!r}\n",
    "yeoh": f"c10 = {0.5 * MU!r}\nc20 = {C20!r}\nc30 = {C30!r}\nkappa = {KAPPA!r}\n",
}

_eye = np.eye(3)


def _t(A):
    return np.swapaxes(A, -1, -2)


def _invariants(F):
    C = _t(F) @ F
    trace = np.trace(C, axis1=-2, axis2=-1)
    return trace, (trace**2 - np.einsum("...ij,...ij", C, C)) / 2, C


def _dI2(F, I1, C):
    return 2 * (I1[..., None, None] * F - F @ C)


def stress(law, F):
    """First Piola-Kirchhoff stress of F (..., 3, 3); analytic in F, so that complex steps differentiate it."""
    s = lambda a: a[..., None, None] if np.ndim(a) else a
    J = np.linalg.det(F)
    G = _t(np.linalg.inv(F))
    I1, I2, C = _invariants(F)
    if law == "linear":
        e = (F + _t(F)) / 2 - _eye
        return 2 * MU * e + LAMBDA * s(np.trace(e, axis1=-2, axis2=-1)) * _eye
    if law == "st-venant-kirchhoff":
        e = (C - _eye) / 2
        return F @ (2 * MU * e + LAMBDA * s(np.trace(e, axis1=-2, axis2=-1)) * _eye)
    if law == "neo-hookean":
        return MU * (F - G) + LAMBDA * s(np.log(J)) * G
    if law == "stable-neo-hookean":
        return MU * F + s(((LAMBDA + MU) * (J - 1) - MU) * J) * G
    # Volume-free part in I1b = J^(-2/3) I1 and I2b = J^(-4/3) I2, and U = kappa/2 (J - 1)^2.
    I1b, I2b = J ** (-2 / 3) * I1, J ** (-4 / 3) * I2
    if law == "mooney-rivlin":
        W1, W2 = C10, C01
    else:
        k = I1b - 3
        W1, W2 = 0.5 * MU + 2 * C20 * k + 3 * C30 * k**2, 0.0
    dI1b = s(J ** (-2 / 3)) * 2 * F - s(2 / 3 * I1b) * G
    dI2b = s(J ** (-4 / 3)) * _dI2(F, I1, C) - s(4 / 3 * I2b) * G
    return s(W1) * dI1b + s(W2) * dI2b + s(KAPPA * (J - 1) * J) * G


def tangent(law, F):
    """dP/dF (..., i, J, k, L) by complex steps: exact to rounding."""
    A = np.empty((*F.shape, 3, 3))
    for k in range(3):
        for L in range(3):
            step = F.astype(complex)
            step[..., k, L] += 1e-30j
            A[..., k, L] = stress(law, step).imag / 1e-30
    return A
