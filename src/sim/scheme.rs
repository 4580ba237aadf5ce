//! Time integrators: what each makes of a node's past, and nothing else.
//!
//! In every scheme velocity and acceleration at the end of a step are affine in the position there,
//!
//! ```text
//! v = rate (x - x_v),   a = inertia (x - x_a),
//! ```
//!
//! so that `M a + damping M v + dW/dx = 0` says that `W + (inertia + damping rate)/2 |x - x_tilde|^2_M` is smallest.
//! Backward differences (first and second order) apply the same difference to x and to v:
//!
//! ```text
//! x_v = last x(n) - before x(n-1),   x_a = x_v + (last v(n) - before v(n-1))/rate,   inertia = rate^2
//! ```
//!
//! Generalised-alpha takes its means over accelerations, a_d being those that the tissue has, a those of Newmark:
//!
//! ```text
//! (1 - am) a(n+1) + am a(n) = (1 - af) a_d(n+1) + af a_d(n)
//! x(n+1) = x + dt v + dt^2 ((1/2 - beta) a(n) + beta a(n+1)),   v(n+1) = v + dt ((1 - gamma) a(n) + gamma a(n+1))
//! am = (2 rho - 1)/(rho + 1), af = rho/(rho + 1), gamma = 1/2 - am + af, beta = (1 - am + af)^2/4
//! ```
//!
//! so forces stand at the ends of steps, where bones, loads and viscous memory are known. a(n) belongs to the time
//! t(n) + (am - af) dt; what is remembered of it is (a - a_d)/dt, which keeps order 2 when dt changes. That memory multiplies
//! by the square of the ratio when steps grow, and what the scheme should damp grows with it; so a step that is longer than
//! the one before by more than a fifth is one of backward Euler, after which a = a_d. No sequence of steps gains
//! energy then (`no_sequence_of_steps_gains_energy`); rho = 1, which remembers nothing, does not need it.
//!
//! Source: Chung & Hulbert, "A time integration algorithm for structural dynamics with improved numerical dissipation",
//! J. Appl. Mech. 60, 1993; in this form Arnold & Bruels, "Convergence of the generalized-alpha scheme for constrained
//! mechanical systems", Multibody Syst. Dyn. 18, 2007. Departure: the start sets a(n) = a_d(n), and steps that grow as said
//! are of first order.

use crate::fem::Difference;
use crate::math::Vec3;

/// Largest ratio of a step to the one before at which generalised-alpha keeps its memory: `1 + 2 (1 - rho)`, and no more than
/// this. No product of up to four amplification matrices, nor any random sequence tried, has an eigenvalue beyond 1 then;
/// with 1.4, or with 1.2 for rho near 1, some do.
const ALPHA_GROWTH: f64 = 1.2;
/// Ratio by which steps of the other schemes grow where they are chosen here: `fem::Difference` bears more.
const GROWTH: f64 = 1.4;

/// Ratio of a step to the one before from which on every scheme starts anew.
const MOST_GROWTH: f64 = 1e6;

/// Part of a ratio that its own round-off may be.
const ROUND_OFF: f64 = 1e-9;

/// A time integrator.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Scheme {
    /// First order, damps all it does not resolve.
    BackwardEuler,
    /// Second order, damps what it does not resolve.
    Bdf2,
    /// Second order; `rho` is what a step leaves of the fastest motions. 1: the trapezoidal form of the implicit midpoint.
    GeneralisedAlpha {
        /// Spectral radius at infinite frequency, 0 to 1.
        rho: f64,
    },
}

/// What a scheme knows of a node when a step begins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Past {
    pub x: Vec3,
    pub v: Vec3,
    /// Backward differences: x and v of the step before. Generalised-alpha: a_d and (a - a_d)/dt.
    pub memory: [Vec3; 2],
}

/// The formulas of one step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Formula {
    dt: f64,
    dt_before: f64,
    /// v = rate (x - x_v), 1/s.
    rate: f64,
    /// a = inertia (x - x_a), 1/s2.
    inertia: f64,
    kind: Kind,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    Difference(Difference),
    Alpha(Alpha),
    /// Backward Euler in a scheme that remembers accelerations.
    Restart(Difference),
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Alpha {
    am: f64,
    af: f64,
    gamma: f64,
    beta: f64,
    /// Whether what is remembered counts, or a(n) = a_d(n).
    remembers: bool,
}

impl Scheme {
    /// Whether a node's past is more than x and v.
    pub(super) fn remembers(&self) -> bool {
        *self != Scheme::BackwardEuler
    }

    /// Exponent of dt in the local error of a position.
    pub(super) fn local_order(&self) -> f64 {
        if *self == Scheme::BackwardEuler { 2.0 } else { 3.0 }
    }

    /// Ratio of a step to the one before up to which a step keeps its order.
    pub(super) fn growth(&self) -> f64 {
        match *self {
            // The trapezoidal rule has no memory to lose.
            Scheme::GeneralisedAlpha { rho } if rho < 1.0 => ALPHA_GROWTH.min(1.0 + 2.0 * (1.0 - rho)),
            _ => GROWTH,
        }
    }

    /// How values that terms remember become rates.
    pub(super) fn difference(&self, dt: f64, dt_before: f64) -> Difference {
        Difference::new(dt, if self.remembers() { dt_before } else { 0.0 })
    }

    /// For a step of `dt` after one of `dt_before` (0 if there was none).
    pub(super) fn formula(&self, dt: f64, dt_before: f64) -> Formula {
        let Scheme::GeneralisedAlpha { rho } = *self else {
            let difference = self.difference(dt, dt_before);
            let rate = difference.rate;
            return Formula { dt, dt_before, rate, inertia: rate * rate, kind: Kind::Difference(difference) };
        };
        // rho = 1 remembers nothing that a step could be too long for, and starts anew only where it is told to.
        let most = if rho < 1.0 { self.growth() } else { MOST_GROWTH };
        if dt_before > 0.0 && dt > most * (1.0 + ROUND_OFF) * dt_before {
            let difference = Difference::new(dt, 0.0);
            let rate = difference.rate;
            return Formula { dt, dt_before, rate, inertia: rate * rate, kind: Kind::Restart(difference) };
        }
        let (am, af) = ((2.0 * rho - 1.0) / (rho + 1.0), rho / (rho + 1.0));
        let (gamma, beta) = (0.5 - am + af, 0.25 * (1.0 - am + af).powi(2));
        let remembers = dt_before > 0.0 && rho < 1.0;
        Formula {
            dt,
            dt_before,
            rate: gamma / (beta * dt),
            inertia: (1.0 - am) / ((1.0 - af) * beta * dt * dt),
            kind: Kind::Alpha(Alpha { am, af, gamma, beta, remembers }),
        }
    }
}

impl Formula {
    /// Coefficient of the inertia term with mass damping of `damping` (1/s), 1/s2.
    pub fn coefficient(&self, damping: f64) -> f64 {
        self.inertia + damping * self.rate
    }

    /// Where inertia and mass damping alone would carry a node.
    pub fn x_tilde(&self, past: &Past, damping: f64) -> Vec3 {
        let (x_v, x_a) = self.anchors(past);
        if damping == 0.0 {
            return x_a;
        }
        (self.inertia * x_a + damping * self.rate * x_v) / self.coefficient(damping)
    }

    /// The same for a node that is on its way to `x` whatever the forces: it moves evenly, as bones do within a step.
    pub fn x_tilde_of_bone(&self, past: &Past, damping: f64, x: &Vec3) -> Vec3 {
        let v = (x - past.x) / self.dt;
        let a = (v - past.v) / self.dt;
        x - (a + damping * v) / self.coefficient(damping)
    }

    /// How much of its own motion the place where inertia carries a node of a bone follows: d x_tilde_of_bone/dx.
    pub fn follows_bone(&self, damping: f64) -> f64 {
        1.0 - (1.0 / self.dt + damping) / (self.dt * self.coefficient(damping))
    }

    /// dv/dx of a node, 1/s; `of_bone` if a bone moves it.
    pub fn rate(&self, of_bone: bool) -> f64 {
        if of_bone { 1.0 / self.dt } else { self.rate }
    }

    /// Velocity at `x` and what is remembered there.
    pub fn arrive(&self, past: &Past, x: &Vec3) -> (Vec3, [Vec3; 2]) {
        let (x_v, x_a) = self.anchors(past);
        let v = self.rate * (x - x_v);
        match self.kind {
            Kind::Difference(_) => (v, [past.x, past.v]),
            Kind::Restart(_) => (v, [self.inertia * (x - x_a), Vec3::zeros()]),
            Kind::Alpha(alpha) => {
                let a_d = self.inertia * (x - x_a);
                let a = alpha.newmark(&a_d, past, self.dt);
                (v, [a_d, (a - a_d) / self.dt])
            }
        }
    }

    /// The same for a node of a bone.
    pub fn arrive_with_bone(&self, past: &Past, x: &Vec3) -> (Vec3, [Vec3; 2]) {
        let v = (x - past.x) / self.dt;
        match self.kind {
            Kind::Difference(_) => (v, [past.x, past.v]),
            Kind::Alpha(_) | Kind::Restart(_) => (v, [(v - past.v) / self.dt, Vec3::zeros()]),
        }
    }

    /// Estimate of the local error of the position `x`.
    ///
    /// Source: Zienkiewicz & Xie, "A simple error estimator and adaptive time stepping procedure for dynamic analysis",
    /// Earthquake Eng. Struct. Dyn. 20, 1991, with the constant of each scheme's own next term.
    pub fn error(&self, past: &Past, x: &Vec3) -> Vec3 {
        let (x_v, x_a) = self.anchors(past);
        match self.kind {
            Kind::Difference(d) | Kind::Restart(d) => {
                let slope = (self.rate * (x - x_v) - past.v) / self.dt;
                if d.before == 0.0 {
                    return 0.5 * self.dt * self.dt * slope;
                }
                let slope_before = (past.v - past.memory[1]) / self.dt_before;
                self.dt / (3.0 * self.rate) * (slope - slope_before)
            }
            Kind::Alpha(alpha) => {
                let a = alpha.newmark(&(self.inertia * (x - x_a)), past, self.dt);
                let constant = alpha.beta - 1.0 / 6.0 + 0.5 * (alpha.am - alpha.af);
                constant * self.dt * self.dt * (a - alpha.last(past, self.dt))
            }
        }
    }

    /// x_v and x_a.
    fn anchors(&self, past: &Past) -> (Vec3, Vec3) {
        match self.kind {
            Kind::Restart(Difference { rate, .. }) => {
                let x_v = past.x;
                (x_v, x_v + past.v / rate)
            }
            Kind::Difference(Difference { rate, last, before }) => {
                let x_v = last * past.x - before * past.memory[0];
                (x_v, x_v + (last * past.v - before * past.memory[1]) / rate)
            }
            Kind::Alpha(alpha) => {
                let (dt, a) = (self.dt, alpha.last(past, self.dt));
                let x = past.x + dt * past.v + dt * dt * (0.5 - alpha.beta) * a;
                let mixed = (alpha.am * a - alpha.af * past.memory[0]) / (1.0 - alpha.af);
                (x - (past.v + dt * (1.0 - alpha.gamma) * a) / self.rate, x - mixed / self.inertia)
            }
        }
    }
}

impl Alpha {
    /// a(n).
    fn last(&self, past: &Past, dt: f64) -> Vec3 {
        if self.remembers { past.memory[0] + dt * past.memory[1] } else { past.memory[0] }
    }

    /// a(n+1) where the tissue's acceleration is `a_d`.
    fn newmark(&self, a_d: &Vec3, past: &Past, dt: f64) -> Vec3 {
        ((1.0 - self.af) * a_d + self.af * past.memory[0] - self.am * self.last(past, dt)) / (1.0 - self.am)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCHEMES: [Scheme; 5] = [
        Scheme::BackwardEuler,
        Scheme::Bdf2,
        Scheme::GeneralisedAlpha { rho: 0.0 },
        Scheme::GeneralisedAlpha { rho: 0.8 },
        Scheme::GeneralisedAlpha { rho: 1.0 },
    ];

    /// One mode: x'' + damping x' + w^2 x = 0, from x = 1.
    struct Mode {
        scheme: Scheme,
        w2: f64,
        damping: f64,
        past: Past,
        dt: f64,
    }

    impl Mode {
        fn new(scheme: Scheme, w: f64, damping: f64) -> Mode {
            let x = Vec3::x();
            let start = if matches!(scheme, Scheme::GeneralisedAlpha { .. }) { -w * w * x } else { Vec3::zeros() };
            Mode {
                scheme,
                w2: w * w,
                damping,
                past: Past { x, v: Vec3::zeros(), memory: [start, Vec3::zeros()] },
                dt: 0.0,
            }
        }

        fn step(&mut self, dt: f64) -> &Past {
            let formula = self.scheme.formula(dt, self.dt);
            let k = formula.coefficient(self.damping);
            let x = k * formula.x_tilde(&self.past, self.damping) / (k + self.w2);
            let (v, memory) = formula.arrive(&self.past, &x);
            (self.past, self.dt) = (Past { x, v, memory }, dt);
            &self.past
        }

        fn energy(&self) -> f64 {
            0.5 * (self.past.v.x.powi(2) + self.w2 * self.past.x.x.powi(2))
        }

        /// Damping in units of the critical one, from the energy over many steps.
        fn ratio(&mut self, theta: f64) -> f64 {
            let dt = theta / self.w2.sqrt();
            let n = (400.0 / theta) as u32;
            for _ in 0..n / 2 {
                self.step(dt);
            }
            let (mut before, mut phase, mut turned) = (self.past, 0.0, 0.0);
            let e0 = self.energy();
            let angle = |p: &Past, w: f64| (-p.v.x / w).atan2(p.x.x);
            for _ in 0..n {
                self.step(dt);
                let step = angle(&self.past, self.w2.sqrt()) - angle(&before, self.w2.sqrt());
                turned += step.rem_euclid(std::f64::consts::TAU);
                before = self.past;
                phase += theta;
            }
            assert!(turned > 0.5 * phase);
            -0.5 * (self.energy() / e0).ln() / turned
        }
    }

    /// The root near exp(i theta) of a polynomial with the coefficients `c` (highest first), by Newton.
    fn root(c: &[[f64; 2]], theta: f64) -> [f64; 2] {
        let times = |a: [f64; 2], b: [f64; 2]| [a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]];
        let mut z = [theta.cos(), theta.sin()];
        for _ in 0..60 {
            let (mut p, mut slope) = ([0.0; 2], [0.0; 2]);
            for c in c {
                slope = times(slope, z);
                slope = [slope[0] + p[0], slope[1] + p[1]];
                p = times(p, z);
                p = [p[0] + c[0], p[1] + c[1]];
            }
            let n = slope[0] * slope[0] + slope[1] * slope[1];
            let step = times(p, [slope[0] / n, -slope[1] / n]);
            z = [z[0] - step[0], z[1] - step[1]];
        }
        z
    }

    /// Damping that docs/theory.md gives for a scheme, in units of the critical one.
    fn formula_of(scheme: Scheme, theta: f64) -> f64 {
        let z = match scheme {
            Scheme::BackwardEuler => return (1.0 + theta * theta).ln() / (2.0 * theta.atan()),
            Scheme::Bdf2 => root(&[[1.5, -theta], [-2.0, 0.0], [0.5, 0.0]], theta),
            Scheme::GeneralisedAlpha { rho } => {
                let (am, af) = ((2.0 * rho - 1.0) / (rho + 1.0), rho / (rho + 1.0));
                let (gamma, beta) = (0.5 - am + af, 0.25 * (1.0 - am + af).powi(2));
                let t2 = theta * theta;
                let (p, q) = (0.5 + gamma - 2.0 * beta, 0.5 - gamma + beta);
                let real = |v: f64| [v, 0.0];
                root(
                    &[
                        real((1.0 - am) + t2 * (1.0 - af) * beta),
                        real(am - 2.0 * (1.0 - am) + t2 * ((1.0 - af) * p + af * beta)),
                        real((1.0 - am) - 2.0 * am + t2 * ((1.0 - af) * q + af * p)),
                        real(am + t2 * af * q),
                    ],
                    theta,
                )
            }
        };
        -0.5 * (z[0] * z[0] + z[1] * z[1]).ln() / z[1].atan2(z[0])
    }

    #[test]
    fn each_scheme_damps_as_its_formula_says() {
        for scheme in SCHEMES {
            for theta in [0.1, 0.3, 1.0] {
                let (found, wanted) = (Mode::new(scheme, 3.0, 0.0).ratio(theta), formula_of(scheme, theta));
                assert!((found - wanted).abs() < 0.02 * wanted + 1e-6, "{scheme:?} {theta}: {found:.3e}, {wanted:.3e}");
            }
        }
        // The figures of docs/theory.md.
        assert!((formula_of(Scheme::BackwardEuler, 0.1) - 0.05).abs() < 1e-3);
        assert!((formula_of(Scheme::Bdf2, 0.1) - 2.4e-4).abs() < 1e-5);
    }

    #[test]
    #[should_panic]
    fn a_planted_damping_is_found() {
        let found = Mode::new(Scheme::Bdf2, 3.0, 0.01).ratio(0.1);
        assert!((found - formula_of(Scheme::Bdf2, 0.1)).abs() < 0.02 * found);
    }

    #[test]
    fn mass_damping_has_its_ratio() {
        for scheme in [Scheme::Bdf2, Scheme::GeneralisedAlpha { rho: 0.8 }, Scheme::GeneralisedAlpha { rho: 1.0 }] {
            let zeta = Mode::new(scheme, 3.0, 0.3).ratio(0.02);
            let wanted = 0.3 / (2.0 * 3.0);
            assert!((zeta - wanted).abs() < 2e-3 * wanted, "{scheme:?}: {zeta} against {wanted}");
        }
    }

    #[test]
    fn steps_of_any_length_keep_the_order() {
        let error = |scheme: Scheme, n: usize| {
            let mut mode = Mode::new(scheme, 1.0, 0.0);
            for k in 0..n {
                mode.step([1.0, 1.2, 0.9, 0.9][k % 4] / n as f64);
            }
            (mode.past.x.x - 1.0_f64.cos()).abs()
        };
        for scheme in SCHEMES {
            let order = (error(scheme, 400) / error(scheme, 800)).log2();
            let wanted = scheme.local_order() - 1.0;
            assert!((order - wanted).abs() < 0.1, "{scheme:?}: order {order}, wanted {wanted}");
        }
    }

    /// Whether the energy is ever above `1 + 1e-3` of that after the first step, over 5000 steps of these lengths.
    fn gains(mut mode: Mode, mut dt: impl FnMut() -> f64) -> bool {
        // As after a much shorter step: set out at rest, unresolved modes overshoot once, whatever the steps that follow.
        mode.dt = 1e-9;
        mode.step(dt());
        let start = mode.energy();
        (0..5000).any(|_| {
            mode.step(dt());
            mode.energy() > (1.0 + 1e-3) * start
        })
    }

    /// Sequences of steps: a fixed cycle, or at random between 1 and 10, or each in a ratio to the one before.
    fn sequences() -> Vec<Box<dyn FnMut() -> f64>> {
        fn random() -> impl FnMut() -> f64 {
            let mut seed = 1_u64;
            move || {
                seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                (seed >> 11) as f64 / (1_u64 << 53) as f64
            }
        }
        fn cycle(steps: &'static [f64]) -> Box<dyn FnMut() -> f64> {
            let mut k = 0;
            Box::new(move || {
                k += 1;
                steps[(k - 1) % steps.len()]
            })
        }
        fn ratios(factors: &'static [f64]) -> Box<dyn FnMut() -> f64> {
            let (mut u, mut dt) = (random(), 1.0);
            Box::new(move || {
                let factor = factors[(u() * factors.len() as f64) as usize];
                dt = f64::clamp(dt * factor, 1e-3, 1e3);
                dt
            })
        }
        let mut u = random();
        vec![
            cycle(&[1.0]),
            cycle(&[10.0, 1.0, 1.0]),
            cycle(&[1.0, 4.0]),
            cycle(&[1.0, 1.2, 1.44, 1.2]),
            cycle(&[1.0, 2.0, 4.0, 2.0]),
            Box::new(move || 10.0_f64.powf(u())),
            ratios(&[0.7, 1.0, 1.4]),
            ratios(&[1.0 / 1.2, 1.0, 1.2]),
            ratios(&[0.25, 0.5, 1.0, 2.0, 10.0]),
        ]
    }

    #[test]
    fn no_sequence_of_steps_gains_energy() {
        let rhos = [0.0, 0.3, 0.5, 0.8, 0.9, 0.95, 0.99, 0.999, 1.0].map(|rho| Scheme::GeneralisedAlpha { rho });
        for scheme in [Scheme::BackwardEuler, Scheme::Bdf2].into_iter().chain(rhos) {
            for w in [1e-3, 0.03, 0.3, 1.0, 3.0, 30.0, 1e3, 1e6] {
                for (k, steps) in sequences().into_iter().enumerate() {
                    assert!(!gains(Mode::new(scheme, w, 0.0), steps), "{scheme:?}, w {w:e}, sequence {k}");
                }
            }
        }
    }

    #[test]
    #[should_panic]
    fn a_planted_gain_is_found() {
        assert!(!gains(Mode::new(Scheme::Bdf2, 3e-3, -1e-6), || 1.0));
    }

    /// Estimated and true error of one step from values that are exact.
    fn local_errors(scheme: Scheme, t: f64, dt: f64, dt_before: f64) -> (f64, f64) {
        let (x, v) = (|t: f64| t.cos() * Vec3::x(), |t: f64| -t.sin() * Vec3::x());
        let memory = match scheme {
            Scheme::GeneralisedAlpha { rho } => [-x(t), (rho - 1.0) / (rho + 1.0) * -v(t)],
            _ => [x(t - dt_before), v(t - dt_before)],
        };
        let past = Past { x: x(t), v: v(t), memory };
        let formula = scheme.formula(dt, dt_before);
        let k = formula.coefficient(0.0);
        let found = k * formula.x_tilde(&past, 0.0) / (k + 1.0);
        (formula.error(&past, &found).norm(), (found - x(t + dt)).norm())
    }

    #[test]
    fn errors_are_estimated_as_they_are() {
        for scheme in SCHEMES {
            for (dt, dt_before) in [(0.02, 0.02), (0.02, 0.03), (0.03, 0.02)] {
                let (estimate, truth) = local_errors(scheme, 0.8, dt, dt_before);
                let ratio = estimate / truth;
                assert!((0.9..1.1).contains(&ratio), "{scheme:?}, {dt}: estimated {estimate:e}, true {truth:e}");
            }
        }
    }
}
