//! The catalogue of hard cases ends as promised; docs/torture.md names every case.

use cutis::solve::Rung;
use cutis::torture::catalogue;

#[test]
fn every_hard_case_ends_in_the_right_answer_or_a_clear_error() {
    let rows = catalogue().flat_map(|c| c.rows());
    let wrong: Vec<String> = rows
        .filter(|row| row.fails())
        .map(|row| format!("{}, {}: {:?}, {:?}", row.case, row.law, row.outcome, row.tally))
        .collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn the_table_of_hard_cases_names_every_row() {
    let text = include_str!("../../docs/torture.md");
    for case in catalogue() {
        assert!(text.contains(&format!("- `{}`: {}", case.name, case.what)), "docs/torture.md misses {}", case.name);
        for law in case.laws {
            assert!(text.contains(&format!("| {} | {law} |", case.name)), "docs/torture.md misses {} {law}", case.name);
        }
    }
}

#[test]
fn a_rung_left_out_is_missed() {
    let case = |name: &str| catalogue().find(|c| c.name == name).expect("a case of the catalogue");
    for (name, law, rung) in [
        ("start-inverted", "neo-hookean", Rung::StandIn),
        ("force-1e4", "fung", Rung::Pieces),
        ("compress-30", "stable-neo-hookean", Rung::Inversion),
    ] {
        let mut rows = case(name).rows_without(Some(rung)).filter(|row| row.law == law);
        assert!(rows.all(|row| row.fails()), "{name} ({law}) ends well without {rung:?}");
    }
}
