//! Nearest positive semi-definite matrix of a symmetric 9x9 tangent.

use super::Mat9;

/// Replaces negative eigenvalues by zero.
///
/// Source: Teran, Sifakis, Irving & Fedkiw, "Robust quasistatic finite elements and flesh simulation", SCA 2005.
pub fn clamp_eigenvalues(H: &Mat9) -> Mat9 {
    let symmetric = 0.5 * (H + H.transpose());
    let eigen = symmetric.symmetric_eigen();
    if eigen.eigenvalues.iter().all(|&l| l >= 0.0) {
        return symmetric;
    }
    let clamped = Mat9::from_diagonal(&eigen.eigenvalues.map(|l| l.max(0.0)));
    eigen.eigenvectors * clamped * eigen.eigenvectors.transpose()
}
