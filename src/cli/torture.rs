//! `cutis torture`: how the hard cases end.

use cutis::torture::{Outcome, Row, catalogue};

#[derive(clap::Args)]
pub struct Torture {
    /// Cases whose name holds this text; all if left out
    case: Option<String>,
    /// Print the table as Markdown, without times
    #[arg(long)]
    markdown: bool,
}

impl Torture {
    pub fn run(self) -> super::Done {
        let wanted = self.case.unwrap_or_default();
        let cases = || catalogue().filter(|c| c.name.contains(&wanted));
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
