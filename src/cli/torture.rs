//! `cutis torture`: how the hard cases end.

use cutis::solve::Rung;
use cutis::torture::{Case, Outcome, Row, catalogue};

#[derive(clap::Args)]
pub struct Torture {
    /// Cases whose name holds this text; all if left out
    case: Option<String>,
    /// Print the table as Markdown, without times
    #[arg(long)]
    markdown: bool,
    /// Run the catalogue without each rung of recovery in turn and say what that costs
    #[arg(long, conflicts_with = "markdown")]
    ablate: bool,
}

impl Torture {
    pub fn run(self) -> super::Done {
        let wanted = self.case.unwrap_or_default();
        let cases = || catalogue().filter(|c| c.name.contains(&wanted));
        if cases().next().is_none() {
            return Err(super::nothing_named("case", &wanted, catalogue().map(|c| c.name)));
        }
        if self.ablate {
            ablate(&cases().collect::<Vec<_>>());
            return Ok(());
        }
        if self.markdown {
            cases().for_each(|c| println!("- `{}`: {}", c.name, c.what));
            println!("\n| case | law | outcome | solves | worst det F | energy (J) | said |");
            println!("| --- | --- | --- | --- | --- | --- | --- |");
        }
        let (mut n_rows, mut failed) = (0, 0);
        for case in cases() {
            if !self.markdown {
                println!("{}: {}", case.name, case.what);
            }
            for row in case.rows() {
                n_rows += 1;
                failed += usize::from(row.fails());
                if self.markdown { markdown(&row) } else { plain(&row) }
            }
        }
        match failed {
            0 if self.markdown => Ok(()),
            0 => {
                println!("{n_rows} rows, none failed");
                Ok(())
            }
            _ => Err(format!("{failed} of {n_rows} rows failed").into()),
        }
    }
}

/// For each rung: rows lost without it, and linear solves of the rows that end well with and without.
fn ablate(cases: &[&'static Case]) {
    let run = |rung| cases.iter().flat_map(|c| c.rows_without(rung)).collect::<Vec<Row>>();
    let all = run(None);
    println!("| without | rows lost | solves | of the worst row | lost |\n| --- | --- | --- | --- | --- |");
    for (name, rung) in Rung::ALL {
        let rows = run(Some(rung));
        let pairs = || all.iter().zip(&rows);
        let lost: Vec<String> = pairs()
            .filter(|(a, b)| !a.fails() && is_lost(a, b))
            .map(|(a, _)| format!("{} ({})", a.case, a.law))
            .collect();
        let kept = || pairs().filter(|(a, b)| !a.fails() && !is_lost(a, b));
        let solves = |row: &Row| f64::from(row.tally.iterations);
        let (with, without): (f64, f64) = (kept().map(|(a, _)| solves(a)).sum(), kept().map(|(_, b)| solves(b)).sum());
        let more = 100.0 * (without / with - 1.0);
        let times = |(a, b): &(&Row, &Row)| solves(b) / solves(a).max(1.0);
        let worst = kept().max_by(|p, q| times(p).total_cmp(&times(q)));
        let worst = worst.map_or(String::new(), |p| format!("x {:.1}: {} ({})", times(&p), p.0.case, p.0.law));
        println!("| {name} | {} of {} | {more:+.1} % | {worst} | {} |", lost.len(), rows.len(), lost.join(", "));
    }
}

/// Whether a row that ends well with all rungs ends worse without one: in a failure, or refused instead of answered.
fn is_lost(with: &Row, without: &Row) -> bool {
    without.fails() || matches!(without.outcome, Outcome::Refused(_)) && !matches!(with.outcome, Outcome::Refused(_))
}

fn plain(row: &Row) {
    let (outcome, said) = words(row);
    let [solves, det_f, energy] = numbers(row);
    println!("  {:<20} {outcome:<16} {solves:>7} {det_f:>9} {energy:>9} {:>8.3} s", row.law, row.seconds);
    if !said.is_empty() {
        println!("    {said}");
    }
}

fn markdown(row: &Row) {
    let (outcome, said) = words(row);
    let [solves, det_f, energy] = numbers(row);
    let said = said.replace('|', "\\|");
    println!("| {} | {} | {outcome} | {solves} | {det_f} | {energy} | {said} |", row.case, row.law);
}

fn words(row: &Row) -> (&'static str, String) {
    let one_line = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
    match &row.outcome {
        Outcome::Answer => ("answer", String::new()),
        Outcome::Inverted { legal: true } => ("inverted (legal)", String::new()),
        Outcome::Inverted { legal: false } => ("inverted", String::new()),
        Outcome::Refused(message) => ("refused", one_line(message)),
        Outcome::Fail(message) => ("FAIL", one_line(message)),
    }
}

/// Solves, worst det F, energy; a dash where no step was taken.
fn numbers(row: &Row) -> [String; 3] {
    let tally = &row.tally;
    if tally.min_det_f == f64::INFINITY {
        return [tally.iterations.to_string(), "-".into(), "-".into()];
    }
    [tally.iterations.to_string(), format!("{:.3}", tally.min_det_f), format!("{:.2e}", tally.energy)]
}
