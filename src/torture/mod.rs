//! Hard cases and how each must end: in the right answer or in a clear error with the state intact; never in a NaN, a
//! hang or a panic.
#![forbid(unsafe_code)]
#![allow(non_snake_case)]

mod inputs;
mod materials;
mod motion;
mod scene;
mod starts;
mod time;
mod trial;
mod ways;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Instant;

use crate::solve::Rung;
use trial::End;
pub use trial::Tally;

/// One law of each kind: quadratic, rotated, finite through inversion, infinite at J = 0, exponential.
const LAWS: &[&str] =
    &["linear", "corotational", "stable-neo-hookean", "polyconvex-neo-hookean", "neo-hookean", "fung"];
/// For cases that ask nothing of the law.
const ONE_LAW: &[&str] = &["polyconvex-neo-hookean"];
/// Laws that stay finite through inversion soften towards it: past some load their equilibrium is inside out.
const FOLDING: &[&str] = &["corotational", "stable-neo-hookean"];
/// The linear law knows no rotation: elements may turn inside out under it, and the answer is still its own.
const LINEAR: &[&str] = &["linear"];
const NONE: &[&str] = &[];

/// A hard case.
pub struct Case {
    /// Name.
    pub name: &'static str,
    /// What it does and what counts as right, in one sentence.
    pub what: &'static str,
    /// Laws that it runs with.
    pub laws: &'static [&'static str],
    /// Laws for which elements inside out are no failure here.
    pub may_invert: &'static [&'static str],
    /// Laws for which a clear error is a right end.
    pub may_refuse: &'static [&'static str],
    body: fn(&str, &mut Tally) -> Result<(), End>,
}

/// How a case ended.
#[derive(Debug, Clone, PartialEq)]
pub enum Outcome {
    /// Converged, finite, no element inside out, and right where the truth is known.
    Answer,
    /// Converged, but with elements inside out; a failure unless the case declares it legal.
    Inverted {
        /// Whether it does.
        legal: bool,
    },
    /// Refused with this message where the case allows it; the state is intact.
    Refused(String),
    /// Anything else.
    Fail(String),
}

/// One case under one law.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Name of the case.
    pub case: &'static str,
    /// Name of the law.
    pub law: &'static str,
    /// How it ended.
    pub outcome: Outcome,
    /// What it took.
    pub tally: Tally,
    /// Wall time, s.
    pub seconds: f64,
}

impl Row {
    /// Whether this end breaks the promise.
    pub fn fails(&self) -> bool {
        matches!(self.outcome, Outcome::Fail(_) | Outcome::Inverted { legal: false })
    }
}

/// Every case, theme by theme.
pub fn catalogue() -> impl Iterator<Item = &'static Case> {
    [starts::CASES, motion::CASES, ways::CASES, materials::CASES, time::CASES, inputs::CASES].into_iter().flatten()
}

impl Case {
    /// Runs the case under each of its laws.
    pub fn rows(&'static self) -> impl Iterator<Item = Row> {
        self.rows_without(None)
    }

    /// The same without one rung of recovery.
    pub fn rows_without(&'static self, rung: Option<Rung>) -> impl Iterator<Item = Row> {
        self.laws.iter().map(move |law| self.run(law, rung))
    }

    fn run(&self, law: &'static str, without: Option<Rung>) -> Row {
        let mut tally = Tally { without, ..Tally::default() };
        let start = Instant::now();
        // The tally is numbers only, whole at any time.
        let end = catch_unwind(AssertUnwindSafe(|| (self.body)(law, &mut tally)));
        let seconds = start.elapsed().as_secs_f64();
        let legal = self.may_invert.contains(&law);
        let outcome = match end {
            Err(panic) => Outcome::Fail(format!("panic: {}", text_of(&*panic))),
            Ok(Err(End::Fail(message))) => Outcome::Fail(message),
            Ok(_) if tally.min_det_f <= 0.0 && !legal => Outcome::Inverted { legal },
            Ok(Err(End::Refused(message))) if self.may_refuse.contains(&law) => Outcome::Refused(message),
            Ok(Err(End::Refused(message))) => Outcome::Fail(format!("refused: {message}")),
            Ok(Ok(())) if tally.min_det_f <= 0.0 => Outcome::Inverted { legal },
            Ok(Ok(())) => Outcome::Answer,
        };
        Row { case: self.name, law, outcome, tally, seconds }
    }
}

fn text_of(panic: &(dyn std::any::Any + Send)) -> &str {
    let text = panic.downcast_ref::<String>().map(String::as_str);
    text.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("without a message")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ends(body: fn(&str, &mut Tally) -> Result<(), End>) -> Row {
        Case { name: "planted", what: "", laws: ONE_LAW, may_invert: NONE, may_refuse: NONE, body }.run("linear", None)
    }

    #[test]
    fn planted_faults_are_found() {
        assert!(!ends(|_, _| Ok(())).fails());
        assert!(ends(|_, _| Err(End::Refused("no".into()))).fails());
        assert!(ends(|_, _| Err(End::Fail("wrong".into()))).fails());
        assert!(ends(|_, _| panic!("planted")).outcome == Outcome::Fail("panic: planted".into()));
        let inverted = ends(|_, tally| {
            tally.min_det_f = -0.1;
            Ok(())
        });
        assert_eq!(inverted.outcome, Outcome::Inverted { legal: false });
    }
}
