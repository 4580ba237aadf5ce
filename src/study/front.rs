//! Who is never beaten, and what a budget of time buys.

use super::Row;
use super::row::Measured;

/// Places of the rows that no other row beats in both time and error, from the fastest to the most accurate; errors below
/// `floor` (m), the reference's own, count as that.
pub fn pareto(rows: &[Row], floor: f64) -> Vec<usize> {
    let error = |m: &Measured| m.errors.rms.max(floor);
    let mut order: Vec<(usize, &Measured)> =
        rows.iter().enumerate().filter_map(|(k, row)| Some((k, row.outcome.as_ref().ok()?))).collect();
    order.sort_by(|(_, a), (_, b)| a.step.total_cmp(&b.step).then(error(a).total_cmp(&error(b))));
    let mut least = f64::INFINITY;
    order.retain(|(_, m)| {
        let better = error(m) < least;
        least = least.min(error(m));
        better
    });
    order.into_iter().map(|(k, _)| k).collect()
}

/// One sentence for each budget (CPU seconds a step): the most accurate row that keeps it. A budget that buys no more than
/// the one before gets none.
pub fn advice(rows: &[Row], budgets: &[f64], floor: f64) -> Vec<String> {
    let front = pareto(rows, floor);
    let mut out = Vec::new();
    let mut bought = None;
    for &budget in budgets {
        let within = |k: &&usize| rows[**k].outcome.as_ref().is_ok_and(|m| m.step <= budget);
        match front.iter().rev().find(within) {
            Some(&k) if bought != Some(k) => {
                bought = Some(k);
                if let Ok(m) = &rows[k].outcome {
                    out.push(format!(
                        "{} ms a step buys {}{} mm ({} mm at worst): {}; {} unknowns, {} ms, {:.0} MB.",
                        figure(1e3 * budget),
                        if m.errors.rms < floor { "less than " } else { "" },
                        figure(1e3 * m.errors.rms.max(floor)),
                        figure(1e3 * m.errors.max),
                        rows[k].name,
                        m.n_dofs,
                        figure(1e3 * m.step),
                        1e-6 * m.memory as f64
                    ));
                }
            }
            Some(_) => {}
            None => {
                let fastest = front.first().and_then(|&k| rows[k].outcome.as_ref().ok());
                if let Some(m) = fastest {
                    let (budget, step) = (figure(1e3 * budget), figure(1e3 * m.step));
                    out.push(format!("{budget} ms a step buys nothing here: the fastest row takes {step} ms."));
                }
            }
        }
    }
    out
}

/// Two significant digits, without an exponent where a person needs none.
pub(super) fn figure(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    let digits = 1 - value.abs().log10().floor() as i32;
    match digits {
        ..=0 => format!("{value:.0}"),
        1..=5 => format!("{value:.*}", digits as usize),
        _ => format!("{value:.1e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::Reading;

    fn row(name: &str, step: f64, rms: f64) -> Row {
        let errors = Reading { rms, p95: rms, max: 2.0 * rms, force: 0.0 };
        let measured = Measured { errors, n_dofs: 3, solves: 1.0, step, setup: 0.0, memory: 0 };
        Row { name: name.into(), outcome: Ok(measured) }
    }

    #[test]
    fn the_front_holds_what_is_never_beaten() {
        let mut rows =
            vec![row("slow", 0.1, 1e-5), row("fast", 0.001, 1e-3), row("beaten", 0.2, 1e-4), row("mid", 0.01, 1e-4)];
        rows.push(Row { name: "failed".into(), outcome: Err("no".into()) });
        assert_eq!(pareto(&rows, 0.0), [1, 3, 0]);
        assert_eq!(pareto(&rows, 2e-4), [1, 3], "what the reference cannot tell apart is no better");
        let said = advice(&rows, &[0.0005, 0.016, 0.018, 1.0], 0.0);
        assert_eq!(said.len(), 3, "{said:?}");
        assert!(said[0].contains("buys nothing"));
        assert!(said[1].starts_with("16 ms a step buys 0.10 mm (0.20 mm at worst): mid;"), "{}", said[1]);
        assert!(said[2].contains("slow"));
    }
}
