//! Active muscle: fibres along a path pull with a stress that the host activates.
//!
//! ```text
//! psi = a T0 int_1^l f(s) ds,   l = |F f0|,   f(s) = 1 or max(0, 1 - ((s - 1)/width)^2)
//! ```
//!
//! `a` is the activation (0..1), `T0` the nominal stress at full activation, `f` the optional force-length curve.
//!
//! Source: Blemker, Pinsky & Delp, "A 3D model of muscle reveals the causes of nonuniform strains in the biceps brachii",
//! J. Biomech. 38(4), 2005; departure: the curve is a parabola over nominal stress, so that its work has a closed form.

use crate::fem::{At, Material};
use crate::math::{Mat3, Mat9, Vec3};

/// Active stress along one direction a point.
pub struct Muscle {
    /// Unit fibre direction at rest, one a point of integration.
    pub fibre: Vec<Vec3>,
    /// Nominal stress at full activation, Pa.
    pub T0: f64,
    /// Half width of the force-length curve in stretch; `None` for a force that does not depend on length.
    pub width: Option<f64>,
    /// Where the activation stands among the inputs.
    pub input: usize,
}

impl Muscle {
    /// Work, force and stiffness along the fibre at stretch `l` per unit of activated stress.
    fn along(&self, l: f64) -> (f64, f64, f64) {
        let e = l - 1.0;
        match self.width {
            None => (e, 1.0, 0.0),
            Some(w) if e.abs() < w => (e - e.powi(3) / (3.0 * w * w), 1.0 - (e / w).powi(2), -2.0 * e / (w * w)),
            Some(w) => (2.0 / 3.0 * w * e.signum(), 0.0, 0.0),
        }
    }

    fn stress(&self, at: &At) -> f64 {
        self.T0 * at.inputs[self.input]
    }
}

impl Material for Muscle {
    fn name(&self) -> &'static str {
        "muscle"
    }
    fn psi(&self, at: &At, p: usize, F: &Mat3) -> f64 {
        self.stress(at) * self.along((F * self.fibre[p]).norm()).0
    }
    fn psi_and_P(&self, at: &At, p: usize, F: &Mat3) -> (f64, Mat3) {
        let T = self.stress(at);
        let f = F * self.fibre[p];
        let l = f.norm();
        let (work, force, _) = self.along(l);
        if T == 0.0 || l == 0.0 {
            return (T * work, Mat3::zeros());
        }
        (T * work, (T * force / l) * f * self.fibre[p].transpose())
    }
    fn dPdF(&self, at: &At, p: usize, F: &Mat3) -> Mat9 {
        let T = self.stress(at);
        let f0 = &self.fibre[p];
        let f = F * f0;
        let l = f.norm();
        let mut H = Mat9::zeros();
        if T == 0.0 || l == 0.0 {
            return H;
        }
        let (_, force, stiffness) = self.along(l);
        let n = f / l;
        let nn = n * n.transpose();
        let A = T * (stiffness * nn + force / l * (Mat3::identity() - nn));
        for j in 0..3 {
            for k in 0..3 {
                H.fixed_view_mut::<3, 3>(3 * j, 3 * k).copy_from(&(f0[j] * f0[k] * A));
            }
        }
        H
    }
    fn is_elastic(&self) -> bool {
        false
    }
    fn inputs(&self) -> std::ops::Range<usize> {
        self.input..self.input + 1
    }
}

/// Direction of a path at the place nearest to `p`, and the distance to it, m.
pub fn nearest_on_path(path: &[Vec3], p: &Vec3) -> (Vec3, f64) {
    let segment = |s: &[Vec3]| {
        let along = s[1] - s[0];
        let share = ((p - s[0]).dot(&along) / along.norm_squared()).clamp(0.0, 1.0);
        (along.normalize(), (s[0] + share * along - p).norm())
    };
    path.windows(2).map(segment).min_by(|a, b| a.1.total_cmp(&b.1)).expect("a path has two points")
}
