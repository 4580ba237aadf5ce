//! The study as a chart and as one page that needs nothing else.

use super::Row;
use super::front::{advice, figure, pareto};
use crate::view::{Chart, Mark, escape};

/// Error over time of all rows; those that are never beaten joined by a line.
pub fn chart(title: &str, rows: &[Row], floor: Option<f64>) -> Chart {
    let front = pareto(rows, floor.unwrap_or(0.0));
    let law = |name: &str| name.split(',').next().unwrap_or_default().to_owned();
    let mut groups: Vec<String> = rows.iter().map(|row| law(&row.name)).collect();
    groups.dedup();
    let mut marks = Vec::new();
    let mut place_of = vec![None; rows.len()];
    for (k, row) in rows.iter().enumerate() {
        if let Ok(m) = &row.outcome {
            place_of[k] = Some(marks.len());
            let group = groups.iter().position(|g| *g == law(&row.name)).unwrap_or(0);
            marks.push(Mark { x: 1e3 * m.step, y: 1e3 * m.errors.rms, group, label: row.name.clone() });
        }
    }
    Chart {
        title: title.to_owned(),
        x: "CPU ms a step".into(),
        y: "skin off by mm, rms".into(),
        groups,
        line: front.into_iter().filter_map(|k| place_of[k]).collect(),
        marks,
        floor: floor.map(|f| 1e3 * f),
    }
}

/// A self-contained HTML page: what was compared, the chart, the advice, the table.
pub fn page(title: &str, about: &[String], rows: &[Row], budgets: &[f64], floor: Option<f64>) -> String {
    let front = pareto(rows, floor.unwrap_or(0.0));
    let paragraphs = |lines: &[String]| lines.iter().map(|l| format!("<p>{}</p>\n", escape(l))).collect::<String>();
    let advice: String =
        advice(rows, budgets, floor.unwrap_or(0.0)).iter().map(|a| format!("<li>{}</li>\n", escape(a))).collect();
    let mut table = String::new();
    for (k, row) in rows.iter().enumerate() {
        let class = if front.contains(&k) { " class=\"best\"" } else { "" };
        let cells = match &row.outcome {
            Ok(m) => [
                m.n_dofs.to_string(),
                figure(1e3 * m.step),
                format!("{:.1}", m.solves),
                figure(m.setup),
                format!("{:.0}", 1e-6 * m.memory as f64),
                figure(1e3 * m.errors.rms),
                figure(1e3 * m.errors.p95),
                figure(1e3 * m.errors.max),
                format!("{} %", figure(100.0 * m.errors.force)),
            ]
            .map(|c| format!("<td>{c}</td>"))
            .concat(),
            Err(why) => format!("<td colspan=\"9\" class=\"why\">{}</td>", escape(why)),
        };
        table += &format!("<tr{class}><th>{}</th>{cells}</tr>\n", escape(&row.name));
    }
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{title}</title>\n<style>{STYLE}</style></head>\n\
         <body><h1>{title}</h1>\n{}{}<h2>What a budget buys</h2>\n<ul>\n{advice}</ul>\n<h2>All rows</h2>\n\
         <p>Rows in bold are never beaten in both time and error.</p>\n\
         <table><tr><th>variant</th><th>unknowns</th><th>ms a step</th><th>solves</th><th>set-up s</th><th>MB</th>\
         <th>rms mm</th><th>p95 mm</th><th>max mm</th><th>force</th></tr>\n{table}</table>\n</body></html>\n",
        paragraphs(about),
        chart(title, rows, floor).to_svg(),
        title = escape(title),
    )
}

const STYLE: &str = "body{font:15px/1.5 sans-serif;max-width:64rem;margin:2rem auto;padding:0 1rem;color:#222}\
    table{border-collapse:collapse;font-size:13px}td,th{padding:.15rem .6rem;text-align:right;border-bottom:1px solid #ddd}\
    tr th:first-child{text-align:left;font-weight:normal}tr.best th:first-child,tr.best td{font-weight:bold}\
    .why{text-align:left;color:#888}svg{max-width:100%;height:auto}";
